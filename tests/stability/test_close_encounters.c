/* Close encounters: fixed steps cannot follow them, adaptive ones can, and where the motion ends in
   a collision the error names time and coordinate. */
#include "follow.h"
#include "tests/close.h"
#include "tests/mentions.h"

/* Kepler's ellipse of e = 0.99 from the apocentre. */
static void open_ellipse(struct motion *m)
{
    const double e = 0.99;
    follow_open(m, "kepler", "e", e);
    m->y[0] = -(1 + e);
    m->y[1] = m->y[2] = 0;
    m->y[3] = -sqrt((1 - e) / (1 + e));
}

/* One period of 1000 steps: relative errors of the energy, of which nothing is left. */
static void fixed_steps_are_thrown_out(void **state)
{
    (void)state;
    static const struct {
        const char *integrator;
        double energy_error;
    } expected[] = {{"verlet", 46}, {"yoshida4", 34}, {"rk4", 18}};
    for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
        struct motion m;
        open_ellipse(&m);
        assert_true(follow_steps(&m, expected[k].integrator, 2 * M_PI / 1000, 1000));
        assert_close(follow_energy_error(&m), expected[k].energy_error, 0, 0.5);
        motion_close(&m);
    }
}

static void control_of_the_error_goes_round(void **state)
{
    (void)state;
    struct motion m;
    open_ellipse(&m);
    assert_true(follow_to(&m, "dop853", 1e-10, 2 * M_PI));
    assert_true(fabs(follow_energy_error(&m)) < 8e-9);
    assert_true(m.info.evaluations <= 2234);
    assert_true(m.info.max_step > 1000 * m.info.min_step); /* why steps of one length cannot */
    motion_close(&m);
}

/* The midpoint Q of a step h from the pericentre solves Q (1 + a/|Q|^3) = P with a = h^2/4, P = q +
   h v/2. |Q| + a/|Q|^2 has a least value, 3/2 (2 a)^(1/3): where |P| is under it there is no step,
   and that is said. Before, there is one that goes on from shorter ones, |Q| > (2 a)^(1/3); beyond,
   one that no shorter step leads to may be found. */
static void implicit_steps_end_where_they_have_no_solution(void **state)
{
    (void)state;
    const double x = 0.01, v = sqrt(199);
    bool before = true;
    for (double h = 1e-4; h < 0.1; h *= 1.2) {
        struct motion m;
        double a = h * h / 4, P = hypot(x, h * v / 2), least = 1.5 * cbrt(2 * a);
        if (fabs(P / least - 1) < 0.02)
            continue; /* where the two solutions meet Newton's method slows down */
        follow_open(&m, "kepler", "e", 0.99);
        bool done = follow_steps(&m, "implicit-midpoint", h, 1);
        before &= P > least;
        assert_true(before ? done : !done || P > least);
        if (done) {
            double Q = hypot(0.5 * (m.y[0] + x), 0.5 * m.y[1]);
            assert_close(Q + a / (Q * Q), P, 1e-13, 0);
            assert_true(Q > cbrt(2 * a));
        } else
            assert_told(&m.error, AD_E_ACCURACY, "stages smaller step");
        motion_close(&m);
    }
}

/* Towards the pericentre the midpoint rule runs into such a place; more stages find a way round,
   and lose the energy like the explicit ones. */
static void implicit_steps_near_the_pericentre(void **state)
{
    (void)state;
    struct motion m;
    open_ellipse(&m);
    assert_false(follow_steps(&m, "implicit-midpoint", 2 * M_PI / 1000, 1000));
    assert_close(m.info.t, M_PI, 0, 0.01 * M_PI);
    motion_close(&m);
    open_ellipse(&m);
    assert_true(follow_steps(&m, "gauss3", 2 * M_PI / 1000, 1000));
    assert_true(fabs(follow_energy_error(&m)) > 1);
    motion_close(&m);
}

/* Along the ellipse the oscillation is fastest at the pericentre, w = (1 - e)^-3/2 = 1000, which
   says what went wrong: steps of 0.006 where 0.002 is the limit. */
static void the_advice_knows_the_pericentre(void **state)
{
    (void)state;
    const double places[2][4] = {{-1.99, 0, 0, -0.07}, {0.01, 0, 0, 14.1}}, t[] = {0, 3.14};
    struct motion m;
    struct phys_step_advice advice;
    open_ellipse(&m);
    follow_advice(&m, "verlet", 2 * M_PI / 1000, &advice); /* at the start alone, all is well */
    assert_int_equal(advice.verdict, PHYS_STEP_GOOD);
    phys_step_advise(phys_integrator_find("verlet", &m.error), &m.system, 2, places[0], t,
                     2 * M_PI / 1000, &advice, &m.error);
    assert_int_equal(m.error.status, AD_OK);
    assert_int_equal(advice.verdict, PHYS_STEP_UNSTABLE);
    assert_close(advice.motion.frequency, 1000, 1e-12, 0);
    assert_close(advice.limit, 0.002, 1e-12, 0);
    assert_mentions(advice.text, "t 3.14 0.0062* 0.002 verlet dop853");
    motion_close(&m);
}

