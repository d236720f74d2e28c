/* Units of a path's coordinates (path_units.h). */
#include "path_units.h"
#include "newton.h"
#include "physics/action/units.h"

#include <math.h>
#include <stdlib.h>

double *phys_hessian_units(const struct phys_hessian *h, const double *path, struct ad_error *error)
{
    size_t dof = h->dof, n = h->elements + 1;
    double *unit = malloc(2 * dof * sizeof *unit), *size = unit ? unit + dof : NULL;
    if (!unit)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; unit && k < dof; k++) {
        unit[k] = 1;
        size[k] = 0;
        for (size_t i = 0; i < n; i++)
            size[k] = fmax(size[k], fabs(path[k * n + i]));
    }
    if (unit && h->of && h->of->units)
        phys_units(dof, h->stiffness, size, unit);
    return unit;
}

double *phys_path_units(const struct phys_system *system, const struct phys_path_settings *settings,
                        struct phys_derivatives *of, const double *path, struct ad_error *error)
{
    struct phys_derivatives own = {0};
    struct phys_hessian h = {.dof = system->dof, .elements = settings->slices - 1};
    struct ad_error lost = {0};
    double *unit = NULL;
    bool differ = phys_may_differ_in_unit(system);
    if (differ && !of)
        phys_derivatives_new(of = &own, system, PHYS_LADDER_COLUMNS, NULL, &lost);
    if (differ && lost.status == AD_OK &&
        phys_hessian_over(&h, of, &phys_rule_left, settings->slices, settings->dt, &lost) ==
            AD_OK) {
        h.mesh = settings->mesh;
        phys_hessian_at(&h, path, 0);
    }
    if (phys_keep_memory(&lost, error) == AD_OK)
        unit = phys_hessian_units(&h, path, error);
    phys_hessian_free(&h);
    phys_derivatives_free(&own);
    return unit;
}

double phys_path_apart(const double *unit, const double *a, const double *b, size_t dof,
                       size_t slices)
{
    double most = 0;
    for (size_t k = 0; k < dof * slices; k++) {
        double apart = fabs(a[k] - b[k]) / unit[k / slices];
        if (!(apart <= most) && !isnan(most))
            most = apart;
    }
    return most;
}

double phys_path_extent(const double *unit, const double *path, size_t dof, size_t slices)
{
    double most = 0;
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < slices; i++)
            most = fmax(most, fabs(path[k * slices + i] - path[k * slices]) / unit[k]);
    return most;
}
