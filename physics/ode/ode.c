/* Functions common to all vector fields. */
#include "internal.h"

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

static double largest(size_t n, const double *x)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(x[k]));
    return most;
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
        double u = largest(half, rate + half);
        memcpy(z + half, rate + half, half * sizeof *z);
        if (ode->field(ode->context, t, z, rate, &ignored) == AD_OK)
            size = u * sqrt(x / (nearer * largest(half, rate)));
    }
    free(z);
    return isfinite(size) ? size : 0;
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
    double x = largest(first, y), v = largest(second, y + first);
    double x_rate = largest(first, scale), v_rate = largest(second, scale + first);
    double x_size = x > 0 ? x : v_rate > 0 ? x_rate * v / v_rate : 1;
    double v_size = x > 0 && halves ? fmax(v, size_of_fall(ode, t, y, x, error)) : v;
    for (size_t k = 0; k < ode->n; k++) {
        double size = k < first ? x_size : v_size;
        scale[k] = size > 0 && isfinite(size) ? size : 1;
    }
    return error->status;
}
