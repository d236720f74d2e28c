/* Turns the rows of a table into samples, component by component (data_table.h). A column is freed
   after its last use, so that table and samples are never both in memory. */
#include "data_table.h"

#include <math.h>
#include <stdlib.h>

/* ---- rates by differences: x and t at a row ---- */

static double forward(const double *x, const double *t) { return (x[1] - x[0]) / (t[1] - t[0]); }

/* The two one-sided slopes, each weighted by the other's step. */
static double central(const double *x, const double *t)
{
    double before = t[0] - t[-1], after = t[1] - t[0];
    return (forward(x - 1, t - 1) * after + forward(x, t) * before) / (before + after);
}

/* ---- samples ---- */

static bool is_sample(const struct hnn_part *part, size_t row)
{
    return part->table->role[row] == part->role;
}

static size_t count(const struct hnn_part *part, size_t from, size_t to)
{
    size_t n = 0;
    for (size_t i = from; i < to; i++)
        n += is_sample(part, i);
    return n;
}

static size_t held(const struct hnn_part *part) { return part->end - part->begin; }

/* A column from the next of a part's rows on. */
static const double *next_of(const struct hnn_part *part, size_t column)
{
    return part->from < part->to ? hnn_table_row(part->table, column, part->from) : NULL;
}

/* Element i+shift of a column for every sample i, to a row of samples. */
static void gather(const struct hnn_part *part, size_t column, size_t shift, double *to)
{
    const double *x = next_of(part, column);
    to += part->taken;
    for (size_t i = part->from; i < part->to; i++, x++)
        if (is_sample(part, i))
            *to++ = x[shift];
}

static void gather_slopes(const struct hnn_part *part, enum hnn_differences kind, size_t column,
                          double *to)
{
    const double *x = next_of(part, column), *t = next_of(part, part->table->plan.time);
    to += part->taken;
    for (size_t i = part->from; i < part->to; i++, x++, t++)
        if (is_sample(part, i))
            *to++ = (kind == HNN_CENTRAL ? central : forward)(x, t);
}

static void gather_target(const struct hnn_dataset_settings *s, const struct hnn_part *part,
                          size_t c)
{
    const struct hnn_plan *plan = &part->table->plan;
    double *target = part->target + c * held(part);
    if (plan->rate)
        gather(part, plan->rate[c], 0, target);
    else if (s->rollout == 0)
        gather_slopes(part, s->differences, plan->state[c], target);
    for (size_t k = 1; k <= s->rollout; k++)
        gather(part, plan->state[c], k, target + (k - 1) * plan->components * held(part));
}

/* Time steps from each sample on: of a rollout, or the one of a forward difference. */
static size_t steps_of(const struct hnn_dataset_settings *s, const struct hnn_table *table)
{
    return s->rollout ? s->rollout : !table->plan.rate && s->differences != HNN_CENTRAL;
}

static void gather_steps(const struct hnn_dataset_settings *s, const struct hnn_part *part)
{
    const struct hnn_table *table = part->table;
    size_t column = table->plan.time;
    const double *t = column != HNN_NO_COLUMN ? next_of(part, column) : NULL;
    for (size_t k = 0; k < steps_of(s, table); k++) {
        double *to = part->steps + k * held(part) + part->taken;
        for (size_t i = 0; i < part->to - part->from; i++)
            if (is_sample(part, part->from + i))
                *to++ = t ? t[i + k + 1] - t[i + k] : s->dt;
    }
}

/* Inputs at each sample, and after each step of its rollout. */
static void gather_inputs(const struct hnn_dataset_settings *s, const struct hnn_part *part)
{
    const struct hnn_plan *plan = &part->table->plan;
    double *to = part->x + plan->components * held(part);
    for (size_t k = 0; k <= s->rollout; k++)
        for (size_t j = 0; j < plan->inputs; j++, to += held(part))
            gather(part, plan->input[j], k, to);
}

/* Component c of one table's parts; states that rates do not come from are given back first. */
static void gather_component(const struct hnn_dataset_settings *s, const struct hnn_part *part,
                             size_t parts, size_t c)
{
    struct hnn_table *table = part->table;
    const struct hnn_plan *plan = &table->plan;
    for (size_t k = 0; k < parts; k++)
        gather(&part[k], plan->state[c], 0, part[k].x + c * held(&part[k]));
    if (plan->rate)
        hnn_table_release(table, plan->state[c]);
    for (size_t k = 0; k < parts; k++)
        gather_target(s, &part[k], c);
    hnn_table_release(table, plan->rate ? plan->rate[c] : plan->state[c]);
}

