/* The hand-written gradients, in every build that this machine can run, against plain Lagrangians
   and their central differences. */
#include "tests/close.h"
#include "apps/bench/hand/hand.h"

#include <stdlib.h>

enum { N = HAND_SLICES, MAX_DOF = 100 };

/* ---- the oracle: one slice at a time, one pair at a time, in long double ---- */

typedef long double real;
typedef real lagrangian(const real *q, const real *v); /* [dof] each; T - V, per body */

static real distance2(const real *q, int a, int b)
{
    real dx = q[2 * a] - q[2 * b], dy = q[2 * a + 1] - q[2 * b + 1];
    return dx * dx + dy * dy + 1e-6L;
}

static real kinetic(int dof, const real *v)
{
    real T = 0;
    for (int k = 0; k < dof; k++)
        T += v[k] * v[k] / 2;
    return T;
}

static real threebody(const real *q, const real *v)
{
    real V = 0;
    for (int b = 1; b < 3; b++)
        for (int a = 0; a < b; a++)
            V -= 1.3e-4L / (sqrtl(distance2(q, a, b)) + 1e-6L);
    return (kinetic(6, v) - V) / 3;
}

static real dblpend(const real *q, const real *v)
{
    real T = v[0] * v[0] + v[1] * v[1] / 2 + v[0] * v[1] * cosl(q[0] - q[1]);
    return T + 2 * cosl(q[0]) + cosl(q[1]);
}

static real ephemeris(const real *q, const real *v)
{
    static const real G = 6.67430e-11L, gm[] = {132712440041.93938e9L, 22031.86855e9L,
                                                324858.592e9L, 398600.435436e9L, 42828.375214e9L};
    real L = 0;
    for (int b = 0; b < 5; b++) {
        L += gm[b] / G * kinetic(3, v + 3 * b);
        for (int a = 0; a < b; a++) {
            real square = 0;
            for (int k = 0; k < 3; k++)
                square += (q[3 * a + k] - q[3 * b + k]) * (q[3 * a + k] - q[3 * b + k]);
            L += gm[a] * gm[b] / G / sqrtl(square);
        }
    }
    return L / 5;
}

static real gas(const real *q, const real *v)
{
    real V = 0;
    for (int b = 1; b < 50; b++)
        for (int a = 0; a < b; a++) {
            real u = 0.04L * 0.04L / distance2(q, a, b);
            V += 1e-4L * (u * u * u - 1) * u * u * u;
        }
    return (kinetic(100, v) - V) / 50;
}

static lagrangian *const lagrangians[HAND_N] = {threebody, dblpend, ephemeris, gas};

/* Of a coordinate, for steps of differences. */
static const double size_of[HAND_N] = {1, 1, 1e11, 1};

static real objective_slice(int scene, const struct hand_kernel *k, const double *x, int i)
{
    int j = i < N - 1 ? i : N - 2;
    real q[MAX_DOF], v[MAX_DOF];
    for (int c = 0; c < k->dof; c++) {
        q[c] = x[c * N + i];
        v[c] = ((real)x[c * N + j + 1] - (real)x[c * N + j]) / (real)k->dt;
    }
    return lagrangians[scene](q, v) / N;
}

static double objective(int scene, const struct hand_kernel *k, const double *x)
{
    real S = 0;
    for (int i = 0; i < N; i++)
        S += objective_slice(scene, k, x, i);
    return (double)S;
}

/* Only slices that coordinate x[at] touches enter; Richardson's extrapolation of steps h and h/2.
 */
static real nearby(int scene, const struct hand_kernel *k, double *x, int at, double h)
{
    double keep = x[at];
    real S[2];
    for (int sign = 0; sign < 2; sign++) {
        x[at] = sign ? keep - h : keep + h;
        S[sign] = 0;
        for (int i = at % N - 2; i <= at % N + 2; i++)
            if (i >= 0 && i < N)
                S[sign] += objective_slice(scene, k, x, i);
    }
    real dx = (real)(keep + h) - (real)(keep - h);
    x[at] = keep;
    return (S[0] - S[1]) / dx;
}

static double difference(int scene, const struct hand_kernel *k, double *x, int at)
{
    const double h = 1e-5 * size_of[scene];
    return (double)((4 * nearby(scene, k, x, at, h / 2) - nearby(scene, k, x, at, h)) / 3);
}

/* ---- paths ---- */

static double uniform(void) { return rand() / (double)RAND_MAX; }

/* Bodies on a jittered lattice wide enough that no pair collides; angles anywhere. */
static void draw(int scene, int dof, double *x)
{
    static const double spacing[HAND_N] = {0.3, 0, 1e11, 0.06};
    static const double jitter[HAND_N] = {0.05, 3, 1e10, 0.008};
    srand(20 + (unsigned)scene);
    for (int c = 0; c < dof; c++) {
        int cell = c % 2 ? c / 2 / 8 : c / 2 % 8;
        for (int i = 0; i < N; i++)
            x[c * N + i] = spacing[scene] * cell + jitter[scene] * (2 * uniform() - 1);
    }
}

