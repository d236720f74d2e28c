/* The error of packets against closed forms and other methods. */
#include "waves.h"

#include "quantum/published.h"
#include "quantum/slit.h"

#include <complex.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- systems of one coordinate ---- */

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = v[0] = 0;
    return AD_OK;
}

static const double shift = 0.7;

/* An oscillator and d(shift q)/dt: the same motion, but p = v + shift, so that L is not m v^2/2 -
 * V. */
static ad_var shifted(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var kinetic = ad_add(ad_mul(0.5, ad_square(v)), ad_mul(shift, v));
    return ad_sum_rows(ad_sub(kinetic, ad_mul(0.5, ad_square(q))));
}

static ad_var eckart(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var inverse = ad_sub(1.0, ad_square(ad_tanh(q))); /* 1 / cosh^2 */
    return ad_sum_rows(ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(2.0, inverse)));
}

static ad_var hill(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sum_rows(ad_mul(0.5, ad_add(ad_square(v), ad_square(q))));
}

static struct phys_system system_of(ad_var (*lagrangian)(ad_var, ad_var, ad_var, const void *))
{
    static struct phys_scene scene;
    struct phys_system system;
    struct ad_error error = {0};
    scene = (struct phys_scene){.version = PHYS_SCENE_VERSION,
                                .size = sizeof scene,
                                .name = "of a test",
                                .what = "one coordinate",
                                .dof = 1,
                                .dims = 1,
                                .unit = "m",
                                .time_unit = "s",
                                .energy_unit = "J",
                                .lagrangian = lagrangian,
                                .slices = 10,
                                .dt = 0.1,
                                .start = start};
    phys_system_make(&scene, &system, &error);
    assert_no_error(&error);
    return system;
}

/* A19: an L that is odd in v has no mirrored paths: refused between reflecting walls alone. */
static void odd_lagrangians_have_no_mirror(void **state)
{
    (void)state;
    ad_var (*const odd[])(ad_var, ad_var, ad_var, const void *) = {shifted, eckart};
    for (size_t k = 0; k < 2; k++) {
        struct phys_system system = system_of(odd[k]);
        struct qm_aliasing aliasing;
        for (int walls = QM_OPEN; walls <= QM_RING; walls++) {
            struct ad_error error = {0};
            const struct qm_slice slice = {.size = sizeof slice,
                                           .system = &system,
                                           .grid = {-4, 4, 64},
                                           .walls = (enum qm_walls)walls,
                                           .dt = 0.4,
                                           .hbar = 1};
            bool refused = qm_aliasing(&slice, &aliasing, &error) == AD_E_ARGUMENT;
            assert_int_equal(refused, k == 0 && walls == QM_REFLECT);
        }
        phys_system_close(&system);
    }
}

/* ---- errors ---- */

static double error_after(const struct qm_method *method, const struct qm_slice *slice,
                          const struct qm_gaussian *packet, size_t steps, const char **against)
{
    struct ad_error error = {0};
    double off = NAN;
    qm_complex *psi = malloc(slice->grid.n * sizeof *psi);
    assert_non_null(psi);
    qm_packet(&slice->grid, slice->hbar, packet, 1, 0, psi);
    move(method, slice, steps, 1, psi);
    qm_error(method, slice, 1, packet, (double)steps * slice->dt, psi, &off, against, &error);
    assert_no_error(&error);
    free(psi);
    return off;
}

/* A19: of an L without a potential of its own the error is estimated by slices three times as fine.
   With p + shift the packet moves as that of the oscillator, whose error is known. */
