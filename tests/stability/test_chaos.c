/* Chaos: the rate at which a double pendulum loses memory of its start, and the horizon beyond
   which motions cannot be compared. */
#include "follow.h"
#include "tests/close.h"

static void lyapunov(struct motion *m, struct phys_lyapunov_settings settings,
                     struct phys_lyapunov *result)
{
    m->error = (struct ad_error){0};
    if (settings.known == 0) {
        settings.known = 1e-8;
        settings.lost = 0.1;
    }
    phys_lyapunov(&m->ode, m->y, &settings, result, &m->error);
    if (m->error.status != AD_OK)
        print_error("%s\n", m->error.message);
    assert_int_equal(m->error.status, AD_OK);
}

static void a_double_pendulum_forgets_its_start(void **state)
{
    (void)state;
    struct motion m;
    struct phys_lyapunov found;
    follow_open(&m, "dblpend", NULL, 0);
    lyapunov(
        &m,
        (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings), .t1 = 400},
        &found);
    assert_close(found.exponent, 0.33, 0, 0.03);
    assert_close(found.time * found.exponent, 1, 1e-15, 0);
    assert_true(found.chaotic && found.megno > 30);
    motion_close(&m);
}

/* 1e-8 in one angle becomes 8e-3 in the other at t = 40, by two trajectories; the linearised field
   says the same. */
static void the_growth_is_that_of_two_trajectories(void **state)
{
    (void)state;
    static const double direction[] = {1, 0, 0, 0};
    struct motion a, b;
    struct phys_lyapunov found;
    double square = 0;
    follow_open(&a, "dblpend", NULL, 0);
    follow_open(&b, "dblpend", NULL, 0);
    lyapunov(&a,
             (struct phys_lyapunov_settings){
                 .size = sizeof(struct phys_lyapunov_settings), .t1 = 40, .direction = direction},
             &found);
    b.y[0] += 1e-8;
    assert_true(follow_to(&a, "dop853", 1e-13, 40));
    assert_true(follow_to(&b, "dop853", 1e-13, 40));
    for (size_t k = 0; k < 4; k++)
        square += (a.y[k] - b.y[k]) * (a.y[k] - b.y[k]);
    assert_close(fabs(a.y[1] - b.y[1]), 8e-3, 0, 5e-4);
    assert_close(1e-8 * found.growth, sqrt(square), 0.02, 0); /* the rest is curvature */
    motion_close(&a);
    motion_close(&b);
}

/* Before the horizon two good runs agree; after it they have nothing to do with each other. */
static void runs_agree_up_to_the_horizon_alone(void **state)
{
    (void)state;
    const double tolerance = 1e-9;
    struct phys_lyapunov found;
    struct motion m;
    follow_open(&m, "dblpend", NULL, 0);
    lyapunov(&m,
             (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings),
                                             .t1 = 120,
                                             .known = tolerance,
                                             .lost = 0.1},
             &found);
    assert_true(found.horizon > 30 && found.horizon < 80);
    for (int after = 0; after < 2; after++) {
        struct motion good, better;
        double t = after ? 1.6 * found.horizon : 0.6 * found.horizon;
        follow_open(&good, "dblpend", NULL, 0);
        follow_open(&better, "dblpend", NULL, 0);
        assert_true(follow_to(&good, "dop853", tolerance, t));
        assert_true(follow_to(&better, "dop853", 1e-13, t));
        double apart = hypot(good.y[0] - better.y[0], good.y[1] - better.y[1]);
        assert_true(after ? apart > 0.1 : apart < 1e-3);
        assert_true(good.info.energy_drift < 1e-6); /* the energy does not tell */
        motion_close(&good);
        motion_close(&better);
    }
    motion_close(&m);
}

/* F5: differences along regular motions grow as powers of the time, or not at all. */
static void regular_motions_are_told_apart(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *parameter;
        double value, t1, megno;
    } cases[] = {
        {"spring", "q0", 0.7, 100, 0}, {"kepler", "e", 0.5, 400, 2}, {"cubic", "q0", 0.4, 1000, 2}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct motion m;
        struct phys_lyapunov found;
        follow_open(&m, cases[k].scene, cases[k].parameter, cases[k].value);
        lyapunov(&m,
                 (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings),
                                                 .t1 = cases[k].t1},
                 &found);
        assert_false(found.chaotic);
        assert_close(found.megno, cases[k].megno, 0, 0.3);
        assert_true(found.exponent < 0.03);
        assert_true(isinf(found.horizon));
        motion_close(&m);
    }
}

