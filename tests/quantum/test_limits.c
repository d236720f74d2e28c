/* Limits between quantum and classical mechanics: tunnelling, which no classical path describes,
   from states and from the kernel; and small hbar, where the stationary path dominates. */
#include "waves.h"
#include "physics/physics.h"

#include <stdlib.h>

/* ---- tunnelling ---- */

enum { N = 384 };
static const double planck = 0.7;

/* The splitting of the lowest two levels by differences on two grids, extrapolated. */
static double splitting(const struct phys_system *system)
{
    double energy[2], level[2];
    static double psi[2 * 3 * N];
    struct ad_error error = {0};
    for (size_t k = 0; k < 2; k++) {
        struct qm_grid grid = {-3.5, 3.5, k ? 3 * N : N};
        qm_eigenstates(system, &grid, planck, 2, energy, psi, &error);
        assert_no_error(&error);
        level[k] = energy[1] - energy[0];
    }
    return (9 * level[1] - level[0]) / 8;
}

/* The lowest two states on the grid of the kernel, and the energies that K turns them by: from
   <psi|K|psi> = exp(-i E dt / hbar) but for dt^2. */
static double splitting_of_kernel(const struct qm_slice *slice)
{
    static double states[2 * N];
    static qm_complex K[N * N], psi[N], moved[N];
    double energy[2], turned[2];
    struct ad_error error = {0};
    qm_eigenstates(slice->system, &slice->grid, slice->hbar, 2, energy, states, &error);
    qm_kernel(slice, K, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < 2; k++) {
        for (size_t a = 0; a < N; a++)
            psi[a] = states[k * N + a];
        qm_kernel_apply(N, K, 1, psi, moved);
        turned[k] = -carg(qm_overlap(&slice->grid, 1, psi, moved)) * slice->hbar / slice->dt;
    }
    return turned[1] - turned[0];
}

static void splitting_is_the_same_twice(void **state)
{
    (void)state;
    struct phys_system system = system_with("double-well", 0, NULL);
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-3.5, 3.5, N}, QM_REFLECT, 0, 0, planck, 1};
    double expected = splitting(&system), found[2];
    for (size_t k = 0; k < 2; k++) {
        slice.dt = k ? 0.06 : 0.12;
        found[k] = splitting_of_kernel(&slice);
    }
    assert_close((4 * found[1] - found[0]) / 3, expected, 0.005, 0);
    phys_system_close(&system);
}

/* A packet in the left well is in the right one after pi hbar / splitting, and back after twice as
   long: far times by squaring. The particle of the same Lagrangian never is. */
static void packet_tunnels(void **state)
{
    (void)state;
    enum { TIMES = 10 };
    struct ad_error error = {0};
    struct phys_system system = system_with("double-well", 0, NULL);
    static double states[2 * N];
    static qm_complex K[N * N], left[N], right[N], moved[N];
    struct qm_slice slice = {
        .size = sizeof slice, &system, NULL, {-3.5, 3.5, N}, QM_REFLECT, 0, 0, planck, 1};
    double energy[2], time = M_PI * slice.hbar / splitting(&system);
    slice.dt = ldexp(time, -TIMES);
    qm_eigenstates(&system, &slice.grid, slice.hbar, 2, energy, states, &error);
    qm_kernel(&slice, K, &error);
    qm_kernel_square(N, TIMES, K, &error);
    assert_no_error(&error);
    double side = states[N / 4] * states[N + N / 4] > 0 ? 1 : -1;
    for (size_t a = 0; a < N; a++) {
        left[a] = (states[a] + side * states[N + a]) * M_SQRT1_2;
        right[a] = (states[a] - side * states[N + a]) * M_SQRT1_2;
    }
    assert_true(qm_moments(&slice.grid, 1, left).mean_x < -1);
    qm_kernel_apply(N, K, 1, left, moved);
    assert_close(cabs(qm_overlap(&slice.grid, 1, right, moved)), 1, 1e-4, 0);
    assert_close(qm_moments(&slice.grid, 1, moved).norm, 1, 1e-4, 0);
    qm_kernel_apply(N, K, 1, moved, right);
    assert_close(cabs(qm_overlap(&slice.grid, 1, left, right)), 1, 1e-4, 0);
    assert_true(energy[1] < 2); /* the barrier */
    phys_system_close(&system);
}

/* ---- stationary phase ---- */

enum { SLICES = 65 };
static const double span = 4;

