/* A19: the reference of packets agrees with closed forms within its uncertainty. */
#include "waves.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static double off(const struct qm_slice *slice, const struct qm_quadratic *exact,
                  const struct qm_gaussian *packet, double t, struct qm_reference *reference)
{
    size_t n = slice->grid.n;
    struct ad_error error = {0};
    qm_complex *psi = calloc(2 * n, sizeof *psi), *truth = psi + n;
    assert_int_equal(qm_reference(slice, packet, t, 1e-6, psi, reference, &error), AD_OK);
    qm_exact_packet(exact, slice->hbar, packet, t, &slice->grid, truth);
    double sum = 0;
    for (size_t a = 0; a < n; a++)
        sum += pow(cabs(psi[a] - truth[a]), 2);
    free(psi);
    return sqrt(sum * qm_dx(&slice->grid));
}

static void test_closed_forms(void **state)
{
    (void)state;
    static const struct {
        const char *scene;
        struct parameter set[2];
        struct qm_quadratic exact;
        struct qm_gaussian packet;
        double low, high, t, hbar;
        size_t n;
    } rows[] = {
        {"freebody", {{"g", 0}}, {1, 0, 0}, {-2, 0.7, 2}, -10, 10, 2, 1, 256},
        {"freebody", {{"g", 0}}, {1, 0, 0}, {0, 0.5, 3}, -4, 4, 5, 1, 100}, /* leaves the box */
        {"freebody", {{"g", 1}}, {1, 0, 1}, {0, 0.7, 2}, -12, 14, 3, 1, 300},
        {"spring", {{"k", 1}}, {1, 1, 0}, {1.5, 0.5, -1}, -6, 6, 7, 1, 200},
        {"spring", {{"k", 4}}, {1, 4, 0}, {1, 0.3, 0}, -6, 6, 20, 0.5, 128},
        /* too fast for the first grid that is tried */
        {"freebody", {{"g", 0}}, {1, 0, 0}, {-6, 0.5, 9}, -10, 10, 1, 1, 24},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct phys_system system = system_with(rows[k].scene, 1, rows[k].set);
        struct qm_slice slice = {.size = sizeof slice,
                                 .system = &system,
                                 .grid = {rows[k].low, rows[k].high, rows[k].n},
                                 .dt = 0.5,
                                 .hbar = rows[k].hbar};
        struct qm_reference reference;
        double error = off(&slice, &rows[k].exact, &rows[k].packet, rows[k].t, &reference);
        if (!(error <= reference.uncertainty + 1e-9 && reference.uncertainty < 1e-5))
            fail_msg("row %zu: error %g, uncertainty %g", k, error, reference.uncertainty);
        assert_close(reference.norm, 1, 0, 1e-6);
        phys_system_close(&system);
    }
}

/* Between walls, and on a ring, a free packet is a sum of images of the exact one. */
static void test_walls(void **state)
{
    (void)state;
    struct parameter set[] = {{"g", 0}};
    struct phys_system system = system_with("freebody", 1, set);
    struct qm_quadratic exact = {1, 0, 0};
    struct qm_gaussian packet = {0.5, 0.4, 3};
    enum { N = 90, IMAGES = 6 };
    for (int ring = 0; ring < 2; ring++) {
        struct qm_slice slice = {.size = sizeof slice,
                                 .system = &system,
                                 .grid = {-4, 4, N},
                                 .walls = ring ? QM_RING : QM_REFLECT,
                                 .dt = 1,
                                 .hbar = 1};
        struct ad_error error = {0};
        struct qm_reference reference;
        qm_complex psi[N], image[N], sum[N] = {0};
        for (int k = -IMAGES; k <= IMAGES; k++) {
            double shift = 8 * k;
            struct qm_gaussian at = packet;
            bool mirror = !ring && k % 2;
            at.x = shift + (mirror ? -packet.x : packet.x);
            at.p = mirror ? -packet.p : packet.p;
            qm_exact_packet(&exact, 1, &at, 2.5, &slice.grid, image);
            for (size_t a = 0; a < N; a++)
                sum[a] += mirror ? -image[a] : image[a];
        }
        assert_int_equal(qm_reference(&slice, &packet, 2.5, 1e-6, psi, &reference, &error), AD_OK);
        double off = 0;
        for (size_t a = 0; a < N; a++)
            off += pow(cabs(psi[a] - sum[a]), 2) * qm_dx(&slice.grid);
        assert_true(reference.uncertainty < 1e-5);
        assert_close(sqrt(off), 0, 0, 1e-5);
    }
    phys_system_close(&system);
}

