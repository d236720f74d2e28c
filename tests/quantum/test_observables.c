/* Potentials given by their values, and what is measured of a wave: momentum, energy, probability
   of a region, correlation. */
#include "waves.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

enum { N = 128 };
static const struct qm_grid box = {-8, 8, N};

/* V = k x^2/2 at the points of a grid. */
static struct phys_system parabola(const struct qm_grid *grid, double k, double mass)
{
    struct phys_system system;
    struct ad_error error = {0};
    double *V = malloc(grid->n * sizeof *V);
    for (size_t a = 0; a < grid->n; a++)
        V[a] = k / 2 * qm_x(grid, a) * qm_x(grid, a);
    qm_sampled(grid, V, mass, &system, &error);
    assert_no_error(&error);
    free(V); /* copied */
    return system;
}

/* A spline is exact for a parabola: the same wave as in the scene, whose V is a formula. */
static void test_sampled_is_the_scene(void **state)
{
    (void)state;
    const char *rules[] = {"trapezoid", "midpoint"};
    const struct parameter values[] = {{"k", 1}, {"m", 1}};
    const struct qm_grid wide = {-9, 9, 45};
    struct phys_system scene = system_with("spring", 2, values), sampled = parabola(&wide, 1, 1);
    for (size_t r = 0; r < 2; r++)
        for (size_t m = 0; m < 3; m++) {
            static qm_complex a[N], b[N];
            struct qm_gaussian packet = {1.5, 0.7, 0.4};
            struct qm_slice slice = {.size = sizeof slice,
                                     .system = &scene,
                                     .rule = rule_named(rules[r]),
                                     .grid = box,
                                     .dt = 0.4,
                                     .hbar = 1};
            qm_packet(&box, 1, &packet, 1, 0, a);
            memcpy(b, a, sizeof a);
            move(qm_methods[m], &slice, 5, 1, a);
            slice.system = &sampled;
            move(qm_methods[m], &slice, 5, 1, b);
            assert_close(distance(N, a, b), 0, 0, 1e-11);
        }
    double q, v;
    struct ad_error error = {0};
    const struct qm_grid aside = {-2, 6, 45};
    phys_system_close(&sampled);
    sampled = parabola(&aside, 1, 1);
    assert_int_equal(sampled.scene->start(sampled.params, 0, &q, &v, &error), AD_OK);
    assert_true(q == 2 && v == 0); /* at rest in the middle */
    phys_system_close(&scene);
    phys_system_close(&sampled);
}

/* The spline and its derivatives, as the Lagrangian has them, against those of the function. */
static void test_order_of_the_spline(void **state)
{
    (void)state;
    double off[2][3] = {{0}};
    for (size_t r = 0; r < 2; r++) {
        struct qm_grid grid = {-1, 2, 40u << r};
        struct phys_system system;
        struct ad_error error = {0};
        double V[80];
        for (size_t a = 0; a < grid.n; a++)
            V[a] = sin(2 * qm_x(&grid, a));
        assert_int_equal(qm_sampled(&grid, V, 1, &system, &error), AD_OK);
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var q = ad_input(tape, 1, 97, "q"), v = ad_input(tape, 1, 97, "v"), f, g;
        ad_var L = phys_system_lagrangian(&system, q, v, ad_broadcast(ad_scalar(tape, 0), 1, 97));
        ad_program *program;
        ad_grad(L, 1, &q, &f);
        ad_grad(f, 1, &q, &g);
        assert_int_equal(ad_compile(tape, 3, (ad_var[]){L, f, g}, &program), AD_OK);
        double x[97], y[3][97];
        for (size_t k = 0; k < 97; k++)
            x[k] = -1 + 3 * (double)k / 96;
        ad_set(program, q, x);
        ad_run(program);
        ad_get(program, L, y[0]);
        ad_get(program, f, y[1]);
        ad_get(program, g, y[2]);
        for (size_t k = 0; k < 97; k++) {
            const double exact[] = {-sin(2 * x[k]), -2 * cos(2 * x[k]), 4 * sin(2 * x[k])};
            for (size_t d = 0; d < 3; d++)
                off[r][d] = fmax(off[r][d], fabs(y[d][k] - exact[d]));
        }
        ad_program_free(program);
        ad_tape_free(tape);
        phys_system_close(&system);
    }
    for (size_t d = 0; d < 3; d++) /* orders 4, 3, 2 */
        assert_true(off[0][d] / off[1][d] > 0.8 * (16 >> d) && off[1][d] < 0.05);
}

/* An operation of the caller's own is not folded; whether t is in it is seen all the same, and
   also where L has values far from the origin alone. */
