/* Random programs of what passes over columns combine (autodiff/compile/passes.c): products, sums
   over columns, concatenations, neighbouring columns, and sums that these accumulate into. Values
   and gradients in blocks of columns against ad_evaluate, which knows no passes; the same bits on
   several threads and in runs again. By hand: test_pass_random PROGRAMS SEED. */
#include "tests/autodiff/support.h"

#include <stdlib.h>

enum { ROWS = 4, MOST = 120, INPUTS = 5, OUTPUTS = 9, SQUARE = 4, LEAST_COLUMNS = 96 };

/* Values [r x cols] and small ones [r x 1] or [r x r], one of which each operation adds. */
struct pool {
    ad_tape *tape;
    uint64_t random;
    size_t cols, n_wide, n_small;
    ad_var wide[MOST], small[MOST], in[INPUTS];
    double *at[INPUTS];
};

static void keep(struct pool *p, ad_var x)
{
    x = below(&p->random, 3) ? x : ad_sin(x);
    if (ad_cols(x) == p->cols)
        p->wide[p->n_wide++] = x;
    else
        p->small[p->n_small++] = x;
}

static ad_var wide(struct pool *p)
{
    size_t recent = p->n_wide < 6 ? p->n_wide : 6;
    return p->wide[below(&p->random, 3) ? p->n_wide - 1 - below(&p->random, recent)
                                        : below(&p->random, p->n_wide)];
}

/* One with so many columns, or the first, the weight. */
static ad_var small(struct pool *p, size_t cols)
{
    for (int attempt = 0; attempt < 8; attempt++) {
        ad_var x = p->small[below(&p->random, p->n_small)];
        if (ad_cols(x) == cols)
            return x;
    }
    return p->small[cols == 1];
}

/* [ROWS x cols] of any wide value. */
static ad_var full(struct pool *p)
{
    ad_var x = wide(p);
    uint32_t rows[ROWS];
    for (size_t r = 0; r < ROWS; r++)
        rows[r] = (uint32_t)below(&p->random, ad_rows(x));
    return ad_rows(x) == ROWS ? x : ad_gather_rows(x, ROWS, rows);
}

/* With a matrix that all columns share, or one whose rows are as many as columns. */
static ad_var product(struct pool *p)
{
    if (below(&p->random, 8) == 0)
        return ad_matmul(full(p), false, p->in[SQUARE], below(&p->random, 2));
    return ad_matmul(ad_slice_rows(small(p, ROWS), 0, ROWS), below(&p->random, 2), full(p), false);
}

/* Over columns: [ROWS x ROWS] or [ROWS x 1]. */
static ad_var total(struct pool *p)
{
    double mean = 1 / (double)p->cols;
    switch (below(&p->random, 3)) {
    case 0:
        return ad_sum_cols(ad_mul(mean, full(p)));
    case 1:
        return ad_matmul(full(p), false, ad_mul(mean, ad_slice_rows(wide(p), 0, 1)), true);
    default:
        return ad_matmul(ad_mul(mean, full(p)), false, full(p), true);
    }
}

static ad_var looked_up(struct pool *p)
{
    uint32_t *list = malloc(p->cols * sizeof *list);
    assert_non_null(list);
    ad_var table = below(&p->random, 2) ? small(p, ROWS) : full(p);
    for (size_t c = 0; c < p->cols; c++)
        list[c] = (uint32_t)below(&p->random, ad_cols(table));
    ad_var y = ad_gather_cols(table, p->cols, list);
    free(list);
    return y;
}

static ad_var placed(struct pool *p)
{
    ad_var parts[] = {ad_cos(wide(p)), product(p), wide(p)};
    size_t rows = ad_rows(parts[0]) + ad_rows(parts[2]);
    if (below(&p->random, 2))
        return ad_concat_rows(3, parts);
    size_t first = below(&p->random, 3);
    return ad_place(p->tape, rows + 2, p->cols, 2, (ad_var[]){parts[0], parts[2]},
                    (size_t[]){first, ad_rows(parts[0]) / 2}, (size_t[]){0, 0});
}

/* A row of all columns but the first, and a sum. */
static ad_var joined(struct pool *p)
{
    ad_var row = ad_slice_rows(wide(p), 0, 1);
    return ad_concat_cols(2,
                          (ad_var[]){ad_cos(ad_slice_cols(row, 1, p->cols - 1)), ad_mean(wide(p))});
}

static ad_var neighbours(struct pool *p)
{
    ad_var x = wide(p);
    return below(&p->random, 2) ? ad_diff(x, 0.5, true) : ad_diff_adjoint(x, 0.5, true, p->cols);
}

static ad_var scattered(struct pool *p)
{
    ad_var x = full(p);
    uint32_t rows[ROWS];
    for (size_t r = 0; r < ROWS; r++)
        rows[r] = (uint32_t)below(&p->random, ROWS);
    return ad_add(ad_scatter_rows(x, rows, ROWS), product(p));
}

static void step(struct pool *p)
{
    switch (below(&p->random, 13)) {
    case 0:
        keep(p, ad_mul(0.4, product(p)));
        break;
    case 1: /* products and what they accumulate onto */
        keep(p, ad_add(product(p), below(&p->random, 2) ? product(p) : ad_sin(full(p))));
        break;
    case 2:
        keep(p, ad_add(ad_add(product(p), ad_sum_rows(wide(p))), product(p)));
        break;
    case 3:
        keep(p, total(p));
        break;
    case 4:
    case 5: {
        ad_var a = total(p), b = total(p), c = total(p);
        if (ad_cols(a) == ad_cols(b))
            a = ad_add(a, b);
        keep(p, ad_cols(a) == ad_cols(c) ? ad_add(c, a) : a);
        break;
    }
    case 6:
        keep(p, placed(p));
        break;
    case 7:
        keep(p, neighbours(p));
        break;
    case 8:
        keep(p, scattered(p));
        break;
    case 9:
        keep(p, looked_up(p));
        break;
    case 10:
        keep(p, ad_mul(full(p), ad_slice_rows(small(p, 1), 0, ROWS)));
        break;
    case 11:
        keep(p, joined(p));
        break;
    default:
        keep(p, ad_tanh(ad_mul(full(p), full(p))));
    }
}

