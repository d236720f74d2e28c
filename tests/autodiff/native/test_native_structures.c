/* Every operation that moves or reduces values, with gradients of three orders, by every back end:
   machine code against the interpreter, on one and two threads, direct evaluation against both, f32
   against f64. Values and derivatives of the interpreter: test_structure. */
#include "native_batch.h"
#include "tests/autodiff/structure_cases.h"
#include "tests/autodiff/support.h"
#include "tests/native.h"

#include <stdlib.h>
#include <string.h>

enum { ROWS = 5, COLS = 37, ORDERS = 3, MOST_OUT = 2 * ORDERS + 1, GROUP = BATCH_PROGRAMS / 2 };

struct subject {
    const struct structure *s;
    ad_tape *tape;
    size_t n, n_out, orders; /* arguments, outputs */
    ad_var x[2], y[ORDERS], out[MOST_OUT];
    double *at[2];
    ad_program *interpreted, *compiled;
};

/* Outputs: the value, then gradients of y[k]; y[k + 1] is a sum over those of y[k]. */
static void record(struct subject *of, const struct structure *s, enum ad_type type)
{
    uint64_t seed = 3;
    *of = (struct subject){.s = s, .n = s->second == NONE ? 1 : 2, .tape = ad_tape_new(type)};
    /* higher ones are differences of numbers 1e8 times as large */
    of->orders = strcmp(s->name, "log_sum_exp_cols beyond exp") == 0 ? 1 : ORDERS;
    for (size_t k = 0; k < of->n; k++) {
        struct matrix m = k ? structure_second(s, ROWS, COLS) : (struct matrix){ROWS, COLS, NULL};
        of->x[k] = ad_input(of->tape, m.rows, m.cols, NULL);
        of->at[k] = random_values(&seed, m.rows * m.cols, -1, 1);
        for (size_t i = 0; i < m.rows * m.cols && s->nature == KINKED; i++) /* all different */
            of->at[k][i] = (double)(float)(-1 + 2 * (double)(i * 73 % 185) / 185);
    }
    ad_var inner[2] = {ad_sin(of->x[0]), of->n > 1 ? ad_sin(of->x[1]) : of->x[0]};
    of->out[of->n_out++] = s->record(inner);
    of->y[0] = weighted_sum(ad_sin(of->out[0]));
    for (size_t k = 0; k < of->orders; k++) {
        ad_var *g = of->out + of->n_out;
        assert_int_equal(ad_grad(of->y[k], of->n, of->x, g), AD_OK);
        of->n_out += of->n;
        if (k + 1 < of->orders)
            of->y[k + 1] = ad_add(weighted_sum(g[0]), weighted_sum(g[of->n - 1]));
    }
    of->interpreted = compile(of->tape, of->n_out, of->out);
    of->compiled = compile(of->tape, of->n_out, of->out);
}

static void release(struct subject *of)
{
    ad_program_free(of->interpreted);
    ad_program_free(of->compiled);
    ad_tape_free(of->tape);
    free(of->at[0]);
    free(of->at[1]);
}

static void run(const struct subject *of, ad_program *p)
{
    for (size_t k = 0; k < of->n; k++)
        ad_set(p, of->x[k], of->at[k]);
    ad_run(p);
    assert_int_equal(ad_program_error(p)->status, AD_OK);
}

static void assert_near(const struct subject *of, const char *way, ad_var x, const double *a,
                        const double *b, double tolerance)
{
    double largest = 1;
    for (size_t i = 0; i < size_of(x); i++)
        largest = fmax(largest, fabs(b[i]));
    for (size_t i = 0; i < size_of(x); i++)
        if (!is_close(a[i], b[i], 0, tolerance * largest))
            fail_msg("%s, %s: element %zu is %.17g, not %.17g", of->s->name, way, i, a[i], b[i]);
}

static double *values(const ad_program *p, ad_var x)
{
    double *v = malloc(size_of(x) * sizeof *v);
    assert_non_null(v);
    assert_int_equal(ad_get(p, x, v), AD_OK);
    return v;
}

static void assert_same_bits(const struct subject *of, ad_program *p)
{
    double *one[MOST_OUT];
    for (size_t k = 0; k < of->n_out; k++)
        one[k] = values(p, of->out[k]);
    ad_set_threads(p, 2);
    ad_run(p);
    for (size_t k = 0; k < of->n_out; k++) {
        double *two = values(p, of->out[k]);
        assert_memory_equal(one[k], two, size_of(of->out[k]) * sizeof *two);
        free(one[k]);
        free(two);
    }
}

static void assert_direct(const struct subject *of, double tolerance)
{
    for (size_t k = 0; k < of->orders; k++) {
        struct ad_error error = {0};
        double value, *slope[2] = {NULL, NULL};
        if (strstr(of->s->name, "custom") && k > 0)
            continue; /* of first order alone */
        for (size_t i = 0; i < of->n; i++)
            slope[i] = malloc(size_of(of->x[i]) * sizeof **slope);
        if (ad_gradient(of->n, of->x, (const double *const *)of->at, of->y[k], &value, slope,
                        &error) != AD_OK)
            fail_msg("%s: %s", of->s->name, error.message);
        for (size_t i = 0; i < of->n; i++) {
            ad_var g = of->out[1 + k * of->n + i];
            double *expected = values(of->interpreted, g);
            assert_near(of, "direct", g, slope[i], expected, tolerance);
            free(expected);
            free(slope[i]);
        }
    }
}

/* In both types. */
static void check(const struct subject *f32, const struct subject *f64)
{
    const struct subject *each[] = {f64, f32};
    for (int k = 0; k < 2; k++) {
        const struct subject *of = each[k];
        const double tolerance = of == f64 ? 1e-11 : 1e-3;
        run(of, of->interpreted);
        run(of, of->compiled);
        for (size_t i = 0; i < of->n_out; i++) {
            double *a = values(of->interpreted, of->out[i]),
                   *b = values(f64->interpreted, f64->out[i]);
            assert_near(of, "f32", of->out[i], a, b, 1e-3);
            assert_same_values(of->interpreted, of->compiled, of->out[i], tolerance, of->s->name);
            free(a);
            free(b);
        }
        assert_direct(of, tolerance);
        assert_same_bits(of, of->interpreted);
        assert_same_bits(of, of->compiled);
    }
}

/* Cases from `first` on; false if there is none. */
static bool check_group(size_t first)
{
    static struct subject of[2][GROUP]; /* by type */
    struct native_batch batch = {0};
    const struct structure *s;
    size_t n = 0;
    for (; n < GROUP && (s = structure_case(first + n)); n++)
        for (int type = AD_F32; type <= AD_F64; type++) {
            record(&of[type][n], s, (enum ad_type)type);
            native_batch_add(&batch, of[type][n].compiled);
        }
    assert_true(native_batch_load(&batch));
    for (size_t k = 0; k < n; k++)
        check(&of[AD_F32][k], &of[AD_F64][k]);
    for (size_t k = 0; k < 2 * n; k++)
        release(&of[k % 2][k / 2]);
    native_batch_release(&batch);
    return n == GROUP;
}

static void test_every_structure(void **state)
{
    (void)state;
    native_need_compiler();
    native_quick_compiler();
    for (size_t first = 0; check_group(first); first += GROUP)
        continue;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_structure)};
    return cmocka_run_group_tests_name("machine code of structures", tests, native_open_cache,
                                       native_remove_cache);
}