/* A fall from rest at r = 1 ends at t = pi / sqrt 8: no step is short enough there. */
static void a_collision_is_reported_when_and_where(void **state)
{
    (void)state;
    static const char *const integrators[] = {"dop853", "dopri5"};
    static const char says[] = "step t 1.11072073* velocity x collision";
    for (size_t k = 0; k < 2; k++) {
        struct motion m;
        follow_open(&m, "fall", NULL, 0);
        assert_false(follow_to(&m, integrators[k], 1e-10, 2));
        assert_told(&m.error, AD_E_ACCURACY, says);
        assert_close(m.info.t, 1.1107207345, 0, 1e-9);
        assert_true(isfinite(m.y[0]) && isfinite(m.y[2]) && fabs(m.y[0]) < 1e-8);
        motion_close(&m);
    }
}

/* Steps of one length jump over the centre without a word of it: the energy tells. */
static void fixed_steps_jump_over_a_collision(void **state)
{
    (void)state;
    struct motion m;
    follow_open(&m, "fall", NULL, 0);
    assert_true(follow_steps(&m, "verlet", 0.001, 2000));
    assert_true(m.info.energy_drift > 1);
    motion_close(&m);
}

/* Burrau's three bodies until one leaves, after some ten close encounters that let rounding grow
   by 1e13: coordinates by a Taylor method in quadruple precision (heyoka, tolerances 1e-30 and
   1e-33, which agree on all digits here). In double precision heyoka errs by 0.006 to 0.014 at the
   end: the rounding of places of order 1 is what bodies 4e-4 apart see of each other. The series
   takes what rounding cut off the places into their differences. What the motion says of its error
   holds. */
static void burrau_until_one_leaves(void **state)
{
    (void)state;
    static const struct {
        double t, q[6], most;
    } known[] = {{30,
                  {0.8563404988973161, 2.28709366369625, -0.8779838790318499, -0.8659638277157472,
                   0.1885828038870903, -0.6794851360451523},
                  1e-10},
                 {50,
                  {-2.7014614092655247, -3.797222682722448, 1.5059381924206812, 0.9608134249383761,
                   0.41612629162277, 1.509682869682768},
                  1e-6},
                 {60,
                  {0.7438075001180829, 1.9399479510948634, 0.26401033468625656, -0.7316243948699637,
                   -0.657492767819855, -0.578669254760947},
                  1e-4}};
    struct motion m;
    struct phys_motion_solution solution = {0};
    motion_open(&m, "pythagorean", false, NULL);
    const struct phys_motion_settings settings = {.size = sizeof settings,
                                                  .time = 60,
                                                  .integrator =
                                                      phys_integrator_find("taylor", &m.error),
                                                  .tolerance = 1e-15,
                                                  .n_samples = 6};
    phys_motion_solve(&m.system, &settings, &solution, &m.error);
    assert_int_equal(m.error.status, AD_OK);
    for (size_t k = 0, i = 0; k < 3; k++) {
        double apart = 0;
        while (i < solution.n && solution.t[i] < known[k].t)
            i++;
        assert_true(i < solution.n && solution.t[i] == known[k].t);
        for (size_t j = 0; j < 6; j++)
            apart = hypot(apart, solution.x[12 * i + j] - known[k].q[j]);
        print_message("t = %g: off by %.2g, %.2g from the reference, which is known to %.2g\n",
                      known[k].t, apart, solution.distance[i], solution.reference_uncertainty);
        assert_true(apart < known[k].most);
        assert_true(apart <= solution.error);
    }
    assert_true(solution.reference_uncertainty < 5e-4);
    phys_motion_solution_free(&solution);
    motion_close(&m);
}

/* The same where the error is asked for, and the method and its steps are not: the reference
   carries what rounding cuts off places, too, by its own means, and is known to less than that. */
static void burrau_to_a_wanted_error(void **state)
{
    (void)state;
    static const double known[] = {0.7438075001180829,  1.9399479510948634, 0.26401033468625656,
                                   -0.7316243948699637, -0.657492767819855, -0.578669254760947};
    struct motion m;
    struct phys_motion_solution solution = {0};
    double apart = 0;
    motion_open(&m, "pythagorean", false, NULL);
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 60, .error = 1e-3, .n_samples = 6};
    phys_motion_solve(&m.system, &settings, &solution, &m.error);
    assert_int_equal(m.error.status, AD_OK);
    assert_true(solution.n == 7 && solution.error <= 1e-3);
    for (size_t j = 0; j < 6; j++)
        apart = hypot(apart, solution.x[12 * 6 + j] - known[j]);
    assert_true(apart <= solution.error_end);
    phys_motion_solution_free(&solution);
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fixed_steps_are_thrown_out),
        cmocka_unit_test(control_of_the_error_goes_round),
        cmocka_unit_test(implicit_steps_end_where_they_have_no_solution),
        cmocka_unit_test(implicit_steps_near_the_pericentre),
        cmocka_unit_test(the_advice_knows_the_pericentre),
        cmocka_unit_test(a_collision_is_reported_when_and_where),
        cmocka_unit_test(fixed_steps_jump_over_a_collision),
        cmocka_unit_test(burrau_until_one_leaves),
        cmocka_unit_test(burrau_to_a_wanted_error),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