/* ---- tests ---- */

static void for_each_build(void (*test)(int scene, const struct hand_kernel *k, double *x))
{
    static double x[MAX_DOF * N];
    const struct hand_kernel *build;
    for (int b = 0; (build = hand_build(b)); b++)
        for (int scene = 0; scene < HAND_N; scene++) {
            draw(scene, build[scene].dof, x);
            test(scene, &build[scene], x);
        }
}

static void check_value(int scene, const struct hand_kernel *k, double *x)
{
    static double g[MAX_DOF * N];
    double expected = objective(scene, k, x);
    assert_close(k->primal(x), expected, 1e-13, 0);
    assert_close(k->gradient(x, g), expected, 1e-13, 0);
}

static void values_are_those_of_the_lagrangian(void **state)
{
    (void)state;
    for_each_build(check_value);
}

static void check_gradient(int scene, const struct hand_kernel *k, double *x)
{
    static double g[MAX_DOF * N];
    static const int slices[] = {0, 1, 2, 47, 95, 96, N - 3, N - 2, N - 1};
    enum { SLICES = sizeof slices / sizeof *slices };
    static double expected[HAND_N][SLICES][MAX_DOF]; /* the same for each build */
    static bool known[HAND_N];
    double largest = 0;
    k->gradient(x, g);
    for (int at = 0; at < k->dof * N; at++)
        largest = fmax(largest, fabs(g[at]));
    for (size_t s = 0; s < SLICES; s++)
        for (int c = 0; c<k->dof; c += k->dof> 10 ? 13 : 1) {
            int at = c * N + slices[s];
            if (!known[scene])
                expected[scene][s][c] = difference(scene, k, x, at);
            assert_close(g[at], expected[scene][s][c], 1e-9, 1e-10 * largest);
        }
    known[scene] = true;
}

static void gradients_are_those_of_central_differences(void **state)
{
    (void)state;
    for_each_build(check_gradient);
}

/* Along u the product is the slope of the gradient; the first is Richardson's of steps h and h/2.
 */
static void check_product(int scene, const struct hand_kernel *k, double *x)
{
    enum { MOST = MAX_DOF * N };
    static double u[MOST], h[MOST], moved[MOST], slope[MOST], g[2][MOST];
    static const double step[HAND_N] = {
        [HAND_THREEBODY] = 1e-4, [HAND_DBLPEND] = 1e-3, [HAND_EPHEMERIS] = 1e8, [HAND_GAS] = 1e-5};
    int n = k->dof * N;
    double largest = 0;
    for (int at = 0; at < n; at++) {
        u[at] = 2 * uniform() - 1;
        h[at] = NAN;
        slope[at] = 0;
    }
    for (int half = 1; half <= 2; half++) {
        for (int sign = 0; sign < 2; sign++) {
            for (int at = 0; at < n; at++)
                moved[at] = x[at] + (sign ? -1 : 1) * step[scene] / half * u[at];
            k->gradient(moved, g[sign]);
        }
        for (int at = 0; at < n; at++)
            slope[at] +=
                (half == 1 ? -1.0 / 3 : 4.0 / 3) * (g[0][at] - g[1][at]) / (2 * step[scene] / half);
    }
    k->product(x, u, h);
    for (int at = 0; at < n; at++)
        largest = fmax(largest, fabs(h[at]));
    for (int at = 0; at < n; at++)
        assert_close(h[at], slope[at], 0, 1e-8 * largest);
}

static void products_are_slopes_of_the_gradient(void **state)
{
    (void)state;
    for_each_build(check_product);
}

/* Whatever is in g before is overwritten, and nothing behind it is touched. */
static void check_overwrites(int scene, const struct hand_kernel *k, double *x)
{
    static double clean[MAX_DOF * N], dirty[MAX_DOF * N + 1];
    size_t n = (size_t)k->dof * N;
    (void)scene;
    for (size_t at = 0; at <= n; at++)
        dirty[at] = NAN;
    k->gradient(x, clean);
    k->gradient(x, dirty);
    assert_memory_equal(clean, dirty, n * sizeof *clean);
    assert_true(isnan(dirty[n]));
}

static void the_gradient_is_written_not_added(void **state)
{
    (void)state;
    for_each_build(check_overwrites);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_the_lagrangian),
        cmocka_unit_test(gradients_are_those_of_central_differences),
        cmocka_unit_test(products_are_slopes_of_the_gradient),
        cmocka_unit_test(the_gradient_is_written_not_added),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
