/* Hand-written adjoints of the discretised action, vectorised over slices. Compiled once for each
   instruction set (HAND_ISA); hand.c chooses.

   Derivation, shared by all: with v_i = (x_{i+1} - x_i) / dt for i < n-1 and v_{n-1} = v_{n-2}, and
   p_i = dL/dv_i / dt, the velocities contribute to dS/dx_i
       -p_0,   p_{i-1} - p_i,   ...,   p_{n-3} - (p_{n-2} + p_{n-1}),   p_{n-2} + p_{n-1}.
   Each slice gathers from its neighbours, nothing is scattered. */
#include "hand.h"

#include <math.h>
#include <string.h>

#define HAND_JOIN(a, b) a##_##b
#define HAND_TABLE(isa) HAND_JOIN(hand_table, isa)

#ifdef __x86_64__ /* glibc has these as vector functions, but declares them so only for            \
                     -ffast-math */
#pragma omp declare simd notinbranch
double sin(double);
#pragma omp declare simd notinbranch
double cos(double);
#endif

enum { N = HAND_SLICES, M = N + 2 };

/* As the tape has its rows: where the stack begins differs from run to run, and with it how many
   vectors would cross a cache line. */
#define ALIGNED _Alignas(64)

/* ---- kinetic energy of a unit mass in the plane: x [2 x N], sum of v^2 / 2 ---- */

static double kinetic(const double *restrict x, double dt)
{
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < N - 1; i++) {
        double dx = x[i + 1] - x[i], dy = x[N + i + 1] - x[N + i];
        sum += dx * dx + dy * dy;
    }
    double dx = x[N - 1] - x[N - 2], dy = x[2 * N - 1] - x[2 * N - 2];
    return 0.5 * (sum + dx * dx + dy * dy) / (dt * dt);
}

/* The ends of one row, as above; returns the squares of the steps the loop over the inside misses.
 */
static double kinetic_ends(const double *x, double scale, double *g)
{
    double last = x[N - 1] - x[N - 2];
    g[0] = -scale * (x[1] - x[0]);
    g[N - 2] -= scale * last;
    g[N - 1] = 2 * scale * last;
    return 2 * last * last;
}

/* Writes g [2 x N], the gradient times `weight`. */
static double kinetic_gradient(const double *restrict x, double dt, double weight,
                               double *restrict g)
{
    double scale = weight / (dt * dt), sum = 0;
#pragma omp simd reduction(+ : sum)
    for (int i = 1; i < N - 1; i++) {
        double dx = x[i] - x[i - 1], dy = x[N + i] - x[N + i - 1];
        g[i] = scale * (dx - (x[i + 1] - x[i]));
        g[N + i] = scale * (dy - (x[N + i + 1] - x[N + i]));
        sum += dx * dx + dy * dy;
    }
    sum += kinetic_ends(x, scale, g) + kinetic_ends(x + N, scale, g + N);
    return 0.5 * sum / (dt * dt);
}

/* ---- three bodies: V = -k sum 1 / (r + eps), r = sqrt(d^2 + soft) ---- */

#define THREEBODY_DT 0.5
#define THREEBODY_K 1.3e-4
#define THREEBODY_EPS 1e-6
#define THREEBODY_SOFT 1e-6
#define THREEBODY_WEIGHT (1.0 / (3 * N))

static inline double distance(double dx, double dy)
{
    return sqrt(dx * dx + dy * dy + THREEBODY_SOFT);
}

static double threebody_primal(const double *x)
{
    double T = 0, V = 0;
    for (int k = 0; k < 6; k += 2)
        T += kinetic(x + k * N, THREEBODY_DT);
#pragma omp simd reduction(+ : V)
    for (int i = 0; i < N; i++) {
        double ax = x[i], ay = x[N + i], bx = x[2 * N + i], by = x[3 * N + i];
        double cx = x[4 * N + i], cy = x[5 * N + i];
        V -= 1 / (distance(ax - bx, ay - by) + THREEBODY_EPS) +
             1 / (distance(ax - cx, ay - cy) + THREEBODY_EPS) +
             1 / (distance(bx - cx, by - cy) + THREEBODY_EPS);
    }
    return THREEBODY_WEIGHT * (T - THREEBODY_K * V);
}

