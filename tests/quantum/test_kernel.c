/* The kernel: element by element against closed forms, aliasing where it is predicted, walls. */
#include "waves.h"
#include "quantum/internal.h"
#include "tests/mentions.h"

#include <stdlib.h>

static const struct parameter weightless[] = {{"g", 0}};

static qm_complex *kernel_of(const struct qm_slice *slice)
{
    struct ad_error error = {0};
    qm_complex *K = malloc(slice->grid.n * slice->grid.n * sizeof *K);
    assert_non_null(K);
    qm_kernel(slice, K, &error);
    assert_no_error(&error);
    return K;
}

/* Largest distance of K from dx times the exact kernel. */
static double kernel_error(const struct qm_slice *slice, const struct qm_quadratic *exact, double t)
{
    size_t n = slice->grid.n;
    double largest = 0, dx = qm_dx(&slice->grid);
    qm_complex *K = kernel_of(slice);
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            qm_complex expected = dx * qm_exact_kernel(exact, slice->hbar, qm_x(&slice->grid, a),
                                                       qm_x(&slice->grid, b), t);
            largest = fmax(largest, cabs(K[a * n + b] - expected) / cabs(expected));
        }
    free(K);
    return largest;
}

static void free_kernel_is_exact(void **state)
{
    (void)state;
    static const char *const rules[] = {"left", "midpoint", "trapezoid"};
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-7, 9, 100}, QM_OPEN, 0, 1.3, 0.7, 2};
    for (size_t k = 0; k < 3; k++) {
        slice.rule = rule_named(rules[k]);
        assert_close(kernel_error(&slice, &(struct qm_quadratic){1, 0, 0}, slice.dt), 0, 0, 1e-12);
    }
    phys_system_close(&system);
}

/* One slice of the trapezoid rule is Mehler's kernel of an oscillator of another mass M and
   frequency W, that of the leapfrog: cos W dt = 1 - (w dt)^2/2, M W dt = m sin W dt. */
static void oscillator_is_mehler(void **state)
{
    (void)state;
    static const struct parameter values[] = {{"m", 1.7}, {"k", 2.3}};
    struct phys_system system = system_with("spring", 2, values);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-3, 2.5, 90}, QM_OPEN, 0, 0.9, 1.1, 1};
    double w2 = 2.3 / 1.7, angle = acos(1 - w2 * slice.dt * slice.dt / 2), W = angle / slice.dt;
    struct qm_quadratic leapfrog = {1.7 * sin(angle) / angle, W * W, 0};
    assert_close(kernel_error(&slice, &leapfrog, slice.dt), 0, 0, 1e-12);
    /* and Mehler's own kernel but for what a path bends between its ends: dt to the first power */
    double before = 0;
    slice.dt /= 4;
    for (int k = 0; k < 3; k++, slice.dt /= 2) {
        double e = kernel_error(&slice, &(struct qm_quadratic){1.7, w2, 0}, slice.dt);
        if (k > 0)
            assert_close(before / e, 2, 0.06, 0);
        before = e;
    }
    phys_system_close(&system);
}

/* In uniform gravity a straight path misses the action of the parabola by a constant. */
static void gravity_misses_a_phase(void **state)
{
    (void)state;
    static const struct parameter values[] = {{"m", 1.7}, {"g", 2.1}};
    struct phys_system system = system_with("freebody", 2, values);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-3, 2.5, 64}, QM_OPEN, 0, 0.9, 1.1, 1};
    struct qm_quadratic exact = {1.7, 0, 2.1};
    qm_complex *K = kernel_of(&slice);
    double missing = 1.7 * 2.1 * 2.1 * pow(slice.dt, 3) / 24 / slice.hbar;
    for (size_t k = 0; k < 64; k += 7) {
        qm_complex e = qm_dx(&slice.grid) * qm_exact_kernel(&exact, 1.1, qm_x(&slice.grid, k),
                                                            qm_x(&slice.grid, 63 - k), slice.dt);
        qm_complex ratio = K[k * 64 + 63 - k] / e;
        assert_close(cabs(ratio - cexp(I * missing)), 0, 0, 1e-12);
    }
    free(K);
    phys_system_close(&system);
}

/* ---- aliasing ---- */

static struct qm_aliasing aliasing_of(const struct qm_slice *slice)
{
    struct qm_aliasing aliasing;
    struct ad_error error = {0};
    qm_aliasing(slice, &aliasing, &error);
    assert_no_error(&error);
    return aliasing;
}

