/* Packets against exact solutions: spreading, falling, oscillating; otherwise methods against each
   other. */
#include "waves.h"

#include <stdlib.h>

static const struct parameter weightless[] = {{"g", 0}};

static void exact_packets_are_exact(void **state)
{
    (void)state;
    struct qm_grid grid = {-12, 12, 600};
    static qm_complex psi[600], start[600];
    struct qm_gaussian half = {0, 0.5, 0};
    qm_exact_packet(&(struct qm_quadratic){1, 0, 0}, 1, &half, 1, &grid, psi);
    struct qm_moments m = qm_moments(&grid, 1, psi);
    assert_close(m.norm, 1, 1e-13, 0);
    assert_close(m.std_x, 1.1180339887498949, 1e-12, 0);
    /* a coherent state comes back upside down after a period, and right after two */
    struct qm_gaussian coherent = {2, M_SQRT1_2, 0.5};
    qm_packet(&grid, 1, &coherent, 1, 0, start);
    for (int k = 1; k <= 2; k++) {
        qm_exact_packet(&(struct qm_quadratic){1, 1, 0}, 1, &coherent, k * 2 * M_PI, &grid, psi);
        assert_close(cabs(qm_overlap(&grid, 1, start, psi) - (k == 1 ? -1 : 1)), 0, 0, 1e-12);
    }
    /* gravity is the limit of a weak spring with the same pull */
    qm_exact_packet(&(struct qm_quadratic){1.3, 0, 2}, 0.7, &coherent, 1.1, &grid, psi);
    qm_exact_packet(&(struct qm_quadratic){1.3, 1e-7, 2}, 0.7, &coherent, 1.1, &grid, start);
    assert_close(distance(600, psi, start), 0, 0, 1e-5);
    assert_close(qm_exact_fringe(1, 1, 4, 0.3, 3), 4.72935358, 1e-9, 0);
}

/* The closed form solves Schroedinger's equation: i hbar psi_t = -hbar^2/(2 m) psi_xx + V psi. */
static void exact_packets_solve_the_equation(void **state)
{
    (void)state;
    static const struct qm_quadratic scenes[] = {{1.3, 0, 0}, {1.3, 0, 2}, {1.3, 1.7, 0.9}};
    const double hbar = 0.8, h = 1e-3;
    struct qm_grid grid = {0.3 - 1.5 * h, 0.3 + 1.5 * h, 3};
    for (size_t k = 0; k < 3; k++) {
        const struct qm_quadratic *s = &scenes[k];
        qm_complex now[3], past[3], next[3];
        struct qm_gaussian packet = {0.5, 0.6, 1.2};
        qm_exact_packet(s, hbar, &packet, 4.1, &grid, now);
        qm_exact_packet(s, hbar, &packet, 4.1 - h, &grid, past);
        qm_exact_packet(s, hbar, &packet, 4.1 + h, &grid, next);
        double x = 0.3, V = s->mass * (0.5 * s->curvature * x * x + s->gravity * x);
        qm_complex left = I * hbar * (next[1] - past[1]) / (2 * h);
        qm_complex right =
            -hbar * hbar / (2 * s->mass) * (now[0] - 2 * now[1] + now[2]) / (h * h) + V * now[1];
        assert_close(cabs(left - right), 0, 0, 2e-5);
    }
}

/* ---- the kernel follows them ---- */

static void free_packet_spreads(void **state)
{
    (void)state;
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-10, 10, 256}, QM_OPEN, 0, 0.5, 1, 1};
    qm_complex psi[256];
    qm_packet(&slice.grid, 1, &(struct qm_gaussian){0, 0.5, 0}, 1, 0, psi);
    move(&qm_method_kernel, &slice, 2, 1, psi);
    struct qm_moments m = qm_moments(&slice.grid, 1, psi);
    assert_close(m.norm, 1, 1e-13, 0);
    assert_close(m.std_x, 1.1180339887498949, 1e-12, 0);
    phys_system_close(&system);
}

