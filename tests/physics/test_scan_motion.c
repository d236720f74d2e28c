/* A motion as a loop: dop853 recorded as one step and differentiated along many, by the start and a
   parameter, against the variational equations by the same method and by one of half its step.

       test_scan_motion [STEPS] */
#include "autodiff/autodiff.h"
#include "physics/integrators/stepper.h"
#include "tests/close.h"

#include <stdlib.h>

/* The driven pendulum q'' = 0.05 cos t - w sin q; x = (q, v, t). */
enum { STATES = 3, BY = 3, ALL = STATES * (1 + BY), MOST_STAGES = 13 };
static const double dt = 0.02;
static size_t steps = 10000;

static ad_var field(ad_var x, ad_var w)
{
    ad_var force = ad_sub(ad_mul(0.05, ad_cos(ad_row(x, 2))), ad_mul(w, ad_sin(ad_row(x, 0))));
    return ad_concat_rows(3, (ad_var[]){ad_row(x, 1), force, ad_scalar(x.tape, 1)});
}

static ad_var recorded_step(const struct phys_butcher *table, ad_var x, ad_var w)
{
    const double *a = table->a;
    ad_var slope[MOST_STAGES];
    for (size_t i = 0; i < table->stages; i++) {
        ad_var y = x;
        for (size_t j = 0; j < i; j++, a++)
            y = *a != 0 ? ad_add(y, ad_mul(dt * *a, slope[j])) : y;
        slope[i] = field(y, w);
    }
    for (size_t j = 0; j < table->stages; j++)
        x = table->b[j] != 0 ? ad_add(x, ad_mul(dt * table->b[j], slope[j])) : x;
    return x;
}

/* Of x, then its derivatives by q, v and w. */
static void variations(const double x[ALL], double w, double f[ALL])
{
    f[0] = x[1];
    f[1] = 0.05 * cos(x[2]) - w * sin(x[0]);
    f[2] = 1;
    for (int k = 0; k < BY; k++) {
        const double *d = x + STATES * (1 + k);
        f[STATES * (1 + k)] = d[1];
        f[STATES * (1 + k) + 1] = -w * cos(x[0]) * d[0] - (k == 2 ? sin(x[0]) : 0);
        f[STATES * (1 + k) + 2] = 0;
    }
}

static void numeric_step(const struct phys_butcher *table, double h, double w, double x[ALL])
{
    const double *a = table->a;
    double slope[MOST_STAGES][ALL], y[ALL];
    for (size_t i = 0; i <= table->stages; i++) {
        const bool last = i == table->stages;
        for (int k = 0; k < ALL; k++) {
            y[k] = x[k];
            for (size_t j = 0; j < i; j++)
                y[k] += h * (last ? table->b[j] : a[j]) * slope[j][k];
        }
        if (last)
            memcpy(x, y, sizeof y);
        else
            variations(y, w, slope[i]);
        a += last ? 0 : i;
    }
}

static void test_variational_equations(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_integrator *method = phys_integrator_find("dop853", &error);
    const struct phys_butcher *table = method->coefficients;
    assert_in_range(table->stages, 2, MOST_STAGES);
    ad_tape *body = ad_tape_new(AD_F64), *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(body, STATES, 1, "x"), w = ad_input(body, 1, 1, "w");
    ad_var next = recorded_step(table, x, w), last, by[4];
    ad_var in[] = {ad_input(tape, STATES, 1, "start"), ad_input(tape, 1, 1, "w")};
    const struct ad_body b = {.size = sizeof b,
                              .tape = body,
                              .n_state = 1,
                              .state = &x,
                              .next = &next,
                              .n_shared = 1,
                              .shared = &w,
                              .checkpoints = 300};
    assert_int_equal(ad_scan(tape, &b, steps, in, NULL, &in[1], &last, NULL), AD_OK);
    for (size_t i = 0; i < 2; i++)
        ad_grad(ad_row(last, i), 2, in, by + 2 * i);
    ad_program *p;
    assert_int_equal(ad_compile(tape, 4, by, &p), AD_OK);
    const double start[STATES] = {0.4, 0.1, 0}, parameter = 2.1;
    ad_set(p, in[0], start);
    ad_set(p, in[1], &parameter);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);

    double same[ALL] = {0.4, 0.1, 0, 1, 0, 0, 0, 1}, finer[ALL];
    memcpy(finer, same, sizeof same);
    for (size_t t = 0; t < steps; t++) {
        numeric_step(table, dt, parameter, same);
        for (int half = 0; half < 2; half++)
            numeric_step(table, dt / 2, parameter, finer);
    }
    for (size_t i = 0; i < 2; i++) {
        double is[BY + 1];
        ad_get(p, by[2 * i], is); /* by q, v, t */
        ad_get(p, by[2 * i + 1], &is[2]);
        for (size_t k = 0; k < BY; k++) {
            assert_close(is[k], same[STATES * (1 + k) + i], 1e-8, 1e-9);
            assert_close(is[k], finer[STATES * (1 + k) + i], 1e-7, 1e-8);
        }
    }
    ad_program_free(p);
    ad_tape_free(tape);
    ad_tape_free(body);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_variational_equations),
    };
    steps = argc > 1 ? strtoul(argv[1], NULL, 10) : steps;
    return cmocka_run_group_tests_name("scan of a motion", tests, NULL, NULL);
}
