/* What an ensemble says of itself: errors whatever the samples, motions that were interrupted. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/native.h"
#include "physics/motion/ensemble.h"
#include "physics/physics.h"

enum { MEMBERS = 8 };

struct solved {
    struct phys_system system;
    struct phys_ensemble e;
    struct ad_error error;
};

static struct solved solve(const char *scene, const char *name, double least,
                           const struct phys_motion_settings *motion)
{
    struct solved s = {0};
    double values[MEMBERS];
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = MEMBERS,
                                                    .n_columns = 1,
                                                    .names = &name,
                                                    .values = values,
                                                    .motion = motion};
    for (size_t i = 0; i < MEMBERS; i++)
        values[i] = least * (1 + 0.1 * (double)i);
    s.system = system_opened(scene);
    phys_ensemble_solve(&s.system, &settings, &s.e, &s.error);
    assert_int_equal(s.error.status, AD_OK);
    return s;
}

static void end(struct solved *s)
{
    phys_ensemble_free(&s->e);
    phys_system_close(&s->system);
}

/* Orbits of a = 1 at the far end: the largest error is at the near one, which is no sample. */
static void errors_are_those_between_samples(void **state)
{
    (void)state;
    struct phys_motion_settings motion = {
        .size = sizeof motion, .time = 3 * M_PI, .tolerance = 1e-7, .n_samples = 1};
    struct solved few = solve("kepler", "e", 0.5, &motion);
    motion.n_samples = 2000;
    struct solved many = solve("kepler", "e", 0.5, &motion);
    for (size_t i = 0; i < MEMBERS; i++) {
        const double error = few.e.member[i].error, true_error = many.e.member[i].error;
        if (!(error > 0.5 * true_error && error <= true_error))
            fail_msg("member %zu: %g by 1 sample, %g by 2000", i, error, true_error);
    }
    end(&few);
    end(&many);
}

/* Thrown up from 0, and down again in one step, between two samples. */
static void what_comes_back_to_zero_has_an_error(void **state)
{
    (void)state;
    struct solved s = {.system = system_opened("freebody")};
    struct phys_crossing crossing;
    assert_int_equal(phys_crossing_read(&s.system, "x<0", &crossing, &s.error), AD_OK);
    crossing.last = true;
    const struct phys_motion_settings motion = {.size = sizeof motion,
                                                .time = 10000,
                                                .error = 1e-7,
                                                .n_samples = 1,
                                                .n_crossings = 1,
                                                .crossings = &crossing};
    phys_system_close(&s.system);
    s = solve("freebody", "v0", 300, &motion);
    for (size_t i = 0; i < MEMBERS; i++) {
        assert_true(s.e.member[i].error < 1e-7);
        assert_close(s.e.member[i].crossed.t[0], 600 * (1 + 0.1 * (double)i), 1e-12, 0);
    }
    assert_int_equal(s.e.missed + s.e.unknown, 0);
    end(&s);
}

/* Of the largest coordinate at the start, not of the first or last: (1 - e, 0). */
static void steps_begin_at_a_thousandth_of_the_error(void **state)
{
    (void)state;
    const struct phys_motion_settings motion = {.size = sizeof motion, .time = 1, .error = 1e-6};
    struct solved s = solve("kepler", "e", 0.3, &motion);
    for (size_t i = 0; i < MEMBERS; i++)
        assert_close(s.e.member[i].tolerance, 1e-9 / (1 - 0.3 * (1 + 0.1 * (double)i)), 1e-9, 0);
    end(&s);
}

/* After some steps of the members. */
static bool some_steps(void *context) { return ++*(size_t *)context < 60; }

static void an_interruption_counts_who_is_complete(void **state)
{
    (void)state;
    size_t asked = 0, complete = 0;
    const struct phys_motion_settings motion = {.size = sizeof motion,
                                                .time = 3 * M_PI,
                                                .tolerance = 1e-7,
                                                .proceed = some_steps,
                                                .context = &asked};
    struct solved s = solve("kepler", "e", 0.1, &motion);
    assert_true(s.e.interrupted);
    for (size_t i = 0; i < MEMBERS; i++)
        complete += isfinite(s.e.x[((i + 1) * s.e.n_times - 1) * 4]) != 0;
    assert_int_equal(s.e.complete, complete);
    assert_true(complete < MEMBERS);
    for (size_t k = 0; k < 6; k++) /* q, v, energy and t at the end */
        assert_int_equal(s.e.spread[s.e.n_times * 5 + k].n, complete);
    end(&s);
}

/* Of members alike the mean is their number, to the last digit, and the deviation 0. */
static void members_alike_have_no_spread(void **state)
{
    (void)state;
    enum { ALIKE = 49 };
    double values[ALIKE];
    const char *const name = "e";
    const struct phys_motion_settings motion = {
        .size = sizeof motion, .time = 0.1, .no_reference = true, .n_samples = 1};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = ALIKE,
                                                    .n_columns = 1,
                                                    .names = &name,
                                                    .values = values,
                                                    .motion = &motion};
    struct phys_system system = system_opened("kepler");
    struct phys_ensemble e;
    struct ad_error error = {0};
    for (size_t i = 0; i < ALIKE; i++)
        values[i] = 0.3;
    assert_int_equal(phys_ensemble_solve(&system, &settings, &e, &error), AD_OK);
    for (size_t k = 0; k < 5 * e.n_times; k++) {
        const struct phys_spread *s = &e.spread[k];
        assert_true(s->n == ALIKE && s->mean == s->quantile[0] && s->deviation == 0);
    }
    phys_ensemble_free(&e);
    phys_system_close(&system);
}

/* A member without a series at its start fails by itself, among others that advance together. */
static void a_member_may_fail_at_its_start(void **state)
{
    (void)state;
    const char *const names[] = {"x", "v_y"};
    double values[2 * MEMBERS];
    struct phys_system system = system_opened("kepler");
    struct phys_ensemble e;
    struct ad_error error = {0};
    const struct phys_motion_settings motion = {.size = sizeof motion,
                                                .time = 3,
                                                .tolerance = 1e-9,
                                                .n_samples = 4,
                                                .integrator =
                                                    phys_integrator_find("taylor", &error)};
    const struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                    .n = MEMBERS,
                                                    .n_columns = 2,
                                                    .names = names,
                                                    .values = values,
                                                    .motion = &motion};
    for (size_t i = 0; i < MEMBERS; i++) {
        values[2 * i] = i == 3 ? 0 : 1;
        values[2 * i + 1] = 1 + 0.01 * (double)i;
    }
    assert_int_equal(phys_ensemble_solve(&system, &settings, &e, &error), AD_OK);
    for (size_t i = 0; i < MEMBERS; i++) {
        assert_int_equal(e.member[i].failure.status, i == 3 ? AD_E_NONFINITE : AD_OK);
    }
    phys_ensemble_free(&e);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_those_between_samples),
        cmocka_unit_test(what_comes_back_to_zero_has_an_error),
        cmocka_unit_test(steps_begin_at_a_thousandth_of_the_error),
        cmocka_unit_test(an_interruption_counts_who_is_complete),
        cmocka_unit_test(members_alike_have_no_spread),
        cmocka_unit_test(a_member_may_fail_at_its_start),
    };
    return cmocka_run_group_tests(tests, native_open_quick, native_remove_cache);
}
