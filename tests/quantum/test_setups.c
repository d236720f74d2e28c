/* Set-ups that the command runs: the double slit and the published box. */
#include "quantum/published.h"
#include "quantum/slit.h"
#include "waves.h"

#include <stdlib.h>

static void slit_begins_and_ends(void **state)
{
    (void)state;
    struct qm_slit_setup setup = qm_slit_defaults();
    struct qm_slit slit;
    struct ad_error error = {0};
    setup.points = 172;
    setup.steps = 75;
    qm_slit_new(&setup, &slit, &error);
    assert_no_error(&error);
    qm_slit_measure(&slit); /* before the barrier the packet is whole */
    assert_close(slit.norm, 1, 0, 0.02);
    assert_close(slit.closed, qm_exact_fringe(1, 1, 4, 0.3, 3), 1e-15, 0);
    for (size_t k = 0; k < 4; k++)
        assert_true(qm_slit_advance(&slit));
    assert_int_equal(slit.frames, 5);
    assert_int_equal(slit.done, 4 * slit.every);
    assert_close(slit.time[4], (double)slit.done * slit.dt, 1e-15, 0);
    qm_slit_measure(&slit);
    assert_true(slit.norm < 1 && slit.norm > 0.5);
    qm_slit_free(&slit);
    qm_slit_free(&slit);
}

static void slits_that_make_no_sense(void **state)
{
    (void)state;
    struct qm_slit_setup bad[6];
    struct qm_slit slit;
    for (size_t k = 0; k < 6; k++)
        bad[k] = qm_slit_defaults();
    bad[0].sigma = -1;
    bad[1].hbar = NAN;
    bad[2].points = 3;
    bad[3].steps = 0;
    bad[4].points = 60; /* waves */
    bad[5].steps = 20;  /* over the barrier */
    for (size_t k = 0; k < 6; k++) {
        struct ad_error error = {0};
        assert_int_equal(qm_slit_new(&bad[k], &slit, &error), AD_E_ARGUMENT);
        qm_slit_free(&slit);
    }
    struct ad_error e[2] = {0};
    assert_int_equal(qm_slit_new(NULL, &slit, &e[0]), AD_E_ARGUMENT);
    assert_int_equal(qm_slit_new(&bad[0], NULL, &e[1]), AD_E_ARGUMENT);
}

/* F8: the published potential changes |psi| by one kick; the norm after a slice is 3, not 1. */
static void published_matrix(void **state)
{
    (void)state;
    struct qm_published p;
    struct ad_error error = {0};
    qm_published_new(0.5, &p, &error);
    assert_no_error(&error);
    /* neighbours, n apart: m dx ((n - 1)^2 - (n - 2)^2) dx / (2 hbar dt) */
    double n = (double)p.grid.n, dx = qm_dx(&p.grid);
    assert_close(p.phases, dx * dx * (2 * n - 3) / (2 * p.hbar * p.dt), 1e-13, 0);
    assert_close(p.ghost, 2 * M_PI * p.hbar * p.dt / dx, 1e-13, 0);
    while (qm_published_advance(&p))
        ;
    assert_int_equal(p.done, p.steps);
    assert_close(p.time[p.frames - 1], (double)p.steps * p.dt, 1e-14, 0);
    assert_true(p.kick > 1e-4 && p.kick < 0.1);
    qm_published_free(&p);
    qm_published_new(1, &p, &error);
    assert_no_error(&error);
    assert_true(qm_published_advance(&p));
    assert_close(p.norm, 3, 0.01, 0);
    qm_published_free(&p);
}

/* Done right the norm stays, whatever the scale. */
static void published_scene_done_right(void **state)
{
    (void)state;
    static const double scales[] = {0.25, 0.3, 0.7};
    for (size_t k = 0; k < 3; k++) {
        struct ad_error error = {0};
        struct phys_system system;
        struct qm_slice slice = {.size = sizeof slice};
        struct qm_gaussian packet;
        size_t steps;
        qm_published_right(scales[k], &system, &slice, &packet, &steps, &error);
        assert_no_error(&error);
        qm_complex *psi = malloc(slice.grid.n * sizeof *psi);
        assert_non_null(psi);
        qm_packet(&slice.grid, slice.hbar, &packet, 1, 0, psi);
        double before = qm_moments(&slice.grid, 1, psi).norm;
        move(&qm_method_kernel, &slice, steps < 20 ? steps : 20, 1, psi);
        assert_close(qm_moments(&slice.grid, 1, psi).norm, before, 1e-11, 0);
        free(psi);
        phys_system_close(&system);
    }
}

static void scales_that_make_no_sense(void **state)
{
    (void)state;
    static const double scales[] = {0.24, 2.1, NAN, -1};
    for (size_t k = 0; k < 4; k++) {
        struct qm_published p;
        struct phys_system system;
        struct qm_slice slice = {.size = sizeof slice};
        struct qm_gaussian packet;
        size_t steps;
        struct ad_error e[3] = {0};
        assert_int_equal(qm_published_new(scales[k], &p, &e[0]), AD_E_ARGUMENT);
        assert_int_equal(qm_published_right(scales[k], &system, &slice, &packet, &steps, &e[1]),
                         AD_E_ARGUMENT);
        assert_int_equal(qm_published_new(scales[k], NULL, &e[2]), AD_E_ARGUMENT);
        qm_published_free(&p);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slit_begins_and_ends),      cmocka_unit_test(slits_that_make_no_sense),
        cmocka_unit_test(published_matrix),          cmocka_unit_test(published_scene_done_right),
        cmocka_unit_test(scales_that_make_no_sense),
    };
    return cmocka_run_group_tests_name("setups", tests, NULL, NULL);
}
