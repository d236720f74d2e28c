/* The error of a level of a refinement.

   With a given rule, free time, or more coordinates than a rule of high order takes, it is
   estimated from the path's distance to the previous one, at the slices of both. With d that
   distance and d' the one before it, errors fall by r = d'/d per level, at most by 2^p for a rule
   of order p; the error of the finer path is then d/(r - 1). Where r is not yet meaningful, d
   itself is used, which is the error of the coarser path. Far from the limit errors may change
   sign, and r mean nothing: an estimate that is small enough is raised to the distance from the
   path of a rule of higher order on the same slices, if it is less. */
#include "internal.h"
#include "physics/path/ends.h"
#include "physics/path/verify/grid_independence.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double CAUTION = 2;   /* the law of convergence holds in the limit */
static const double MARGIN = 1.5;  /* the path of the rule of higher order errs, too ... */
static const double ALONE = 3;     /* ... and without levels to compare, at other slices more */
static const double EXACT = 1e-14; /* of the path's size: no distance but rounding */
static const double FINE = 1e-7;   /* of the path's size: where rounding may stop the fall */
static const double FALLING = 0.7; /* of the distance, from level to level, at the least */

double phys_climb_rounding(const struct phys_climb *c, size_t elements)
{
    return c->ends_error + CAUTION * DBL_EPSILON * c->size * (double)elements;
}

void phys_climb_estimate(struct phys_climb *c, struct phys_level *level, struct ad_error *error)
{
    const struct phys_stage *coarse = &c->before;
    size_t dof = c->system->dof, n = coarse->grid.slices, m = c->here.grid.slices;
    c->here.distance = level->estimate = NAN;
    if (!level->found)
        return;
    free(c->unit);
    c->unit = phys_climb_free_time(c)
                  ? phys_path_units(c->system, c->to->settings, c->to->of, c->here.path, error)
                  : phys_hessian_units(&c->newton.hessian, c->here.path, error);
    if (!c->unit)
        return;
    c->size = 0;
    for (size_t k = 0; k < dof * m; k++)
        c->size = fmax(c->size, fabs(c->here.path[k]));
    if (c->here.apart) { /* the path before errs more between its slices */
        double moved = phys_path_apart(c->unit, c->here.start, c->here.path, dof, m);
        c->here.distance = phys_climb_settled(c, coarse) ? moved : (double)NAN;
        return;
    }
    if (c->high || !coarse->path || coarse->grid.rule != level->rule || 2 * n != m + 1)
        return;
    double d = 0, widest = 0; /* of a step between slices */
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++) {
            const double *x = coarse->path + k * n + i;
            d = fmax(d, fabs(*x - c->here.path[k * m + 2 * i]) / c->unit[k]);
            double length = i > 0 && coarse->mesh ? coarse->mesh[i] - coarse->mesh[i - 1] : 1;
            widest = fmax(widest, i > 0 ? fabs(x[0] - x[-1]) / length / c->unit[k] : 0);
        }
    double later = 2 * c->here.grid.dt - coarse->grid.dt; /* 0 unless the time is free */
    if (phys_climb_free_time(c))
        d = fmax(d, widest * (double)(n - 1) * fabs(later) / coarse->grid.dt);
    double fall = coarse->distance / d, most = pow(2, (double)level->rule->order);
    double likely = fall > 2 && !coarse->apart ? CAUTION * d / (fmin(fall, most) - 1) : d;
    c->here.distance = d;
    if (isnan(coarse->distance) && d <= EXACT * c->size)
        return; /* the slices of two levels alone may be exact by symmetry */
    level->estimate = fmax(fmin(likely, d), phys_climb_rounding(c, level->elements));
}

static enum ad_status find_spectrum(struct phys_climb *c, struct phys_spectrum *spectrum,
                                    struct ad_error *error)
{
    struct phys_newton *newton = &c->newton;
    if (!phys_climb_free_time(c) ||
        phys_newton_new(newton, c->system, c->to->settings, c->to->of, error) == AD_OK)
        phys_newton_spectrum(newton, PHYS_KIND, c->here.path, spectrum, error);
    if (phys_climb_free_time(c))
        phys_newton_free(newton);
    return error->status;
}

/* The path of a level that was solved roughly. */
static bool settle(struct phys_climb *c, struct ad_error *error)
{
    struct phys_path_info info;
    c->newton.rough = false;
    return !c->rough || phys_newton_settle(&c->newton, c->here.path, &info, error);
}

bool phys_climb_verified(struct phys_climb *c, struct phys_level *level, struct ad_error *error)
{
    double *finer = &c->to->finer;
    struct phys_spectrum *spectrum = &c->to->spectrum;
    if (!level->found || !(c->high || level->estimate < c->tolerance))
        return false;
    if (!settle(c, error))
        return false;
    if (find_spectrum(c, spectrum, error) == AD_OK)
        phys_path_discretisation(c->system, c->to->settings, c->to->of, c->here.path, true, finer,
                                 spectrum, error);
    if (c->high) {
        c->here.distance = *finer;
        level->estimate = phys_climb_rounding(c, level->elements);
    }
    level->estimate =
        fmax(level->estimate, (c->high ? ALONE : MARGIN) * *finer); /* fmax ignores NaN */
    bool close = level->estimate < c->tolerance && error->status == AD_OK;
    if (close && spectrum->undetermined)
        ad_fail(error, AD_E_ACCURACY,
                "error %g cannot be verified: an eigenvalue of the second variation is zero within "
                "its error, so that the path may lie elsewhere; %s",
                c->tolerance, phys_ends_advice(c->to->settings->ends));
    bool exists = true;
    if (close && error->status == AD_OK && c->doubted)
        phys_path_grid_independent(c->system, c->to->settings, c->here.path, &exists, error);
    if (!exists && error->status == AD_OK)
        ad_fail(error, AD_E_ACCURACY,
                "error %g cannot be verified: no motion was found near the path of %zu elements of "
                "%s, which the grid alone may hold, as through a collision; try another start, or "
                "other ends",
                c->tolerance, level->elements, level->rule->name);
    if (!close)
        phys_spectrum_free(spectrum);
    return close;
}

bool phys_climb_at_rounding(const struct phys_climb *c, const struct phys_level *level)
{
    return phys_climb_rounding(c, level->elements) > c->tolerance ||
           (c->before.distance <= FINE * c->size && c->here.distance <= FINE * c->size &&
            c->here.distance > FALLING * c->before.distance);
}
