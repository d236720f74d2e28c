/* Boxes of velocities and the linear part of an end map on them (end_box.h). */
#include "end_box.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <string.h>

enum { DOF = PHYS_END_MAP_DOF };

bool phys_end_solve(size_t n, const double *J, const double *g, double *x)
{
    double a[DOF * DOF];
    memcpy(a, J, n * n * sizeof *J);
    memcpy(x, g, n * sizeof *g);
    return phys_lapack_lu_solve_once(n, a, x) == 0 && isfinite(phys_end_norm(n, x));
}

/* Whether |u g| exceeds what the linear part and the departure `off` can make up. */
static bool separates(size_t n, const struct phys_end_box *b, const double *u, double off)
{
    double length = phys_end_norm(n, u), here = 0, most = 0;
    for (size_t i = 0; i < n; i++)
        here += u[i] * b->g[i];
    for (size_t k = 0; k < n; k++) {
        double part = 0;
        for (size_t i = 0; i < n; i++)
            part += u[i] * b->J[i * n + k];
        most += fabs(part) * b->half;
    }
    return length > 0 && fabs(here) > most + off * length;
}

bool phys_end_box_left_out(size_t n, const struct phys_end_box *b, double off)
{
    struct phys_singular s;
    if (separates(n, b, b->g, off))
        return true;
    phys_singular_values(n, b->J, &s);
    for (size_t r = 0; r < n; r++)
        if (separates(n, b, s.left[r], off))
            return true;
    for (size_t k = 0; k < n && s.size[n - 1] > 0; k++) { /* rows of J^-1 */
        double u[DOF] = {0};
        for (size_t i = 0; i < n; i++)
            for (size_t r = 0; r < n; r++)
                u[i] += s.right[r][k] * s.left[r][i] / s.size[r];
        if (separates(n, b, u, off))
            return true;
    }
    return false;
}

double phys_end_box_varies(size_t n, const double *J, const double *other)
{
    double sum[DOF] = {0}, most = 0;
    for (size_t k = 0; k < n; k++) {
        double d[DOF], x[DOF];
        for (size_t i = 0; i < n; i++)
            d[i] = other[i * n + k] - J[i * n + k];
        if (!phys_end_solve(n, J, d, x))
            return (double)INFINITY;
        for (size_t i = 0; i < n; i++)
            sum[i] += fabs(x[i]);
    }
    for (size_t i = 0; i < n; i++)
        most = fmax(most, sum[i]);
    return most;
}

double phys_end_box_departure(size_t n, const struct phys_end_box *at,
                              const struct phys_end_box *child, size_t children)
{
    double off = 0;
    for (size_t c = 0; c < children; c++) {
        double by_value[DOF], by_slope[DOF] = {0};
        for (size_t i = 0; i < n; i++) {
            by_value[i] = child[c].g[i] - at->g[i];
            for (size_t k = 0; k < n; k++) {
                size_t ik = i * n + k;
                by_value[i] -= at->J[ik] * (child[c].x[k] - at->x[k]);
                by_slope[i] += 0.5 * child[c].half * fabs(child[c].J[ik] - at->J[ik]);
            }
        }
        off = fmax(off, fmax(phys_end_norm(n, by_value), phys_end_norm(n, by_slope)));
    }
    return off;
}
