/* Patterns of sparse matrices against all entries, and accelerations of many coordinates whose
   masses are coupled against the whole matrix. */
#include "physics/lagrangian/internal.h"
#include "physics/lagrangian/mass.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct ad_error error;

/* ---- patterns ---- */

enum { N = 60 };

/* Entries of a random matrix over (q, v), [2 N x 2 N]: those of a graph of few edges an index. */
static void fill(uint64_t *seed, size_t edges, bool has[N][N], size_t start[2 * N + 1],
                 uint32_t *col)
{
    bool entry[2 * N][2 * N] = {{0}};
    size_t n = 0;
    memset(has, 0, N * sizeof *has);
    for (size_t k = 0; k < edges; k++) {
        *seed = *seed * 6364136223846793005U + 1442695040888963407U;
        size_t i = (*seed >> 33) % (2 * N), j = (*seed >> 45) % (2 * N);
        entry[i][j] = true;
        has[i % N][j % N] = has[j % N][i % N] = true;
    }
    for (size_t i = 0; i < 2 * N; i++) {
        has[i % N][i % N] = true;
        start[i] = n;
        for (uint32_t j = 0; j < 2 * N; j++)
            if (entry[i][j])
                col[n++] = j;
    }
    start[2 * N] = n;
}

static size_t distance(size_t a, size_t b) { return a > b ? a - b : b - a; }

static void patterns_have_what_is_there(void **state)
{
    static bool has[N][N];
    static size_t start[2 * N + 1];
    static uint32_t col[4 * N * N];
    uint64_t seed = 7;
    (void)state;
    for (size_t edges = 0; edges < 6 * N; edges += 17) {
        fill(&seed, edges, has, start, col);
        struct phys_pattern p;
        size_t natural = 0, width = 0;
        assert_true(phys_pattern_new(&p, N, &(struct ad_sparse){2 * N, 2 * N, start, col, NULL}));
        for (size_t i = 0; i < N; i++) {
            assert_int_equal(p.place[p.order[i]], i);
            for (size_t j = 0; j < N; j++) {
                assert_int_equal(phys_pattern_has(&p, i, j), has[i][j]);
                if (has[i][j]) {
                    natural = distance(i, j) > natural ? distance(i, j) : natural;
                    size_t apart = distance(p.place[i], p.place[j]);
                    width = apart > width ? apart : width;
                }
                for (size_t k = 0; k < j; k++)
                    assert_true(!has[i][j] || !has[i][k] || p.colour[j] != p.colour[k]);
            }
        }
        assert_int_equal(p.width, width);
        assert_true(width <= natural);
        phys_pattern_free(&p);
    }
}

/* ---- masses ---- */

enum { SITES = 150, STEP = 7 }; /* site k is coordinate STEP k */

static size_t coordinate(size_t site) { return STEP * site % SITES; }

/* Above 1 this couples velocities of sites that are far from each other. */
static double far_coupling(double x) { return x > 1 ? (x - 1) * (x - 1) : 0; }

/* A ring with M_kk = 2 + q_k^2 / 2, M_k,k+1 = sin(q_k) / 3, V = -sum of q_k k; sites 3 and 90 are
   coupled where q_3 > 1. */
static ad_var ring(ad_var q, ad_var v, ad_var t, const void *params)
{
    uint32_t site[SITES], next[SITES];
    double force[SITES];
    (void)t, (void)params;
    for (size_t k = 0; k < SITES; k++) {
        site[k] = (uint32_t)coordinate(k);
        next[k] = (uint32_t)coordinate(k + 1);
        force[site[k]] = (double)k;
    }
    ad_var u = ad_gather_rows(v, SITES, site), x = ad_gather_rows(q, SITES, site);
    ad_var L = ad_sum_rows(ad_mul(ad_add(1, ad_mul(0.25, ad_square(q))), ad_square(v)));
    L = ad_add(
        L, ad_sum_rows(ad_mul(ad_div(ad_sin(x), 3), ad_mul(u, ad_gather_rows(v, SITES, next)))));
    ad_var at = ad_row(x, 3), both = ad_mul(ad_row(u, 3), ad_row(u, 90));
    L = ad_add(L, ad_select(ad_gt(at, 1), ad_mul(ad_square(ad_sub(at, 1)), both), 0));
    return ad_add(L, ad_sum_rows(ad_mul(ad_const(q.tape, SITES, 1, force), q)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *e)
{
    (void)params, (void)seed, (void)e;
    for (size_t k = 0; k < SITES; k++)
        q[k] = v[k] = 0;
    return AD_OK;
}

static void mass_of(const double *q, double *M)
{
    memset(M, 0, SITES * SITES * sizeof *M);
    for (size_t k = 0; k < SITES; k++) {
        size_t i = coordinate(k), j = coordinate(k + 1);
        M[i * SITES + i] = 2 + q[i] * q[i] / 2;
        M[i * SITES + j] = M[j * SITES + i] = sin(q[i]) / 3;
    }
    size_t i = coordinate(3), j = coordinate(90);
    M[i * SITES + j] = M[j * SITES + i] = far_coupling(q[i]);
}

static void coupled_masses_are_solved(void **state)
{
    const struct phys_scene scene = scene_of("ring", SITES, ring, 10, 0.1, start);
    struct phys_system system;
    phys_motion *motion;
    phys_legendre *legendre;
    static double M[SITES * SITES];
    (void)state;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_motion_new(&system, &motion, &error), AD_OK);
    assert_int_equal(phys_legendre_new(&system, &legendre, &error), AD_OK);
    struct phys_pattern p;
    assert_true(phys_coupling_new(&p, &system, true, 4));
    assert_in_range(p.colours, 3, 6);
    assert_in_range(p.width, 2, 8); /* as numbered 143 */
    phys_pattern_free(&p);
    for (size_t place = 0; place < 4; place++) {
        double q[SITES], v[SITES] = {0}, a[SITES], b[SITES], momentum[SITES];
        for (size_t k = 0; k < SITES; k++)
            q[k] = sin(1.3 * (double)(k + 31 * place));
        q[coordinate(3)] = place % 2 ? 1.9 : 0.4;
        for (size_t k = 0; k < SITES; k++)
            b[coordinate(k)] = (double)k;
        assert_int_equal(phys_motion_acceleration(motion, q, v, 0, a, &error), AD_OK);
        mass_of(q, M);
        for (size_t i = 0; i < SITES; i++) {
            double sum = 0, size = 0;
            for (size_t j = 0; j < SITES; j++) {
                sum += M[i * SITES + j] * a[j];
                size += fabs(M[i * SITES + j] * a[j]);
            }
            assert_close(sum, b[i], 0, 1e-14 * (size + fabs(b[i])));
        }
        for (size_t k = 0; k < SITES; k++)
            v[k] = cos(2.1 * (double)k);
        phys_legendre_momentum(legendre, q, v, 0, momentum, NULL);
        assert_int_equal(phys_legendre_velocity(legendre, q, momentum, 0, a, &error), AD_OK);
        for (size_t k = 0; k < SITES; k++)
            assert_close(a[k], v[k], 0, 1e-13);
        assert_int_equal(phys_legendre_negative(legendre, q, v, 0), 0);
    }
    phys_legendre_free(legendre);
    phys_motion_free(motion);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(patterns_have_what_is_there),
                                       cmocka_unit_test(coupled_masses_are_solved)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
