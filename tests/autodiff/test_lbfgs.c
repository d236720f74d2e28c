/* L-BFGS on a function whose minimum is known. */
#include "autodiff/lbfgs.h"
#include "support.h"

#include <string.h>

static double rosenbrock(void *context, double *x, double *g)
{
    ++*(int *)context;
    double a = 1 - x[0], b = x[1] - x[0] * x[0];
    g[0] = -2 * a - 400 * x[0] * b;
    g[1] = 200 * b;
    return a * a + 100 * b * b;
}

/* Every step keeps the strong Wolfe conditions (Nocedal, Wright: c1 = 1e-4, c2 = 0.9), and the last
   comes to rest at the minimum. */
static void test_wolfe_conditions(void **state)
{
    (void)state;
    double x[2] = {-1.2, 1}, g[2], before[2], slope;
    int evaluations = 0, steps = 0;
    double value = rosenbrock(&evaluations, x, g), old = value;
    ad_lbfgs *method = ad_lbfgs_new(2);
    memcpy(before, x, sizeof x);
    double before_g[2] = {g[0], g[1]};
    while (hypot(g[0], g[1]) > 1e-9 && steps < 200 &&
           ad_lbfgs_step(method, rosenbrock, &evaluations, 1, x, g, &value)) {
        double s[2] = {x[0] - before[0], x[1] - before[1]};
        slope = before_g[0] * s[0] + before_g[1] * s[1];
        assert_true(slope < 0 && value <= old + 1e-4 * slope + 1e-15);
        assert_true(fabs(g[0] * s[0] + g[1] * s[1]) <= 0.9 * fabs(slope) + 1e-15);
        memcpy(before, x, sizeof x);
        memcpy(before_g, g, sizeof g);
        old = value;
        steps++;
    }
    assert_true(steps > 10 && steps < 60 && evaluations < 2 * steps);
    assert_close(x[0], 1, 0, 1e-8);
    assert_close(x[1], 1, 0, 1e-8);
    ad_lbfgs_free(method);
}

/* Of curvatures 1 and 1e6 around (3, -2); `context` counts evaluations. */
static double valley(void *context, double *x, double *g)
{
    ++*(int *)context;
    g[0] = x[0] - 3;
    g[1] = 1e6 * (x[1] + 2);
    return 0.5 * (g[0] * g[0] + 1e-6 * g[1] * g[1]);
}

static void divide(void *context, double *d)
{
    (void)context;
    d[1] /= 1e6;
}

static void test_preconditioned(void **state)
{
    (void)state;
    double x[2] = {-1.2, 1}, g[2];
    int evaluations = 0;
    double value = valley(&evaluations, x, g);
    ad_lbfgs *method = ad_lbfgs_new(2);
    ad_lbfgs_precondition(method, divide, NULL);
    assert_true(ad_lbfgs_step(method, valley, &evaluations, 1e-9, x, g, &value));
    assert_int_equal(evaluations, 2);
    assert_close(x[0], 3, 1e-15, 0);
    assert_close(x[1], -2, 1e-15, 0);
    ad_lbfgs_free(method);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wolfe_conditions),
        cmocka_unit_test(test_preconditioned),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