void hnn_parts_take(const struct hnn_dataset_settings *s, struct hnn_part *part, size_t parts)
{
    for (size_t c = 0; c < part->table->plan.components; c++)
        gather_component(s, part, parts, c);
    for (struct hnn_part *p = part; p < part + parts; p++) {
        gather_steps(s, p);
        gather_inputs(s, p);
        p->taken += count(p, p->from, p->to);
        p->from = p->to;
    }
}

/* The rows of the samples held. */
static void find_rows(struct hnn_part *part)
{
    size_t n = 0;
    for (size_t i = 0; i < part->table->rows && n < part->end; i++) {
        bool sample = is_sample(part, i);
        if (sample && n == part->begin)
            part->first = i;
        n += sample;
        part->last = i + 1;
    }
    part->from = part->first;
    part->to = part->last;
}

static struct hnn_samples samples_of(const struct hnn_part *part)
{
    const bool shared = part->shared;
    return (struct hnn_samples){.n = part->n,
                                .x = part->x,
                                .target = part->target,
                                .steps = part->steps,
                                .begin = shared ? part->begin : 0,
                                .end = shared ? part->end : 0};
}

/* Slices one allocation: x and target of the training, then of the test. */
static enum ad_status allocate(struct hnn_dataset *dataset, struct hnn_part part[2], size_t rollout,
                               size_t steps, struct ad_error *error)
{
    size_t components = 2 * dataset->dof, wide = components + dataset->inputs,
           rows = held(&part[0]) + held(&part[1]);
    size_t numbers = rollout < SIZE_MAX / (wide + 1) - 2
                         ? wide * (1 + (rollout ? rollout : 1)) + steps
                         : SIZE_MAX;
    size_t x_rows = components + dataset->inputs * (1 + rollout);
    if (numbers <= SIZE_MAX / sizeof(double) / rows)
        dataset->values = malloc(numbers * rows * sizeof(double));
    if (!dataset->values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", rows);
    double *at = dataset->values;
    for (size_t k = 0; k < 2; k++) {
        part[k].x = at;
        part[k].target = at + x_rows * held(&part[k]);
        at += numbers * held(&part[k]);
        part[k].steps = steps ? at - steps * held(&part[k]) : NULL;
    }
    dataset->train = samples_of(&part[0]);
    dataset->test = samples_of(&part[1]);
    return AD_OK;
}

/* Huge states and tiny steps of time overflow. */
static enum ad_status check_slopes(const struct hnn_part *part, struct ad_error *error)
{
    size_t n = part->table->plan.components * held(part);
    for (size_t i = 0; i < n; i++)
        if (!isfinite(part->target[i]))
            return ad_fail(error, AD_E_INPUT,
                           "%s: differences over time are not finite: expected smaller states or "
                           "longer steps of time",
                           part->table->file);
    return AD_OK;
}

enum ad_status hnn_samples_make(const struct hnn_dataset_settings *s, struct hnn_table *table,
                                struct hnn_table *test, struct hnn_dataset *dataset,
                                struct ad_error *error)
{
    struct hnn_part part[2] = {{.table = table, .role = HNN_TRAIN},
                               {.table = test, .role = HNN_TEST}};
    for (size_t k = 0; k < 2; k++) {
        part[k].n = part[k].end = count(&part[k], 0, part[k].table->rows);
        if (part[k].table->shared)
            hnn_samples_share(s->ranks, part[k].n, &part[k].begin, &part[k].end);
        part[k].shared = part[k].table->shared && part[k].end;
        part[k].end = part[k].end ? part[k].end : part[k].n;
        find_rows(&part[k]);
    }
    if (part[0].n == 0 || (part[1].n == 0 && (test != table || s->test_fraction > 0)))
        return ad_fail(error, AD_E_INPUT, "%s: no sample is left %s: expected longer trajectories",
                       table->file, part[0].n ? "for the test" : "to train on");
    if (allocate(dataset, part, s->rollout, steps_of(s, table), error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < (test == table ? 1 : 2); k++) {
        size_t parts = test == table ? 2 : 1;
        if (part[k].table->shared)
            hnn_share_read(s, &part[k], parts, error);
        else
            hnn_parts_take(s, &part[k], parts);
    }
    for (size_t k = 0; k < 2 && !table->plan.rate && s->rollout == 0; k++)
        check_slopes(&part[k], error);
    return error->status;
}
