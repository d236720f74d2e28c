/* Infers the roles of columns from their names. */
#include "data_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status no_memory(const struct hnn_source *s, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "%s: out of memory", s->file);
}

/* Names of columns for a message, in quotes; cut where they are many. */
struct listing {
    char text[120];
};
static struct listing listing_of(const struct hnn_source *s, size_t n, const size_t *column)
{
    struct listing list = {""};
    size_t used = 0;
    for (size_t k = 0; k < n; k++) {
        const char *name = s->name ? s->name[column[k]] : NULL;
        if (used > sizeof list.text - 48) {
            snprintf(list.text + used, sizeof list.text - used, ", ...");
            break;
        }
        const char *comma = k ? ", " : "";
        used += (size_t)(name ? snprintf(list.text + used, sizeof list.text - used, "%s'%.32s'",
                                         comma, name)
                              : snprintf(list.text + used, sizeof list.text - used, "%scolumn %zu",
                                         comma, column[k] + 1));
    }
    return list;
}

/* Those that have a rate; else, where time is known, all that are neither time nor trial. */
static void guess_columns(const struct hnn_source *s, struct hnn_plan *plan)
{
    plan->components = 0;
    for (size_t k = 0; k < s->columns; k++)
        if (hnn_rate_of(s, k) != HNN_NO_COLUMN)
            plan->state[plan->components++] = k;
    bool guess = plan->components == 0 && plan->time != HNN_NO_COLUMN;
    for (size_t k = 0; guess && k < s->columns; k++)
        if (k != plan->time && k != plan->trial)
            plan->state[plan->components++] = k;
}

/* Two columns are in the order of the file, if it has one; the field is the same either way,
   because a pair has no other partner. */
enum ad_status hnn_guess_state(const struct hnn_source *s, struct hnn_plan *plan,
                               struct ad_error *error)
{
    guess_columns(s, plan);
    size_t n = plan->components;
    const struct listing list = listing_of(s, n, plan->state);
    if (n == 0 && s->mixed_line)
        return ad_fail(error, AD_E_INPUT,
                       "%s:%zu: names and numbers are mixed; expected one kind, or a choice "
                       "of the state by number from 1 to %zu",
                       s->file, s->mixed_line, s->columns);
    if (n == 0)
        return ad_fail(error, AD_E_INPUT,
                       "%s: which columns are the state? expected columns X and dXdt, or a choice "
                       "by name or by number from 1 to %zu",
                       s->file, s->columns);
    bool paired;
    if (hnn_pairs_order(s, n, plan->state, &paired, error) != AD_OK || paired ||
        (n == 2 && s->ordered))
        return error->status;
    if (n % 2 == 0)
        return ad_fail(error, AD_E_INPUT,
                       "%s: which columns are coordinates, which momenta? the names %s do not tell "
                       "(as q1, p1 or x, px do)%s; expected a choice of the state: coordinates, "
                       "then momenta",
                       s->file, list.text,
                       s->ordered ? "" : ", and arrays in HDF5 stand in no order");
    size_t rest = 0;
    for (size_t k = 0; k < s->columns; k++)
        if (k != plan->time && k != plan->trial && hnn_rate_of(s, k) == HNN_NO_COLUMN &&
            !hnn_named_as_rate(s, k))
            plan->state[rest++] = k;
    return ad_fail(error, AD_E_INPUT,
                   "%s: which columns are the state? found %s%s%s; expected as many momenta as "
                   "coordinates, or a choice of the state",
                   s->file, list.text, rest && rest < n + rest ? ", and without a rate dXdt " : "",
                   listing_of(s, rest, plan->state).text);
}

enum ad_status hnn_guess_rate(const struct hnn_source *s, struct hnn_plan *plan,
                              struct ad_error *error)
{
    plan->rate = malloc(plan->components * sizeof *plan->rate);
    if (!plan->rate)
        return no_memory(s, error);
    for (size_t k = 0; k < plan->components; k++) {
        plan->rate[k] = hnn_rate_of(s, plan->state[k]);
        if (plan->rate[k] == HNN_NO_COLUMN)
            return ad_fail(error, AD_E_INPUT,
                           "%s: which columns are the rates? expected a choice of %zu, or a time "
                           "for differences",
                           s->file, plan->components);
    }
    return AD_OK;
}

static int by_text(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

enum ad_status hnn_names_check(const struct hnn_dataset_settings *settings,
                               const struct hnn_source *s, struct ad_error *error)
{
    bool guesses = !settings->state || !(settings->rate || settings->time || settings->rollout);
    const char **name = guesses && s->name ? malloc((s->columns + 1) * sizeof *name) : NULL;
    size_t n = 0;
    if (!guesses || !s->name)
        return AD_OK;
    if (!name)
        return no_memory(s, error);
    for (size_t k = 0; k < s->columns; k++)
        if (s->name[k])
            name[n++] = s->name[k];
    qsort(name, n, sizeof *name, by_text);
    for (size_t k = 1; k < n && error->status == AD_OK; k++)
        if (strcmp(name[k - 1], name[k]) == 0)
            ad_fail(error, AD_E_INPUT,
                    "%s:%zu: two columns are named '%.60s'; expected names that differ, or a "
                    "choice of state and rate by number",
                    s->file, s->names_line, name[k]);
    free(name);
    return error->status;
}
