/* Interpolation of a path between its slices (path_nodes.h), and on another grid (path.h). */
#include "path_nodes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct phys_grid phys_grid_of(const struct phys_path_settings *settings)
{
    if (!settings)
        return (struct phys_grid){0};
    return (struct phys_grid){settings->rule, settings->slices, settings->dt, settings->mesh};
}

double phys_grid_time(const struct phys_grid *grid, size_t slice)
{
    return !grid ? NAN : (grid->mesh ? grid->mesh[slice] : (double)slice) * grid->dt;
}

/* Time in units of dt at a share of the element behind a slice. */
static double at_node(const struct phys_grid *grid, size_t slice, double share)
{
    const double *mesh = grid->mesh ? grid->mesh + slice : NULL;
    return mesh ? mesh[0] + (share > 0 ? share * (mesh[1] - mesh[0]) : 0) : (double)slice + share;
}

/* phys_rule_nodes has even elements. */
static void move_times(const struct phys_grid *grid, struct phys_path_nodes *nodes)
{
    size_t s = nodes->degree;
    for (size_t j = 0; grid->mesh && j < nodes->n; j++) {
        double share = j % s ? nodes->time[j] / grid->dt - (double)(j / s) : 0;
        nodes->time[j] = at_node(grid, j / s, share) * grid->dt;
    }
}

enum ad_status phys_path_nodes_new(struct phys_path_nodes *nodes, size_t dof,
                                   const struct phys_grid *grid, size_t least, const double *path,
                                   struct ad_error *error)
{
    const struct phys_rule *rule = grid->rule;
    size_t slices = grid->slices;
    if (rule->degree < least && !grid->mesh) /* cubics through even slices */
        rule = phys_rule_find("gauss3", error);
    *nodes = (struct phys_path_nodes){
        .degree = rule->degree, .dof = dof, .slices = slices, .n = rule->degree * (slices - 1) + 1};
    size_t given = rule->degree * dof * slices;
    nodes->memory = malloc((given + (dof + 1) * nodes->n) * sizeof *nodes->memory);
    if (!nodes->memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a path of %zu slices", slices);
    nodes->x = nodes->memory + given;
    nodes->time = nodes->x + dof * nodes->n;
    memcpy(nodes->memory, path, grid->rule->degree * dof * slices * sizeof *path);
    if (rule != grid->rule)
        phys_rule_interpolate(rule, dof, slices, nodes->memory);
    phys_rule_nodes(rule, dof, slices, grid->dt, nodes->memory, nodes->x, nodes->time);
    move_times(grid, nodes);
    return AD_OK;
}

void phys_path_nodes_free(struct phys_path_nodes *nodes) { free(nodes->memory); }

void phys_path_nodes_at(const struct phys_path_nodes *nodes, double t, double *q, double *v)
{
    size_t s = nodes->degree, dof = nodes->dof, m = nodes->n, low = 0, high = nodes->slices - 2;
    while (low < high) { /* the last element that begins by then */
        size_t middle = (low + high + 1) / 2;
        if (nodes->time[middle * s] <= t)
            low = middle;
        else
            high = middle - 1;
    }
    size_t first = low * s;
    const double *at = nodes->time + first;
    memset(q, 0, dof * sizeof *q);
    if (v)
        memset(v, 0, dof * sizeof *v);
    for (size_t j = 0; j <= s; j++) {
        double value = 1, slope = 0;
        for (size_t k = 0; k <= s; k++)
            if (k != j) {
                slope = v ? (slope * (t - at[k]) + value) / (at[j] - at[k]) : 0;
                value *= (t - at[k]) / (at[j] - at[k]);
            }
        for (size_t d = 0; d < dof; d++)
            q[d] += value * nodes->x[d * m + first + j];
        for (size_t d = 0; v && d < dof; d++)
            v[d] += slope * nodes->x[d * m + first + j];
    }
}

static bool is_grid(const struct phys_grid *grid, struct ad_error *error)
{
    if (AD_LACKS(error, grid, grid->rule))
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
    struct phys_path_nodes nodes = {0};
    struct phys_rule_table table;
    if (AD_LACKS(error, path) || !is_grid(from, error) || !is_grid(to, error))
        return NULL;
    size_t s = to->rule->degree, n = to->slices;
    double *q = malloc(dof * sizeof *q), *result = malloc(s * dof * n * sizeof *result);
    if (!q || !result)
        ad_fail(error, AD_E_MEMORY, "no memory for a path of %zu slices", n);
    else if (phys_path_nodes_new(&nodes, dof, from, 0, path, error) == AD_OK) {
        to->rule->fill(to->rule, &table);
        for (size_t i = 0; i < n * s; i++) {
            double t = at_node(to, i / s, i / s + 1 < n ? table.node[i % s] : 0);
            phys_path_nodes_at(&nodes, t * to->dt, q, NULL);
            for (size_t d = 0; d < dof; d++)
                result[(i % s * dof + d) * n + i / s] = q[d];
        }
    }
    phys_path_nodes_free(&nodes);
    free(q);
    if (error->status == AD_OK)
        return result;
    free(result);
    return NULL;
}
