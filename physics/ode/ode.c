/* Functions common to all vector fields. */
#include "physics/linear/vectors.h"
#include "internal.h"
#include "physics/lagrangian/mass.h"
#include "physics/action/units.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void phys_state_name(const struct phys_system *system, size_t k, const char *what, char *name,
                     size_t size)
{
    char coordinate[48];
    phys_coordinate_name(system, k % system->dof, coordinate, sizeof coordinate);
    if (k < system->dof)
        snprintf(name, size, "%s", coordinate);
    else
        snprintf(name, size, "the %s of %s", what, coordinate);
}

enum ad_status phys_ode_enter(const struct phys_ode *ode, double t, const double *q,
                              const double *v, double *y, struct ad_error *error)
{
    if (AD_LACKS(error, ode, q, v, y))
        return error->status;
    size_t half = ode->n / 2;
    if (ode->enter)
        return ode->enter(ode->context, t, q, v, y, error);
    memcpy(y, q, half * sizeof *y);
    memcpy(y + half, v, half * sizeof *y);
    return AD_OK;
}

enum ad_status phys_ode_leave(const struct phys_ode *ode, double t, const double *y, double *q,
                              double *v, struct ad_error *error)
{
    if (AD_LACKS(error, ode, y, q, v))
        return error->status;
    size_t half = ode->n / 2;
    if (ode->leave)
        return ode->leave(ode->context, t, y, q, v, error);
    memcpy(q, y, half * sizeof *q);
    memcpy(v, y + half, half * sizeof *v);
    return AD_OK;
}

void phys_ode_component(const struct phys_ode *ode, size_t k, char *name, size_t size)
{
    if (!name)
        return;
    if (!ode)
        snprintf(name, size, "?");
    else if (ode->component)
        ode->component(ode->context, k, name, size);
    else if (ode->system)
        phys_state_name(ode->system, k, "velocity", name, size);
    else
        snprintf(name, size, "y%zu", k + 1);
}

void phys_ode_free(struct phys_ode *ode)
{
    if (!ode)
        return;
    if (ode->free)
        ode->free(ode->context);
    *ode = (struct phys_ode){0};
}

/* Masses that couple nothing leave accelerations the pattern of the forces. */
static bool has_own_masses(const struct phys_system *system, bool *memory)
{
    struct phys_pattern masses;
    *memory = phys_coupling_new(&masses, system, PHYS_COUPLING_MASSES, PHYS_MASS_FEW);
    const bool own = *memory && masses.width == 0;
    phys_pattern_free(&masses);
    return own;
}

bool phys_ode_coupling(const struct phys_ode *ode, struct phys_pattern *coupling)
{
    const struct phys_system *system = ode->system;
    bool memory = true;
    *coupling = (struct phys_pattern){0};
    if (system && !system->scene->ode && !system->scene->constraint &&
        has_own_masses(system, &memory))
        return phys_coupling_new(coupling, system, PHYS_COUPLING_RATES, PHYS_MASS_FEW);
    return memory && phys_pattern_new(coupling, ode->n, NULL);
}

/* The size to which a fall from rest through a length x brings the second half of y = (q, v) or
   (q, p): the rate u of that half, for a time with x = a time^2, where a is |q'| when the half is
   u. Not at q itself, which may be an equilibrium, but nearer to the origin, as if the force grew
   in proportion to q from there. 0: not known. */
static double size_of_fall(const struct phys_ode *ode, double t, const double *y, double x,
                           struct ad_error *error)
{
    size_t half = ode->n / 2;
    struct ad_error ignored = {0}; /* that place may be outside the field's domain */
    const double nearer = 0.9;
    double *z = calloc(2 * ode->n, sizeof *z), size = 0;
    if (!z) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return 0;
    }
    double *rate = z + ode->n;
    for (size_t k = 0; k < half; k++)
        z[k] = nearer * y[k];
    if (ode->field(ode->context, t, z, rate, &ignored) == AD_OK) {
        double u = phys_largest(half, rate + half);
        memcpy(z + half, rate + half, half * sizeof *z);
        if (ode->field(ode->context, t, z, rate, &ignored) == AD_OK)
            size = u * sqrt(x / (nearer * phys_largest(half, rate)));
    }
    free(z);
    return isfinite(size) ? size : 0;
}

