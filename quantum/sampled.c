/* A system whose potential is an array: V by the cubic spline through its points (not-a-knot, de
   Boor, A Practical Guide to Splines, 1978, chapter IV), exact for cubics and of fourth order else;
   an operation of its own on the tape, whose derivatives are operations of this kind. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ORDERS = 4 }; /* V, V', V'' and V''', which is constant between points */

struct derivative {
    const struct sampled *of;
    int order;
};

/* The params of the system; all arrays follow it in one allocation. */
struct sampled {
    struct qm_grid grid;
    double mass;
    const double *V, *bend; /* [n] values and second derivatives at the points */
    const struct derivative *derivative;
};

static double spline(const struct sampled *s, int order, double x)
{
    const double dx = qm_dx(&s->grid), at = (x - qm_x(&s->grid, 0)) / dx;
    if (!(x >= s->grid.low && x <= s->grid.high))
        return NAN;
    double most = (double)(s->grid.n - 2), cell = fmin(fmax(floor(at), 0), most);
    size_t k = (size_t)cell;
    double t = at - cell, u = 1 - t, y0 = s->V[k], y1 = s->V[k + 1];
    double m0 = s->bend[k], m1 = s->bend[k + 1];
    switch (order) {
    case 0:
        return u * y0 + t * y1 + dx * dx / 6 * ((u * u * u - u) * m0 + (t * t * t - t) * m1);
    case 1:
        return (y1 - y0) / dx + dx / 6 * ((3 * t * t - 1) * m1 - (3 * u * u - 1) * m0);
    case 2:
        return u * m0 + t * m1;
    default:
        return (m1 - m0) / dx;
    }
}

static int value(void *user, size_t cols, const double *const x[], double *y)
{
    const struct derivative *d = user;
    for (size_t k = 0; k < cols; k++)
        y[k] = spline(d->of, d->order, x[0][k]);
    return 0;
}

static ad_var record(const struct derivative *d, ad_var q);

static void recorded(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    const struct derivative *d = user;
    (void)y;
    gx[0] = d->order + 1 < ORDERS ? ad_mul(gy, record(d + 1, x[0])) : ad_mul(0.0, gy);
}

static ad_var record(const struct derivative *d, ad_var q)
{
    return ad_custom(1, &q,
                     &(struct ad_custom){.size = sizeof(struct ad_custom),
                                         .name = "potential",
                                         .rows = 1,
                                         .value = value,
                                         .recorded = recorded,
                                         .user = (void *)(uintptr_t)d});
}

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t;
    return ad_mul(((const struct sampled *)params)->mass / 2, ad_square(v));
}

static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)t;
    return record(((const struct sampled *)params)->derivative, q);
}

/* At rest in the middle. */
static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct qm_grid *grid = &((const struct sampled *)params)->grid;
    (void)seed, (void)error;
    *q = (grid->low + grid->high) / 2;
    *v = 0;
    return AD_OK;
}

static const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                        .size = sizeof(struct phys_scene),
                                        .name = "sampled",
                                        .what = "a particle in a potential given by its values",
                                        .dof = 1,
                                        .dims = 1,
                                        .coordinates = (const char *const[]){"x"},
                                        .unit = "1",
                                        .time_unit = "1",
                                        .energy_unit = "1",
                                        .params_bytes = sizeof(struct sampled),
                                        .kinetic = kinetic,
                                        .potential = potential,
                                        .slices = 100,
                                        .dt = 0.01,
                                        .start = start};

/* Second derivatives: M_{k-1} + 4 M_k + M_{k+1} = 6 (V_{k-1} - 2 V_k + V_{k+1})/dx^2, and the third
   is continuous at the second point from either end, which makes 6 M = that there. */
static void bend(size_t n, const double *V, double dx, double *M, double *ratio)
{
    for (size_t k = 1; k + 1 < n; k++)
        M[k] = (V[k - 1] - 2 * V[k] + V[k + 1]) / (dx * dx);
    ratio[1] = 0;
    for (size_t k = 2; k + 2 < n; k++) { /* between the two that are known now */
        ratio[k] = 1 / (4 - ratio[k - 1]);
        M[k] = (6 * M[k] - M[k - 1]) * ratio[k];
    }
    for (size_t k = n - 3; k >= 2; k--)
        M[k] -= ratio[k] * M[k + 1];
    M[0] = 2 * M[1] - M[2];
    M[n - 1] = 2 * M[n - 2] - M[n - 3];
}

enum ad_status qm_sampled(const struct qm_grid *grid, const double *V, double mass,
                          struct phys_system *system, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, system) || AD_LACKS(error, grid, V))
        return error->status;
    const size_t n = grid->n;
    if (n < 4 || n > SIZE_MAX / 64 || !(grid->high > grid->low) || !isfinite(qm_dx(grid)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "a sampled potential: expected 4 or more points of a box, got %zu of %g,%g",
                       n, grid->low, grid->high);
    if (!(mass > 0) || !isfinite(mass))
        return ad_fail(error, AD_E_ARGUMENT, "mass: expected more than 0, such as 1, got %g", mass);
    for (size_t k = 0; k < n; k++)
        if (!isfinite(V[k]))
            return ad_fail(error, AD_E_NONFINITE, "the potential at point %zu is %g", k, V[k]);
    struct sampled *s =
        malloc(sizeof *s + ORDERS * sizeof(struct derivative) + 3 * n * sizeof(double));
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    struct derivative *derivative = (struct derivative *)(s + 1);
    double *values = (double *)(derivative + ORDERS), *M = values + n;
    for (int k = 0; k < ORDERS; k++)
        derivative[k] = (struct derivative){s, k};
    memcpy(values, V, n * sizeof *values);
    bend(n, values, qm_dx(grid), M, M + n);
    *s = (struct sampled){*grid, mass, values, M, derivative};
    *system = (struct phys_system){.scene = &scene, .dof = 1, .bodies = 1, .dims = 1, .params = s};
    return AD_OK;
}
