/* The discretisation error of a stationary path: its distance from that of a rule of higher order
   on finer elements. */
#include "autodiff/free.h"
#include "mesh.h"
#include "newton.h"
#include "path_units.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double BETWEEN = 3; /* times as far at other slices: they are looked at */
static const double NEAR = 0.3;  /* of the extent: a finer path further away is another one */
enum { DEGREE = 4 };             /* of the finer rule, at least */

/* How much the momenta differ at slices i of a path and i * each / 2 of a finer one that is
   settled, by what they move in a step: their slices alone may agree by symmetry. */
static double momenta_apart(const double *unit, struct phys_hessian *h, const double *path,
                            struct phys_newton *to, const double *moved, size_t each)
{
    struct phys_hessian *finer = &to->hessian;
    double most = 0, *apart = to->step;
    phys_hessian_gradient_at(h, path, 0);
    phys_hessian_gradient_at(finer, moved, 0);
    for (size_t i = 0; i < h->elements; i += 2) {
        const size_t e = i * each / 2;
        for (size_t k = 0; k < h->dof; k++)
            apart[k] = h->gradient[i * h->side + k] - finer->gradient[e * finer->side + k];
        if (to->path.surface) /* forces of constraints on half a node are in both */
            phys_surface_project(to->path.surface, moved, e, 0, apart);
        for (size_t k = 0; k < h->dof; k++)
            if (apart[k] != 0)
                most = fmax(most, fabs(apart[k]) * phys_hessian_length(h, i) * (double)each / 2 /
                                      (finer->stiffness[k] * unit[k]));
    }
    return most;
}

/* How far a finer path, of 3 elements for 2, is from a path at the slices that it has not, by
   interpolation, which may err more than either. */
static double odd_slices_apart(const double *unit, const struct phys_grid *from, const double *path,
                               const struct phys_grid *to, const double *finer, size_t dof,
                               struct ad_error *error)
{
    double most = 0, *back = phys_path_resample(to, finer, from, dof, error);
    for (size_t k = 0; back && k < dof; k++)
        for (size_t i = 1; i < from->slices; i += 2)
            most =
                fmax(most, fabs(back[k * from->slices + i] - path[k * from->slices + i]) / unit[k]);
    free(back);
    return most;
}

enum ad_status phys_path_discretisation(const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        struct phys_derivatives *of, const double *path, bool more,
                                        double *distance, struct phys_spectrum *spectrum,
                                        struct ad_error *error)
{
    struct phys_path_settings finer = *settings;
    struct phys_newton newton = {0};
    struct phys_hessian coarse = {0};
    struct phys_derivatives own = {0};
    struct phys_path_info info = {0};
    struct ad_error lost = {0};
    size_t n = settings->slices, dof = system->dof,
           degree = finer.rule->degree + PHYS_FINER_DEGREES;
    char name[24];
    *distance = (double)NAN;
    degree = degree < DEGREE ? DEGREE : degree;
    if (finer.rule->repeat || degree > PHYS_RULE_MOST || degree * dof > PHYS_FINER_MOST)
        return AD_OK;
    snprintf(name, sizeof name, "gauss%zu", degree);
    finer.rule = phys_rule_find(name, error);
    size_t each = more && n % 2 == 1 ? 3 : 2, m = (n - 1) * each / 2 + 1;
    finer.slices = m;
    finer.dt = 2 * settings->dt / (double)each;
    double *mesh = settings->mesh ? phys_mesh_divide(settings->mesh, n, m, error) : NULL;
    finer.mesh = mesh;
    const struct phys_grid from = phys_grid_of(settings), to = phys_grid_of(&finer);
    *distance = (double)INFINITY;
    double *moved =
        error->status == AD_OK ? phys_path_resample(&from, path, &to, dof, error) : NULL;
    if (moved && !of)
        phys_derivatives_new(of = &own, system, PHYS_LADDER_COLUMNS, NULL, &lost);
    double *unit = NULL;
    bool made = moved && lost.status == AD_OK &&
                phys_hessian_over(&coarse, of, settings->rule, n, settings->dt, &lost) == AD_OK &&
                phys_newton_new(&newton, system, &finer, of, &lost) == AD_OK;
    coarse.mesh = settings->mesh;
    newton.rough = true;
    if (made && phys_newton_settle(&newton, moved, &info, error) &&
        (unit = phys_hessian_units(&newton.hessian, moved, error))) {
        double most = 0;
        for (size_t k = 0; k < dof; k++)
            for (size_t i = 0; i < n; i += each == 3 ? 2 : 1)
                most = fmax(most, fabs(moved[k * m + i * each / 2] - path[k * n + i]) / unit[k]);
        if (most <= NEAR * phys_path_extent(unit, path, dof, n))
            *distance = each == 3 && settings->rule->order > 1
                            ? fmax(most, momenta_apart(unit, &coarse, path, &newton, moved, each))
                            : most;
        /* in a layer at an end the slices between may err more: they need a path that has them */
        if (each == 3 &&
            odd_slices_apart(unit, &from, path, &to, moved, dof, error) > BETWEEN * most) {
            double same = 0;
            phys_path_discretisation(system, settings, of, path, false, &same, NULL, error);
            *distance = fmax(*distance, same);
        }
    } else if (info.stop == PHYS_STOP_INTERRUPTED) {
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    }
    if (made && spectrum && !isfinite(*distance)) { /* none nearby: judged at this one */
        free(moved);
        moved = phys_path_resample(&from, path, &to, dof, error);
    }
    if (made && spectrum && moved && error->status == AD_OK &&
        spectrum->legendre != PHYS_INDEFINITE)
        spectrum->undetermined |= !phys_newton_confirms(
            &newton, moved, isfinite(*distance) && info.steps == 1, spectrum, error);
    phys_keep_memory(&lost, error);
    phys_newton_free(&newton);
    phys_hessian_free(&coarse);
    phys_derivatives_free(&own);
    AD_FREE(moved, mesh, unit);
    return error->status;
}