/* The straight path in uniform gravity is right but for a phase, g^2 m dt^3/24 a slice. */
static void gravity_packet_falls(void **state)
{
    (void)state;
    static const struct parameter values[] = {{"m", 1.5}, {"g", 2}};
    struct phys_system system = system_with("freebody", 2, values);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-14, 10, 400}, QM_OPEN, 0, 0.7, 1, 1};
    struct qm_gaussian packet = {0, 0.6, 3};
    qm_complex psi[400], exact[400];
    qm_packet(&slice.grid, 1, &packet, 1, 0, psi);
    move(&qm_method_kernel, &slice, 4, 1, psi);
    qm_exact_packet(&(struct qm_quadratic){1.5, 0, 2}, 1, &packet, 2.8, &slice.grid, exact);
    qm_complex overlap = qm_overlap(&slice.grid, 1, exact, psi);
    assert_close(cabs(overlap), 1, 1e-10, 0);
    assert_close(carg(overlap), 4 * 1.5 * 4 * pow(0.7, 3) / 24, 1e-9, 0);
    struct qm_moments m = qm_moments(&slice.grid, 1, psi); /* Ehrenfest: the parabola */
    assert_close(m.mean_x, 3 / 1.5 * 2.8 - 2.8 * 2.8, 1e-8, 0);
    phys_system_close(&system);
}

/* After a period -1, to second order in dt. */
static void coherent_state_swings(void **state)
{
    (void)state;
    struct phys_system system = system_with("spring", 0, NULL);
    struct qm_slice slice = {.size = sizeof slice, &system, NULL, {-8, 8, 0}, QM_OPEN, 0, 0, 1, 1};
    struct qm_gaussian packet = {1.5, M_SQRT1_2, 0};
    double before = 0;
    for (size_t steps = 32; steps <= 128; steps *= 2) {
        slice.dt = 2 * M_PI / (double)steps;
        slice.grid.n = (size_t)ceil(16 * 16 / (M_PI * slice.dt)) + 2;
        double error = packet_error(&qm_method_kernel, &slice, &(struct qm_quadratic){1, 1, 0},
                                    &packet, steps);
        if (before > 0)
            assert_close(before / error, 4, 0.05, 0);
        before = error;
    }
    assert_true(before < 2e-3);
    phys_system_close(&system);
}

/* Orders of the rules in dt; left is the trapezoid rule seen from half a kick away. */
static void rules_have_their_orders(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double order;
    } rules[] = {{"left", 1}, {"midpoint", 2}, {"trapezoid", 2}};
    struct phys_system system = system_with("spring", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-8, 8, 850}, QM_OPEN, 0, 0, 1, 1};
    for (size_t r = 0; r < 3; r++) {
        double before = 0;
        slice.rule = rule_named(rules[r].name);
        for (size_t steps = 15; steps <= 30; steps *= 2) {
            slice.dt = 3 / (double)steps;
            double error = packet_error(&qm_method_kernel, &slice, &(struct qm_quadratic){1, 1, 0},
                                        &(struct qm_gaussian){1.5, 0.6, 0.4}, steps);
            if (before > 0)
                assert_close(log2(before / error), rules[r].order, 0, 0.12);
            before = error;
        }
    }
    phys_system_close(&system);
}

/* ---- methods against each other ---- */

/* fft gives what the matrix gives, one packet or three. */
static void fft_is_the_kernel(void **state)
{
    (void)state;
    static const enum qm_walls walls[] = {QM_OPEN, QM_RING};
    static const char *const scenes[] = {"spring", "freebody", "double-well"};
    static qm_complex psi[300 * 3], other[300 * 3];
    for (size_t k = 0; k < 6; k++) {
        struct phys_system system = system_with(scenes[k % 3], 0, NULL);
        struct qm_slice slice = {
            .size = sizeof slice, &system, NULL, {-6, 5, 300}, walls[k / 3], 1.5, 0.15, 1, 1};
        slice.rule = rule_named(k % 2 ? "left" : "trapezoid");
        for (size_t p = 0; p < 3; p++)
            qm_packet(&slice.grid, 1, &(struct qm_gaussian){(double)p - 1, 0.6, 1}, 3, p, psi);
        for (size_t p = 0; p < 900; p++)
            other[p] = psi[p];
        move(&qm_method_kernel, &slice, 5, 3, psi);
        move(&qm_method_fft, &slice, 5, 3, other);
        assert_close(distance(900, psi, other), 0, 0, 1e-11);
        phys_system_close(&system);
    }
}

/* On a ring of 2^k points it sums all windings in closed form: the kernel where that is right, and
   right where the kernel's grid would alias. */
