/* Damped Newton steps: (H - i m) x = b by block elimination, put back into the equations. */
#include "physics/path/inertia.h"
#include "physics/path/newton_system.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

/* Largest entry of (D^-1 H D^-1 - i m) x - b over the unknowns. */
static double residual(const struct phys_hessian *h, size_t hold, const double *scale, double m,
                       const double *x, const double *b)
{
    size_t stride = h->table.degree * h->dof, first = ((hold - 1) * h->table.degree + 1) * h->dof;
    size_t n = ((h->elements + 1 - 2 * hold) * h->table.degree + h->table.degree - 1) * h->dof;
    double complex *r = malloc(n * sizeof *r);
    double most = 0;
    for (size_t k = 0; k < n; k++)
        r[k] = -(double complex)b[k] - I * m * (x[2 * k] + I * x[2 * k + 1]);
    for (size_t e = 0; e < h->elements; e++)
        for (size_t i = 0; i < h->side; i++)
            for (size_t j = 0; j < h->side; j++) {
                size_t row = e * stride + i - first, col = e * stride + j - first;
                if (row < n && col < n)
                    r[row] +=
                        phys_hessian_entry(h, e, i / h->dof, i % h->dof, j / h->dof, j % h->dof) *
                        scale[i % h->dof] * scale[j % h->dof] * (x[2 * col] + I * x[2 * col + 1]);
            }
    for (size_t k = 0; k < n; k++)
        most = fmax(most, cabs(r[k]));
    free(r);
    return most;
}

static void damped_equations_are_solved(void **state)
{
    static const struct {
        const char *rule;
        size_t slices, hold;
        double damping;
    } cases[] = {{"left", 12, 1, 0.3},   {"left", 3, 1, 1e-5},   {"midpoint", 12, 4, 10},
                 {"gauss2", 12, 1, 0.3}, {"gauss5", 9, 2, 1e-3}, {"gauss3", 3, 1, 0.3}};
    const double scale[] = {0.7, 1.3};
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open("dblpend", &system, &error);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const struct phys_rule *rule = phys_rule_find(cases[k].rule, &error);
        struct phys_hessian h;
        struct phys_block_tridiagonal blocks;
        size_t n = rule->degree * 2 * cases[k].slices;
        phys_hessian_new(&h, &system, rule, cases[k].slices, 0.4, NULL, &error);
        assert_no_error(&error);
        double *path = malloc(2 * n * sizeof *path), *b = path + n;
        for (size_t i = 0; i < n; i++)
            path[i] = b[i] = sin(1.3 * (double)i);
        phys_hessian_at(&h, path, 0);
        assert_true(phys_block_tridiagonal_new(&blocks, &h, cases[k].hold, scale));
        assert_true(phys_block_tridiagonal_factor(&blocks, cases[k].damping));
        phys_block_tridiagonal_solve(&blocks, path);
        double r = residual(&h, cases[k].hold, scale, cases[k].damping, blocks.right, b);
        assert_close(r, 0, 0, 1e-12);
        assert_true(path[0] == blocks.right[0]);
        phys_block_tridiagonal_free(&blocks);
        phys_hessian_free(&h);
        free(path);
    }
    phys_system_close(&system);
}

enum { SITES = 24 };

static bool ring; /* the chain is closed, and its coordinates are out of order */

static ad_var chain(ad_var q, ad_var v, ad_var t, const void *params)
{
    uint32_t next[2][SITES];
    for (uint32_t k = 0; k < SITES; k++)
        for (uint32_t i = 0; i < 2; i++)
            next[i][k] = (k + i) % SITES * (ring ? 7 : 1) % SITES;
    size_t bonds = ring ? SITES : SITES - 1;
    ad_var apart = ad_sub(ad_gather_rows(q, bonds, next[1]), ad_gather_rows(q, bonds, next[0]));
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), ad_sum_rows(ad_cosh(apart)));
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    for (size_t k = 0; k < SITES; k++)
        q[k] = v[k] = 0;
    return AD_OK;
}

/* C12: where neighbours alone are coupled, steps go by blocks whose inner nodes are bands, or by
   coordinate where that is less work, as with one node an element; with all coordinates taken as
   coupled, node by node, or by full blocks. */
