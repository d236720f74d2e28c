/* Ensembles: each member is what phys_motion_solve makes of it alone, whatever the others do. */
#include "tests/physics/systems.h"
#include "autodiff/ascending.h"
#include "tests/close.h"
#include "tests/native.h"
#include "physics/motion/ensemble.h"
#include "physics/physics.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 40, STATES = 4, COLUMNS = 4 };

struct case_of {
    const char *scene;
    size_t n, n_columns;
    const char *names[COLUMNS];
    double values[MOST * COLUMNS];
    struct phys_motion_settings motion;
};

/* Irregular numbers between 0 and 1. */
static double irregular(size_t k)
{
    double x = 0.6180339887498949 * (double)(k + 1);
    return x - floor(x);
}

static void solve(const struct case_of *c, size_t threads, size_t at_once,
                  struct phys_system *system, struct phys_ensemble *ensemble)
{
    struct ad_error error = {0};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = c->n,
                                                    .n_columns = c->n_columns,
                                                    .names = c->names,
                                                    .values = c->values,
                                                    .motion = &c->motion,
                                                    .threads = threads,
                                                    .at_once = at_once};
    *system = system_opened(c->scene);
    phys_ensemble_solve(system, &settings, ensemble, &error);
    assert_string_equal(error.message, "");
    assert_int_equal(error.status, AD_OK);
}

static void close_all(struct phys_system *system, struct phys_ensemble *ensemble)
{
    phys_ensemble_free(ensemble);
    phys_system_close(system);
}

/* Member i alone, from its row. */
static void solve_alone(const struct case_of *c, const struct phys_ensemble *e, size_t i,
                        struct phys_system *system, struct phys_motion_solution *motion,
                        struct ad_error *error)
{
    struct phys_motion_settings settings = c->motion;
    double start[STATES];
    *system = system_opened(c->scene);
    for (size_t k = 0; k < c->n_columns; k++)
        if (!isnan(phys_system_get(system, c->names[k])))
            system_set(system, c->names[k], c->values[i * c->n_columns + k]);
    system_start(system, 0, start, start + e->dof);
    for (size_t k = 0; k < 2 * e->dof; k++)
        for (size_t j = 0; j < c->n_columns; j++) {
            char name[64] = "v_";
            phys_coordinate_name(system, k % e->dof, name + (k < e->dof ? 0 : 2), 60);
            if (strcmp(name, c->names[j]) == 0)
                start[k] = c->values[i * c->n_columns + j];
        }
    settings.q = start;
    settings.v = start + e->dof;
    settings.integrator = e->integrator;
    settings.tolerance = e->member[i].tolerance;
    settings.error = 0;
    settings.n_samples = e->n_times - 1;
    settings.no_reference = true;
    phys_motion_solve(system, &settings, motion, error);
}

/* Samples, energies, steps and events to the last bit. */
static void compare_all(const struct case_of *c, const struct phys_ensemble *e)
{
    for (size_t i = 0; i < e->n; i++) {
        struct phys_system system;
        struct phys_motion_solution m;
        struct ad_error error = {0};
        const struct phys_member *member = &e->member[i];
        solve_alone(c, e, i, &system, &m, &error);
        size_t bytes = 2 * e->dof * sizeof(double), reached = 0;
        const double *x = e->x + i * e->n_times * 2 * e->dof;
        while (reached < e->n_times && !isnan(x[2 * e->dof * reached]))
            reached++;
        assert_int_equal(member->failure.status, error.status);
        assert_string_equal(member->failure.message, error.message);
        assert_int_equal(member->info.steps, m.info.steps);
        assert_int_equal(member->info.rejected, m.info.rejected);
        assert_int_equal(member->info.evaluations, m.info.evaluations);
        assert_int_equal(member->info.stop, m.info.stop);
        assert_true(member->info.t == m.info.t);
        size_t cut = m.n > 0 && m.info.stop == PHYS_SIMULATION_EVENT; /* a sample at the event */
        assert_int_equal(reached, m.n - cut);
        assert_memory_equal(x, m.x, reached * bytes);
        for (size_t j = 0; j < reached; j++)
            assert_close(e->energy[i * e->n_times + j], m.energy[j], 1e-13, 1e-13);
        assert_int_equal(member->crossed.n, m.crossed.n);
        if (m.crossed.n) {
            assert_memory_equal(member->crossed.t, m.crossed.t, m.crossed.n * sizeof(double));
            assert_memory_equal(member->crossed.x, m.crossed.x, m.crossed.n * bytes);
        }
        phys_motion_solution_free(&m);
        phys_system_close(&system);
    }
}

