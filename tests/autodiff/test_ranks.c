/* Ranks: sums of the same bits for every number of them, each block made once; tasks dealt out;
   errors and texts compared; what is sent, counted. */
#include "autodiff/ranks.h"
#include "support.h"
#include "tests/mentions.h"
#include "tests/ranks.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 7, BLOCKS = 40, WIDTH = 3, TASKS = 1500 };

static double entry(size_t k, size_t i) { return sin(1e3 * (double)(k + 1) + 7.7 * (double)i); }

/* The tree again, from its definition: no code shared. */
static double naive(size_t first, size_t last, size_t i)
{
    size_t half = 1;
    if (last - first == 1)
        return entry(first, i);
    while (2 * half < last - first)
        half *= 2;
    double left = naive(first, first + half, i);
    return left + naive(first + half, last, i);
}

struct sums {
    size_t blocks, failing;
    atomic_int made[BLOCKS];
    double sum[MOST][WIDTH];
    struct ad_error error[MOST];
    uint64_t messages[MOST], bytes[MOST];
};

static enum ad_status make(void *context, size_t k, double *values, struct ad_error *error)
{
    struct sums *s = context;
    s->made[k]++;
    for (size_t i = 0; i < WIDTH; i++)
        values[i] = entry(k, i);
    return k == s->failing ? ad_fail(error, AD_E_NONFINITE, "block %zu", k) : AD_OK;
}

static void add_up(void *context, struct ad_ranks *r)
{
    struct sums *s = context;
    size_t k = r ? r->rank : 0;
    ad_ranks_sum(r, s->blocks, WIDTH, make, s, s->sum[k], &s->error[k]);
    if (r) {
        s->messages[k] = r->messages;
        s->bytes[k] = r->bytes;
    }
}

static void test_sums(void **state)
{
    (void)state;
    for (size_t count = 0; count <= MOST; count++)
        for (size_t blocks = 1; blocks <= BLOCKS; blocks++) {
            struct sums s = {.blocks = blocks, .failing = BLOCKS};
            with_ranks(count, add_up, &s);
            for (size_t k = 0; k < (count ? count : 1); k++)
                for (size_t i = 0; i < WIDTH; i++) {
                    assert_int_equal(s.error[k].status, AD_OK);
                    assert_true(s.sum[k][i] == naive(0, blocks, i));
                }
            for (size_t k = 0; k < blocks; k++)
                assert_int_equal(s.made[k], 1);
        }
}

/* Agreement by 4 ranks has two rounds. The sum goes up the tree once and back: one message of each
   of the others, and a broadcast. */
static void test_counts(void **state)
{
    (void)state;
    const size_t round = 2 * sizeof(double), values = WIDTH * sizeof(double);
    struct sums s = {.blocks = 32, .failing = BLOCKS};
    with_ranks(4, add_up, &s);
    assert_int_equal(s.messages[0], 2 + 3);
    assert_int_equal(s.bytes[0], 2 * round + 3 * values);
    for (size_t k = 1; k < 4; k++) {
        assert_int_equal(s.messages[k], 2 + 1);
        assert_int_equal(s.bytes[k], 2 * round + values);
    }
}

/* The error of one rank's block is that of all, and names the rank. */
static void test_failing_block(void **state)
{
    (void)state;
    struct sums s = {.blocks = 8, .failing = 5};
    with_ranks(4, add_up, &s);
    for (size_t k = 0; k < 4; k++) {
        assert_int_equal(s.error[k].status, AD_E_NONFINITE);
        assert_mentions(s.error[k].message, "rank 2: block 5");
    }
}

struct agreeing {
    bool failing[MOST];
    double least[MOST][2];
    struct ad_error error[MOST];
};

static void meet(void *context, struct ad_ranks *r)
{
    struct agreeing *a = context;
    struct ad_error sending = {0}, *error = &a->error[r->rank];
    double *least = a->least[r->rank];
    least[0] = fabs((double)r->rank - 3);
    least[1] = r->rank == 1 ? (double)NAN : -(double)r->rank;
    ad_ranks_least(r, 2, least, &sending);
    if (a->failing[r->rank])
        ad_fail(error, AD_E_INPUT, "by %zu", r->rank);
    ad_ranks_agree(r, error);
}

/* Every set of ranks that fail, of every number of ranks. */
static void test_agreement(void **state)
{
    (void)state;
    for (size_t count = 1; count <= MOST; count++)
        for (unsigned set = 0; set < 1U << count; set++) {
            struct agreeing a = {0};
            char said[32] = "";
            for (size_t k = count; k-- > 0;)
                if ((a.failing[k] = set >> k & 1))
                    snprintf(said, sizeof said, "rank %zu: by %zu", k, k);
            with_ranks(count, meet, &a);
            for (size_t k = 0; k < count; k++) {
                assert_int_equal(a.error[k].status, set ? AD_E_INPUT : AD_OK);
                assert_string_equal(a.error[k].message, set + 1 == 1U << count ? "by 0" : said);
                assert_true(a.least[k][0] == (count > 3 ? 0 : 4 - (double)count));
                assert_true(count == 2 ? a.least[k][1] == 0
                                       : a.least[k][1] == -(double)(count - 1));
            }
        }
}