static void a_band_solves_what_blocks_do(void **state)
{
    static const char *const rules[] = {"left", "midpoint", "gauss2", "gauss4"};
    static const double damping[] = {0.2, 1e-4, 0};
    const struct phys_scene scene = scene_of("chain", SITES, chain, 41, 0.1, start);
    enum { TIMES = 41, MOST = 4 * SITES * TIMES };
    struct phys_system system;
    struct ad_error error = {0};
    static double path[MOST], gradient[MOST], step[2][MOST];
    (void)state;
    for (size_t k = 0; k < MOST; k++) {
        path[k] = sin(1.3 * (double)k);
        gradient[k] = cos(2.1 * (double)k);
    }
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    for (size_t r = 0; r < 2 * LENGTH(rules) * LENGTH(damping); r++) {
        const struct phys_rule *rule = phys_rule_find(rules[r / 2 / LENGTH(damping)], &error);
        const double m = damping[r / 2 % LENGTH(damping)];
        double size = 0;
        ring = r % 2;
        for (int full = 0; full < 2; full++) {
            struct phys_derivatives of;
            struct phys_hessian h;
            struct phys_newton_system newton;
            assert_int_equal(phys_derivatives_new(&of, &system, TIMES, NULL, &error), AD_OK);
            if (full) {
                phys_pattern_free(&of.coupling);
                assert_true(phys_pattern_new(&of.coupling, SITES, NULL));
            }
            assert_int_equal(phys_hessian_over(&h, &of, rule, TIMES, 0.1, &error), AD_OK);
            assert_int_equal(phys_newton_system_new(&newton, &h, 1, &error), AD_OK);
            phys_hessian_at(&h, path, 0);
            phys_hessian_at(&h, path, 0); /* nothing is left of the first time */
            if (full) {
                h.reach = SITES - 1;
            } else {
                assert_int_equal(h.reach, ring ? 2 : 1);
                assert_int_equal(h.width, ring ? 5 : 3); /* C12: matrices grow as the sites */
            }
            phys_newton_system_scale(&newton);
            const double bytes = phys_newton_system_bytes(&newton);
            assert_true(phys_newton_system_factor(&newton, m));
            if (m > 0 && !full && !newton.by_blocks) /* C12: what is said to be needed is taken */
                assert_close(sizeof(double) * (double)newton.room, bytes, 0, 1e-12);
            assert_true(newton.by_blocks == (full ? m > 0 : rule->degree > 1) || ring);
            phys_newton_system_step(&newton, gradient, step[full]);
            size = phys_newton_system_norm(&newton, step[0]);
            phys_newton_system_free(&newton);
            phys_hessian_free(&h);
            phys_derivatives_free(&of);
        }
        for (size_t k = 0; k < rule->degree * SITES * TIMES; k++)
            assert_close(step[0][k], step[1][k], 0, 1e-10 * size);
    }
    phys_system_close(&system);
}

enum { SLICES = 9, DOF = 6, DEGREE = 5 };

/* At the nodes that move, the largest part of H x + g relative to its terms; elsewhere x is 0. */
static double step_residual(const struct phys_hessian *h, size_t hold, const double *g,
                            const double *x)
{
    double sum[(SLICES * DEGREE + 1) * DOF] = {0}, most = 0, size = 1;
    size_t degree = h->table.degree, n = h->dof, last = h->elements * degree;
#define AT(node, d) (((node) % degree * n + (d)) * SLICES + (node) / degree)
    for (size_t e = 0; e < h->elements; e++)
        for (size_t i = 0; i < h->side; i++)
            for (size_t j = 0; j < h->side; j++) {
                double term = phys_hessian_entry(h, e, i / n, i % n, j / n, j % n) *
                              x[AT(e * degree + j / n, j % n)];
                sum[e * degree * n + i] += term;
                size = fmax(size, fabs(term));
            }
    for (size_t node = 0; node <= last; node++)
        for (size_t d = 0; d < n; d++) {
            size_t from_end = node < last - node ? node : last - node;
            if (from_end > (hold - 1) * degree ||
                (from_end == 0 && phys_end_moves(h->ends, node == last, d)))
                most = fmax(most, fabs(sum[node * n + d] + g[AT(node, d)]));
            else
                assert_true(x[AT(node, d)] == 0);
        }
    return most / size;
#undef AT
}

/* Steps by elements that are reduced to their ends, put back into the equations. */
static void assert_elements_solve(const struct phys_system *system, const char *name, double dt,
                                  size_t hold, const bool *start, const bool *end, bool reduced)
{
    struct ad_error error = {0};
    const struct phys_rule *rule = phys_rule_find(name, &error);
    struct phys_hessian h;
    struct phys_newton_system newton;
    double path[DEGREE * DOF * SLICES], g[DEGREE * DOF * SLICES], step[DEGREE * DOF * SLICES];
    phys_hessian_new(&h, system, rule, SLICES, dt, NULL, &error);
    const struct phys_ends ends = {.size = sizeof ends, .free = {start, end}};
    h.ends = start || end ? &ends : NULL;
    h.free[0] = start;
    h.free[1] = end;
    phys_newton_system_new(&newton, &h, hold, &error);
    assert_no_error(&error);
    for (size_t k = 0; k < rule->degree * system->dof * SLICES; k++) {
        size_t row = k / SLICES, slice = k % SLICES, d = row % system->dof;
        const bool *free = slice ? end : start;
        bool given = row < system->dof && slice % (SLICES - 1) == 0 && !(free && free[d]);
        path[k] = sin(1.3 * (double)k);
        g[k] = given ? 0 : cos(2.1 * (double)k);
    }
    phys_hessian_at(&h, path, 0);
    phys_newton_system_scale(&newton);
    assert_true(phys_newton_system_factor(&newton, 0));
    assert_int_equal(newton.by_elements, reduced);
    phys_newton_system_step(&newton, g, step);
    assert_close(step_residual(&h, hold, g, step), 0, 0, 1e-12);
    phys_newton_system_free(&newton);
    phys_hessian_free(&h);
}

