/* Placement of elements (mesh.h). On an element of length h a polynomial of degree s errs by about
   h^(s+1) times the path's derivative of order s + 1, which is the change of the highest derivative
   of the polynomials from element to element. Its root of order s + 1, times h, is the element's
   share: it is proportional to h, so that elements are placed at equal parts of its sum. */
#include "mesh.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double ROUNDING = 8; /* of a node's coordinate */

/* The highest derivative of the polynomial of an element, over s!, and what is rounding in it. */
static double highest(const struct phys_grid *grid, const struct phys_rule_table *table,
                      const double *x, size_t dof, size_t e, double *rounding)
{
    size_t s = table->degree, n = grid->slices;
    double sum = 0, all = 0, length = phys_grid_time(grid, e + 1) - phys_grid_time(grid, e);
    for (size_t k = 0; k <= s; k++) {
        double part = k < s ? x[k * dof * n + e] : x[e + 1];
        for (size_t j = 0; j <= s; j++)
            part /= j == k ? 1 : table->node[k] - table->node[j];
        sum += part;
        all += fabs(part);
    }
    *rounding = ROUNDING * DBL_EPSILON * all / pow(length, (double)s);
    return sum / pow(length, (double)s);
}

/* The shares of all elements, as the derivative of order s + 1 over s! at first. */
static double find_shares(const struct phys_grid *grid, const double *path, const double *unit,
                          size_t dof, double *share)
{
    struct phys_rule_table table;
    size_t n = grid->slices - 1;
    double sum = 0;
    grid->rule->fill(grid->rule, &table);
    for (size_t e = 0; e < n; e++)
        share[e] = 0;
    for (size_t d = 0; d < dof; d++) {
        const double *x = path + d * grid->slices;
        double rounding[2], before = highest(grid, &table, x, dof, 0, &rounding[0]);
        for (size_t e = 1; e < n; e++) {
            double here = highest(grid, &table, x, dof, e, &rounding[e % 2]);
            double apart = 0.5 * (phys_grid_time(grid, e + 1) - phys_grid_time(grid, e - 1));
            double change =
                fmax(0, fabs(here - before) - rounding[0] - rounding[1]) / apart / unit[d];
            share[e - 1] = fmax(share[e - 1], change);
            share[e] = fmax(share[e], change);
            before = here;
        }
    }
    for (size_t e = 0; e < n; e++) {
        share[e] = pow(share[e], 1 / (double)(table.degree + 1)) *
                   (phys_grid_time(grid, e + 1) - phys_grid_time(grid, e));
        sum += share[e];
    }
    return sum;
}

enum ad_status phys_mesh_place(const struct phys_grid *grid, const double *path, const double *unit,
                               size_t dof, size_t elements, double *mesh, double *gain,
                               struct ad_error *error)
{
    size_t n = grid->slices - 1, e = 0;
    double *share = malloc(n * sizeof *share), most = 0, before = 0;
    if (!share)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n + 1);
    double sum = find_shares(grid, path, unit, dof, share), time = phys_grid_time(grid, n);
    for (size_t k = 0; k < n; k++)
        most = fmax(most, share[k]);
    *gain = sum > 0 && isfinite(sum) ? (double)n * most / (2 * sum) : 1;
    bool even = !(sum > 0 && isfinite(sum));
    for (size_t k = 0; mesh && k <= elements; k++) {
        double wanted = 2 * (double)k / (double)elements, from = 0, part = 0;
        for (; e < n; e++, before += part) { /* half of the shares are those of the time */
            from = phys_grid_time(grid, e) / time;
            part = phys_grid_time(grid, e + 1) / time - from;
            part += even ? part : share[e] / sum;
            if (before + part >= wanted)
                break;
        }
        double at = e < n ? phys_grid_time(grid, e) / time : 1;
        double length = e < n ? phys_grid_time(grid, e + 1) / time - at : 0;
        mesh[k] = (at + fmin(1, (wanted - before) / part) * length) * (double)elements;
    }
    if (mesh) {
        mesh[0] = 0;
        mesh[elements] = (double)elements;
    }
    free(share);
    return AD_OK;
}

double *phys_mesh_divide(const double *from, size_t slices, size_t m, struct ad_error *error)
{
    double *mesh = malloc(m * sizeof *mesh), share = (double)(slices - 1) / (double)(m - 1);
    if (!mesh)
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", m);
    for (size_t j = 0; mesh && j < m; j++) {
        size_t e = j * (slices - 1) / (m - 1);
        double rest = (double)j * share - (double)e;
        mesh[j] = j + 1 < m ? (from[e] + rest * (from[e + 1] - from[e])) / share : (double)j;
    }
    return mesh;
}
