/* Near pairs against all pairs; order of known arrangements. */
#include "tests/close.h"
#include "physics/gas/cell_list.h"
#include "physics/gas/order.h"
#include "physics/io/random.h"
#include "tests/mentions.h"

#include <stdlib.h>

enum { BODIES = 3000 };

static double place[2 * BODIES];
static const double sides[] = {1.7, 1.1};

/* Anywhere in a rectangle. */
static void scatter(size_t n, uint64_t seed)
{
    struct phys_random random;
    phys_random_seed(&random, seed);
    for (size_t k = 0; k < 2 * n; k++)
        place[k] = sides[k % 2] * phys_random_uniform(&random) - 3;
}

/* ---- near pairs ---- */

static size_t count_slowly(size_t n, double reach)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = i + 1; j < n; j++) {
            double dx = place[2 * i] - place[2 * j], dy = place[2 * i + 1] - place[2 * j + 1];
            count += dx * dx + dy * dy <= reach * reach;
        }
    return count;
}

static int by_bodies(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Every pair is there, near, once, and in order. */
static void check_pairs(size_t n, double reach)
{
    struct phys_near near = {0};
    struct ad_error error = {0};
    assert_int_equal(phys_near_pairs(n, place, reach, &near, &error), AD_OK);
    assert_int_equal(near.n, count_slowly(n, reach));
    uint64_t *code = malloc((near.n + 1) * sizeof *code);
    assert_non_null(code);
    for (size_t k = 0; k < near.n; k++) {
        const double *a = place + 2 * near.first[k], *b = place + 2 * near.second[k];
        assert_true(near.first[k] < near.second[k] && near.second[k] < n);
        assert_true(hypot(a[0] - b[0], a[1] - b[1]) <= reach * (1 + 1e-15));
        code[k] = (uint64_t)near.first[k] << 32 | near.second[k];
    }
    qsort(code, near.n, sizeof *code, by_bodies);
    for (size_t k = 1; k < near.n; k++)
        assert_true(code[k] != code[k - 1]);
    free(code);
    phys_near_free(&near);
}

static void test_near_pairs(void **state)
{
    static const double reaches[] = {1e-4, 0.03, 0.2, 1, 5};
    (void)state;
    for (size_t k = 0; k < sizeof reaches / sizeof *reaches; k++)
        for (size_t n = 1; n < 700; n = 3 * n + 1) {
            scatter(n, n);
            check_pairs(n, reaches[k]);
        }
    scatter(500, 7); /* one far from all others, two in one place */
    place[20] = 1e6;
    place[40] = place[60], place[41] = place[61];
    check_pairs(500, 0.05);
    for (size_t k = 0; k < 40; k++) /* on a line, and on the borders of cells */
        place[2 * k] = 0.25 * (double)k, place[2 * k + 1] = -2;
    check_pairs(40, 0.25);
    check_pairs(40, 0.5);
}

static void test_nowhere(void **state)
{
    struct phys_near near = {0};
    struct ad_error error = {0};
    (void)state;
    scatter(30, 1);
    place[2 * 16 + 1] = (double)NAN;
    assert_int_equal(phys_near_pairs(30, place, 0.1, &near, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "body 17 y");
    phys_near_free(&near);
}

/* ---- order ---- */

/* A patch of a lattice, turned by an angle. The middle of it is far from the edge. */
static void lay(size_t side, double slant, double height, double angle)
{
    for (size_t i = 0; i < side; i++)
        for (size_t j = 0; j < side; j++) {
            double x = (double)i + slant * (double)(j % 2), y = height * (double)j;
            place[2 * (i * side + j)] = x * cos(angle) - y * sin(angle);
            place[2 * (i * side + j) + 1] = x * sin(angle) + y * cos(angle);
        }
}

static void check_middle(size_t side, uint32_t neighbours, double hexatic)
{
    enum { MARGIN = 2 };
    uint32_t count[900];
    double share[900];
    struct phys_order order;
    struct ad_error error = {0};
    assert_int_equal(phys_order(side * side, place, 1.2, count, share, &order, &error), AD_OK);
    for (size_t i = MARGIN; i < side - MARGIN; i++)
        for (size_t j = MARGIN; j < side - MARGIN; j++) {
            assert_int_equal(count[i * side + j], neighbours);
            assert_close(share[i * side + j], hexatic, 0, 1e-11);
        }
}

static void test_lattices(void **state)
{
    struct phys_order order;
    struct ad_error error = {0};
    (void)state;
    for (double angle = 0; angle < 1; angle += 0.237) {
        lay(30, 0.5, sqrt(0.75), angle);
        check_middle(30, 6, 1);
        lay(20, 0, 1, angle); /* squares have four directions, of which six-fold sums cancel */
        check_middle(20, 4, 0);
    }
    lay(30, 0.5, sqrt(0.75), 0.3);
    phys_order(900, place, 1.2, NULL, NULL, &order, &error);
    assert_int_equal(order.state, PHYS_STATE_SOLID);
    assert_true(order.neighbours > 5.5 && order.neighbours < 6);
}

/* Bodies thrown at random are an ideal gas: g is 1 up to the edge, within the noise that draws of
   it show among themselves. */
static void test_ideal_gas(void **state)
{
    enum { BINS = 40, DRAWS = 20, FEW = 1000 };
    const double reach = 1.1;
    double g[BINS], sum[BINS] = {0}, squares[BINS] = {0};
    struct ad_error error = {0};
    (void)state;
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        scatter(FEW, seed);
        assert_int_equal(phys_pair_distribution(FEW, place, sides, reach, BINS, g, &error), AD_OK);
        for (size_t k = 0; k < BINS; k++) {
            sum[k] += g[k] / DRAWS;
            squares[k] += g[k] * g[k] / DRAWS;
        }
    }
    for (size_t k = 0; k < BINS; k++) {
        double noise = sqrt((squares[k] - sum[k] * sum[k]) / (DRAWS - 1));
        assert_true(noise < (k < 3 ? 0.02 : 0.006));
        assert_close(sum[k], 1, 0, 4 * noise);
    }
    assert_int_equal(phys_pair_distribution(10, place, sides, 1.2, BINS, g, &error), AD_E_ARGUMENT);
}

/* And there is no order among them. */
static void test_no_order(void **state)
{
    struct phys_order order;
    struct ad_error error = {0};
    double spacing = sqrt(sides[0] * sides[1] / BODIES);
    (void)state;
    scatter(BODIES, 11);
    assert_int_equal(phys_order(BODIES, place, 0.5 * spacing, NULL, NULL, &order, &error), AD_OK);
    assert_close(order.neighbours, M_PI / 4, 0.1, 0);
    assert_int_equal(order.state, PHYS_STATE_GAS);
    assert_true(order.hexatic < 0.2);
    phys_order(BODIES, place, 1.5 * spacing, NULL, NULL, &order, &error);
    assert_int_equal(order.state, PHYS_STATE_DENSE); /* many neighbours, but lying anyhow */
}

/* A gas that starts on a lattice: neighbours at one spacing, where g has its peak. */
static void test_order_of_a_gas(void **state)
{
    (void)state;
    const struct phys_setting set[] = {
        {"bodies", 100}, {"jitter", 0}, {"sigma", 0.05}, {"spacing", 0.056}};
    struct ad_error error = {0};
    struct phys_system system;
    struct phys_gas_order order;
    assert_int_equal(phys_system_open("gas", &system, &error), AD_OK);
    assert_int_equal(phys_system_set_all(&system, 4, set, &error), AD_OK);
    double *q = malloc(2 * system.dof * sizeof *q);
    system.scene->start(system.params, 1, q, q + system.dof, &error);
    assert_int_equal(phys_gas_order(&system, q, &order, &error), AD_OK);
    struct phys_order mean;
    phys_order(system.bodies, q, phys_gas_shell(&system), NULL, NULL, &mean, &error);
    assert_close(order.mean.neighbours, mean.neighbours, 0, 0);
    assert_close(order.reach, 0.25, 1e-12, 0);
    assert_true(fabs(order.peak_at - 0.056) <= 0.25 / PHYS_GAS_BINS);
    for (size_t k = 0; k < PHYS_GAS_BINS; k++)
        assert_true(order.g[k] <= order.peak);
    free(q);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_near_pairs), cmocka_unit_test(test_nowhere),
        cmocka_unit_test(test_lattices),   cmocka_unit_test(test_ideal_gas),
        cmocka_unit_test(test_no_order),   cmocka_unit_test(test_order_of_a_gas),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