static int square(void *user, size_t cols, const double *const x[], double *y)
{
    (void)user;
    for (size_t k = 0; k < cols; k++)
        y[k] = x[0][k] * x[0][k];
    return 0;
}
static void slope(void *user, const ad_var x[], ad_var y, ad_var gy, ad_var gx[])
{
    (void)user, (void)y;
    gx[0] = ad_mul(ad_mul(2.0, x[0]), gy);
}
static const int *which;
static ad_var forced(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct ad_custom own = {
        .size = sizeof own, .rows = 1, .value = square, .recorded = slope};
    ad_var in[] = {q, t, ad_sign(ad_sin(t)), q};
    (void)params;
    if (*which == 4)
        return ad_sub(ad_square(v), ad_sqrt(ad_sub(q, 100.0)));
    ad_var V = ad_custom(1, &in[*which], &own);
    return ad_sub(ad_square(v), *which == 3 ? ad_mul(V, ad_sign(ad_sin(t))) : V);
}
static enum ad_status begin(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    *q = *v = 1;
    return AD_OK;
}

static void test_time_in_custom(void **state)
{
    (void)state;
    static const struct phys_scene scene = {.version = PHYS_SCENE_VERSION,
                                            .size = sizeof(struct phys_scene),
                                            .name = "forced",
                                            .what = "forced",
                                            .dof = 1,
                                            .dims = 1,
                                            .unit = "m",
                                            .time_unit = "s",
                                            .energy_unit = "J",
                                            .lagrangian = forced,
                                            .start = begin,
                                            .slices = 20,
                                            .dt = .1};
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    for (int k = 0; k < 5; k++) {
        which = &k;
        assert_int_equal(phys_keeps_energy(&system, &error), k == 0 || k == 4);
        assert_no_error(&error);
    }
    phys_system_close(&system);
}

static void test_refused_potentials(void **state)
{
    (void)state;
    double V[N] = {0};
    struct phys_system system;
    const struct qm_grid few = {-8, 8, 3}, turned = {8, -8, N};
    struct ad_error e[6] = {{0}};
    assert_int_equal(qm_sampled(&few, V, 1, &system, &e[0]), AD_E_ARGUMENT);
    assert_int_equal(qm_sampled(&turned, V, 1, &system, &e[1]), AD_E_ARGUMENT);
    assert_int_equal(qm_sampled(&box, V, 0, &system, &e[2]), AD_E_ARGUMENT);
    assert_int_equal(qm_sampled(&box, NULL, 1, &system, &e[3]), AD_E_ARGUMENT);
    V[77] = NAN;
    assert_int_equal(qm_sampled(&box, V, 1, &system, &e[4]), AD_E_NONFINITE);
    assert_mentions(e[4].message, "77");
    assert_null(system.params);
    /* what is beyond the values is not made up */
    static qm_complex K[N * N];
    const struct qm_grid narrow = {-7, 8, N};
    system = parabola(&narrow, 1, 1);
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = box, .dt = 0.4, .hbar = 1};
    assert_int_equal(qm_kernel(&slice, K, &e[5]), AD_E_NONFINITE);
    phys_system_close(&system);
}

/* Of a Gaussian in closed form: p, hbar/(2 sigma), and energies of a parabola. */
static void test_gaussian(void **state)
{
    (void)state;
    const double hbar = 0.7, mass = 1.3, k = 2.1, deviation = hbar / (2 * 0.8);
    struct phys_system system = parabola(&box, k, mass);
    for (int walls = QM_OPEN; walls <= QM_RING; walls++)
        for (size_t n = N - 1; n <= N; n++) {
            static qm_complex psi[2 * N];
            struct qm_slice slice = {.size = sizeof slice,
                                     .system = &system,
                                     .grid = {-8, 8, n},
                                     .walls = (enum qm_walls)walls,
                                     .dt = 0.1,
                                     .hbar = hbar};
            struct qm_gaussian packet = {0.4, 0.8, -1.9}, other = {-0.5, 1, 0.3};
            struct qm_observables o;
            struct ad_error error = {0};
            qm_packet(&slice.grid, hbar, &other, 2, 0, psi);
            qm_packet(&slice.grid, hbar, &packet, 2, 1, psi);
            for (size_t a = 0; a < n; a++)
                psi[2 * a + 1] *= 3; /* not normalised */
            qm_observe(&slice, 2, psi + 1, &o, &error);
            assert_no_error(&error);
            double T = (1.9 * 1.9 + deviation * deviation) / (2 * mass);
            double V = k / 2 * (0.4 * 0.4 + 0.8 * 0.8);
            assert_close(o.mean_p, -1.9, 1e-9, 0);
            assert_close(o.std_p, deviation, 1e-9, 0);
            assert_close(o.kinetic, T, 1e-9, 0);
            assert_close(o.potential, V, 1e-9, 0);
            assert_close(o.energy, T + V, 1e-9, 0);
        }
    phys_system_close(&system);
}

/* Between walls sin(k pi x/L) has the energy of a box, up to the wall. */
static void test_box(void **state)
{
    (void)state;
    struct phys_system system = parabola(&box, 0, 2);
    struct qm_slice slice = {.size = sizeof slice,
                             .system = &system,
                             .grid = box,
                             .walls = QM_REFLECT,
                             .dt = 0.1,
                             .hbar = 1};
    static qm_complex psi[N];
    for (int k = 1; k < 60; k += 7) {
        struct qm_observables o;
        struct ad_error error = {0};
        for (size_t a = 0; a < N; a++)
            psi[a] = sin(k * M_PI * (qm_x(&box, a) + 8) / 16);
        qm_observe(&slice, 1, psi, &o, &error);
        assert_no_error(&error);
        assert_close(o.energy, pow(k * M_PI / 16, 2) / 4, 1e-10, 0);
        assert_close(o.mean_p, 0, 0, 1e-11);
    }
    phys_system_close(&system);
}

