/* Where forces that depend on time change: what is said to be resolved is seen. */
#include "physics/motion/time_scan.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>

static const double T = 3;
static double from, until, width; /* of an edge */
static bool bell;                 /* else a rectangle */

static ad_var pulse(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var force = bell ? ad_exp(ad_neg(ad_square(ad_div(ad_sub(t, from), width))))
                        : ad_sub(ad_tanh(ad_div(ad_sub(t, from), width)),
                                 ad_tanh(ad_div(ad_sub(t, until), width)));
    return ad_add(ad_mul(0.5, ad_square(v)), ad_mul(q, force));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.2;
    v[0] = 0.7;
    return AD_OK;
}

/* Distance of the nearest time. */
static double nearest(const struct phys_time_scan *scan, double t)
{
    double d = INFINITY;
    for (size_t k = 0; k < scan->n; k++)
        d = fmin(d, fabs(scan->times[k] - t));
    return d;
}

static struct phys_time_scan scanned(void)
{
    struct phys_scene scene = scene_of("pulse", 1, pulse, 11, 0.1, start);
    struct phys_system system;
    struct phys_time_scan scan;
    struct ad_error error = {0};
    const double q = 0.2, v = 0.7;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_time_scan(&system, &q, &v, 0, T, &scan, &error), AD_OK);
    phys_system_close(&system);
    assert_close(scan.resolution, T / ((1 << 17) - 1), 1e-15, 0);
    assert_true(scan.unresolved == INFINITY);
    return scan;
}

/* Rectangles just longer than the resolution, anywhere: their edges are followed far below it. */
static void rectangles_are_seen(void **state)
{
    (void)state;
    const double resolution = T / ((1 << 17) - 1);
    bell = false;
    width = 1e-4 * resolution;
    for (int k = 0; k < 4; k++) {
        from = T * (k == 0 ? 1e-5 : k == 3 ? 1 - 2e-5 : 0.1 + 0.618 * k / 2);
        until = from + 1.01 * resolution;
        struct phys_time_scan scan = scanned();
        assert_true(nearest(&scan, from) < 1e-3 * resolution);
        assert_true(nearest(&scan, until) < 1e-3 * resolution);
        phys_time_scan_free(&scan);
    }
}

/* Bells whose tails are above rounding at one time of the grid: 8 deviations of one of T / 9e5. */
static void bells_are_seen(void **state)
{
    (void)state;
    bell = true;
    width = sqrt(2) * T / 9e5;
    for (int k = 0; k < 3; k++) {
        from = T * (0.2 + 0.618 * k / 2);
        struct phys_time_scan scan = scanned();
        assert_true(nearest(&scan, from) < width);
        phys_time_scan_free(&scan);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rectangles_are_seen),
                                       cmocka_unit_test(bells_are_seen)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
