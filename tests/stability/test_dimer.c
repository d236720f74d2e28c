/* Two bodies under a Lennard-Jones potential: the steep wall limits the step, and bodies at the
   same position are refused. */
#include "follow.h"
#include "tests/close.h"
#include "tests/mentions.h"

static const double rest = 1.1224620483093730; /* 2^(1/6) */

/* 2 / w of the bond at rest; w^2 = 2 V'' / m. */
static void the_limit_follows_from_the_law(void **state)
{
    (void)state;
    struct motion m;
    struct phys_step_advice advice;
    follow_open(&m, "dimer", "r0", rest);
    follow_advice(&m, "verlet", 0.18, &advice);
    assert_close(advice.limit, 0.187077, 0, 5e-7);
    assert_close(advice.limit, 2 / sqrt(2 * 72 / cbrt(2)), 1e-12, 0);
    motion_close(&m);
}

/* Places where forces are taken, r0 first and at rest there, follow r_(i+1) = 2 r_i - r_(i-1) +
   dt^2 a(r_i) with r_1 = r_(-1). The step drift, kick, drift begins half a step later. */
static void begin_at_the_turning_point(struct motion *m, double dt)
{
    double rate[8];
    m->ode.field(m->ode.context, 0, m->y, rate, &m->error);
    assert_int_equal(m->error.status, AD_OK);
    for (size_t k = 0; k < 4; k++) {
        m->y[4 + k] = 0.5 * dt * rate[4 + k];
        m->y[k] += 0.5 * dt * m->y[4 + k];
    }
}

/* Lost: the error of the energy is more than all the energy that the oscillation has. */
static void a_bond_is_held_below_and_lost_beyond(void **state)
{
    (void)state;
    static const struct {
        double dt;
        bool held;
    } cases[] = {{0.18, true}, {0.187, true}, {0.188, false}, {0.19, false}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct motion m;
        follow_open(&m, "dimer", "r0", 1.13);
        double bottom = -1, own = m.ode.energy(m.ode.context, 0, m.y) - bottom;
        begin_at_the_turning_point(&m, cases[k].dt);
        assert_true(follow_steps(&m, "verlet", cases[k].dt, 100000));
        double off = m.info.energy_drift * fabs(m.info.energy_start);
        assert_int_equal(off < own, cases[k].held);
        motion_close(&m);
    }
}

/* A twentieth of a period needs no such care. */
static void short_steps_hold_it_anyhow(void **state)
{
    (void)state;
    struct motion m;
    follow_open(&m, "dimer", "r0", 1.13);
    assert_true(follow_steps(&m, "verlet", 0.03, 100000));
    assert_true(m.info.energy_drift < 1e-4);
    motion_close(&m);
}

static void what_was_lost_had_been_warned_of(void **state)
{
    (void)state;
    struct motion m;
    struct phys_step_advice advice;
    follow_open(&m, "dimer", "r0", rest);
    follow_advice(&m, "verlet", 0.19, &advice);
    assert_int_equal(advice.verdict, PHYS_STEP_UNSTABLE);
    assert_mentions(advice.text, "0.19 0.187077 verlet x* 0.028*");
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_limit_follows_from_the_law),
        cmocka_unit_test(a_bond_is_held_below_and_lost_beyond),
        cmocka_unit_test(short_steps_hold_it_anyhow),
        cmocka_unit_test(what_was_lost_had_been_warned_of),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
