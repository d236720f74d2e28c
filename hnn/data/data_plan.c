/* Which column is what: as asked for, or from the names alone. */
#include "data_table.h"

#include <stdlib.h>
#include <string.h>

static enum ad_status no_memory(const struct hnn_source *s, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory", s->file);
}

/* The column of that name; HNN_NO_COLUMN. */
static size_t named(const struct hnn_source *s, const char *name)
{
    for (size_t k = 0; s->name && k < s->columns; k++)
        if (s->name[k] && strcmp(s->name[k], name) == 0)
            return k;
    return HNN_NO_COLUMN;
}

/* The column dXdt of column X. */
static size_t rate_of(const struct hnn_source *s, size_t column)
{
    char rate[128];
    if (!s->name || !s->name[column])
        return HNN_NO_COLUMN;
    int length = snprintf(rate, sizeof rate, "d%sdt", s->name[column]);
    return length < (int)sizeof rate ? named(s, rate) : HNN_NO_COLUMN;
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
    plan->trial = trial ? HNN_NO_COLUMN : named(s, "trial");
    if (settings->time)
        choose_one(s, "time", settings->time, &plan->time, error);
    if (trial && *trial)
        choose_one(s, "trial", trial, &plan->trial, error);
    return error->status;
}

/* Those that have a rate; else, where time is known, all that are neither time nor trial. */
static void guess_state(const struct hnn_source *s, struct hnn_plan *plan)
{
    plan->components = 0;
    for (size_t k = 0; k < s->columns && s->ordered; k++)
        if (rate_of(s, k) != HNN_NO_COLUMN)
            plan->state[plan->components++] = k;
    bool guess = plan->components == 0 && plan->time != HNN_NO_COLUMN && s->ordered;
    for (size_t k = 0; guess && k < s->columns; k++)
        if (k != plan->time && k != plan->trial)
            plan->state[plan->components++] = k;
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
        guess_state(s, plan);
        if (plan->components == 0)
            return ad_fail(error, AD_E_INPUT,
                           "%s: which columns are the state? expected columns X and dXdt, or a "
                           "choice by name or by number from 1 to %zu",
                           s->file, s->columns);
    }
    if (plan->components % 2)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: state: expected coordinates and as many momenta, found %zu columns",
                       s->file, plan->components);
    for (size_t k = 0; k < plan->components; k++)
        for (size_t j = 0; j < k; j++)
            if (plan->state[j] == plan->state[k])
                return ad_fail(error, AD_E_ARGUMENT,
                               "%s: state: column %zu is there twice; expected each once", s->file,
                               plan->state[k] + 1);
    return AD_OK;
}

static enum ad_status guess_rate(const struct hnn_source *s, struct hnn_plan *plan,
                                 struct ad_error *error)
{
    plan->rate = malloc(plan->components * sizeof *plan->rate);
    if (!plan->rate)
        return no_memory(s, error);
    for (size_t k = 0; k < plan->components; k++) {
        plan->rate[k] = rate_of(s, plan->state[k]);
        if (plan->rate[k] == HNN_NO_COLUMN)
            return ad_fail(error, AD_E_INPUT,
                           "%s: which columns are the rates? expected a choice of %zu, or a time "
                           "for differences",
                           s->file, plan->components);
    }
    return AD_OK;
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
        guess_rate(s, plan, error);
    if (error->status == AD_OK && n != plan->components)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: rate: expected %zu columns as of the state, "
                       "found %zu",
                       s->file, plan->components, n);
    return error->status;
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
    need(plan, plan->time);
    need(plan, plan->trial);
    return AD_OK;
}

enum ad_status hnn_plan_make(const struct hnn_dataset_settings *settings,
                             const struct hnn_source *source, struct hnn_plan *plan,
                             struct ad_error *error)
{
    *plan = (struct hnn_plan){0};
    if (find_time_and_trial(settings, source, plan, error) == AD_OK &&
        find_state(settings, source, plan, error) == AD_OK &&
        find_rate(settings, source, plan, error) == AD_OK)
        list_needed(source, plan, error);
    return error->status;
}

void hnn_plan_free(struct hnn_plan *plan)
{
    free(plan->state);
    free(plan->rate);
    free(plan->column);
    free(plan->slot);
    *plan = (struct hnn_plan){0};
}

char *hnn_plan_names(const struct hnn_source *source, const size_t *column, size_t n)
{
    size_t size = 1;
    for (size_t k = 0; column && k < n; k++)
        size +=
            24 + (source->name && source->name[column[k]] ? strlen(source->name[column[k]]) : 0);
    char *text = calloc(size, 1), *to = text;
    for (size_t k = 0; text && column && k < n; k++) {
        const char *name = source->name ? source->name[column[k]] : NULL;
        size_t room = size - (size_t)(to - text);
        to += name ? snprintf(to, room, "%s%s", k ? "," : "", name)
                   : snprintf(to, room, "%s%zu", k ? "," : "", column[k] + 1);
    }
    return text;
}
