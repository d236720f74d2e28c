/* Approximate bodies and the first post-Newtonian terms, against their defining formulas. */
#include "tests/close.h"
#include "physics/physics.h"
#include "physics/scenes/ephemeris.h"

#include <string.h>

static const double day = 86400, au = 149597870700.0, c = 299792458.0;
static const double gm_sun = 132712440041.93938e9;

static const struct ephemeris_rough *rough(const char *name)
{
    for (size_t k = 0; k < PHYS_EPHEMERIS_ROUGH; k++)
        if (strcmp(phys_ephemeris_rough[k].name, name) == 0)
            return &phys_ephemeris_rough[k];
    fail_msg("%s", name);
    return NULL;
}

static double norm(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/* Velocities are rates of the positions: but for the difference.s own error for the Moon, to the
   rates of the mean elements for planets. */
static void test_rough_velocities(void **state)
{
    static const struct {
        const char *name;
        double tolerance;
    } rows[] = {{"jupiter", 2e-3}, {"saturn", 5e-3}, {"moon", 2e-6}};
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        for (double jd = 2451545; jd < 2470000; jd += 1234.5) {
            const struct ephemeris_body centre = {.gm = k < 2 ? gm_sun : 3.986e14};
            struct ephemeris_body before, at, after;
            const double h = 0.01;
            phys_ephemeris_place(rough(rows[k].name), jd - h, &centre, &before);
            phys_ephemeris_place(rough(rows[k].name), jd, &centre, &at);
            phys_ephemeris_place(rough(rows[k].name), jd + h, &centre, &after);
            for (int i = 0; i < 3; i++)
                assert_close((after.position[i] - before.position[i]) / (2 * h * day),
                             at.velocity[i], 0, rows[k].tolerance * norm(at.velocity));
        }
}

/* Where they were: opposition of Jupiter on 2022-09-26 19:33 UT at 3.95 au from the Earth, Saturn's
   on 2022-08-14, the eclipsed full Moon of 2022-11-08 10:59 UT. */
static void test_rough_places(void **state)
{
    const struct ephemeris_body sun = {.gm = gm_sun}, earth = {.gm = 3.986e14};
    struct ephemeris_body jupiter, saturn, moon;
    (void)state;
    phys_ephemeris_place(rough("jupiter"), 2459849.3153, &sun, &jupiter);
    phys_ephemeris_place(rough("saturn"), 2459806.2153, &sun, &saturn);
    phys_ephemeris_place(rough("moon"), 2459891.9585, &earth, &moon);
    const double degree = M_PI / 180;
    assert_close(norm(jupiter.position) / au, 4.955, 0, 0.01);
    assert_close(atan2(jupiter.position[1], jupiter.position[0]) / degree, 3.4, 0, 0.4);
    assert_close(atan2(saturn.position[1], saturn.position[0]) / degree, -38.6, 0, 0.4);
    /* opposite to the Sun, which stands at 225.7 degrees of the ecliptic of J2000 */
    assert_close(atan2(moon.position[1], moon.position[0]) / degree, 45.7, 0, 0.6);
    assert_close(fabs(moon.position[2]) / norm(moon.position), 0, 0, 0.01);
    assert_close(norm(moon.position), 3.9e8, 0.02, 0);
}

/* A body about one so heavy that it stands still: perihelia advance by 6 pi GM / (c^2 a (1 - e^2))
   an orbit, to first order in GM / (c^2 a). */
static void test_perihelion(void **state)
{
    struct phys_system system;
    struct phys_ode ode = {0};
    struct ad_error error = {0};
    const double a = 5.7909e10, e = 0.2056, gm = gm_sun * 1e4; /* stronger, to be seen */
    const double period = 2 * M_PI * sqrt(a * a * a / gm);
    double y[8], advance[2];
    (void)state;
    for (int relativity = 0; relativity < 2; relativity++) {
        assert_int_equal(phys_system_open("ephemeris", &system, &error), AD_OK);
        assert_int_equal(phys_ephemeris_choose(&system, "sun,mercury", 2, &error), AD_OK);
        phys_system_set(&system, "relativity", relativity, &error);
        phys_system_set(&system, "mass_sun", gm / phys_system_get(&system, "G"), &error);
        phys_system_set(&system, "mass_mercury", 1e10, &error);
        assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
        memset(y, 0, sizeof y);
        y[2] = a * (1 - e);
        y[7] = sqrt(gm / a * (1 + e) / (1 - e));
        double scale[8] = {a, a, a, a, y[7], y[7], y[7], y[7]};
        const struct phys_simulation settings = {.size = sizeof settings,
                                                 .integrator =
                                                     phys_integrator_find("dop853", &error),
                                                 .t1 = 10 * period,
                                                 .rtol = 1e-13,
                                                 .atol = 1e-13,
                                                 .scale = scale};
        struct phys_simulation_info info;
        assert_int_equal(phys_simulate(&settings, &ode, y, &info, &error), AD_OK);
        /* direction of the perihelion: Laplace's vector v x L - GM n */
        double x[] = {y[2] - y[0], y[3] - y[1]}, v[] = {y[6] - y[4], y[7] - y[5]};
        double L = x[0] * v[1] - x[1] * v[0], r = hypot(x[0], x[1]);
        advance[relativity] = atan2(-v[0] * L - gm * x[1] / r, v[1] * L - gm * x[0] / r);
        phys_ode_free(&ode);
        phys_system_close(&system);
    }
    double expected = 10 * 6 * M_PI * gm / (c * c * a * (1 - e * e));
    assert_close(advance[0], 0, 0, 1e-9);
    assert_close(advance[1], expected, 0.1, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rough_velocities),
        cmocka_unit_test(test_rough_places),
        cmocka_unit_test(test_perihelion),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
