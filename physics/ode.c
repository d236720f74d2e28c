/* What all vector fields share. */
#include "integrate.h"
#include "internal.h"

#include <math.h>
#include <stdio.h>

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

void phys_ode_free(struct phys_ode *ode)
{
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

enum ad_status phys_typical_sizes(const struct phys_ode *ode, double t, const double *y,
                                  double *scale, struct ad_error *error)
{
    bool halves = ode->canonical || ode->kick || ode->enter;
    size_t first = halves ? ode->n / 2 : ode->n, second = ode->n - first;
    if (ode->field(ode->context, t, y, scale, error) != AD_OK)
        return error->status;
    /* where one half is zero, its size follows from its rate and the other half's clock */
    double x = largest(first, y), v = largest(second, y + first);
    double x_rate = largest(first, scale), v_rate = largest(second, scale + first);
    double x_size = x > 0 ? x : v_rate > 0 ? x_rate * v / v_rate : 1;
    double v_size = v;
    if (x > 0 && v_rate > 0 && halves) /* of a fall from rest through a length x */
        v_size = fmax(v, ode->kick && !ode->drift ? sqrt(x * v_rate) : v);
    for (size_t k = 0; k < ode->n; k++) {
        double size = k < first ? x_size : v_size;
        scale[k] = size > 0 && isfinite(size) ? size : 1;
    }
    return AD_OK;
}
