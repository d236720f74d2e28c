/* Assigns a role to each column: as given, or inferred from the names. */
#include "autodiff/free.h"
#include "data_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status no_memory(const struct hnn_source *s, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory", s->file);
}

static enum ad_status choose_one(const struct hnn_source *s, const char *role, const char *name,
                                 size_t *chosen, struct ad_error *error)
{
    size_t *column, n;
    if (hnn_choose(s, role, name, &column, &n, error) == AD_OK && n != 1)
        ad_fail(error, AD_E_ARGUMENT, "%s '%s': expected one column, found %zu", role, name, n);
    *chosen = error->status == AD_OK ? *column : HNN_NO_COLUMN;
    free(column);
    return error->status;
}

static enum ad_status find_time_and_trial(const struct hnn_dataset_settings *settings,
                                          const struct hnn_source *s, struct hnn_plan *plan,
                                          struct ad_error *error)
{
    const char *trial = settings->trial;
    plan->time = HNN_NO_COLUMN;
    plan->trial = trial ? HNN_NO_COLUMN : hnn_column_named(s, "trial");
    if (settings->time)
        choose_one(s, "time", settings->time, &plan->time, error);
    if (trial && *trial)
        choose_one(s, "trial", trial, &plan->trial, error);
    return error->status;
}

static enum ad_status check_each_once(const struct hnn_source *s, const char *role, size_t n,
                                      const size_t *column, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < k; j++)
            if (column[j] == column[k])
                return ad_fail(error, AD_E_ARGUMENT,
                               "%s: %s: column %zu is there twice; expected each once", s->file,
                               role, column[k] + 1);
    return AD_OK;
}

static enum ad_status find_state(const struct hnn_dataset_settings *settings,
                                 const struct hnn_source *s, struct hnn_plan *plan,
                                 struct ad_error *error)
{
    if (settings->state) {
        if (hnn_choose(s, "state", settings->state, &plan->state, &plan->components, error) !=
            AD_OK)
            return error->status;
    } else {
        plan->state = malloc((s->columns + 1) * sizeof *plan->state);
        if (!plan->state)
            return no_memory(s, error);
        if (hnn_guess_state(s, plan, error) != AD_OK)
            return error->status;
    }
    if (plan->components % 2)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "%s: state: expected coordinates and as many momenta or velocities, found %zu "
            "columns",
            s->file, plan->components);
    for (size_t k = 0; k < plan->components; k++) {
        if (plan->state[k] == plan->trial && !settings->trial)
            plan->trial = HNN_NO_COLUMN; /* its name alone made it one */
        if (plan->state[k] == plan->time || plan->state[k] == plan->trial)
            return ad_fail(error, AD_E_ARGUMENT,
                           "%s: state: column %zu is the %s; expected coordinates and momenta or "
                           "velocities",
                           s->file, plan->state[k] + 1,
                           plan->state[k] == plan->time ? "time" : "trial");
    }
    return check_each_once(s, "state", plan->components, plan->state, error);
}

static enum ad_status find_rate(const struct hnn_dataset_settings *settings,
                                const struct hnn_source *s, struct hnn_plan *plan,
                                struct ad_error *error)
{
    size_t n = plan->components;
    if (settings->rollout)
        return AD_OK;
    if (settings->rate)
        hnn_choose(s, "rate", settings->rate, &plan->rate, &n, error);
    else if (plan->time == HNN_NO_COLUMN)
        hnn_guess_rate(s, plan, error);
    if (error->status == AD_OK && n != plan->components)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: rate: expected %zu columns as of the state, "
                       "found %zu",
                       s->file, plan->components, n);
    if (error->status != AD_OK || !plan->rate ||
        check_each_once(s, "rate", n, plan->rate, error) != AD_OK)
        return error->status;
    return hnn_rates_match(s, n, plan->state, plan->rate, error);
}

static bool is_in(size_t column, size_t n, const size_t *columns)
{
    for (size_t k = 0; k < n; k++)
        if (columns[k] == column)
            return true;
    return false;
}