/* On the top of a hill, q'' = q, differences grow as e^t from the start. */
static enum ad_status hilltop(void *context, double t, const double *y, double *rate,
                              struct ad_error *error)
{
    (void)context, (void)t, (void)error;
    rate[0] = y[1];
    rate[1] = y[0];
    return AD_OK;
}

static void the_exponent_of_a_hilltop_is_exact(void **state)
{
    (void)state;
    static const double along[] = {1, 1}, top[] = {0, 0};
    const struct phys_ode ode = {.n = 2, .field = hilltop};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = 20, .direction = along, .known = 1e-6, .lost = 1e-2};
    struct phys_lyapunov found;
    struct ad_error error = {0};
    assert_int_equal(phys_lyapunov(&ode, top, &settings, &found, &error), AD_OK);
    assert_close(found.exponent, 1, 1e-8, 0);
    assert_close(found.growth, exp(20), 1e-6, 0);
    assert_close(found.megno, 10, 0.01, 0);
    assert_close(found.horizon, log(1e4), 1e-6, 0);
    assert_false(found.chaotic); /* an equilibrium does not move */
}

/* Differences grow as fast as the motion: unstable, but not chaotic, and as many digits are known
   at the end as at the start; q'' = (1 + cos(t) / 2) q does not conserve its energy. */
static enum ad_status swaying_hill(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)context, (void)error;
    rate[0] = y[1];
    rate[1] = (1 + 0.5 * cos(t)) * y[0];
    return AD_OK;
}

static void a_linear_saddle_is_not_chaotic(void **state)
{
    (void)state;
    static const double starts[][2] = {{1, 0}, {0, 0.3}, {1e-6, 1e-6}, {1, -0.9}};
    const struct phys_ode odes[] = {{.n = 2, .field = hilltop}, {.n = 2, .field = swaying_hill}};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = 30, .known = 1e-9, .lost = 0.1};
    for (size_t k = 0; k < sizeof starts / sizeof *starts; k++)
        for (size_t j = 0; j < 2; j++) {
            struct phys_lyapunov found;
            struct ad_error error = {0};
            assert_int_equal(phys_lyapunov(&odes[j], starts[k], &settings, &found, &error), AD_OK);
            assert_true(found.exponent > 0.9 && found.megno > 10);
            assert_false(found.chaotic);
            if (k < 2)
                assert_true(isinf(found.horizon));
        }
}

/* Henon and Heiles, Astron. J. 69 (1964), at E = 1/8: an island and the sea around it, where the
   exponent is .046 to .05 (C. Skokos et al., Physica D 231 (2007) 30: starts (0, y, px, py)). */
static enum ad_status henon_heiles(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)context, (void)t, (void)error;
    rate[0] = y[2];
    rate[1] = y[3];
    rate[2] = -y[0] - 2 * y[0] * y[1];
    rate[3] = -y[1] - y[0] * y[0] + y[1] * y[1];
    return AD_OK;
}

static void an_island_is_told_from_the_sea(void **state)
{
    (void)state;
    static const double island[] = {0, 0.55, 0.2417, 0}, sea[] = {0, -0.25, 0.42, 0};
    const struct phys_ode ode = {.n = 4, .field = henon_heiles};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = 500, .known = 1e-9, .lost = 0.1};
    struct phys_lyapunov found;
    struct ad_error error = {0};
    assert_int_equal(phys_lyapunov(&ode, island, &settings, &found, &error), AD_OK);
    assert_false(found.chaotic);
    assert_close(found.megno, 2, 0, 0.3);
    assert_int_equal(phys_lyapunov(&ode, sea, &settings, &found, &error), AD_OK);
    assert_true(found.chaotic);
    assert_true(found.least > 0.03 && found.most < 0.08);
    assert_true(found.horizon <= found.latest && found.latest < 500);
}

/* 2.65 to 2.88 by the direction of the difference, by another program: the complex step through the
   equations of motion by hand, rk4 with steps of 5e-4. */
static void finite_times_of_growth_are_those_of_another_program(void **state)
{
    (void)state;
    static const double other[][2] = {
        {0.363655, 49.9}, {0.368952, 49.7}, {0.354571, 52.4}, {0.372438, 47.4}};
    for (size_t k = 0; k < 4; k += 2) {
        struct motion m;
        struct phys_lyapunov found;
        double direction[4] = {0};
        direction[k] = 1;
        follow_open(&m, "dblpend", NULL, 0);
        lyapunov(&m,
                 (struct phys_lyapunov_settings){.size = sizeof(struct phys_lyapunov_settings),
                                                 .t1 = 80,
                                                 .direction = direction,
                                                 .known = 1e-9,
                                                 .lost = 0.1},
                 &found);
        assert_close(found.exponent, other[k][0], 0, 0.02); /* known to t = 70 alone */
        assert_close(found.horizon, other[k][1], 0, 0.2);
        assert_close(found.latest, found.horizon, 0, 0.02);
        motion_close(&m);
    }
}