/* q [dof x M]: the path with a slice before and one behind, such that every slice has the same
   kinetic terms: no step before the first, the last step once more (backwards) behind the last. */
static void with_ghosts(int dof, const double *restrict x, double *restrict q)
{
    for (int k = 0; k < dof; k++, x += N, q += M) {
        q[0] = x[0];
        memcpy(q + 1, x, N * sizeof *x);
        q[N + 1] = x[N - 2];
    }
}

static double threebody_gradient(const double *restrict x, double *restrict g)
{
    const double inertia = THREEBODY_WEIGHT / (THREEBODY_DT * THREEBODY_DT);
    const double strength = THREEBODY_WEIGHT * THREEBODY_K;
    ALIGNED double q[6 * M];
    double T = 0, V = 0;
    with_ghosts(6, x, q);
#pragma omp simd reduction(+ : T, V)
    for (int i = 0; i < N; i++) {
        const double *p = q + i;
        double ax = p[1], ay = p[M + 1], bx = p[2 * M + 1], by = p[3 * M + 1];
        double cx = p[4 * M + 1], cy = p[5 * M + 1];
        double abx = ax - bx, aby = ay - by, acx = ax - cx, acy = ay - cy;
        double bcx = bx - cx, bcy = by - cy;
        double rab = distance(abx, aby), rac = distance(acx, acy), rbc = distance(bcx, bcy);
        double uab = 1 / (rab + THREEBODY_EPS), uac = 1 / (rac + THREEBODY_EPS);
        double ubc = 1 / (rbc + THREEBODY_EPS);
        double fab = strength * uab * uab / rab, fac = strength * uac * uac / rac;
        double fbc = strength * ubc * ubc / rbc;
        double force[6] = {-fab * abx - fac * acx, -fab * aby - fac * acy, fab * abx - fbc * bcx,
                           fab * aby - fbc * bcy,  fac * acx + fbc * bcx,  fac * acy + fbc * bcy};
        V -= uab + uac + ubc;
        for (int k = 0; k < 6; k++) {
            double before = p[k * M + 1] - p[k * M], after = p[k * M + 2] - p[k * M + 1];
            T += after * after;
            g[k * N + i] = inertia * (before - after) + force[k];
        }
    }
    for (int k = 0; k < 6; k++)
        g[k * N + N - 2] -= inertia * (x[k * N + N - 1] - x[k * N + N - 2]);
    return THREEBODY_WEIGHT * (0.5 / (THREEBODY_DT * THREEBODY_DT) * T - THREEBODY_K * V);
}

/* ---- double pendulum, m = l = g = 1:
        L = va^2 + vb^2/2 + va vb cos(a - b) + 2 cos a + cos b ---- */

#define DBLPEND_DT 0.06
#define DBLPEND_WEIGHT (1.0 / N)

/* sin and cos of one argument in one loop would be merged into a call that has no vector version.
 */
static void sines(const double *restrict x, double *restrict s)
{
#pragma omp simd
    for (int i = 0; i < 2 * N; i++)
        s[i] = sin(x[i]);
}

static void cosines(const double *restrict x, double *restrict c)
{
#pragma omp simd
    for (int i = 0; i < 2 * N; i++)
        c[i] = cos(x[i]);
}

static void velocities(const double *restrict x, double *restrict v)
{
#pragma omp simd
    for (int i = 0; i < N - 1; i++)
        v[i] = (x[i + 1] - x[i]) * (1 / DBLPEND_DT);
    v[N - 1] = v[N - 2];
}

static double dblpend_primal(const double *x)
{
    const double *a = x, *b = x + N;
    ALIGNED double va[N], vb[N], c[2 * N];
    double sum = 0;
    velocities(a, va);
    velocities(b, vb);
    cosines(x, c);
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < N; i++)
        sum += va[i] * va[i] + 0.5 * vb[i] * vb[i] + va[i] * vb[i] * cos(a[i] - b[i]) + 2 * c[i] +
               c[N + i];
    return DBLPEND_WEIGHT * sum;
}