static void finer_slices_tell_the_error(void **state)
{
    (void)state;
    static const struct {
        const char *rule;
        size_t steps, n;
        double within;
    } rows[] = {{"trapezoid", 8, 400, 0.1}, {"midpoint", 12, 500, 0.1}, {"left", 20, 700, 0.2}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct phys_system plain = system_with("spring", 0, NULL), system = system_of(shifted);
        struct qm_slice slice = {.size = sizeof slice,
                                 .system = &plain,
                                 .rule = rule_named(rows[k].rule),
                                 .grid = {-7, 7, rows[k].n},
                                 .dt = 3.0 / (double)rows[k].steps,
                                 .hbar = 1};
        struct qm_gaussian packet = {1.5, 0.6, -0.4}, moved = {1.5, 0.6, -0.4 + shift};
        const char *known, *estimated;
        double expected = error_after(&qm_method_kernel, &slice, &packet, rows[k].steps, &known);
        slice.system = &system;
        double found = error_after(&qm_method_kernel, &slice, &moved, rows[k].steps, &estimated);
        assert_non_null(strstr(known, "closed form"));
        assert_non_null(strstr(estimated, "three times as fine"));
        if (!(fabs(found / expected - 1) < rows[k].within))
            fail_msg("%s, %zu slices: %g, true %g", rows[k].rule, rows[k].steps, found, expected);
        phys_system_close(&plain);
        phys_system_close(&system);
    }
}

/* A19: one slice of 5 over an Eckart barrier is wrong, and said to be; short ones are right. The
   error is that against Crank-Nicolson on a fine grid. */
static void eckart_barrier(void **state)
{
    (void)state;
    enum { N = 800, FINE = 5 * N };
    struct phys_system system = system_of(eckart);
    struct qm_gaussian packet = {-6, 0.8, 2};
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-25, 25, N}, .dt = 5, .hbar = 1};
    const char *against;
    double crude = error_after(&qm_method_fft, &slice, &packet, 1, &against);
    qm_complex *psi = calloc(N + FINE, sizeof *psi), *truth = psi + N;
    assert_non_null(psi);
    qm_packet(&slice.grid, 1, &packet, 1, 0, psi);
    move(&qm_method_fft, &slice, 1, 1, psi);
    struct qm_slice fine = slice;
    fine.grid.n = FINE;
    fine.walls = QM_REFLECT;
    fine.dt = 0.01;
    qm_packet(&fine.grid, 1, &packet, 1, 0, truth);
    move(&qm_method_crank_nicolson, &fine, 500, 1, truth);
    double sum = 0;
    for (size_t a = 0; a < N; a++)
        sum += pow(cabs(psi[a] - truth[5 * a + 2]), 2) * qm_dx(&slice.grid);
    assert_true(crude > 0.5);
    assert_close(crude, sqrt(sum), 0.01, 0);
    slice.grid.n = 6000;
    slice.dt = 0.25;
    assert_true(error_after(&qm_method_fft, &slice, &packet, 20, &against) < 0.02);
    free(psi);
    phys_system_close(&system);
}

/* |K|^2 = dx^2 D / (2 pi hbar): by the midpoint rule D = m/dt + dt V''/4, by trapezoid m/dt. */
static void amplitude_of_a_slice(void **state)
{
    (void)state;
    enum { N = 40 };
    struct phys_system system = system_of(hill); /* V'' = -1 */
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-2, 2, N}, .dt = 1.3, .hbar = 0.8};
    static const char *const rules[] = {"midpoint", "trapezoid", "left"};
    static qm_complex K[N * N];
    for (int k = 0; k < 3; k++) {
        struct ad_error error = {0};
        slice.rule = rule_named(rules[k]);
        qm_kernel(&slice, K, &error);
        assert_no_error(&error);
        double D = 1 / slice.dt - (k == 0 ? slice.dt / 4 : 0), dx = qm_dx(&slice.grid);
        for (size_t i = 0; i < N * N; i += 7)
            assert_close(cabs(K[i]), dx * sqrt(D / (2 * M_PI * slice.hbar)), 1e-12, 0);
    }
    phys_system_close(&system);
}

/* F4: on top of a hill no path has a focus. A slice is refused where straight paths have no
   amplitude, with what two slices of half the length have; admitted ones have their error. */