static bool no(void *unused)
{
    (void)unused;
    return false;
}

static void a_measurement_can_be_stopped(void **state)
{
    (void)state;
    const struct phys_ode ode = {.n = 4, .field = henon_heiles};
    const struct phys_lyapunov_settings settings = {
        .size = sizeof settings, .t1 = 1e6, .known = 1e-9, .lost = 0.1, .proceed = no};
    struct phys_lyapunov found;
    struct ad_error error = {0};
    assert_int_equal(phys_lyapunov(&ode, (double[]){0, -0.25, 0.42, 0}, &settings, &found, &error),
                     AD_E_ACCURACY);
}

/* In typical sizes, from rest: they follow from a fall, and small motions have small ones, without
   or with a mass matrix, in (q, v) or (q, p). A start on an equilibrium is no exception: upside
   down, the pendulum's differences grow as e^t. */
static void sizes_at_rest_are_those_of_a_fall(void **state)
{
    (void)state;
    struct motion m;
    struct phys_lyapunov found;
    double scale[4];
    follow_open(&m, "spring", "q0", 0.7);
    phys_typical_sizes(&m.ode, 0, m.y, scale, &m.error);
    assert_close(scale[0], 0.7, 1e-15, 0);
    assert_close(scale[1], 0.7, 1e-15, 0);
    motion_close(&m);

    for (int canonical = 0; canonical < 2; canonical++) {
        motion_open(&m, "dblpend", canonical,
                    (const struct phys_setting[]){{"a0", 1e-6}, {"b0", 1e-6}, {0}});
        phys_typical_sizes(&m.ode, 0, m.y, scale, &m.error);
        assert_close(scale[0], 1e-6, 1e-15, 0);
        assert_true(scale[2] > 0.5e-6 && scale[2] < 3e-6);
        lyapunov(&m,
                 (struct phys_lyapunov_settings){
                     .size = sizeof(struct phys_lyapunov_settings), .t1 = 40, .scale = scale},
                 &found);
        assert_true(found.exponent < 0.05);
        motion_close(&m);
    }

    motion_open(&m, "pendulum", false,
                (const struct phys_setting[]){{"l", 1}, {"theta0", M_PI}, {0}});
    phys_typical_sizes(&m.ode, 0, m.y, scale, &m.error);
    lyapunov(&m,
             (struct phys_lyapunov_settings){
                 .size = sizeof(struct phys_lyapunov_settings), .t1 = 20, .scale = scale},
             &found);
    assert_close(found.exponent, 1, 0, 0.05);
    motion_close(&m);
}

static void wrong_questions_are_refused(void **state)
{
    (void)state;
    static const struct {
        struct phys_lyapunov_settings settings;
        const char *says;
    } cases[] = {
        {{sizeof(struct phys_lyapunov_settings), .t1 = 0, .known = 1, .lost = 2}, "t1 0 end"},
        {{sizeof(struct phys_lyapunov_settings), .t1 = 1, .known = 0, .lost = 2}, "0 start"},
        {{sizeof(struct phys_lyapunov_settings), .t1 = 1, .known = 2, .lost = 1}, "1 horizon"},
    };
    struct motion m;
    follow_open(&m, "spring", NULL, 0);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_lyapunov found;
        struct ad_error error = {0};
        phys_lyapunov(&m.ode, m.y, &cases[k].settings, &found, &error);
        assert_told(&error, AD_E_ARGUMENT, cases[k].says);
    }
    motion_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_double_pendulum_forgets_its_start),
        cmocka_unit_test(the_growth_is_that_of_two_trajectories),
        cmocka_unit_test(runs_agree_up_to_the_horizon_alone),
        cmocka_unit_test(regular_motions_are_told_apart),
        cmocka_unit_test(the_exponent_of_a_hilltop_is_exact),
        cmocka_unit_test(a_linear_saddle_is_not_chaotic),
        cmocka_unit_test(an_island_is_told_from_the_sea),
        cmocka_unit_test(finite_times_of_growth_are_those_of_another_program),
        cmocka_unit_test(a_measurement_can_be_stopped),
        cmocka_unit_test(sizes_at_rest_are_those_of_a_fall),
        cmocka_unit_test(wrong_questions_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
