/* Motions whose series have poles next to the path: steps shrink with the distance of the pole, and
   the motion keeps to its closed form. */
#include "own.h"
#include "tests/close.h"

#include <math.h>
#include <string.h>

static double width; /* of the well */

/* L = v^2/2 + 1/(q^2 + width^2). */
static ad_var well(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_div(1.0, ad_add(ad_square(q), width * width)));
}

static enum ad_status begin(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = -1;
    v[0] = 1;
    return AD_OK;
}

/* dt/dq at q = width sinh(u), times dq/du; or, `across`, at q = i width sin(u), divided by i. */
static double slowness(double u, bool across)
{
    const double c = across ? cos(u) : cosh(u), energy = 0.5 - 1 / (1 + width * width);
    return width * c / sqrt(2 * energy + 2 / pow(width * c, 2));
}

/* By Simpson's rule. */
static double time_to(double end, bool across)
{
    enum { N = 4000 };
    double sum = 0;
    for (int i = 0; i <= N; i++)
        sum += (i == 0 || i == N ? 1 : i % 2 ? 4 : 2) * slowness(end * i / N, across);
    return sum * end / N / 3;
}

/* From -1 to 1, where the velocity is 1 again, past the poles at q = +-i width. */
static void test_steps_shrink_next_to_a_pole(void **state)
{
    (void)state;
    const double widths[] = {0.3, 0.1, 0.03, 0.01};
    size_t steps = 0, evaluations = 0;
    for (size_t k = 0; k < LENGTH(widths); k++) {
        width = widths[k];
        struct phys_scene scene = scene_of("well", 1, well, 11, 0.1, begin);
        struct phys_system system;
        struct phys_motion_solution m;
        struct ad_error error = {0};
        const struct phys_motion_settings settings = {.size = sizeof settings,
                                                      .time = 2 * time_to(asinh(1 / width), false),
                                                      .error = 1e-9,
                                                      .integrator =
                                                          phys_integrator_find("taylor", &error)};
        const double radius = time_to(M_PI / 2, true);
        assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
        assert_int_equal(phys_motion_solve(&system, &settings, &m, &error), AD_OK);
        print_message("width %g: radius %.2g, steps from %.2g to %.2g, %zu of them, %zu "
                      "evaluations, error %.1e\n",
                      width, radius, m.info.min_step, m.info.max_step, m.info.steps,
                      m.info.evaluations, m.error);
        assert_close(m.x[2 * (m.n - 1)], 1, 0, 1e-9);
        assert_true(m.error <= 1e-9);
        assert_true(m.info.min_step > 0.1 * radius && m.info.min_step < 0.5 * radius);
        assert_true(m.info.steps > steps && m.info.evaluations > evaluations);
        steps = m.info.steps;
        evaluations = m.info.evaluations;
        phys_motion_solution_free(&m);
        phys_system_close(&system);
    }
}

/* x of the ellipse about the origin at time t from the pericentre: Kepler's equation by halving. */
static void ellipse(double e, double t, double x[2])
{
    const double M = remainder(t, 2 * M_PI);
    double low = -M_PI, high = M_PI;
    for (int k = 0; k < 64; k++) {
        const double E = 0.5 * (low + high);
        *(E - e * sin(E) < M ? &low : &high) = E;
    }
    x[0] = cos(low) - e;
    x[1] = sqrt((1 - e) * (1 + e)) * sin(low);
}

/* Ten times past the pericentre, at 1e-4 of the mean distance. */
static void test_close_pericentres(void **state)
{
    (void)state;
    const double e = 0.9999, asked = 1e-6;
    const struct phys_motion_settings settings = {
        .size = sizeof settings, .time = 62.83, .error = asked};
    struct phys_system system;
    struct phys_motion_solution m;
    struct ad_error error = {0};
    double most = 0;
    assert_int_equal(phys_system_open("kepler", &system, &error), AD_OK);
    assert_int_equal(phys_system_set(&system, "e", e, &error), AD_OK);
    assert_int_equal(phys_motion_solve(&system, &settings, &m, &error), AD_OK);
    for (size_t i = 0; i < m.n; i++) {
        double x[2];
        ellipse(e, m.t[i], x);
        most = fmax(most, hypot(m.x[4 * i] - x[0], m.x[4 * i + 1] - x[1]));
    }
    print_message("e = %g: %.1e at %zu times, said to be %.1e, asked for %.0e\n", e, most, m.n,
                  m.error, asked);
    assert_true(most <= asked && most <= m.error && m.error <= asked);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps_shrink_next_to_a_pole),
        cmocka_unit_test(test_close_pericentres),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
