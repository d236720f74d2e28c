/* Selects the rows that have a target, and divides them into training and test.

   Random choices use selection sampling (D. E. Knuth, The Art of Computer Programming 2, 3.4.2,
   Algorithm S): exactly the requested number, every choice equally likely, rows in order. */
#include "data_table.h"

#include <math.h>
#include <string.h>

size_t hnn_roles_usable(struct hnn_table *table)
{
    const size_t before = table->before, after = table->after;
    size_t usable = 0;
    for (size_t first = 0, end; first < table->rows; first = end) {
        for (end = first + 1; end < table->rows && hnn_table_follows(table, end);)
            end++;
        if (end - first <= before + after)
            continue;
        memset(table->role + first + before, HNN_TRAIN, end - first - before - after);
        usable += end - first - before - after;
    }
    return usable;
}

bool hnn_select(struct phys_random *random, size_t *wanted, size_t *left)
{
    bool chosen = phys_random_uniform(random) * (double)*left < (double)*wanted;
    *wanted -= chosen;
    --*left;
    return chosen;
}

static void split_tail(struct hnn_table *table, size_t rollout, size_t wanted)
{
    size_t row = table->rows;
    while (wanted) {
        row--;
        if (table->role[row] == HNN_TRAIN) {
            table->role[row] = HNN_TEST;
            wanted--;
        }
    }
    /* Targets of the rows before are states of the test. */
    for (size_t k = 0; k < rollout && row > 0 && hnn_table_follows(table, row); k++)
        table->role[--row] = HNN_UNUSED;
}

static void split_random(struct hnn_table *table, struct phys_random *random, size_t usable,
                         size_t wanted)
{
    for (size_t i = 0; i < table->rows; i++)
        if (table->role[i] == HNN_TRAIN && hnn_select(random, &wanted, &usable))
            table->role[i] = HNN_TEST;
}

static void split_trials(struct hnn_table *table, struct phys_random *random, size_t wanted)
{
    size_t trials = table->trials;
    bool test = false;
    for (size_t i = 0; i < table->rows; i++) {
        if (hnn_table_begins(table, i))
            test = hnn_select(random, &wanted, &trials);
        if (test && table->role[i] == HNN_TRAIN)
            table->role[i] = HNN_TEST;
    }
}

enum ad_status hnn_roles_split(const struct hnn_dataset_settings *s, struct hnn_table *table,
                               size_t usable, struct ad_error *error)
{
    bool by_trial = s->split == HNN_SPLIT_TRIAL;
    size_t of = by_trial ? table->trials : usable;
    size_t wanted = (size_t)llround(s->test_fraction * (double)of);
    struct phys_random random;
    if (by_trial && table->plan.trial == HNN_NO_COLUMN && table->trials < 2)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "%s: a split by trial needs a trial column; expected one named trial, or a choice",
            table->file);
    if (s->rollout && s->split == HNN_SPLIT_RANDOM)
        return ad_fail(error, AD_E_ARGUMENT,
                       "rollouts share states: split them at the tail, or by trial");
    if (wanted == 0 || wanted >= of)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: a test fraction of %g of %zu %s leaves none %s; expected a %s one",
                       table->file, s->test_fraction, of, by_trial ? "trials" : "samples",
                       wanted ? "to train on" : "for the test", wanted ? "smaller" : "larger");
    phys_random_seed(&random, s->seed);
    if (s->split == HNN_SPLIT_TAIL)
        split_tail(table, s->rollout, wanted);
    else if (by_trial)
        split_trials(table, &random, wanted);
    else
        split_random(table, &random, usable, wanted);
    return AD_OK;
}