static void fft_on_a_ring_has_no_shortest_slice(void **state)
{
    (void)state;
    struct phys_system system = system_with("spring", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-8, 8, 512}, QM_RING, 0, 0.2, 1, 1};
    static qm_complex psi[512], other[512];
    struct qm_gaussian packet = {1.5, 0.6, 0.4};
    qm_packet(&slice.grid, 1, &packet, 1, 0, psi);
    for (size_t k = 0; k < 512; k++)
        other[k] = psi[k];
    move(&qm_method_kernel, &slice, 5, 1, psi);
    move(&qm_method_fft, &slice, 5, 1, other);
    assert_close(distance(512, psi, other), 0, 0, 1e-7);
    slice.dt = 3e-4;
    double error =
        packet_error(&qm_method_fft, &slice, &(struct qm_quadratic){1, 1, 0}, &packet, 10000);
    assert_close(error, 0, 0, 2 * slice.dt * slice.dt); /* the rule's, no more */
    assert_false(qm_method_fft.aliases(&slice));
    phys_system_close(&system);
    /* thousands of slices leave what one would, for want of forces: rounding does not add up */
    system = system_with("freebody", 1, weightless);
    error = packet_error(&qm_method_fft, &slice, &(struct qm_quadratic){1, 0, 0}, &packet, 1000);
    assert_close(error, 0, 0, 1e-10);
    phys_system_close(&system);
}

static void fft_refuses_what_is_no_convolution(void **state)
{
    (void)state;
    struct phys_system system = system_with("double-well", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, rule_named("midpoint"), {-4, 4, 100}, QM_OPEN, 0, 0.2, 1, 1};
    qm_propagator *propagator;
    for (int k = 0; k < 2; k++) {
        struct ad_error error = {0};
        assert_int_equal(qm_propagator_new(&qm_method_fft, &slice, &propagator, &error),
                         AD_E_ARGUMENT);
        assert_null(propagator);
        slice.rule = NULL, slice.walls = QM_REFLECT;
    }
    phys_system_close(&system);
}

/* Crank-Nicolson on a fine grid with two steps, extrapolated, against the kernel with two, in the
   double well, where nothing is known in closed form. */
static void crank_nicolson_agrees(void **state)
{
    (void)state;
    struct phys_system system = system_with("double-well", 0, NULL);
    struct qm_gaussian packet = {-1.5, 0.4, 2};
    static qm_complex coarse[729], fine[2187];
    static qm_complex short_slices[729], long_slices[729];
    struct qm_slice cn = {
        .size = sizeof cn, &system, NULL, {-4, 4, 729}, QM_REFLECT, 0, 2.0 / 300, 1, 1};
    qm_packet(&cn.grid, 1, &packet, 1, 0, coarse);
    double norm = qm_moments(&cn.grid, 1, coarse).norm;
    move(&qm_method_crank_nicolson, &cn, 300, 1, coarse);
    assert_close(qm_moments(&cn.grid, 1, coarse).norm, norm, 1e-12, 0);
    cn.grid.n = 2187, cn.dt /= 3; /* every third point is one of the coarse grid */
    qm_packet(&cn.grid, 1, &packet, 1, 0, fine);
    move(&qm_method_crank_nicolson, &cn, 900, 1, fine);
    for (size_t a = 0; a < 729; a++)
        coarse[a] = (9 * fine[3 * a + 1] - coarse[a]) / 8;
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-4, 4, 729}, QM_REFLECT, 0, 2.0 / 40, 1, 1};
    qm_packet(&slice.grid, 1, &packet, 1, 0, long_slices);
    move(&qm_method_kernel, &slice, 40, 1, long_slices);
    slice.dt /= 2;
    qm_packet(&slice.grid, 1, &packet, 1, 0, short_slices);
    move(&qm_method_kernel, &slice, 80, 1, short_slices);
    for (size_t a = 0; a < 729; a++)
        long_slices[a] = (4 * short_slices[a] - long_slices[a]) / 3;
    assert_close(distance(729, coarse, long_slices), 0, 0, 1e-4);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_packets_are_exact),
        cmocka_unit_test(exact_packets_solve_the_equation),
        cmocka_unit_test(free_packet_spreads),
        cmocka_unit_test(gravity_packet_falls),
        cmocka_unit_test(coherent_state_swings),
        cmocka_unit_test(rules_have_their_orders),
        cmocka_unit_test(fft_is_the_kernel),
        cmocka_unit_test(fft_on_a_ring_has_no_shortest_slice),
        cmocka_unit_test(fft_refuses_what_is_no_convolution),
        cmocka_unit_test(crank_nicolson_agrees),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