static enum ad_status find_inputs(const struct hnn_dataset_settings *settings,
                                  const struct hnn_source *s, struct hnn_plan *plan,
                                  struct ad_error *error)
{
    const char *const list[] = {settings->inputs, settings->controls};
    if (!list[0] && !list[1])
        return AD_OK;
    if (!settings->state)
        return ad_fail(error, AD_E_ARGUMENT, "%s: inputs: expected the columns of the state, too",
                       s->file);
    if (!(plan->input = malloc(2 * HNN_INPUTS_MOST * sizeof *plan->input)))
        return no_memory(s, error);
    for (size_t k = 0; k < 2; k++) {
        size_t *column = NULL, n = 0;
        if (list[k] &&
            hnn_choose(s, k ? "controls" : "inputs", list[k], &column, &n, error) == AD_OK &&
            plan->inputs + n > HNN_INPUTS_MOST)
            ad_fail(error, AD_E_ARGUMENT, "%s: inputs: expected at most %d, got %zu", s->file,
                    HNN_INPUTS_MOST, plan->inputs + n);
        for (size_t i = 0; i < n && error->status == AD_OK; i++) {
            plan->input[plan->inputs++] = column[i];
            if (k == 0 && column[i] == plan->time) { /* to the front */
                plan->input[plan->inputs - 1] = plan->input[0];
                plan->input[0] = column[i];
            }
        }
        plan->controls = k ? n : 0;
        free(column);
        if (error->status != AD_OK)
            return error->status;
    }
    for (size_t k = 0; k < plan->inputs; k++) {
        size_t c = plan->input[k];
        if (is_in(c, plan->components, plan->state) ||
            (plan->rate && is_in(c, plan->components, plan->rate)) ||
            (k >= plan->inputs - plan->controls && c == plan->time))
            return ad_fail(error, AD_E_ARGUMENT,
                           "%s: inputs: column %zu is one of the state, its rates, or the time as "
                           "a control",
                           s->file, c + 1);
    }
    return check_each_once(s, "inputs", plan->inputs, plan->input, error);
}

static void need(struct hnn_plan *plan, size_t column)
{
    if (column == HNN_NO_COLUMN || plan->slot[column] != HNN_NO_COLUMN)
        return;
    plan->slot[column] = plan->n;
    plan->column[plan->n++] = column;
}

static enum ad_status list_needed(const struct hnn_source *s, struct hnn_plan *plan,
                                  struct ad_error *error)
{
    plan->slot = malloc(s->columns * sizeof *plan->slot);
    plan->column = malloc(s->columns * sizeof *plan->column);
    if (!plan->slot || !plan->column)
        return no_memory(s, error);
    for (size_t k = 0; k < s->columns; k++)
        plan->slot[k] = HNN_NO_COLUMN;
    for (size_t k = 0; k < plan->components; k++) {
        need(plan, plan->state[k]);
        need(plan, plan->rate ? plan->rate[k] : HNN_NO_COLUMN);
    }
    for (size_t k = 0; k < plan->inputs; k++)
        need(plan, plan->input[k]);
    need(plan, plan->time);
    need(plan, plan->trial);
    return AD_OK;
}

enum ad_status hnn_plan_make(const struct hnn_dataset_settings *settings,
                             const struct hnn_source *source, struct hnn_plan *plan,
                             struct ad_error *error)
{
    *plan = (struct hnn_plan){0};
    if (hnn_names_check(settings, source, error) == AD_OK &&
        find_time_and_trial(settings, source, plan, error) == AD_OK &&
        find_state(settings, source, plan, error) == AD_OK &&
        find_rate(settings, source, plan, error) == AD_OK &&
        find_inputs(settings, source, plan, error) == AD_OK)
        list_needed(source, plan, error);
    return error->status;
}

void hnn_plan_free(struct hnn_plan *plan)
{
    AD_FREE(plan->state, plan->rate, plan->input, plan->column, plan->slot);
    *plan = (struct hnn_plan){0};
}

/* A name as an element of a list: quoted if it contains commas or quotes. */
static size_t put_name(const char *name, char *to)
{
    char *start = to;
    bool quoted = strpbrk(name, ",\"") != NULL;
    if (quoted)
        *to++ = '"';
    for (; *name; name++) {
        *to++ = *name;
        if (*name == '"')
            *to++ = '"';
    }
    if (quoted)
        *to++ = '"';
    return (size_t)(to - start);
}

char *hnn_plan_names(const struct hnn_source *source, const size_t *column, size_t n)
{
    size_t size = 1;
    for (size_t k = 0; column && k < n; k++)
        size += 24 +
                (source->name && source->name[column[k]] ? 2 * strlen(source->name[column[k]]) : 0);
    char *text = calloc(size, 1), *to = text;
    for (size_t k = 0; text && column && k < n; k++) {
        const char *name = source->name ? source->name[column[k]] : NULL;
        if (k)
            *to++ = ',';
        to += name ? put_name(name, to) : (size_t)sprintf(to, "%zu", column[k] + 1);
    }
    return text;
}