static void reduced_elements_are_solved(void **state)
{
    static const char *const scenes[] = {"spring", "dblpend", "threebody"};
    static const bool some[DOF] = {true, false, true, true, false, true},
                      all[DOF] = {1, 1, 1, 1, 1, 1};
    (void)state;
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct phys_system system = system_opened(scenes[k]);
        for (size_t hold = 1; hold <= 2; hold++)
            assert_elements_solve(&system, "gauss2", 0.4, hold, NULL, NULL, true);
        assert_elements_solve(&system, "gauss5", 0.4, 1, NULL, NULL, true);
        assert_elements_solve(&system, "gauss5", 0.4, 1, some, NULL, true);
        assert_elements_solve(&system, "gauss3", 0.4, 1, all, some, true);
        assert_elements_solve(&system, "gauss4", 0.4, 1, NULL, all, true);
        phys_system_close(&system);
    }
}

/* Half a period to an element of gauss2: its inner node alone is singular, the path is not. */
static ad_var swinging(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(6, ad_square(q)));
}

static void singular_inner_nodes_leave_a_band(void **state)
{
    static const double elements[] = {1, 1 + 1e-9, 1.01};
    const struct phys_scene scene = scene_of("swinging", 1, swinging, SLICES, 1, start);
    struct phys_system system;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    for (size_t k = 0; k < LENGTH(elements); k++)
        assert_elements_solve(&system, "gauss2", elements[k], 1, NULL, NULL, k == 2);
    phys_system_close(&system);
}

/* Eigenvalues below a shift: counted by places, as of many coordinates, and slice by slice. */
static void inertia_by_places_is_that_by_slices(void **state)
{
    static const char *const rules[] = {"left", "gauss2", "gauss3"};
    const struct phys_scene scene = scene_of("chain", SITES, chain, 12, 0.9, start);
    enum { TIMES = 12, MOST = 3 * SITES * TIMES };
    struct phys_system system;
    struct ad_error error = {0};
    static double path[MOST];
    (void)state;
    for (size_t k = 0; k < MOST; k++)
        path[k] = sin(1.3 * (double)k);
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    for (size_t r = 0; r < 2 * LENGTH(rules); r++) {
        const struct phys_rule *rule = phys_rule_find(rules[r / 2], &error);
        struct phys_hessian h;
        struct phys_inertia c;
        size_t before = 0;
        ring = r % 2;
        assert_int_equal(phys_hessian_new(&h, &system, rule, TIMES, 0.9, NULL, &error), AD_OK);
        phys_hessian_at(&h, path, 0);
        assert_true(phys_inertia_new(&c, &h, NULL));
        for (int integral = 0; integral < 2; integral++) {
            phys_inertia_masses(&c, integral);
            for (int shift = -4; shift <= 8; shift++) {
                c.wide = false;
                size_t below = phys_inertia_below(&c, 0.37 * shift, NULL);
                c.wide = true;
                assert_int_equal(phys_inertia_below(&c, 0.37 * shift, NULL), below);
                assert_true(shift == -4 || below >= before);
                before = below;
            }
            assert_in_range(before, 1, SITES * TIMES * 3 - 1);
        }
        phys_inertia_free(&c);
        phys_hessian_free(&h);
    }
    phys_system_close(&system);
}

static ad_var springs(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sum_rows(ad_sub(ad_square(v), ad_square(q)));
}

/* Of so many coordinates that inner nodes are left to LAPACK: each meets again after pi. */
static void many_inner_nodes_are_left_to_lapack(void **state)
{
    (void)state;
    enum { MANY = 70 };
    const struct phys_scene scene = scene_of("springs", MANY, springs, SLICES, 3.5 / 8, NULL);
    struct phys_system system = {.scene = &scene, .dof = MANY};
    struct phys_path_settings settings = phys_path_defaults(&system);
    struct phys_spectrum found;
    struct ad_error error = {0};
    static const double rest[4 * MANY * SLICES] = {0};
    settings.rule = phys_rule_find("gauss4", &error);
    phys_path_spectrum(&system, &settings, rest, &found, &error);
    assert_no_error(&error);
    assert_int_equal(found.index, MANY);
    assert_int_equal(found.n_conjugate, MANY);
    assert_close(found.conjugate[0].time, M_PI, 0, found.conjugate[0].error + 1e-4);
    phys_spectrum_free(&found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(damped_equations_are_solved),
                                       cmocka_unit_test(a_band_solves_what_blocks_do),
                                       cmocka_unit_test(reduced_elements_are_solved),
                                       cmocka_unit_test(singular_inner_nodes_leave_a_band),
                                       cmocka_unit_test(inertia_by_places_is_that_by_slices),
                                       cmocka_unit_test(many_inner_nodes_are_left_to_lapack)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