struct dealing {
    size_t failing, seen[MOST];
    atomic_int run[TASKS], after;
    double result[MOST][TASKS];
    struct ad_error error[MOST];
};

static enum ad_status square(void *context, size_t task, void *result, struct ad_error *error)
{
    struct dealing *d = context;
    d->run[task]++;
    *(double *)result += (double)(task * task);
    return task == d->failing ? ad_fail(error, AD_E_INPUT, "task %zu", task) : AD_OK;
}

static void deal(void *context, struct ad_ranks *r)
{
    struct dealing *d = context;
    size_t k = r ? r->rank : 0;
    for (int again = 0; again < 2; again++) /* the numbers go on */
        ad_ranks_deal(r, TASKS, sizeof(double), square, d, d->result[k], &d->error[k]);
}

static void test_tasks(void **state)
{
    (void)state;
    for (size_t count = 0; count <= 4; count++) {
        struct dealing d = {.failing = TASKS};
        with_ranks(count, deal, &d);
        for (size_t task = 0; task < TASKS; task++) {
            assert_int_equal(d.run[task], 2);
            for (size_t k = 0; k < (count ? count : 1); k++)
                assert_true(d.result[k][task] == (double)(task * task));
        }
    }
}

static void test_failing_task(void **state)
{
    (void)state;
    for (size_t count = 1; count <= 4; count++) {
        struct dealing d = {.failing = 11};
        int run = 0;
        with_ranks(count, deal, &d);
        for (size_t k = 0; k < count; k++) {
            assert_int_equal(d.error[k].status, AD_E_INPUT);
            assert_mentions(d.error[k].message, "task 11");
        }
        for (size_t task = 0; task < TASKS; task++)
            run += d.run[task];
        assert_in_range(run, 12, TASKS);
    }
}

struct talk {
    const char *text[3];
    struct ad_error error[3];
    double halo[3][2];
    char last[3][4];
};

static void talk(void *context, struct ad_ranks *r)
{
    struct talk *t = context;
    double mine = 10 + (double)r->rank, *halo = t->halo[r->rank];
    struct ad_error *error = &t->error[r->rank];
    size_t left = r->rank ? r->rank - 1 : AD_NO_RANK;
    size_t right = r->rank + 1 < r->count ? r->rank + 1 : AD_NO_RANK;
    ad_ranks_exchange(r, right, &mine, left, &halo[0], sizeof mine, error);
    ad_ranks_exchange(r, left, &mine, right, &halo[1], sizeof mine, error);
    void *text = (void *)t->text[r->rank];
    size_t bytes = 4;
    ad_ranks_spread(r, 2, &text, &bytes, error);
    if (error->status == AD_OK && bytes == 4)
        memcpy(t->last[r->rank], text, bytes);
    if (r->rank != 2)
        free(text);
    ad_ranks_same(r, "version", t->text[r->rank], error);
}

static void test_texts_and_neighbours(void **state)
{
    (void)state;
    struct talk same = {.text = {"1.0", "1.0", "1.0"}}, other = {.text = {"1.0", "1.0", "1.1"}};
    with_ranks(3, talk, &same);
    with_ranks(3, talk, &other);
    for (size_t k = 0; k < 3; k++) {
        assert_int_equal(same.error[k].status, AD_OK);
        assert_int_equal(other.error[k].status, AD_E_INPUT);
        assert_mentions(other.error[k].message, "version '1.0' '1.1' rank 2");
        assert_string_equal(other.last[k], "1.1");
        assert_true(same.halo[k][0] == (k > 0 ? 9 + (double)k : 0));
        assert_true(same.halo[k][1] == (k < 2 ? 11 + (double)k : 0));
    }
}

static void test_settings(void **state)
{
    (void)state;
    struct ad_ranks r = {.size = sizeof r, .rank = 2, .count = 2};
    struct ad_error error = {0};
    assert_int_equal(ad_ranks_check(&r, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "gather");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sums),          cmocka_unit_test(test_counts),
        cmocka_unit_test(test_failing_block), cmocka_unit_test(test_tasks),
        cmocka_unit_test(test_failing_task),  cmocka_unit_test(test_texts_and_neighbours),
        cmocka_unit_test(test_settings),      cmocka_unit_test(test_agreement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
