/* Motions from rest at 0, where no component has a size before the first step. */
#include "physics/physics.h"
#include "tests/close.h"

/* x'' = sin t - k x: no component has a size before the first
   step, and x itself has none to first order. */
static enum ad_status drive(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const double *k = context;
    (void)error;
    rate[0] = y[1];
    rate[1] = sin(t) - *k * y[0];
    return AD_OK;
}

static void test_driven_from_rest(void **state)
{
    (void)state;
    static const char *const methods[] = {
        "implicit-midpoint", "gauss2", "gauss3", "gauss4", "gauss5", "rk4"};
    double stiffness[] = {0, 4, 1e4}; /* the last is for Newton's method */
    for (size_t i = 0; i < 5 + 1; i++)
        for (size_t j = 0; j < (i < 5 ? 3 : 2); j++) {
            double k = stiffness[j], w = sqrt(k), y[2] = {0}, T = 3;
            struct ad_error error = {0};
            struct phys_ode ode = {.n = 2, .field = drive, .context = &k};
            struct phys_simulation how = {.size = sizeof how,
                                          .integrator = phys_integrator_find(methods[i], &error),
                                          .t1 = T,
                                          .dt = 0.01};
            assert_int_equal(phys_simulate(&how, &ode, y, NULL, &error), AD_OK);
            double x = k == 0 ? T - sin(T) : (sin(T) - sin(w * T) / w) / (k - 1);
            assert_close(y[0], x, 0, i == 0 ? 1e-4 : 1e-6); /* the first is of order 2 */
        }
}

static enum ad_status drive_alone(void *context, double t, const double *q, double *rate,
                                  struct ad_error *error)
{
    (void)context, (void)q, (void)error;
    rate[0] = sin(t);
    return AD_OK;
}

/* A force that is kept from one step to the next is that of its time, though nothing has moved. */
static void test_kicks_from_rest(void **state)
{
    (void)state;
    static const char *const methods[] = {"semi-implicit", "velocity-verlet", "verlet", "yoshida4"};
    for (size_t i = 0; i < LENGTH(methods); i++) {
        double k = 0, y[2] = {0};
        struct ad_error error = {0};
        struct phys_ode ode = {
            .n = 2, .field = drive, .kick = drive_alone, .canonical = true, .context = &k};
        struct phys_simulation how = {.size = sizeof how,
                                      .integrator = phys_integrator_find(methods[i], &error),
                                      .t1 = 3,
                                      .dt = 0.01};
        assert_int_equal(phys_simulate(&how, &ode, y, NULL, &error), AD_OK);
        assert_close(y[0], 3 - sin(3), 0, 1e-4);
        assert_close(y[1], 1 - cos(3), 0, 1e-2);
    }
}

/* A force at the start alone: the first guess is far from the stages, which are 0. */
static enum ad_status kick_at_once(void *context, double t, const double *y, double *rate,
                                   struct ad_error *error)
{
    (void)context, (void)error;
    rate[0] = y[1];
    rate[1] = t == 0 ? 1e5 : 0;
    return AD_OK;
}

static void test_a_force_at_the_start_alone(void **state)
{
    (void)state;
    double y[2] = {0};
    struct ad_error error = {0};
    struct phys_ode ode = {.n = 2, .field = kick_at_once};
    struct phys_simulation how = {.size = sizeof how,
                                  .integrator = phys_integrator_find("gauss5", &error),
                                  .t1 = 1,
                                  .dt = 0.01};
    assert_int_equal(phys_simulate(&how, &ode, y, NULL, &error), AD_OK);
    assert_true(y[0] == 0 && y[1] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_driven_from_rest),
        cmocka_unit_test(test_kicks_from_rest),
        cmocka_unit_test(test_a_force_at_the_start_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
