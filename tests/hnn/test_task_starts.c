/* Starts of the published systems: circles, circular orbits, speeds, seeds. */
#include "observed.h"
#include "tests/close.h"

static void assert_between(double x, double low, double high)
{
    if (!(x >= low - 1e-12 && x <= high + 1e-12))
        fail_msg("%.17g is not within %g and %g", x, low, high);
}

/* The least and largest of many starts come near the ends of their range, and never beyond. */
static void test_starts_on_circles(void **state)
{
    (void)state;
    static const char *const names[] = {"spring", "pendulum"};
    for (size_t k = 0; k < 2; k++) {
        struct hnn_sampling s = published_sampling(names[k]);
        s.noise = 0;
        s.points = 2;
        s.trials = 2000;
        struct hnn_observations o = observed(names[k], &s, 5);
        double least = 1e9, most = 0;
        for (size_t i = 0; i < o.rows; i += s.points) {
            double r = hypot(observed_at(&o, 0, i), observed_at(&o, 1, i));
            assert_between(r, s.radius_min, s.radius_max);
            least = fmin(least, r);
            most = fmax(most, r);
        }
        assert_close(least, s.radius_min, 0, 0.01);
        assert_close(most, s.radius_max, 0, 0.01);
        hnn_observations_free(&o);
    }
}

/* Without spread both systems of bodies turn rigidly: all distances stay. */
static void test_circular_orbits(void **state)
{
    (void)state;
    static const char *const names[] = {"twobody", "threebody"};
    for (size_t k = 0; k < 2; k++) {
        struct hnn_sampling s = published_sampling(names[k]);
        s.spread = 0;
        s.trials = 20;
        s.strength = 1.7;
        struct hnn_observations o = observed(names[k], &s, 11);
        size_t bodies = o.dof / 2;
        for (size_t i = 0; i < o.rows; i++)
            for (size_t b = 0; b < bodies; b++) {
                size_t start = i - i % s.points;
                double r = hypot(observed_at(&o, b, start), observed_at(&o, bodies + b, start));
                assert_close(hypot(observed_at(&o, b, i), observed_at(&o, bodies + b, i)), r, 1e-8,
                             0);
                if (bodies == 3)
                    assert_between(r, s.radius_min, s.radius_max);
                else
                    assert_between(fabs(observed_at(&o, b, start)), s.radius_min, s.radius_max);
            }
        hnn_observations_free(&o);
    }
}

/* Speeds of three bodies: every component within the spread, near its ends too. */
static void test_spread_of_speeds(void **state)
{
    (void)state;
    struct hnn_sampling s = published_sampling("threebody");
    s.points = 2;
    s.time = 1e-3;
    s.trials = 1000;
    struct hnn_observations o = observed("threebody", &s, 13);
    double most = 0;
    for (size_t i = 0; i < o.rows; i += 2)
        for (size_t b = 0; b < 3; b++) {
            double x = observed_at(&o, b, i), y = observed_at(&o, 3 + b, i), r = hypot(x, y);
            double circular = sqrt(1 / (sqrt(3.0) * r));
            double off = fmax(fabs(observed_at(&o, 6 + b, i) / (-circular * y / r) - 1),
                              fabs(observed_at(&o, 9 + b, i) / (circular * x / r) - 1));
            assert_between(off, 0, 0.2 + 1e-9);
            most = fmax(most, off);
        }
    assert_close(most, 0.2, 0, 1e-3);
    hnn_observations_free(&o);
}

static void test_seeds(void **state)
{
    (void)state;
    struct hnn_sampling s = published_sampling("pendulum");
    struct hnn_observations a = observed("pendulum", &s, 1), b = observed("pendulum", &s, 1);
    struct hnn_observations c = observed("pendulum", &s, 2);
    size_t bytes = a.rows * a.cols * sizeof *a.values;
    assert_memory_equal(a.values, b.values, bytes);
    assert_memory_not_equal(a.values, c.values, bytes / a.cols);
    hnn_observations_free(&a);
    hnn_observations_free(&b);
    hnn_observations_free(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_starts_on_circles),
        cmocka_unit_test(test_circular_orbits),
        cmocka_unit_test(test_spread_of_speeds),
        cmocka_unit_test(test_seeds),
    };
    return cmocka_run_group_tests_name("published systems", tests, NULL, NULL);
}