static void aliasing_is_foreseen(void **state)
{
    (void)state;
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-10, 10, 256}, QM_OPEN, 0, 0.5, 1, 1};
    double dx = 20.0 / 256, limit = (20 - 2 * dx) * dx / M_PI; /* from first to last but one */
    struct qm_aliasing a = aliasing_of(&slice);
    assert_close(a.dt_least, limit, 1e-2, 0);
    assert_close(a.ratio, a.dt_least / 0.5, 1e-8, 0);
    assert_close(a.ghost, 2 * M_PI * 0.5 / dx, 1e-12, 0);
    slice.dt = a.dt_least;
    assert_close(aliasing_of(&slice).ratio, 1, 1e-8, 0);
    slice.dt = 0.125;
    a = aliasing_of(&slice);
    slice.grid.n = (size_t)ceil(20 / a.dx_most);
    assert_true(aliasing_of(&slice).ratio < 1);
    phys_system_close(&system);
}

/* A packet of width 1/2 to t = 1 in a box of 20 on 256 points, slice by slice. */
static void aliasing_strikes_where_foreseen(void **state)
{
    (void)state;
    static const struct {
        double dt, least, most; /* error of psi */
    } cases[] = {{0.5, 0, 2e-15}, {0.25, 1e-10, 2e-9}, {0.125, 10, 30}};
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-10, 10, 256}, QM_OPEN, 0, 0, 1, 1};
    for (size_t k = 0; k < 3; k++) {
        slice.dt = cases[k].dt;
        double error = packet_error(&qm_method_kernel, &slice, &(struct qm_quadratic){1, 0, 0},
                                    &(struct qm_gaussian){0, 0.5, 0}, (size_t)(1 / slice.dt));
        assert_true(error >= cases[k].least && error <= cases[k].most);
    }
    phys_system_close(&system);
}

/* The ghost of a packet stands where it is said to: the norm between here and there is next to
   nothing. */
static void ghosts_stand_where_said(void **state)
{
    (void)state;
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-10, 10, 256}, QM_OPEN, 0, 0.06, 1, 1};
    double ghost = aliasing_of(&slice).ghost;
    qm_complex psi[256];
    qm_packet(&slice.grid, 1, &(struct qm_gaussian){-2, 0.4, 0}, 1, 0, psi);
    move(&qm_method_kernel, &slice, 1, 1, psi);
    struct qm_grid here = {-10, 10, 256};
    size_t best = 0;
    double target = -2 + ghost;
    for (size_t a = 0; a < 256; a++)
        if (qm_x(&here, a) > -2 + ghost / 2 && cabs(psi[a]) > cabs(psi[best]) * 0.999 &&
            qm_x(&here, a) < -2 + 1.5 * ghost)
            best = a;
    assert_true(ghost > 3);
    assert_close(qm_x(&here, best), target, 0, qm_dx(&here));
    phys_system_close(&system);
}

/* ---- walls ---- */

static double norm_after(struct qm_slice *slice, const struct qm_gaussian *packet, size_t steps)
{
    size_t n = slice->grid.n;
    qm_complex *psi = malloc(n * sizeof *psi);
    assert_non_null(psi);
    qm_packet(&slice->grid, slice->hbar, packet, 1, 0, psi);
    double before = qm_moments(&slice->grid, 1, psi).norm;
    move(&qm_method_kernel, slice, steps, 1, psi);
    double after = qm_moments(&slice->grid, 1, psi).norm;
    free(psi);
    return after / before;
}

/* Where the box is a whole number of ghosts long, or half of one, K is unitary on the grid whatever
   the potential. */
static void norm_is_kept_between_walls(void **state)
{
    (void)state;
    static const struct parameter stiff[] = {{"k", 3}};
    struct phys_system system = system_with("spring", 1, stiff);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-6, 6, 128}, QM_REFLECT, 0, 0, 1, 1};
    slice.dt = 12 * qm_dx(&slice.grid) / M_PI; /* the mirrored ring of 24 is one ghost long */
    assert_close(norm_after(&slice, &(struct qm_gaussian){2, 0.5, 3}, 300), 1, 1e-12, 0);
    slice.walls = QM_RING;
    slice.dt *= 2;
    assert_close(norm_after(&slice, &(struct qm_gaussian){2, 0.5, 3}, 300), 1, 1e-12, 0);
    phys_system_close(&system);
}

/* A particle in a box of length L is back where it was after 4 L^2 / pi, by ten squarings. */
static void box_revives(void **state)
{
    (void)state;
    enum { N = 128, TIMES = 9 };
    struct ad_error error = {0};
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {0, 5, N}, QM_REFLECT, 0, 25 / (M_PI * N), 1, 2};
    assert_close(ldexp(slice.dt, TIMES), 4 * 25 / M_PI, 1e-14, 0);
    static qm_complex K[N * N], start[N], end[N], half[N];
    qm_packet(&slice.grid, 1, &(struct qm_gaussian){1.4, 0.2, 2}, 1, 0, start);
    qm_kernel(&slice, K, &error);
    qm_kernel_square(N, TIMES - 1, K, &error);
    assert_no_error(&error);
    for (size_t a = 0; a < N; a++)
        for (size_t b = 0; b < N; b++)
            half[a] += K[a * N + b] * start[b];
    for (size_t a = 0; a < N; a++)
        for (size_t b = 0; b < N; b++)
            end[a] += K[a * N + b] * half[b];
    assert_close(distance(N, start, end), 0, 0, 1e-9);
    /* half way it is its own mirror image, upside down */
    for (size_t a = 0; a < N; a++)
        end[a] = -start[N - 1 - a];
    assert_close(distance(N, half, end), 0, 0, 1e-9);
    phys_system_close(&system);
}

