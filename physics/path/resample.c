/* A path on other slices, or for another rule (path.h). */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lagrange's polynomial number j through the s + 1 given times, at t. */
static double basis(size_t s, const double *times, size_t j, double t)
{
    double product = 1;
    for (size_t k = 0; k <= s; k++)
        if (k != j)
            product *= (t - times[k]) / (times[j] - times[k]);
    return product;
}

/* Column i of row block k of `path`: where the nodes of the element around t put it. */
static void place(const struct phys_grid *from, size_t dof, const double *nodes,
                  const double *times, double t, size_t row, size_t columns, double *path)
{
    size_t s = from->rule->degree, elements = from->slices - 1, m = s * elements + 1;
    double at = floor(t / from->dt);
    size_t first = s * (at < (double)elements ? (size_t)at : elements - 1);
    for (size_t d = 0; d < dof; d++)
        path[(row + d) * columns] = 0;
    for (size_t j = 0; j <= s; j++) {
        double share = basis(s, times + first, j, t);
        for (size_t d = 0; d < dof; d++)
            path[(row + d) * columns] += share * nodes[d * m + first + j];
    }
}

static bool is_grid(const struct phys_grid *grid, struct ad_error *error)
{
    if (phys_lacks(grid, "slices", error) || phys_lacks(grid->rule, "action rule", error))
        return false;
    if (grid->slices >= 2 && grid->dt > 0 && isfinite(grid->dt))
        return true;
    ad_fail(error, AD_E_ARGUMENT, "slices: got %zu, %g apart; expected 2 or more, apart",
            grid->slices, grid->dt);
    return false;
}

double *phys_path_resample(const struct phys_grid *from, const double *path,
                           const struct phys_grid *to, size_t dof, struct ad_error *error)
{
    struct phys_rule_table table;
    if (phys_lacks(path, "path", error) || !is_grid(from, error) || !is_grid(to, error))
        return NULL;
    size_t s = to->rule->degree, n = to->slices, m = from->rule->degree * (from->slices - 1) + 1;
    double *nodes = malloc((dof + 1) * m * sizeof *nodes), *times = nodes ? nodes + dof * m : NULL;
    double *result = malloc(s * dof * n * sizeof *result);
    if (!nodes || !result) {
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
        free(nodes);
        free(result);
        return NULL;
    }
    to->rule->fill(to->rule, &table);
    phys_rule_nodes(from->rule, dof, from->slices, from->dt, path, nodes, times);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < s; k++) {
            double t = ((double)i + (i + 1 < n ? table.node[k] : 0)) * to->dt;
            place(from, dof, nodes, times, t, k * dof, n, result + i);
        }
    free(nodes);
    return result;
}