static struct case_of double_pendula(size_t n)
{
    struct case_of c = {.scene = "dblpend",
                        .n = n,
                        .n_columns = 3,
                        .names = {"b", "v_a", "l1"},
                        .motion = {.size = sizeof(struct phys_motion_settings),
                                   .time = 5,
                                   .tolerance = 1e-9,
                                   .n_samples = 70}};
    for (size_t i = 0; i < n; i++) {
        c.values[3 * i] = 3 * irregular(3 * i);
        c.values[3 * i + 1] = 2 * irregular(3 * i + 1) - 1;
        c.values[3 * i + 2] = 0.5 + irregular(3 * i + 2);
    }
    return c;
}

/* Starts and parameters, several at once and one by one, on one thread and two. */
static void test_members_are_motions(void **state)
{
    (void)state;
    native_need_compiler();
    const struct case_of c = double_pendula(19);
    const size_t others[][2] = {{2, 2}, {1, 1}, {2, 1}};
    struct phys_system system;
    struct phys_ensemble e, again;
    solve(&c, 1, 2, &system, &e);
    assert_true(e.vectors && e.failed == 0 && e.unknown == 0);
    compare_all(&c, &e);
    for (size_t k = 0; k < LENGTH(others); k++) {
        struct phys_system same;
        solve(&c, others[k][0], others[k][1], &same, &again);
        assert_true(again.vectors == (others[k][1] > 1));
        assert_memory_equal(again.x, e.x, e.n * e.n_times * STATES * sizeof *e.x);
        for (size_t i = 0; i < e.n; i++)
            assert_true(again.member[i].error == e.member[i].error);
        close_all(&same, &again);
    }
    close_all(&system, &e);
}

/* A collision, an escape and orbits: steps, orders, ends and events of each are its own. */
static struct case_of orbits(void)
{
    struct case_of c = {.scene = "kepler",
                        .n = 21,
                        .n_columns = 3,
                        .names = {"x", "v_x", "v_y"},
                        .motion = {.size = sizeof(struct phys_motion_settings),
                                   .time = 9,
                                   .tolerance = 1e-8,
                                   .n_samples = 9}};
    for (size_t i = 0; i < c.n; i++) {
        c.values[3 * i] = 0.3 + irregular(2 * i);
        c.values[3 * i + 2] = 0.2 + 2 * irregular(2 * i + 1);
    }
    for (size_t i = 4; i < c.n; i += 9)
        c.values[3 * i + 2] = 0; /* falls to the centre */
    return c;
}

/* Members of different tolerances, whose series have different orders. */
static void test_orders_are_their_own(void **state)
{
    (void)state;
    native_need_compiler();
    struct case_of c = orbits();
    struct phys_system system;
    struct phys_ensemble e;
    size_t different = 0;
    c.motion.tolerance = 0;
    c.motion.error = 1e-6;
    for (size_t i = 0; i < c.n; i++) {
        const double r = exp(6 * irregular(i));
        c.values[3 * i] = r;
        c.values[3 * i + 2] = sqrt((1 + 0.3 * irregular(i + 7)) / r);
    }
    solve(&c, 1, 2, &system, &e);
    assert_true(e.vectors && e.failed == 0 && e.missed == 0);
    for (size_t i = 1; i < e.n; i++)
        different += fabs(log(e.member[i].tolerance / e.member[i - 1].tolerance)) > 2;
    assert_true(different > 5);
    compare_all(&c, &e);
    close_all(&system, &e);
}

static void test_failures_stay_alone(void **state)
{
    (void)state;
    native_need_compiler();
    const struct case_of c = orbits();
    struct phys_system system;
    struct phys_ensemble e;
    struct ad_error missed = {0};
    const struct phys_ensemble_settings settings = {
        .size = sizeof settings, .n = c.n, .motion = &c.motion};
    solve(&c, 2, 2, &system, &e);
    assert_true(e.vectors);
    assert_int_equal(e.failed, 2);
    for (size_t i = 0; i < e.n; i++)
        assert_true((e.member[i].failure.status != AD_OK) == (i == 4 || i == 13));
    compare_all(&c, &e);
    assert_int_equal(phys_ensemble_met(&settings, &e, &missed), AD_E_ACCURACY);
    assert_non_null(strstr(missed.message, "row 5"));
    assert_int_equal(e.spread[9 * 5].n, e.n - 2);
    assert_int_equal(e.spread[0].n, e.n);
    close_all(&system, &e);
}

