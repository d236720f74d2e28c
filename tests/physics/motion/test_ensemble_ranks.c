/* An ensemble on ranks is that of one process to the last bit, on every rank, with members that
   fail and crossings of their own. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/native.h"
#include "tests/ranks.h"
#include "physics/motion/ensemble.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = 170, MOST = 4, TIMES = 6, STATES = 4 };

struct job {
    struct phys_system system;
    struct phys_motion_settings motion;
    double values[N * 3];
    size_t threads, at_once;
    struct phys_ensemble ensemble[MOST];
    struct ad_error error[MOST];
};

static void solve(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    static const char *const names[] = {"x", "v_x", "v_y"};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = N,
                                                    .n_columns = 3,
                                                    .names = names,
                                                    .values = j->values,
                                                    .motion = &j->motion,
                                                    .threads = j->threads,
                                                    .at_once = j->at_once,
                                                    .ranks = ranks};
    phys_ensemble_solve(&j->system, &settings, &j->ensemble[rank], &j->error[rank]);
}

static void compare(const struct phys_ensemble *e, const struct phys_ensemble *alone)
{
    size_t rows = N * TIMES;
    assert_memory_equal(e->x, alone->x, rows * STATES * sizeof *e->x);
    assert_memory_equal(e->energy, alone->energy, (rows + N) * sizeof *e->energy);
    assert_memory_equal(e->spread, alone->spread, (TIMES + 1) * (STATES + 1) * sizeof *e->spread);
    assert_int_equal(e->failed, alone->failed);
    assert_int_equal(e->complete, alone->complete);
    assert_int_equal(e->unknown, alone->unknown);
    for (size_t i = 0; i < N; i++) {
        const struct phys_member *m = &e->member[i], *a = &alone->member[i];
        size_t bytes = a->crossed.n * sizeof(double);
        assert_string_equal(m->failure.message, a->failure.message);
        assert_memory_equal(&m->error, &a->error, sizeof a->error);
        assert_int_equal(m->info.steps, a->info.steps);
        assert_int_equal(m->crossed.n, a->crossed.n);
        if (bytes == 0)
            continue;
        assert_memory_equal(m->crossed.t, a->crossed.t, bytes);
        assert_memory_equal(m->crossed.which, a->crossed.which, bytes);
        assert_memory_equal(m->crossed.x, a->crossed.x, STATES * bytes);
        assert_memory_equal(m->crossed.uncertainty, a->crossed.uncertainty, bytes);
    }
}

static void test_same_bits(void **state)
{
    (void)state;
    struct phys_crossing crossing;
    struct ad_error error = {0};
    struct job j = {.system = system_opened("kepler"),
                    .motion = {.size = sizeof(struct phys_motion_settings),
                               .time = 2,
                               .tolerance = 1e-6,
                               .n_samples = TIMES - 1,
                               .n_crossings = 1,
                               .crossings = &crossing}};
    assert_int_equal(phys_crossing_read(&j.system, "y=0.1", &crossing, &error), AD_OK);
    for (size_t i = 0; i < N; i++) {
        j.values[3 * i] = 0.3 + fmod(0.618033988 * (double)i, 1);
        j.values[3 * i + 2] = i % 37 == 5 ? 0 : 0.4 + fmod(0.7548776662 * (double)i, 1);
    }
    j.at_once = 1;
    solve(&j, NULL);
    struct phys_ensemble alone = j.ensemble[0];
    assert_int_equal(j.error[0].status, AD_OK);
    assert_in_range(alone.failed, 1, 5); /* fall to the centre */
    for (size_t k = 0; k < 2 * MOST; k++) {
        const size_t count = k % MOST + 1;
        j.threads = count % 2 + 1;
        j.at_once = 1 + k / MOST; /* one by one; several by machine code, which shares do not end */
        with_ranks(count, solve, &j);
        for (size_t rank = 0; rank < count; rank++) {
            assert_string_equal(j.error[rank].message, "");
            compare(&j.ensemble[rank], &alone);
            phys_ensemble_free(&j.ensemble[rank]);
        }
    }
    phys_ensemble_free(&alone);
    phys_system_close(&j.system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits)};
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
