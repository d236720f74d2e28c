/* The range of states and inputs seen in training: of all ranks, and at the ends of steps. */
#include "tests/hnn/small.h"
#include "tests/close.h"
#include "tests/ranks.h"
#include "hnn/data/data.h"

#include <stdlib.h>
#include <string.h>

enum { PARTS = 20000, RANKS = 3 };

struct seen {
    const double *x; /* states, a parameter, the same after a step; [4 x PARTS] */
    double low[RANKS][3], high[RANKS][3];
};

/* Ranks have their share of samples, one process all, and rollouts. */
static void see(void *context, struct ad_ranks *ranks)
{
    struct seen *seen = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct hnn_settings s = small_settings(&small_kinds[1], 1, 2);
    struct hnn_training training = hnn_training_defaults();
    struct hnn_samples samples = {.n = PARTS};
    s.inputs = 1;
    training.ranks = ranks;
    training.rollout = !ranks;
    training.dt = 0.1;
    if (ranks)
        hnn_samples_share(ranks, PARTS, &samples.begin, &samples.end);
    size_t held = samples.end ? samples.end - samples.begin : PARTS;
    double *mine = malloc(4 * held * sizeof *mine);
    for (size_t r = 0; r < 4; r++)
        memcpy(mine + r * held, seen->x + r * PARTS + samples.begin, held * sizeof *mine);
    samples.x = samples.target = mine;
    hnn_model *model = small_model(&s);
    hnn_trainer *trainer = small_trainer(model, &training, &samples, &small_none);
    const struct hnn_range range = hnn_model_range(model);
    memcpy(seen->low[rank], range.low, sizeof seen->low[rank]);
    memcpy(seen->high[rank], range.high, sizeof seen->high[rank]);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    free(mine);
}

/* Of all ranks' samples, and of inputs at the ends of steps. */
static void test_range(void **state)
{
    (void)state;
    double *x = small_values(8, 4, PARTS);
    for (size_t k = 0; k < 3; k++) {
        x[k * PARTS] = -2.0 - (double)k;
        x[(k + 1) * PARTS - 1] = 3.0 + (double)k;
    }
    x[3 * PARTS + 1] = 11;
    struct seen seen = {.x = x};
    for (size_t count = 0; count <= RANKS; count += RANKS) {
        with_ranks(count, see, &seen);
        for (size_t k = 0; k < 3 * (count + !count); k++) {
            size_t rank = k / 3, of = k % 3;
            assert_true(seen.low[rank][of] == -2.0 - (double)of);
            assert_true(seen.high[rank][of] == (of < 2 || count ? 3.0 + (double)of : 11));
        }
    }
    free(x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_range)};
    return cmocka_run_group_tests_name("range", tests, NULL, NULL);
}