/* g [N] holds dS/dx; adds the part of the momenta p [N]. */
static void add_momenta(const double *restrict p, double *restrict g)
{
#pragma omp simd
    for (int i = 1; i < N - 1; i++)
        g[i] += p[i - 1] - p[i];
    g[0] -= p[0];
    g[N - 2] -= p[N - 1];
    g[N - 1] += p[N - 2] + p[N - 1];
}

static double dblpend_gradient(const double *restrict x, double *restrict g)
{
    const double w = DBLPEND_WEIGHT, w_dt = DBLPEND_WEIGHT / DBLPEND_DT;
    ALIGNED double va[N], vb[N], pa[N], pb[N], s[2 * N], c[2 * N];
    double sum = 0;
    velocities(x, va);
    velocities(x + N, vb);
    sines(x, s);
    cosines(x, c);
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < N; i++) {
        double sa = s[i], sb = s[N + i], ca = c[i], cb = c[N + i], u = va[i], v = vb[i];
        double cross = ca * cb + sa * sb, turn = u * v * (sa * cb - ca * sb);
        sum += u * u + 0.5 * v * v + u * v * cross + 2 * ca + cb;
        pa[i] = w_dt * (2 * u + v * cross);
        pb[i] = w_dt * (v + u * cross);
        g[i] = w * (-turn - 2 * sa);
        g[N + i] = w * (turn - sb);
    }
    add_momenta(pa, g);
    add_momenta(pb, g + N);
    return w * sum;
}

/* ---- the Sun and the inner planets in space: V = -sum G m_i m_j / r, masses GM / G ---- */

#include "hand_ephemeris.h"

/* ---- Lennard-Jones gas: V = k sum (s/r)^12 - (s/r)^6, r^2 = d^2 + soft ---- */

#define GAS_DT 0.2
#define GAS_K 1e-4
#define GAS_S2 (0.04 * 0.04)
#define GAS_SOFT 1e-6

enum { BODIES = 50, DOF = 2 * BODIES };
#define GAS_WEIGHT (1.0 / (BODIES * N))

/* Slices go through the pair loop a register at a time. 100 slices are twelve eights and a four. */
#define LANES 4
#include "hand_gas.h"
#undef LANES
#ifdef __AVX512F__
#define LANES 8
#include "hand_gas.h"
#undef LANES
enum { EIGHTS = N / 8 * 8 };
#else
enum { EIGHTS = 0 };
#define gas_potential_8 gas_potential_4
#define gas_force_8 gas_force_4
#define gas_product_8 gas_product_4
#endif

static double gas_primal(const double *x)
{
    double T = 0, V = 0;
    for (int k = 0; k < DOF; k += 2)
        T += kinetic(x + k * N, GAS_DT);
    for (int i = 0; i < EIGHTS; i += 8)
        V += gas_potential_8(x + i);
    for (int i = EIGHTS; i < N; i += 4)
        V += gas_potential_4(x + i);
    return GAS_WEIGHT * (T - V);
}

static double gas_gradient(const double *x, double *g)
{
    double T = 0, V = 0;
    for (int k = 0; k < DOF; k += 2)
        T += kinetic_gradient(x + k * N, GAS_DT, GAS_WEIGHT, g + k * N);
    for (int i = 0; i < EIGHTS; i += 8)
        V += gas_force_8(x + i, g + i);
    for (int i = EIGHTS; i < N; i += 4)
        V += gas_force_4(x + i, g + i);
    return GAS_WEIGHT * (T - V);
}

#include "hand_products.h"

extern const struct hand_kernel HAND_TABLE(HAND_ISA)[HAND_N];
const struct hand_kernel HAND_TABLE(HAND_ISA)[HAND_N] = {
    [HAND_THREEBODY] = {"threebody", 6, THREEBODY_DT, threebody_gradient, threebody_primal,
                        threebody_product},
    [HAND_DBLPEND] = {"dblpend", 2, DBLPEND_DT, dblpend_gradient, dblpend_primal, dblpend_product},
    [HAND_EPHEMERIS] = {"ephemeris", EPHEMERIS_DOF, EPHEMERIS_DT, ephemeris_gradient,
                        ephemeris_primal, ephemeris_product},
    [HAND_GAS] = {"gas", DOF, GAS_DT, gas_gradient, gas_primal, gas_product},
};
