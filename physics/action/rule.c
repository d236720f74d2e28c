/* The table of action rules, and the points at which a rule evaluates a path. */
#include "internal.h"

#include <stdlib.h>
#include <string.h>

const struct phys_rule *const phys_rules[] = {
#define RULE(name) &phys_rule_##name,
#include "rules.def"
#undef RULE
    &phys_rules_gauss[0], &phys_rules_gauss[1], &phys_rules_gauss[2], NULL};

const struct phys_rule *phys_rule_find(const char *name, struct ad_error *error)
{
    const struct phys_rule *rules[LENGTH(phys_rules) + PHYS_RULE_MOST];
    const char *names[LENGTH(rules)];
    size_t n = 0;
    for (; phys_rules[n] != phys_rules_gauss; n++)
        rules[n] = phys_rules[n];
    for (const struct phys_rule *rule = phys_rules_gauss; rule->name; rule++)
        rules[n++] = rule;
    for (size_t k = 0; k < n; k++)
        names[k] = rules[k]->name;
    rules[n] = NULL;
    return rules[phys_find("action rule", name, n, names, error)];
}

/* ---- points on a tape ---- */

/* A row of numbers, one a point: base[j] + e * step for element e. */
static ad_var point_row(ad_tape *tape, size_t points, size_t elements, const double base[],
                        double step)
{
    double *row = malloc(points * elements * sizeof *row);
    if (!row)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory for %zu points", points * elements);
    for (size_t j = 0; j < points; j++)
        for (size_t e = 0; e < elements; e++)
            row[j * elements + e] = base[j] + (double)e * step;
    ad_var x = ad_const(tape, 1, points * elements, row);
    free(row);
    return x;
}

/* Node k of every element of x [s*dof x n]: [dof x n-1], a view. */
static ad_var node(ad_var x, size_t degree, size_t k)
{
    size_t dof = ad_rows(x) / degree, elements = ad_cols(x) - 1;
    ad_var rows = ad_slice_rows(x, k < degree ? k * dof : 0, dof);
    return ad_slice_cols(rows, k < degree ? 0 : 1, elements);
}

/* sum_k c[k] X_k */
static ad_var combine(ad_var x, size_t degree, const double c[])
{
    ad_var sum = {0};
    for (size_t k = 0; k <= degree; k++) {
        if (c[k] == 0)
            continue;
        ad_var part = node(x, degree, k);
        if (c[k] != 1)
            part = ad_mul(c[k], part);
        sum = sum.tape ? ad_add(sum, part) : part;
    }
    return sum;
}

static void scaled(size_t n, const double x[], double factor, double y[])
{
    for (size_t k = 0; k < n; k++)
        y[k] = x[k] * factor;
}

static void points_of_table(const struct phys_rule_table *table, ad_var x, double dt,
                            struct phys_rule_points *points)
{
    size_t s = table->degree, n = table->points, elements = ad_cols(x) - 1;
    ad_var q[PHYS_RULE_MOST], v[PHYS_RULE_MOST];
    double time[PHYS_RULE_MOST], rate[PHYS_RULE_MOST + 1];
    scaled(n, table->time, dt, time);
    for (size_t j = 0; j < n; j++) {
        scaled(s + 1, table->v[j], 1 / dt, rate);
        q[j] = combine(x, s, table->q[j]);
        v[j] = s == 1 ? ad_diff(x, 1 / dt, false) : combine(x, s, rate);
    }
    points->q = n == 1 ? q[0] : ad_concat_cols(n, q);
    points->v = n == 1 ? v[0] : ad_concat_cols(n, v);
    points->t = point_row(x.tape, n, elements, time, dt);
    points->weight =
        n == 1 ? ad_scalar(x.tape, 1) : point_row(x.tape, n, elements, table->weight, 0);
    points->elements = elements;
}

void phys_rule_points(const struct phys_rule *rule, ad_var x, double dt,
                      struct phys_rule_points *points)
{
    if (!points)
        return;
    if (!rule) {
        ad_var none = ad_refuse(x.tape, AD_E_ARGUMENT, "got no action rule (NULL)");
        *points = (struct phys_rule_points){none, none, none, none, 0};
        return;
    }
    if (rule->repeat) {
        points->q = x;
        points->v = ad_diff(x, 1 / dt, true);
        points->t = point_row(x.tape, 1, ad_cols(x), (double[]){0}, dt);
        points->weight = ad_scalar(x.tape, 1);
        points->elements = ad_cols(x);
        return;
    }
    struct phys_rule_table table;
    rule->fill(rule, &table);
    points_of_table(&table, x, dt, points);
}

/* ---- inner nodes of a path ---- */

/* Where the cubic through four neighbouring slices of x [slices], or through all there are, is at
   `at` behind slice i. */
static double cubic(const double *x, size_t slices, size_t i, double at)
{
    size_t n = slices < 4 ? slices : 4, first = i > 0 ? i - 1 : 0;
    if (first + n > slices)
        first = slices - n;
    double sum = 0, where = (double)(i - first) + at;
    for (size_t a = 0; a < n; a++) {
        double l = 1;
        for (size_t b = 0; b < n; b++)
            if (b != a)
                l *= (where - (double)b) / ((double)a - (double)b);
        sum += l * x[first + a];
    }
    return sum;
}

void phys_rule_interpolate(const struct phys_rule *rule, size_t dof, size_t slices, double *path)
{
    struct phys_rule_table table;
    if (!rule || !path)
        return;
    rule->fill(rule, &table);
    for (size_t k = 1; k < table.degree; k++)
        for (size_t d = 0; d < dof; d++) {
            double *row = path + (k * dof + d) * slices;
            for (size_t i = 0; i + 1 < slices; i++)
                row[i] = cubic(path + d * slices, slices, i, table.node[k]);
            row[slices - 1] = path[d * slices + slices - 1];
        }
}

void phys_rule_nodes(const struct phys_rule *rule, size_t dof, size_t slices, double dt,
                     const double *path, double *nodes, double *times)
{
    struct phys_rule_table table;
    if (!rule || !path || !nodes)
        return;
    rule->fill(rule, &table);
    size_t s = table.degree, n = s * (slices - 1) + 1;
    for (size_t j = 0; j < n; j++) {
        size_t i = j / s, k = j % s;
        for (size_t d = 0; d < dof; d++)
            nodes[d * n + j] = path[(k * dof + d) * slices + i];
        if (times)
            times[j] = ((double)i + table.node[k]) * dt;
    }
}
