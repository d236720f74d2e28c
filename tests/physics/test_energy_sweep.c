/* Motions of a pendulum, g = l = 1, from 0 to 1 with m turns: each duration belongs to two
   energies, or to none. It is 2 m K(k) + F(asin(sin(1/2)/k), k), k^2 = E/2, whose minimum over k is
   where the two meet. (All paths of longer durations: path/test_path_all.c.) */
#include "tests/close.h"
#include "physics/path/all/energy_sweep.h"

static const double end = 1;

/* F(phi, k) by Simpson's rule, K for phi = pi/2. */
static double elliptic(double phi, double k)
{
    enum { N = 400 };
    double sum = 0;
    for (int i = 0; i <= N; i++) {
        double s = k * sin(phi * i / N);
        sum += (i == 0 || i == N ? 1 : i % 2 ? 4 : 2) / sqrt(1 - s * s);
    }
    return sum * phi / N / 3;
}

static double time_of(int turns, double k)
{
    return 2 * turns * elliptic(M_PI / 2, k) + elliptic(asin(sin(end / 2) / k), k);
}

static double least_time(int turns, double *k)
{
    double a = sin(end / 2) + 1e-9, b = 0.95, golden = (sqrt(5) - 1) / 2;
    while (b - a > 1e-8) {
        double x = b - golden * (b - a), y = a + golden * (b - a);
        *(time_of(turns, x) < time_of(turns, y) ? &b : &a) =
            time_of(turns, x) < time_of(turns, y) ? y : x;
    }
    *k = (a + b) / 2;
    return time_of(turns, *k);
}

static size_t energies(const struct phys_system *system, int turns, double time, double E[8])
{
    const struct phys_energy_question question = {
        .from = 0, .to = end, .time = time, .span = 3, .speed = 2, .most_turns = 20};
    struct phys_energy_sweep *sweep;
    const struct phys_energy_root *roots;
    struct ad_error error = {0};
    bool certified, limited;
    size_t found = 0;
    assert_int_equal(phys_energy_sweep_new(system, &question, &sweep, &error), AD_OK);
    size_t n = phys_energy_sweep_roots(sweep, &roots, &certified, &limited);
    assert_true(certified && !limited);
    for (size_t k = 0; k < n; k++)
        if (roots[k].turns == (size_t)turns && roots[k].direction == (turns % 2 ? -1 : 1))
            E[found++] = roots[k].level + roots[k].side * exp(roots[k].log_gap);
    phys_energy_sweep_free(sweep);
    return found;
}

/* A pair is found as soon as it is there, however near to each other its two energies are. */
static void pairs_are_found_where_they_begin(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &error), AD_OK);
    phys_system_set(&pendulum, "g", 1, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    for (int turns = 1; turns <= 3; turns++) {
        double k, least = least_time(turns, &k), E[8] = {0}, relative = 1e-8;
        assert_int_equal(energies(&pendulum, turns, least * (1 - relative), E), 0);
        assert_int_equal(energies(&pendulum, turns, least * (1 + relative), E), 2);
        for (size_t i = 0; i < 2; i++) {
            assert_close(E[i], 2 * k * k, 2e-3, 0);
            assert_close(time_of(turns, sqrt(E[i] / 2)), least * (1 + relative), 1e-9, 0);
        }
    }
    phys_system_close(&pendulum);
}

/* K at the complementary modulus k' by the arithmetic-geometric mean. */
static double complete(double k1)
{
    double a = 1, b = k1;
    while (fabs(a - b) > 1e-15 * a) {
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return M_PI / (a + b);
}

/* A turn just below the top, where the time is a logarithm of the gap: its height is found between
   the places that are looked at. */
static void energies_just_below_the_top(void **state)
{
    (void)state;
    struct phys_system pendulum;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open("pendulum", &pendulum, &error), AD_OK);
    phys_system_set(&pendulum, "g", 1, &error);
    phys_system_set(&pendulum, "l", 1, &error);
    for (double gap = 1e-4; gap > 1e-10; gap /= 10) {
        double k = sqrt(1 - gap / 2), E[8] = {0};
        double time = 2 * complete(sqrt(gap / 2)) + elliptic(asin(sin(end / 2) / k), k);
        assert_int_equal(energies(&pendulum, 1, time, E), 1);
        assert_close(2 - E[0], gap, 1e-6, 1e-13);
    }
    phys_system_close(&pendulum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pairs_are_found_where_they_begin),
                                       cmocka_unit_test(energies_just_below_the_top)};
    return cmocka_run_group_tests_name("energy sweep", tests, NULL, NULL);
}