/* Of high order the series overflow before the steps end, together and alone. */
static void test_series_that_overflow(void **state)
{
    (void)state;
    native_need_compiler();
    struct case_of c = orbits();
    struct phys_system system;
    struct phys_ensemble e;
    c.motion.tolerance = 1e-15;
    solve(&c, 1, 2, &system, &e);
    assert_true(e.vectors && e.failed == 2);
    compare_all(&c, &e);
    close_all(&system, &e);
}

/* The statistics of the ends are of the states at the last crossings of those that came to one. */
static void ends_are_crossings(const struct phys_ensemble *e)
{
    const struct phys_spread *end = e->spread + 5 * e->n_times;
    double mean[6] = {0};
    size_t n = 0;
    for (size_t i = 0; i < e->n; i++) {
        const struct phys_crossed *c = &e->member[i].crossed;
        if (c->n == 0 || c->which[c->n - 1] != 2)
            continue;
        const double *x = c->x + 4 * (c->n - 1);
        assert_close(x[0], -0.4, 0, 1e-12);
        n++;
        for (size_t k = 0; k < 4; k++)
            mean[k] += x[k];
        mean[4] += (x[2] * x[2] + x[3] * x[3]) / 2 - 1 / hypot(x[0], x[1]);
        mean[5] += c->t[c->n - 1];
    }
    for (size_t k = 0; k < 6; k++) {
        assert_int_equal(end[k].n, n);
        assert_close(end[k].mean, mean[k] / (double)n, 1e-12, 1e-13);
    }
}

static void test_events_of_members(void **state)
{
    (void)state;
    native_need_compiler();
    struct case_of c = orbits();
    struct phys_system system = system_opened("kepler");
    struct phys_ensemble e;
    struct phys_crossing crossings[2];
    struct ad_error error = {0};
    phys_crossing_read(&system, "y=0", &crossings[0], &error);
    phys_crossing_read(&system, "x<-0.4", &crossings[1], &error);
    assert_int_equal(error.status, AD_OK);
    phys_system_close(&system);
    crossings[1].last = true;
    c.motion.n_crossings = 2;
    c.motion.crossings = crossings;
    solve(&c, 1, 2, &system, &e);
    compare_all(&c, &e);
    size_t events = 0, known = 0, stopped = 0;
    for (size_t i = 0; i < e.n; i++) {
        stopped += e.member[i].info.stop == PHYS_SIMULATION_EVENT;
        for (size_t k = 0; k < e.member[i].crossed.n; k++, events++)
            known += e.member[i].crossed.uncertainty[k] < 1e-3;
    }
    assert_true(events > 20 && known > events - 5 && stopped > 3 && stopped < e.n);
    ends_are_crossings(&e);
    close_all(&system, &e);
}

/* Against a reference for each; and an error that is asked for is kept. */
static void test_errors_are_known(void **state)
{
    (void)state;
    native_need_compiler();
    struct case_of c = double_pendula(8);
    for (int asked = 0; asked < 2; asked++) {
        struct phys_system system, own;
        struct phys_ensemble e;
        if (asked) {
            c.motion.tolerance = 0;
            c.motion.error = 1e-10;
        }
        solve(&c, 1, 2, &system, &e);
        assert_int_equal(e.missed, 0);
        assert_int_equal(e.n_checked, 2);
        for (size_t i = 0; i < e.n; i++) {
            struct phys_reference r = {0};
            struct phys_motion_solution m;
            struct ad_error error = {0};
            solve_alone(&c, &e, i, &own, &m, &error);
            phys_reference(&own, m.start, m.start + e.dof, e.n_times, e.t, 0.1, NULL, NULL, &r,
                           &error);
            assert_int_equal(error.status, AD_OK);
            double most = 0, known = 0;
            for (size_t j = 0; j < e.n_times; j++) {
                const double *x = e.x + 2 * e.dof * (i * e.n_times + j), *y = r.x + 2 * e.dof * j;
                most = fmax(most, hypot(x[0] - y[0], x[1] - y[1]));
                known = fmax(known, r.uncertainty[j]);
            }
            assert_true(most <= e.member[i].error + known);
            for (size_t k = 0; k < e.n_checked; k++)
                if (e.checked[k] == i)
                    assert_close(e.measured[k], most, 1e-12, 0);
            assert_true(e.member[i].error < (asked ? 1e-10 : 1e-5));
            phys_reference_free(&r);
            phys_motion_solution_free(&m);
            phys_system_close(&own);
        }
        close_all(&system, &e);
    }
}

