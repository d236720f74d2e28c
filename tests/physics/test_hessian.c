/* Second derivatives of the discretised action (docs/theory.md, Newton's method): those of the
   rule's table agree with differences of the gradient, and vanish beyond the band. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "physics/action/hessian.h"

enum { SLICES = 4, MOST = 64 };

static struct phys_system dblpend;
static struct ad_error error;

/* Where coordinate d of node j, counted along the path, lies in [degree*dof x slices]. */
static size_t place(size_t degree, size_t j, size_t d)
{
    return (j % degree * dblpend.dof + d) * SLICES + j / degree;
}

/* Entry [n][n] by central differences, extrapolated, of dS/dx by the tape. */
static void by_differences(const struct phys_rule *rule, double dt, double *path, size_t n,
                           double H[MOST][MOST])
{
    static const double at[] = {-2, -1, 1, 2}, weight[] = {1.0 / 12, -2.0 / 3, 2.0 / 3, -1.0 / 12};
    const double h = 1e-3;
    double g[MOST * SLICES];
    struct phys_action action;
    ad_program *program;
    ad_var gradient;
    ad_tape *tape = ad_tape_new(AD_F64);
    assert_int_equal(phys_action_record(tape, &dblpend, rule, SLICES, dt, 0, &action), AD_OK);
    assert_int_equal(ad_grad(action.action, 1, &action.path, &gradient), AD_OK);
    assert_int_equal(ad_compile(tape, 1, &gradient, &program), AD_OK);
    for (size_t c = 0; c < n; c++) {
        double *x = &path[place(rule->degree, c / dblpend.dof, c % dblpend.dof)], old = *x;
        for (size_t k = 0; k < LENGTH(at); k++) {
            *x = old + at[k] * h;
            ad_set(program, action.path, path);
            ad_run(program);
            ad_get(program, gradient, g);
            for (size_t r = 0; r < n; r++)
                H[r][c] += weight[k] * g[place(rule->degree, r / dblpend.dof, r % dblpend.dof)] / h;
        }
        *x = old;
    }
    ad_program_free(program);
    ad_tape_free(tape);
}

static void test_elements(void **state)
{
    (void)state;
    static const char *const rules[] = {"left", "midpoint", "trapezoid", "gauss2", "gauss3"};
    assert_int_equal(phys_system_open("dblpend", &dblpend, &error), AD_OK);
    for (size_t k = 0; k < LENGTH(rules); k++) {
        const struct phys_rule *rule = phys_rule_find(rules[k], &error);
        const double dt = 0.37;
        const size_t s = rule->degree, dof = dblpend.dof, n = (s * (SLICES - 1) + 1) * dof;
        double path[MOST * SLICES], wanted[MOST][MOST] = {{0}}, found[MOST][MOST] = {{0}}, most = 0;
        for (size_t i = 0; i < s * dof * SLICES; i++)
            path[i] = sin(1.3 * (double)i);
        by_differences(rule, dt, path, n, wanted);
        struct phys_hessian h;
        assert_int_equal(phys_hessian_new(&h, &dblpend, rule, SLICES, dt, NULL, &error), AD_OK);
        phys_hessian_at(&h, path, 0);
        for (size_t e = 0; e < h.elements; e++)
            for (size_t i = 0; i < h.side; i++)
                for (size_t j = 0; j < h.side; j++)
                    found[e * s * dof + i][e * s * dof + j] +=
                        phys_hessian_entry(&h, e, i / dof, i % dof, j / dof, j % dof);
        phys_hessian_free(&h);
        for (size_t r = 0; r < n; r++)
            for (size_t c = 0; c < n; c++)
                most = fmax(most, fabs(wanted[r][c]));
        for (size_t r = 0; r < n; r++)
            for (size_t c = 0; c < n; c++) {
                size_t apart = r > c ? r - c : c - r;
                assert_close(found[r][c], wanted[r][c], 0, 1e-8 * most);
                assert_true(apart <= (s + 1) * dof - 1 || fabs(wanted[r][c]) < 1e-10 * most);
            }
    }
    phys_system_close(&dblpend);
}

/* ---- C12: one product for all coordinates that no row couples ---- */

enum { SITES = 14 };

/* Sites coupled by q to their neighbours in a ring, by q and v two sites on, and by v to site 0
   every fifth one. */
static ad_var lattice(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var L = ad_mul(0.5, ad_sum_rows(ad_square(v)));
    for (size_t k = 0; k < SITES; k++) {
        ad_var a = ad_row(q, k), near = ad_row(q, (k + 1) % SITES);
        L = ad_sub(L, ad_cosh(ad_sub(a, ad_mul(near, ad_cos(t)))));
        if (k + 2 < SITES)
            L = ad_add(L, ad_mul(ad_sin(a), ad_row(v, k + 2)));
        if (k > 0 && k % 5 == 0)
            L = ad_add(L, ad_mul(ad_square(ad_row(v, 0)), ad_square(ad_row(v, k))));
    }
    return L;
}

