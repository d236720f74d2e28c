/* Helpers for tests of the tape (support.h). */
#include "support.h"

#include <float.h>
#include <stdlib.h>

uint64_t random_bits(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

double uniform(uint64_t *state, double lo, double hi)
{
    return lo + (hi - lo) * (double)(random_bits(state) >> 11) * 0x1p-53;
}

size_t below(uint64_t *state, size_t n) { return (size_t)(random_bits(state) % n); }

double *random_values(uint64_t *state, size_t n, double lo, double hi)
{
    double *v = malloc(n * sizeof *v);
    assert_non_null(v);
    for (size_t i = 0; i < n; i++)
        v[i] = (float)uniform(state, lo, hi);
    return v;
}

void assert_tape_ok(const ad_tape *tape)
{
    const struct ad_error *e = ad_tape_error(tape);
    if (e->status != AD_OK)
        fail_msg("tape: %s", e->message);
}

ad_program *compile(ad_tape *tape, size_t n, const ad_var out[])
{
    ad_program *program = NULL;
    ad_compile(tape, n, out, &program);
    assert_tape_ok(tape);
    assert_non_null(program);
    return program;
}

double *evaluate(ad_var y, size_t n, const ad_var x[], const double *const at[])
{
    ad_program *p = compile(y.tape, 1, &y);
    for (size_t k = 0; k < n; k++)
        assert_int_equal(ad_set(p, x[k], at[k]), AD_OK);
    ad_run(p);
    double *values = malloc(ad_rows(y) * ad_cols(y) * sizeof *values);
    assert_non_null(values);
    assert_int_equal(ad_get(p, y, values), AD_OK);
    ad_program_free(p);
    return values;
}

double evaluate_scalar(ad_var y, size_t n, const ad_var x[], const double *const at[])
{
    assert_int_equal(ad_rows(y) * ad_cols(y), 1);
    double *v = evaluate(y, n, x, at), value = *v;
    free(v);
    return value;
}

ad_var weighted_sum(ad_var y)
{
    uint64_t state = 2718;
    size_t rows = ad_rows(y), cols = ad_cols(y);
    double *w = random_values(&state, rows * cols, 0.5, 1.5);
    ad_var sum = ad_sum(ad_mul(y, ad_const(y.tape, rows, cols, w)));
    free(w);
    return sum;
}

typedef enum ad_status check(ad_var y, size_t n, const ad_var x[], const double *const at[],
                             double tolerance, size_t entries, struct ad_check *report);

static void assert_check(check *f, const char *order, const char *name, ad_var y, size_t n,
                         const ad_var x[], const double *const at[], double tolerance,
                         size_t entries)
{
    struct ad_check r;
    enum ad_status status = f(y, n, x, at, tolerance, entries, &r);
    if (status != AD_OK)
        fail_msg("%s, %s: %s", name, order, ad_tape_error(y.tape)->message);
    assert_true(r.entries > 0);
    if (!r.passed)
        fail_msg("%s, %s: x[%zu](%zu, %zu): tape %.12g, differences %.12g, error %.3g", name, order,
                 r.input, r.row, r.col, r.tape, r.difference, r.worst);
}

void assert_gradient(const char *name, ad_var y, size_t n, const ad_var x[],
                     const double *const at[], double tolerance, size_t entries)
{
    assert_check(ad_check_gradient, "first order", name, y, n, x, at, tolerance, entries);
}

void assert_second(const char *name, ad_var y, size_t n, const ad_var x[], const double *const at[],
                   double tolerance, size_t entries)
{
    assert_check(ad_check_second, "second order", name, y, n, x, at, tolerance, entries);
}

void for_each_isa(void (*f)(void))
{
    static const char *const isas[] = {"base", "avx2", "avx512"};
    for (size_t k = 0; k < sizeof isas / sizeof isas[0]; k++) {
        setenv("LEASTACTION_ISA", isas[k], 1);
        f();
    }
    unsetenv("LEASTACTION_ISA");
}

double derivative(function *f, int order, double x)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var in = ad_input(tape, 1, 1, "x"), y = f(in);
    for (int k = 0; k < order; k++) {
        ad_var g;
        assert_int_equal(ad_grad(y, 1, &in, &g), AD_OK);
        y = g;
    }
    double value = evaluate_scalar(y, 1, &in, (const double *const[]){&x});
    ad_tape_free(tape);
    return value;
}

void assert_same(double a, double b, const char *what)
{
    bool same = isnan(b) ? isnan(a) : a == b || fabs(a - b) <= 4 * DBL_EPSILON * fabs(b);
    if (!same)
        fail_msg("%s is %.17g, not %.17g", what, a, b);
}