/* The sum of all outputs is what the gradients are of. */
static ad_var record(struct pool *p, uint64_t seed, ad_var out[OUTPUTS])
{
    *p = (struct pool){.tape = ad_tape_new(AD_F64), .random = seed};
    p->cols = LEAST_COLUMNS + below(&p->random, 3) * 57;
    const size_t steps = 4 + below(&p->random, 30),
                 cols[INPUTS] = {ROWS, 1, p->cols, p->cols, p->cols};
    const size_t rows[INPUTS] = {ROWS, ROWS, ROWS, ROWS, p->cols};
    for (size_t k = 0; k < INPUTS; k++) {
        p->in[k] = ad_input(p->tape, rows[k], cols[k], NULL);
        p->at[k] = random_values(&p->random, rows[k] * cols[k], -1, 1);
    }
    for (size_t k = 0; k < 2; k++)
        p->small[p->n_small++] = p->in[k];
    for (size_t k = 2; k < SQUARE; k++)
        p->wide[p->n_wide++] = p->in[k];
    if (below(&p->random, 3) == 0)
        ad_hold(p->in[below(&p->random, INPUTS)]);
    for (size_t k = 0; k < steps; k++)
        step(p);
    ad_var y = ad_scalar(p->tape, 0);
    for (size_t k = 1; k < OUTPUTS - INPUTS; k++) {
        out[k] = k % 2 ? wide(p) : p->small[p->n_small - 1];
        y = ad_add(y, ad_div(weighted_sum(out[k]), (double)ad_cols(out[k])));
    }
    out[0] = y;
    assert_int_equal(ad_grad(y, INPUTS, p->in, out + OUTPUTS - INPUTS), AD_OK);
    return y;
}

static double **expected(const struct pool *p, const ad_var out[OUTPUTS])
{
    double **value = calloc(OUTPUTS, sizeof *value);
    struct ad_error error = {0};
    assert_non_null(value);
    for (size_t k = 0; k < OUTPUTS; k++) {
        value[k] = malloc(ad_rows(out[k]) * ad_cols(out[k]) * sizeof **value);
        assert_non_null(value[k]);
    }
    const double *const *at = (const double *const *)p->at;
    for (size_t k = 1; k < OUTPUTS - INPUTS; k++)
        ad_evaluate(INPUTS, p->in, at, out[k], value[k], &error);
    ad_gradient(INPUTS, p->in, at, out[0], value[0], value + OUTPUTS - INPUTS, &error);
    if (error.status != AD_OK)
        fail_msg("%s", error.message);
    return value;
}

static void compare(const ad_program *p, const ad_var out[OUTPUTS], double *const value[OUTPUTS],
                    bool keeps, double tolerance, uint64_t seed)
{
    for (size_t k = 0; k < OUTPUTS; k++) {
        size_t n = ad_rows(out[k]) * ad_cols(out[k]);
        double *got = malloc(n * sizeof *got), largest = 0;
        assert_non_null(got);
        assert_int_equal(ad_get(p, out[k], got), AD_OK);
        for (size_t i = 0; i < n; i++)
            largest = fmax(largest, fabs(value[k][i]));
        for (size_t i = 0; i < n; i++) {
            if (!is_close(got[i], value[k][i], tolerance, tolerance * (1 + largest)))
                fail_msg("program %llu, output %zu, element %zu: %.17g, not %.17g",
                         (unsigned long long)seed, k, i, got[i], value[k][i]);
            value[k][i] = keeps ? got[i] : value[k][i];
        }
        free(got);
    }
}

static void check(uint64_t seed, const char *columns)
{
    struct pool p;
    ad_var out[OUTPUTS];
    struct ad_error error = {0};
    record(&p, seed, out);
    double **value = expected(&p, out);
    setenv("LEASTACTION_COLUMNS", columns, 1);
    ad_program *program = compile(p.tape, OUTPUTS, out);
    unsetenv("LEASTACTION_COLUMNS");
    for (size_t k = 0; k < INPUTS; k++)
        ad_set(program, p.in[k], p.at[k]);
    ad_run(program);
    compare(program, out, value, true, 1e-11, seed);
    for (size_t threads = 2; threads < 4; threads++) {
        ad_set_threads(program, threads);
        ad_run(program);
        compare(program, out, value, false, 0, seed);
    }
    assert_int_equal(ad_rerun(program), AD_OK);
    compare(program, out, value, false, 0, seed);
    assert_int_equal(ad_run_checked(program, &error), AD_OK);
    compare(program, out, value, false, 0, seed);
    for (size_t k = 0; k < OUTPUTS; k++)
        free(value[k]);
    for (size_t k = 0; k < INPUTS; k++)
        free(p.at[k]);
    free(value);
    ad_program_free(program);
    ad_tape_free(p.tape);
}

static uint64_t programs = 240, first;

static void test_random(void **state)
{
    static const char *const columns[] = {"16", "48", "32"};
    (void)state;
    for (uint64_t seed = first; seed < first + programs; seed++)
        check(seed, columns[seed % 3]);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random)};
    programs = argc > 1 ? strtoull(argv[1], NULL, 10) : programs;
    first = argc > 2 ? strtoull(argv[2], NULL, 10) : first;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