static void test_refused_waves(void **state)
{
    (void)state;
    struct phys_system system = parabola(&box, 1, 1), relative;
    struct qm_slice slice = {
        .size = sizeof slice, .system = &system, .grid = box, .dt = 0.1, .hbar = 1};
    struct qm_observables o;
    struct ad_error zero = {0}, cut = {0}, nan = {0}, null = {0}, none = {0};
    static qm_complex psi[N];
    assert_int_equal(qm_observe(&slice, 1, psi, &o, &zero), AD_E_NONFINITE);
    qm_packet(&box, 1, &(struct qm_gaussian){7, 1, 0}, 1, 0, psi); /* half of it is outside */
    assert_int_equal(qm_observe(&slice, 1, psi, &o, &cut), AD_E_ACCURACY);
    psi[5] = NAN;
    assert_int_equal(qm_observe(&slice, 1, psi, &o, &nan), AD_E_NONFINITE);
    assert_int_equal(qm_observe(&slice, 1, NULL, &o, &null), AD_E_ARGUMENT);
    relative = system_with("pendulum", 0, NULL); /* m l^2 v^2/2 - V: fine; a broken slice is not */
    slice.system = &relative;
    slice.hbar = 0;
    assert_int_equal(qm_observe(&slice, 1, psi, &o, &none), AD_E_ARGUMENT);
    phys_system_close(&relative);
    phys_system_close(&system);
}

static void test_probability(void **state)
{
    (void)state;
    static qm_complex psi[N];
    qm_packet(&box, 1, &(struct qm_gaussian){0.3, 1, 2}, 1, 0, psi);
    assert_close(qm_probability(&box, -INFINITY, INFINITY, 1, psi), 1, 1e-12, 0);
    assert_close(qm_probability(&box, -0.7, 1.3, 1, psi), erf(M_SQRT1_2), 0, 1e-3);
    assert_close(qm_probability(&box, 0.31, 0.32, 1, psi), 0.01 / sqrt(2 * M_PI), 0, 1e-5);
    assert_close(qm_probability(&box, -0.7, 0.9, 1, psi) + qm_probability(&box, 0.9, 1.3, 1, psi),
                 qm_probability(&box, -0.7, 1.3, 1, psi), 1e-14, 0);
    assert_close(qm_probability(&box, 9, 10, 1, psi), 0, 0, 0);
    assert_true(isnan(qm_probability(&box, 1, 0, 1, psi)) &&
                isnan(qm_probability(&box, NAN, 0, 1, psi)));
}

/* A coherent state: after each turn it is back, with the sign of the phase of its ground state. */
static void test_correlation(void **state)
{
    (void)state;
    const struct qm_gaussian coherent = {1.5, M_SQRT1_2, 0}, still = {0, M_SQRT1_2, 0};
    struct phys_system system = parabola(&box, 1, 1);
    struct qm_slice slice = {.size = sizeof slice,
                             .system = &system,
                             .grid = {-8, 8, N},
                             .walls = QM_RING,
                             .dt = 2 * M_PI / 400,
                             .hbar = 1};
    static qm_complex psi[2 * N], c[2 * 801];
    struct ad_error error = {0};
    qm_propagator *propagator;
    qm_packet(&box, 1, &coherent, 2, 0, psi);
    qm_packet(&box, 1, &still, 2, 1, psi);
    qm_propagator_new(&qm_method_fft, &slice, &propagator, &error);
    assert_no_error(&error);
    assert_int_equal(qm_correlation(propagator, 800, 2, psi, c, &error), AD_OK);
    assert_close(cabs(c[0] - 1), 0, 0, 1e-10);
    for (int k = 0; k <= 800; k += 100) { /* |C|^2 = exp(-(1 - cos t) x^2), Glauber */
        double t = 2 * M_PI * k / 400;
        assert_close(cabs(c[2 * k]), exp(-(1 - cos(t)) * 1.5 * 1.5 / 2), 0, 1e-3);
        assert_close(cabs(c[2 * k + 1] - cexp(-I * t / 2)), 0, 0, 1e-3);
    }
    assert_close(cabs(c[800] + 1), 0, 0, 1e-3);
    struct ad_error null = {0};
    assert_int_equal(qm_correlation(propagator, 1, 2, psi, NULL, &null), AD_E_ARGUMENT);
    qm_propagator_free(propagator);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sampled_is_the_scene),
        cmocka_unit_test(test_order_of_the_spline),
        cmocka_unit_test(test_time_in_custom),
        cmocka_unit_test(test_refused_potentials),
        cmocka_unit_test(test_gaussian),
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_refused_waves),
        cmocka_unit_test(test_probability),
        cmocka_unit_test(test_correlation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