static void slices_without_amplitude(void **state)
{
    (void)state;
    struct phys_system system = system_of(hill);
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-12, 12, 400}, .dt = 2.1, .hbar = 1};
    struct qm_gaussian packet = {0.1, 0.7, -0.3};
    struct qm_aliasing aliasing;
    struct ad_error error = {0};
    const char *against;
    slice.rule = rule_named("midpoint");
    assert_int_equal(qm_aliasing(&slice, &aliasing, &error), AD_E_ARGUMENT);
    /* D = 1/dt - dt/4; of two halves (1/h - h/4)^2 / (2/h + h/2), h = dt/2 */
    const char *numbers = strstr(error.message, "dx_b = ");
    double one, two, h = 1.05;
    assert_non_null(numbers);
    assert_int_equal(sscanf(numbers, "dx_b = %lf, two of half the length %lf", &one, &two), 2);
    assert_close(one, 1 / 2.1 - 2.1 / 4, 0.01, 0);
    assert_close(two, pow(1 / h - h / 4, 2) / (2 / h + h / 2), 0.01, 0);
    slice.dt = 1.9;
    assert_true(error_after(&qm_method_kernel, &slice, &packet, 1, &against) > 0.1);
    slice.rule = NULL;
    slice.dt = 2.1;
    assert_true(error_after(&qm_method_kernel, &slice, &packet, 1, &against) > 0.1);
    slice.grid.n = 3000;
    slice.dt = 0.1;
    assert_true(error_after(&qm_method_fft, &slice, &packet, 10, &against) < 0.01);
    phys_system_close(&system);
}

/* ---- the particle ---- */

static void particle_between_walls(void **state)
{
    (void)state;
    const struct parameter set[] = {{"g", 0}};
    struct phys_system system = system_with("freebody", 1, set);
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = {-1, 1, 8}, .dt = 1, .hbar = 1};
    struct qm_gaussian packet = {0, 0.1, 1};
    const double t[] = {0, 0.5, 1.5, 2.5, 4};
    static const struct {
        enum qm_walls walls;
        double x[5];
    } rows[] = {{QM_REFLECT, {0, 0.5, 0.5, -0.5, 0}},
                {QM_RING, {0, 0.5, -0.5, 0.5, 0}},
                {QM_OPEN, {0, 0.5, NAN, NAN, NAN}}};
    for (size_t k = 0; k < 3; k++) {
        double x[5];
        struct ad_error error = {0};
        slice.walls = rows[k].walls;
        qm_classical(&slice, &packet, 5, t, x, &error);
        assert_no_error(&error);
        for (size_t i = 0; i < 5; i++) {
            assert_int_equal(isnan(x[i]), isnan(rows[k].x[i]));
            if (!isnan(x[i]))
                assert_close(x[i], rows[k].x[i], 0, 1e-9);
        }
    }
    phys_system_close(&system);
}

/* ---- mistakes ---- */

static const struct qm_grid box = {-1, 1, 4};
static const struct qm_gaussian gaussian = {0, 0.2, 0}, flat = {0, 0, 0};
static const struct qm_quadratic quadratic = {1, 0, 0}, massless = {0, 0, 0};
static qm_complex room[16];

