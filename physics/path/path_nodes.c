/* A path between its slices (path_nodes.h). */
#include "path_nodes.h"

#include <stdlib.h>
#include <string.h>

enum ad_status phys_path_nodes_new(struct phys_path_nodes *nodes, size_t dof,
                                   const struct phys_path_settings *settings, const double *path,
                                   struct ad_error *error)
{
    const struct phys_rule *rule = settings->rule;
    size_t slices = settings->slices;
    if (rule->degree < 3)
        rule = phys_rule_find("gauss3", error);
    *nodes = (struct phys_path_nodes){
        .degree = rule->degree, .dof = dof, .slices = slices, .n = rule->degree * (slices - 1) + 1};
    size_t given = rule->degree * dof * slices;
    nodes->memory = malloc((given + (dof + 1) * nodes->n) * sizeof *nodes->memory);
    if (!nodes->memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a path of %zu slices", slices);
    nodes->x = nodes->memory + given;
    nodes->time = nodes->x + dof * nodes->n;
    memcpy(nodes->memory, path, settings->rule->degree * dof * slices * sizeof *path);
    if (rule != settings->rule)
        phys_rule_interpolate(rule, dof, slices, nodes->memory);
    phys_rule_nodes(rule, dof, slices, settings->dt, nodes->memory, nodes->x, nodes->time);
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
    memset(v, 0, dof * sizeof *v);
    for (size_t j = 0; j <= s; j++) {
        double value = 1, slope = 0;
        for (size_t k = 0; k <= s; k++)
            if (k != j) {
                slope = (slope * (t - at[k]) + value) / (at[j] - at[k]);
                value *= (t - at[k]) / (at[j] - at[k]);
            }
        for (size_t d = 0; d < dof; d++) {
            q[d] += value * nodes->x[d * m + first + j];
            v[d] += slope * nodes->x[d * m + first + j];
        }
    }
}