static enum ad_status at_rest(const void *params, uint64_t seed, double *q, double *v,
                              struct ad_error *e)
{
    (void)params, (void)seed, (void)e;
    for (size_t k = 0; k < SITES; k++)
        q[k] = v[k] = 0;
    return AD_OK;
}

static double mass_at(const struct phys_hessian *h, size_t p, size_t i, size_t j)
{
    const size_t first = i < j ? i : j, apart = i < j ? j - i : i - j;
    return apart > h->around ? 0 : h->mass[(p * SITES + first) * (h->around + 1) + apart];
}

static void test_colours(void **state)
{
    const struct phys_scene scene = scene_of("lattice", SITES, lattice, SLICES, 0.1, at_rest);
    struct phys_system system;
    struct phys_derivatives of[2];
    struct phys_hessian h[2];
    double path[3 * SITES * SLICES];
    (void)state;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct phys_rule *rule = phys_rule_find("gauss2", &error);
    for (size_t k = 0; k < LENGTH(path); k++)
        path[k] = sin(1.3 * (double)k);
    for (int all = 0; all < 2; all++) {
        assert_int_equal(phys_derivatives_new(&of[all], &system, SLICES, NULL, &error), AD_OK);
        if (all) { /* coordinates coupled: a product for each */
            phys_pattern_free(&of[1].coupling);
            assert_true(phys_pattern_new(&of[1].coupling, SITES, NULL));
        } else {
            assert_in_range(of[0].coupling.colours, 5, 8); /* rows have 5 to 7 entries */
        }
        assert_int_equal(phys_hessian_over(&h[all], &of[all], rule, SLICES, 0.1, &error), AD_OK);
        assert_true(phys_hessian_keep_mass(&h[all]));
        for (int again = 0; again < 2; again++)
            phys_hessian_at(&h[all], path, 0.3);
    }
    const uint32_t *place = of[0].coupling.place;
    assert_in_range(h[0].reach, 2, SITES - 2); /* numbered as in the scene: SITES - 1 */
    for (size_t e = 0; e < SLICES - 1; e++)
        for (size_t b = 0; b < h[0].side; b++)
            for (size_t a = 0; a < h[0].side; a++) {
                size_t i = a % SITES, j = b % SITES;
                assert_close(phys_hessian_entry(&h[0], e, a / SITES, place[i], b / SITES, place[j]),
                             phys_hessian_entry(&h[1], e, a / SITES, i, b / SITES, j), 1e-13,
                             1e-13);
            }
    for (size_t p = 0; p < h[0].points; p++)
        for (size_t i = 0; i < SITES; i++)
            for (size_t j = 0; j <= i; j++)
                assert_close(mass_at(&h[0], p, place[i], place[j]), mass_at(&h[1], p, i, j), 1e-13,
                             0);
    for (size_t d = 0; d < SITES; d++)
        assert_close(h[0].stiffness[d], h[1].stiffness[d], 1e-13, 0);
    for (int all = 0; all < 2; all++) {
        phys_hessian_free(&h[all]);
        phys_derivatives_free(&of[all]);
    }
    phys_system_close(&system);
}

/* By the L that an action recorded, the elements and their gradients are those of a recording of
   their own, for every rule: q of left+repeat is the path itself, of which v depends. */
static void test_of_an_action(void **state)
{
    (void)state;
    static const char *const scenes[] = {"dblpend", "arenstorf"};
    for (size_t k = 0; k < LENGTH(scenes); k++) {
        struct phys_system system;
        assert_int_equal(phys_system_open(scenes[k], &system, &error), AD_OK);
        for (size_t r = 0; phys_rules[r]; r++) {
            const double dt = 0.37;
            double path[PHYS_RULE_MOST * SLICES];
            struct phys_action action;
            struct phys_hessian own, shared;
            ad_tape *tape = ad_tape_new(AD_F64);
            for (size_t i = 0; i < phys_rules[r]->degree * system.dof * SLICES; i++)
                path[i] = sin(1.3 * (double)i);
            phys_action_record(tape, &system, phys_rules[r], SLICES, dt, 0, &action);
            phys_hessian_new(&own, &system, phys_rules[r], SLICES, dt, NULL, &error);
            phys_hessian_new(&shared, &system, phys_rules[r], SLICES, dt, &action, &error);
            assert_int_equal(error.status, AD_OK);
            phys_hessian_at(&own, path, 0);
            for (int again = 0; again < 2; again++)
                phys_hessian_at(&shared, path, 0);
            for (size_t i = 0; i < phys_hessian_size(&own); i++)
                assert_close(shared.element[i], own.element[i], 1e-13, 1e-12);
            phys_hessian_gradient_at(&shared, path, 0);
            for (size_t i = 0; i < own.elements * own.side; i++)
                assert_close(shared.gradient[i], own.gradient[i], 1e-13, 1e-12);
            phys_hessian_free(&own);
            phys_hessian_free(&shared);
            ad_tape_free(tape);
        }
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_elements),
                                       cmocka_unit_test(test_colours),
                                       cmocka_unit_test(test_of_an_action)};
    return cmocka_run_group_tests_name("hessian", tests, NULL, NULL);
}