/* d2E / dy_k^2, where E is even in y_k about 0, from the smallest y_k = 2^(10 j) that E shows; it
   shows all that are larger. */
static double energy_curvature(const struct phys_ode *ode, double t, size_t k, double *y)
{
    y[k] = 0;
    const double none = ode->energy(ode->context, t, y);
    double curvature = NAN;
    for (int low = -20, high = 21; low < high;) {
        const int j = (low + high + 42) / 2 - 21;
        y[k] = ldexp(1, 10 * j);
        double more = ode->energy(ode->context, t, y) - none;
        bool shown = none == 0 ? fabs(more) > 1e-250 : fabs(more) > 1e-3 * fabs(none);
        if (shown || isnan(more))
            high = j;
        else
            low = j + 1;
        if (shown)
            curvature = 2 * more / (y[k] * y[k]);
    }
    return curvature;
}

/* A coordinate of another unit (units.h) gets a size of its own, and its velocity or momentum, too.
   scale: x_size, v_size. */
static void separate_units(const struct phys_ode *ode, double t, const double *start, double *scale)
{
    const size_t dof = ode->n / 2;
    double mass[PHYS_UNITS_MOST], y[2 * PHYS_UNITS_MOST], ratio[PHYS_UNITS_MOST],
        largest_momentum = 0;
    if (!ode->system || !ode->energy || !phys_may_differ_in_unit(ode->system))
        return;
    memcpy(y, start, dof * sizeof *y);
    for (size_t k = 0; k < dof; k++) {
        memset(y + dof, 0, dof * sizeof *y);
        double curvature = energy_curvature(ode, t, dof + k, y);
        mass[k] = ode->enter ? 1 / curvature : curvature; /* of p and of v */
        if (!(mass[k] > 0 && isfinite(mass[k])))
            return;
    }
    phys_units(dof, mass, start, ratio);
    for (size_t k = 0; k < dof; k++)
        largest_momentum = fmax(largest_momentum, ratio[k] * mass[k]);
    for (size_t k = 0; k < dof; k++) {
        double of_momentum = ratio[k] * mass[k] / largest_momentum;
        scale[k] *= ratio[k];
        if (!ode->enter)
            scale[dof + k] *= ratio[k];
        else if (of_momentum < PHYS_ANOTHER_UNIT)
            scale[dof + k] *= of_momentum;
    }
}

enum ad_status phys_typical_sizes(const struct phys_ode *ode, double t, const double *y,
                                  double *scale, struct ad_error *error)
{
    if (AD_LACKS(error, ode, ode->field, y, scale))
        return error->status;
    bool halves = ode->canonical || ode->kick || ode->system;
    size_t first = halves ? ode->n / 2 : ode->n, second = ode->n - first;
    if (ode->field(ode->context, t, y, scale, error) != AD_OK)
        return error->status;
    /* where one half is zero, its size follows from its rate and the other half's clock */
    double x = phys_largest(first, y), v = phys_largest(second, y + first);
    double x_rate = phys_largest(first, scale), v_rate = phys_largest(second, scale + first);
    double x_size = x > 0 ? x : v_rate > 0 ? x_rate * v / v_rate : 1;
    double v_size = x > 0 && halves ? fmax(v, size_of_fall(ode, t, y, x, error)) : v;
    for (size_t k = 0; k < ode->n; k++) {
        double size = k < first ? x_size : v_size;
        scale[k] = size > 0 && isfinite(size) ? size : 1;
    }
    if (halves)
        separate_units(ode, t, y, scale);
    return error->status;
}