static struct phys_path_settings settings(void)
{
    return (struct phys_path_settings){.size = sizeof(struct phys_path_settings),
                                       .rule = rule_named("trapezoid"),
                                       .slices = SLICES,
                                       .steps = 50,
                                       .dt = span / (SLICES - 1),
                                       .learning_rate = 1,
                                       .tolerance = 1e-13};
}

static size_t index_of(const struct phys_system *system, const double *path)
{
    struct ad_error error = {0};
    struct phys_spectrum spectrum;
    struct phys_path_settings s = settings();
    phys_path_spectrum(system, &s, path, &spectrum, &error);
    assert_no_error(&error);
    size_t index = spectrum.index;
    phys_spectrum_free(&spectrum);
    return index;
}

/* The action of the stationary path from x_b to x_a, near `path`, in the same slices and by the
   same rule as the kernel's. */
static double action_between(const struct phys_system *system, const double *path, double shift_b,
                             double shift_a)
{
    double moved[SLICES];
    struct ad_error error = {0};
    struct phys_path_info info;
    struct phys_path_settings how = settings();
    for (size_t i = 0; i < SLICES; i++) {
        double share = (double)i / (SLICES - 1);
        moved[i] = path[i] + (1 - share) * shift_b + share * shift_a;
    }
    phys_path_solve(phys_solver_find("newton", &error), system, &how, moved, &info, &error);
    assert_no_error(&error);
    return info.action;
}

/* psi at the end of the path, of a packet that starts at its other end, by stationary phase: S to
   second order in x_b, van Vleck's determinant, and a quarter of a turn for every focus on the way.
 */
static qm_complex stationary_phase(const struct phys_system *system, const double *path,
                                   double sigma, double hbar, double *momentum)
{
    const double h = 1e-3;
    double S[3][3];
    for (int b = -1; b <= 1; b++)
        for (int a = -1; a <= 1; a++)
            S[b + 1][a + 1] = action_between(system, path, b * h, a * h);
    double mixed = -(S[2][2] - S[2][0] - S[0][2] + S[0][0]) / (4 * h * h);
    double bend = (S[2][1] - 2 * S[1][1] + S[0][1]) / (h * h);
    *momentum = -(S[2][1] - S[0][1]) / (2 * h);
    assert_int_equal(mixed < 0, index_of(system, path) % 2);
    qm_complex width = 1 / (4 * sigma * sigma) - I * bend / (2 * hbar);
    double turned = M_PI / 4 + M_PI / 2 * (double)index_of(system, path);
    return sqrt(fabs(mixed) / (2 * M_PI * hbar)) * cexp(I * (S[1][1] / hbar - turned)) *
           pow(2 * M_PI * sigma * sigma, -0.25) * csqrt(M_PI / width);
}

static qm_complex by_the_kernel(const struct phys_system *system, const double *path, double sigma,
                                double hbar, double momentum)
{
    enum { POINTS = 8191 };
    static qm_complex psi[POINTS];
    struct qm_slice slice = {
        .size = sizeof slice, .system = system, .dt = span / (SLICES - 1), .hbar = hbar};
    double dx = 4.0 / POINTS; /* a point lies at the end of the path */
    slice.grid.low = path[SLICES - 1] - ((POINTS / 2) + 0.5) * dx;
    slice.grid.high = slice.grid.low + 4;
    slice.grid.n = POINTS;
    qm_packet(&slice.grid, hbar, &(struct qm_gaussian){path[0], sigma, momentum}, 1, 0, psi);
    move(&qm_method_fft, &slice, SLICES - 1, 1, psi);
    return psi[POINTS / 2];
}

/* Amplitude and phase, of dozens of turns and several foci: what is left over falls with hbar. */
static void small_hbar_is_the_stationary_path(void **state)
{
    (void)state;
    struct phys_system system = system_with("double-well", 0, NULL);
    struct ad_error error = {0};
    double path[SLICES], before = 0;
    phys_motion_path(&system, NULL, (double[]){-1.2}, (double[]){0.3}, SLICES, span / (SLICES - 1),
                     path, &error);
    assert_no_error(&error);
    for (int k = 0; k < 3; k++) {
        double hbar = ldexp(0.04, -k), sigma = sqrt(hbar) / 2, momentum;
        qm_complex expected = stationary_phase(&system, path, sigma, hbar, &momentum);
        qm_complex found = by_the_kernel(&system, path, sigma, hbar, momentum);
        double off = cabs(found / expected - 1);
        assert_true(k == 0 || off < 0.7 * before);
        before = off;
    }
    assert_true(before < 0.01);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splitting_is_the_same_twice),
        cmocka_unit_test(packet_tunnels),
        cmocka_unit_test(small_hbar_is_the_stationary_path),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