/* G2: functions without a status give NaN, and no number. */
static void mistakes_give_nan(void **state)
{
    (void)state;
    const struct qm_grid none = {0};
    struct qm_slit slit = {0};
    struct qm_published published = {0};
    const double numbers[] = {
        qm_dx(NULL),
        qm_dx(&none),
        qm_x(NULL, 0),
        qm_moments(NULL, 1, room).norm,
        qm_moments(&box, 1, NULL).mean_x,
        qm_moments(&box, 0, room).norm,
        creal(qm_overlap(&box, 1, room, NULL)),
        creal(qm_overlap(&box, 0, room, room)),
        creal(qm_exact_kernel(&quadratic, 0, 0, 1, 1)),
        creal(qm_exact_kernel(NULL, 1, 0, 1, 1)),
        creal(qm_exact_kernel(&quadratic, 1, 0, 1, -1)),
        creal(qm_exact_kernel(&(struct qm_quadratic){1, 1, 0}, 1, 0, 1, 7)), /* beyond a period */
        creal(qm_exact_kernel(&(struct qm_quadratic){1, -1, 0}, 1, 0, 1, 1)),
        qm_exact_fringe(1, 1, 4, 0.3, 0),
        qm_exact_fringe(1, 1, -4, 0.3, 1),
    };
    for (size_t k = 0; k < LENGTH(numbers); k++)
        if (!isnan(numbers[k]))
            fail_msg("number %zu: %g", k, numbers[k]);
    for (int k = 0; k < 8; k++) {
        for (size_t a = 0; a < LENGTH(room); a++)
            room[a] = 1;
        k == 0   ? qm_packet(&box, 1, NULL, 1, 0, room)
        : k == 1 ? qm_packet(&box, 1, &flat, 1, 0, room)
        : k == 2 ? qm_packet(&box, 0, &gaussian, 1, 0, room)
        : k == 3 ? qm_exact_packet(&massless, 1, &gaussian, 1, &box, room)
        : k == 4 ? qm_exact_packet(NULL, 1, &gaussian, 1, &box, room)
        : k == 5 ? qm_exact_packet(&quadratic, 1, NULL, 1, &box, room)
        : k == 6 ? qm_kernel_apply(4, NULL, 1, room + 8, room)
                 : qm_propagate_plane(2, NULL, 2, room + 8, NULL, 1, room, room + 12);
        for (size_t a = 0; a < LENGTH(room); a++)
            assert_int_equal(isnan(creal(room[a])), a < 4);
    }
    room[0] = 1;
    qm_packet(NULL, 1, &gaussian, 1, 0, room);
    qm_packet(&box, 1, &gaussian, 1, 1, room); /* no such column */
    qm_packet(&box, 1, &gaussian, 1, 0, NULL);
    qm_exact_packet(&quadratic, 1, &gaussian, 1, NULL, room);
    qm_kernel_apply(0, room, 1, room, room);
    qm_kernel_apply(4, room, 1, room, NULL);
    qm_propagate_plane(2, room, 2, room, NULL, 1, NULL, room);
    assert_true(creal(room[0]) == 1);
    assert_false(qm_slit_advance(NULL) || qm_slit_advance(&slit));
    assert_false(qm_published_advance(NULL) || qm_published_advance(&published));
    qm_slit_measure(NULL);
    qm_slit_measure(&slit);
    qm_slit_free(NULL);
    qm_published_free(NULL);
}

static void bad_arguments(void **state)
{
    (void)state;
    struct phys_system system = system_of(hill);
    const struct qm_slice good = {
        .size = sizeof good, .system = &system, .grid = {-4, 4, 8}, .dt = 3, .hbar = 1};
    const double t = 0;
    double off, x;
    const char *against;
    struct qm_reference reference;
    struct ad_error e[11] = {0};
    qm_reference(&good, &gaussian, 1, 0, room, &reference, &e[8]); /* no work is enough */
    qm_reference(&good, &gaussian, 1, NAN, room, &reference, &e[9]);
    qm_kernel_square(2, SIZE_MAX, room, &e[10]);
    qm_error(NULL, &good, 1, &gaussian, 1, room, &off, &against, &e[0]);
    qm_error(&qm_method_fft, NULL, 1, &gaussian, 1, room, &off, &against, &e[1]);
    qm_error(&qm_method_fft, &good, 0, &gaussian, 1, room, &off, &against, &e[2]);
    qm_error(&qm_method_fft, &good, 1, &gaussian, NAN, room, &off, &against, &e[3]);
    qm_error(&qm_method_fft, &good, 1, &gaussian, 1, room, NULL, &against, &e[4]);
    qm_classical(NULL, &gaussian, 1, &t, &x, &e[5]);
    qm_classical(&good, NULL, 1, &t, &x, &e[6]);
    assert_null(qm_method_find(NULL, &e[7]));
    for (size_t k = 0; k < sizeof e / sizeof *e; k++)
        assert_int_equal(e[k].status, AD_E_ARGUMENT);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(odd_lagrangians_have_no_mirror),
        cmocka_unit_test(finer_slices_tell_the_error),
        cmocka_unit_test(eckart_barrier),
        cmocka_unit_test(slices_without_amplitude),
        cmocka_unit_test(amplitude_of_a_slice),
        cmocka_unit_test(particle_between_walls),
        cmocka_unit_test(mistakes_give_nan),
        cmocka_unit_test(bad_arguments),
    };
    return cmocka_run_group_tests_name("error", tests, NULL, NULL);
}
