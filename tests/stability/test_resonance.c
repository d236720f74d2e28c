/* Resonance of the step with the motion, V = x^2/2 + x^3/3: where a step turns the phase by a third
   of a circle, the cubic term always pushes in the same direction, and no orbit is small enough to
   stay (Skeel, Zhang, Schlick, SIAM J. Sci. Comput. 18, 1997). Linear stability does not predict
   it. */
#include "follow.h"
#include "tests/close.h"
#include "tests/mentions.h"

/* Steps that an orbit of this amplitude lasts, at most `most`. */
static size_t lasts(const char *integrator, double dt, double amplitude, size_t most)
{
    struct motion m;
    follow_open(&m, "cubic", "q0", amplitude);
    bool whole = follow_steps(&m, integrator, dt, most);
    size_t steps = whole && fabs(m.y[0]) < 1 ? most : m.info.steps;
    motion_close(&m);
    return steps;
}

static const struct {
    const char *integrator;
    double dt;        /* of the resonance */
    double amplitude; /* held a little away from it */
} cases[] = {{"verlet", 1.7320508075688772, 0.01}, {"implicit-midpoint", 3.4641016151377544, 0.03}};

enum { N_CASES = sizeof cases / sizeof *cases, MANY = 20000 };

/* The pull is of second order in the amplitude: a tenth of it lasts ten times as long, and then is
   lost all the same. */
static void at_resonance_no_amplitude_is_held(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_CASES; k++) {
        size_t wide = lasts(cases[k].integrator, cases[k].dt, cases[k].amplitude, MANY);
        size_t narrow = lasts(cases[k].integrator, cases[k].dt, 0.1 * cases[k].amplitude, MANY);
        assert_true(narrow < MANY);
        assert_close((double)narrow, 10 * (double)wide, 0.2, 0);
    }
}

static void two_percent_away_the_same_orbit_is_held(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_CASES; k++)
        for (int side = -1; side <= 1; side += 2) {
            double dt = cases[k].dt * (1 + 0.02 * side);
            assert_int_equal(lasts(cases[k].integrator, dt, cases[k].amplitude, MANY), MANY);
        }
}

/* What would be held by linear stability alone is warned of, and the loss is reported. */
static void it_is_reported(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_CASES; k++) {
        struct motion m;
        struct phys_step_advice advice;
        follow_open(&m, "cubic", "q0", 0);
        follow_advice(&m, cases[k].integrator, 1.0001 * cases[k].dt, &advice);
        assert_int_equal(advice.verdict, PHYS_STEP_RESONANT);
        assert_close(advice.resonance, cases[k].dt, 1e-12, 0);
        assert_mentions(advice.text, "resonance");
        assert_mentions(advice.text, cases[k].integrator);
        m.y[0] = cases[k].amplitude;
        assert_false(follow_steps(&m, cases[k].integrator, cases[k].dt, MANY));
        assert_mentions(m.error.message, "step x t");
        motion_close(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_resonance_no_amplitude_is_held),
        cmocka_unit_test(two_percent_away_the_same_orbit_is_held),
        cmocka_unit_test(it_is_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
