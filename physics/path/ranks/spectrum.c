/* The kind of a path over ranks (path_ranks.h): Legendre's condition block by block, and the Morse
   index by the inertia of Newton's system. */
#include "elimination.h"
#include "physics/path/path_program.h"
#include "physics/path/spectrum.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double ROUNDING = 16; /* of an eigenvalue, in units of the largest entry */

/* Whether L_vv is positive definite, negative definite, or neither, in a block, as counts. */
struct definite {
    struct phys_ranked_path *path;
    double time;
};

static enum ad_status definite_block(void *context, size_t b, double *values,
                                     struct ad_error *error)
{
    struct definite *d = context;
    struct phys_hessian *h = &d->path->hessian;
    double start = phys_ranked_load(d->path, b), time;
    phys_hessian_at(h, d->path->block, start);
    enum phys_definite is = phys_hessian_definite(h, &time);
    d->time = fmin(d->time, start + time);
    for (size_t k = 0; k < 3; k++)
        values[k] = is == (enum phys_definite)k;
    return error->status;
}

static enum ad_status find_definite(struct phys_ranked_path *p, struct phys_spectrum *spectrum,
                                    struct ad_error *error)
{
    struct definite d = {p, (double)INFINITY};
    double kinds[3], range[2];
    if (!phys_hessian_keep_mass(&p->hessian))
        ad_fail(error, AD_E_MEMORY, "out of memory for the mass matrices");
    if (ad_ranks_agree(p->ranks, error) != AD_OK ||
        ad_ranks_sum(p->ranks, p->blocks.count, 3, definite_block, &d, kinds, error) != AD_OK)
        return error->status;
    free(p->hessian.mass);
    p->hessian.mass = NULL;
    range[0] = range[1] = d.time;
    phys_ranked_range(p, range, error);
    spectrum->not_definite = range[0];
    spectrum->legendre = kinds[PHYS_POSITIVE] == (double)p->blocks.count   ? PHYS_POSITIVE
                         : kinds[PHYS_NEGATIVE] == (double)p->blocks.count ? PHYS_NEGATIVE
                                                                           : PHYS_INDEFINITE;
    return error->status;
}

/* The index is that on both sides of zero, further from it than rounding moves an eigenvalue. */
static enum ad_status find_index(struct phys_ranked_path *p, struct phys_spectrum *spectrum,
                                 struct ad_error *error)
{
    struct phys_elimination e;
    size_t below[3] = {0};
    double range[2] = {0, 0};
    phys_elimination_new(&e, p, error);
    for (int k = 0; k < 3 && error->status == AD_OK; k++) {
        phys_eliminate(&e, (k == 2 ? -1 : k) * ROUNDING * DBL_EPSILON * range[1], error);
        below[k] = e.negative;
        if (k == 0) {
            range[1] = e.largest;
            phys_ranked_range(p, range, error);
            spectrum->undetermined = e.singular;
        }
    }
    phys_elimination_free(&e);
    size_t unknowns = p->rows * (p->settings->slices - 1) - p->system->dof;
    spectrum->undetermined |= below[1] != below[2];
    spectrum->index = spectrum->legendre == PHYS_POSITIVE ? below[0] : unknowns - below[0];
    return error->status;
}

enum ad_status phys_path_ranks_spectrum(struct ad_ranks *ranks, const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        const double *path, struct phys_spectrum *spectrum,
                                        struct ad_error *error)
{
    struct phys_ranked_path p = {0};
    if (AD_LACKS_RESULT(error, spectrum) || (ranks && ad_ranks_check(ranks, error) != AD_OK) ||
        phys_path_check(&phys_solver_newton, system, settings, path, &(struct phys_path_info){0},
                        error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (phys_ranked_check(system, settings, &phys_solver_newton, error) == AD_OK &&
        phys_ranked_new(&p, ranks, system, settings, true, error) == AD_OK) {
        p.path = path;
        *spectrum =
            (struct phys_spectrum){.smallest = NAN, .second_variation = NAN, .around = {NAN, NAN}};
        if (phys_ranked_scale(&p, error) == AD_OK && find_definite(&p, spectrum, error) == AD_OK &&
            spectrum->legendre != PHYS_INDEFINITE)
            find_index(&p, spectrum, error);
    }
    phys_ranked_free(&p);
    return error->status;
}