/* Two hundred slices, each a tenth of what the grid allows. */
static void short_slices_are_right(void **state)
{
    (void)state;
    enum { N = 256, STEPS = 200 };
    struct ad_error error = {0};
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-15, 15, N}, QM_RING, 0, 0.01, 1, 2};
    struct qm_gaussian packet = {-3, 1, 3};
    static qm_complex K[N * N], psi[2][N];
    assert_true(aliasing_of(&slice).ratio > 10);
    qm_kernel_short(&slice, K, &error);
    assert_no_error(&error);
    qm_packet(&slice.grid, 1, &packet, 1, 0, psi[0]);
    for (size_t k = 0; k < STEPS; k++)
        qm_kernel_apply(N, K, 1, psi[k % 2], psi[1 - k % 2]);
    qm_exact_packet(&(struct qm_quadratic){1, 0, 0}, 1, &packet, 2, &slice.grid, psi[1]);
    assert_close(distance(N, psi[0], psi[1]), 0, 0, 1e-6);
    phys_system_close(&system);
    system = system_with("spring", 0, NULL);
    slice.system = &system;
    assert_int_equal(qm_kernel_short(&slice, K, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

static void absorbing_layers_absorb(void **state)
{
    (void)state;
    struct phys_system system = system_with("freebody", 1, weightless);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-10, 10, 256}, QM_OPEN, 4, 0.5, 1, 1};
    struct qm_gaussian packet = {0, 0.8, 6};
    assert_true(norm_after(&slice, &packet, 1) > 0.999);
    assert_true(norm_after(&slice, &packet, 8) < 1e-5);
    const size_t n = slice.grid.n;
    double *mask = malloc(n * sizeof *mask);
    assert_non_null(mask);
    qm_absorber(&slice, mask);
    qm_complex *absorbing = kernel_of(&slice), *open = (slice.absorb = 0, kernel_of(&slice));
    for (size_t k = 0; k < n * n; k++) /* from the first row to the last */
        assert_close(cabs(absorbing[k]), mask[k / n] * cabs(open[k]), 1e-12, 0);
    free(absorbing);
    free(open);
    free(mask);
    phys_system_close(&system);
}

/* ---- what is refused ---- */

static void refused(const struct qm_slice *slice, const char *why)
{
    struct ad_error error = {0};
    qm_complex K[64 * 64];
    assert_int_equal(qm_kernel(slice, K, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, why);
}

static void misuse_is_refused(void **state)
{
    (void)state;
    struct phys_system system = system_with("spring", 0, NULL),
                       plane = system_with("dblpend", 0, NULL);
    struct qm_slice good = {.size = sizeof good, &system, NULL, {-3, 3, 64}, QM_OPEN, 0, 0.5, 1, 1},
                    bad;
    bad = good, bad.dt = 0;
    refused(&bad, "dt 0");
    bad = good, bad.hbar = (double)NAN;
    refused(&bad, "hbar");
    bad = good, bad.grid.high = -4;
    refused(&bad, "box");
    bad = good, bad.grid.n = 3;
    refused(&bad, "points 4");
    bad = good, bad.absorb = 4;
    refused(&bad, "half box");
    bad = good, bad.system = &plane;
    refused(&bad, "scene one");
    bad = good, bad.rule = rule_named("gauss2");
    refused(&bad, "straight");
    bad = good, bad.rule = rule_named("midpoint"), bad.walls = QM_REFLECT;
    refused(&bad, "folded");
    phys_system_close(&system);
    phys_system_close(&plane);
}

/* Threads change no bit. */
static void threads_change_nothing(void **state)
{
    (void)state;
    struct phys_system system = system_with("spring", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-6, 6, 300}, QM_REFLECT, 0, 0.2, 1, 1};
    qm_complex *one = kernel_of(&slice);
    slice.threads = 3;
    qm_complex *three = kernel_of(&slice);
    assert_memory_equal(one, three, 300 * 300 * sizeof *one);
    free(one);
    free(three);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(free_kernel_is_exact),
        cmocka_unit_test(oscillator_is_mehler),
        cmocka_unit_test(gravity_misses_a_phase),
        cmocka_unit_test(aliasing_is_foreseen),
        cmocka_unit_test(aliasing_strikes_where_foreseen),
        cmocka_unit_test(ghosts_stand_where_said),
        cmocka_unit_test(norm_is_kept_between_walls),
        cmocka_unit_test(box_revives),
        cmocka_unit_test(short_slices_are_right),
        cmocka_unit_test(absorbing_layers_absorb),
        cmocka_unit_test(misuse_is_refused),
        cmocka_unit_test(threads_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
