/* Second derivatives of the discretised action (docs/theory.md, Newton's method): those of the
   rule's table agree with differences of the gradient, and vanish beyond the band. */
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
        assert_int_equal(phys_hessian_new(&h, &dblpend, rule, SLICES, dt, &error), AD_OK);
        phys_hessian_at(&h, path, 0);
        for (size_t e = 0; e < h.elements; e++)
            for (size_t i = 0; i < h.side; i++)
                for (size_t j = 0; j < h.side; j++)
                    found[e * s * dof + i][e * s * dof + j] +=
                        h.element[(e * h.side + j) * h.side + i];
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_elements)};
    return cmocka_run_group_tests_name("hessian", tests, NULL, NULL);
}