/* What is not there, or makes no sense, is an error of every function, and no crash. */
static void test_bad_arguments(void **state)
{
    (void)state;
    struct parameter set[] = {{"g", 0}};
    struct phys_system system = system_with("freebody", 1, set);
    const struct qm_slice good = {
        .size = sizeof good, .system = &system, .grid = {-4, 4, 8}, .dt = 3, .hbar = 1};
    struct qm_slice none = {.size = sizeof none}, walls = good;
    walls.walls = (enum qm_walls)7;
    const struct qm_slice *const bad[] = {NULL, &none, &walls};
    struct qm_gaussian packet = {0, 1, 0}, flat = {0, 0, 0};
    struct qm_aliasing aliasing;
    struct qm_reference reference;
    qm_propagator *propagator;
    qm_complex K[64];
    double V[8], mass;
    for (size_t k = 0; k < 3; k++) {
        struct ad_error e[6] = {0};
        assert_int_equal(qm_aliasing(bad[k], &aliasing, &e[0]), AD_E_ARGUMENT);
        assert_int_equal(qm_kernel(bad[k], K, &e[1]), AD_E_ARGUMENT);
        assert_int_equal(qm_kernel_short(bad[k], K, &e[2]), AD_E_ARGUMENT);
        assert_int_equal(qm_propagator_new(&qm_method_fft, bad[k], &propagator, &e[3]),
                         AD_E_ARGUMENT);
        assert_null(propagator);
        assert_int_equal(qm_reference(bad[k], &packet, 1, 1e-3, K, &reference, &e[4]),
                         AD_E_ARGUMENT);
    }
    struct ad_error e[12] = {0};
    assert_int_equal(qm_aliasing(&good, NULL, &e[0]), AD_E_ARGUMENT);
    assert_int_equal(qm_kernel(&good, NULL, &e[1]), AD_E_ARGUMENT);
    assert_int_equal(qm_kernel_short(&good, NULL, &e[2]), AD_E_ARGUMENT);
    assert_int_equal(qm_kernel_square(0, 1, K, &e[3]), AD_E_ARGUMENT);
    assert_int_equal(qm_propagator_new(NULL, &good, &propagator, &e[4]), AD_E_ARGUMENT);
    assert_int_equal(qm_propagator_new(qm_method_find("kernl", &e[5]), &good, &propagator, &e[5]),
                     AD_E_ARGUMENT);
    assert_non_null(strstr(e[5].message, "kernel"));
    assert_int_equal(qm_propagate(NULL, 1, K, &e[6]), AD_E_ARGUMENT);
    assert_int_equal(qm_reference(&good, &flat, 1, 1e-3, K, &reference, &e[7]), AD_E_ARGUMENT);
    assert_int_equal(qm_reference(&good, &packet, (double)NAN, 1e-3, K, &reference, &e[8]),
                     AD_E_ARGUMENT);
    assert_int_equal(qm_potential(NULL, &good.grid, V, &mass, &e[9]), AD_E_ARGUMENT);
    assert_int_equal(qm_eigenstates(&system, NULL, 1, 1, V, V, &e[10]), AD_E_ARGUMENT);
    phys_system_close(&system);
}

/* A wave that is not finite at one point of one packet. */
static void test_waves_that_are_not_finite(void **state)
{
    (void)state;
    struct parameter set[] = {{"g", 0}};
    struct phys_system system = system_with("freebody", 1, set);
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-4, 4, 8}, .dt = 3, .hbar = 1};
    for (size_t k = 0; qm_methods[k]; k++)
        for (size_t at = 0; at < 16; at += 5) {
            struct ad_error error = {0};
            qm_propagator *propagator;
            qm_complex psi[16];
            char name[48];
            for (size_t i = 0; i < 16; i++)
                psi[i] = 0.25;
            ((double *)&psi[at])[at % 2 ? 0 : 1] = at % 2 ? (double)NAN : (double)INFINITY;
            snprintf(name, sizeof name, "point %zu of packet %zu", at / 2, at % 2);
            slice.walls = k == 2 ? QM_REFLECT : QM_RING;
            assert_int_equal(qm_propagator_new(qm_methods[k], &slice, &propagator, &error), AD_OK);
            assert_int_equal(qm_propagate(propagator, 2, psi, &error), AD_E_NONFINITE);
            assert_non_null(strstr(error.message, name));
            assert_true(psi[(at + 1) % 16] == 0.25);
            qm_propagator_free(propagator);
        }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_waves_that_are_not_finite),
        cmocka_unit_test(test_closed_forms),
        cmocka_unit_test(test_walls),
        cmocka_unit_test(test_bad_arguments),
    };
    return cmocka_run_group_tests_name("reference", tests, NULL, NULL);
}