/* Of chaotic motions that part the error is unknown. */
static void test_chaos_is_unknown(void **state)
{
    (void)state;
    struct case_of c = double_pendula(3);
    struct phys_system system;
    struct phys_ensemble e;
    c.motion.time = 40;
    c.motion.tolerance = 1e-3;
    for (size_t i = 0; i < c.n; i++)
        c.values[3 * i] = 3;
    solve(&c, 1, 1, &system, &e);
    assert_true(e.unknown == 3 && isnan(e.member[1].error));
    close_all(&system, &e);
}

static void test_statistics(void **state)
{
    (void)state;
    static const size_t sizes[] = {1, 2, 3, 11};
    for (size_t m = 0; m < LENGTH(sizes); m++) {
        const size_t n = sizes[m];
        const struct case_of c = double_pendula(n);
        struct phys_system system;
        struct phys_ensemble e;
        double x[MOST], mean = 0, squares = 0;
        solve(&c, 1, 1, &system, &e);
        const size_t j = 5, k = 2;
        const struct phys_spread *s = &e.spread[j * 5 + k];
        for (size_t i = 0; i < n; i++)
            mean += x[i] = e.x[(i * e.n_times + j) * 4 + k];
        mean /= (double)n;
        for (size_t i = 0; i < n; i++)
            squares += pow(x[i] - mean, 2);
        qsort(x, n, sizeof *x, ad_ascending);
        assert_int_equal(s->n, n);
        assert_close(s->mean, mean, 1e-12, 1e-14);
        if (n > 1)
            assert_close(s->deviation, sqrt(squares / (double)(n - 1)), 1e-12, 0);
        else
            assert_true(isnan(s->deviation));
        assert_close(s->quantile[2], n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2, 1e-14, 0);
        if (n == 11)
            assert_close(s->quantile[0], (x[0] + x[1]) / 2, 1e-14, 0);
        close_all(&system, &e);
    }
}

static ad_var with_a_kink(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_abs(q));
}

static enum ad_status at_one(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    *q = 1;
    *v = 0;
    return AD_OK;
}

static void test_kinks_take_dop853(void **state)
{
    (void)state;
    const struct phys_scene scene = scene_of("kink", 1, with_a_kink, 11, 0.1, at_one);
    const char *const names[] = {"x1"};
    const double values[] = {1, 2, 0.5};
    const struct phys_motion_settings motion = {.size = sizeof motion, .time = 1};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = 3,
                                                    .n_columns = 1,
                                                    .names = names,
                                                    .values = values,
                                                    .motion = &motion};
    struct phys_system system;
    struct phys_ensemble e;
    struct ad_error error = {0};
    phys_system_make(&scene, &system, &error);
    phys_ensemble_solve(&system, &settings, &e, &error);
    assert_int_equal(error.status, AD_OK);
    assert_string_equal(e.integrator->name, "dop853");
    for (size_t i = 0; i < 3; i++)
        assert_close(e.x[((i + 1) * e.n_times - 1) * 2], values[i] - 0.5, 0, 1e-6);
    close_all(&system, &e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_members_are_motions),  cmocka_unit_test(test_failures_stay_alone),
        cmocka_unit_test(test_series_that_overflow), cmocka_unit_test(test_events_of_members),
        cmocka_unit_test(test_errors_are_known),     cmocka_unit_test(test_chaos_is_unknown),
        cmocka_unit_test(test_statistics),           cmocka_unit_test(test_kinks_take_dop853),
        cmocka_unit_test(test_orders_are_their_own),
    };
    return cmocka_run_group_tests(tests, native_open_quick, native_remove_cache);
}
