/* Random recordings (random_tape.h). Values are kept of order one: each new value is looked at as
   soon as it is recorded, and scaled where it is large. */
#include "random_tape.h"

#include "tests/autodiff/support.h"

#include <math.h>
#include <stdlib.h>

struct maker {
    struct random_tape *r;
    uint64_t random;
    size_t rows, cols, n, max;
    size_t most; /* elements of a value */
    ad_var *pool;
};

static size_t pick(struct maker *m, size_t n) { return below(&m->random, n); }

static double number(struct maker *m, double lo, double hi)
{
    return (float)uniform(&m->random, lo, hi);
}

static void range(struct maker *m, ad_var x, double *lo, double *hi)
{
    plain_run(&m->r->plain);
    const double *v = m->r->plain.value[x.id];
    *lo = INFINITY, *hi = -INFINITY;
    for (size_t k = 0; k < ad_rows(x) * ad_cols(x); k++) {
        *lo = fmin(*lo, v[k]);
        *hi = fmax(*hi, v[k]);
    }
}

/* x in [lo, hi], by a factor and a shift where it is not. */
static ad_var into(struct maker *m, ad_var x, double lo, double hi)
{
    double least, most;
    range(m, x, &least, &most);
    if (least >= lo && most <= hi)
        return x;
    double width = most - least, scale = width > hi - lo ? (hi - lo) / width : 1;
    double middle = (lo + hi) / 2 - scale * (least + most) / 2;
    if (!isfinite(scale) || !isfinite(middle) || scale == 0)
        return ad_add((lo + hi) / 2, ad_mul(0.1 * (hi - lo), ad_tanh(x)));
    return ad_add((double)(float)middle, ad_mul((double)(float)(0.99 * scale), x));
}

static void keep(struct maker *m, ad_var x)
{
    double lo, hi;
    range(m, x, &lo, &hi);
    if (!(fmax(fabs(lo), fabs(hi)) < 4) && isfinite(lo) && isfinite(hi))
        x = ad_mul((double)(float)(2 / fmax(fabs(lo), fabs(hi))), x);
    else if (!isfinite(lo) || !isfinite(hi))
        x = ad_select(ad_lt(ad_abs(x), 4.0), x, 0.5);
    if (m->n == m->max) {
        m->max = 2 * m->max + 64;
        m->pool = realloc(m->pool, m->max * sizeof *m->pool);
        if (!m->pool)
            abort();
    }
    m->pool[m->n++] = x;
}

/* Recent values more often; old ones so that they live long. */
static ad_var any(struct maker *m)
{
    size_t recent = m->n < 8 ? m->n : 8;
    return m->pool[pick(m, 3) ? m->n - 1 - pick(m, recent) : pick(m, m->n)];
}

static bool fits(size_t a, size_t b) { return a == b || a == 1 || b == 1; }
static size_t larger(size_t a, size_t b) { return a > b ? a : b; }

static ad_var partner(struct maker *m, ad_var a)
{
    for (int attempt = 0; attempt < 12; attempt++) {
        ad_var b = any(m);
        if (fits(ad_rows(a), ad_rows(b)) && fits(ad_cols(a), ad_cols(b)) &&
            larger(ad_rows(a), ad_rows(b)) * larger(ad_cols(a), ad_cols(b)) <= m->most)
            return b;
    }
    return a;
}

/* ---- elementwise ---- */

static const struct {
    int arity;
    double lo, hi;
} domain[AD_N_OPS] = {
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = {1, lo, hi},
#define AD_BINARY(name, value, da, db, lo, hi) [AD_OP_##name] = {2, lo, hi},
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = {3, lo, hi},
#include "autodiff/ops.def"
};

static void elementwise(struct maker *m)
{
    enum ad_op op;
    do
        op = (enum ad_op)pick(m, AD_N_OPS);
    while (!domain[op].arity);
    ad_var a = into(m, any(m), domain[op].lo, domain[op].hi);
    if (domain[op].arity == 1) {
        keep(m, ad_unary(op, a));
        return;
    }
    if (op == AD_OP_powi) {
        static const double exponents[] = {-3, -2, -1, 2, 3, 4, 5, 7};
        keep(m, ad_pow(a, exponents[pick(m, 8)]));
        return;
    }
    ad_var b = into(m, partner(m, a), domain[op].lo, domain[op].hi);
    if (domain[op].arity == 2) {
        bool constant = pick(m, 5) == 0;
        double c = number(m, domain[op].lo, domain[op].hi);
        if (constant)
            keep(m, pick(m, 2) ? ad_binary(op, AD_ARG(a), AD_ARG(c))
                               : ad_binary(op, AD_ARG(c), AD_ARG(a)));
        else
            keep(m, ad_binary(op, AD_ARG(a), AD_ARG(b)));
        return;
    }
    ad_var c = partner(m, b);
    if (!fits(ad_rows(a), ad_rows(c)) || !fits(ad_cols(a), ad_cols(c)))
        c = a;
    ad_var condition = pick(m, 2) ? ad_lt(a, number(m, -1, 1)) : ad_le(b, c);
    if (larger(larger(ad_rows(a), ad_rows(b)), ad_rows(c)) *
            larger(larger(ad_cols(a), ad_cols(b)), ad_cols(c)) <=
        m->most)
        keep(m, ad_select(condition, pick(m, 4) ? b : a, c));
}

/* Plain arithmetic and few functions, of the program's main shape: segments get long. */
static void chain(struct maker *m)
{
    ad_var a = any(m), b = any(m);
    for (int attempt = 0; attempt < 8 && (ad_rows(a) != m->rows || ad_cols(a) != m->cols);
         attempt++)
        a = any(m);
    if (!fits(ad_rows(a), ad_rows(b)) || !fits(ad_cols(a), ad_cols(b)) ||
        larger(ad_rows(a), ad_rows(b)) * larger(ad_cols(a), ad_cols(b)) > m->most)
        b = a;
    switch (pick(m, 6)) {
    case 0:
        keep(m, ad_mul(number(m, 0.3, 0.9), ad_add(a, b)));
        break;
    case 1:
        keep(m, ad_sub(a, ad_mul(0.5, b)));
        break;
    case 2:
        keep(m, ad_mul(a, ad_sin(b)));
        break;
    case 3:
        keep(m, ad_cos(a));
        break;
    case 4:
        keep(m, ad_div(a, ad_add(1.25, ad_square(b))));
        break;
    default:
        keep(m, ad_tanh(ad_add(a, b)));
    }
}

/* ---- sums ---- */

static void sums(struct maker *m)
{
    ad_var x = any(m), y = partner(m, x);
    double size = (double)(ad_rows(x) * ad_cols(x));
    switch (pick(m, 5)) {
    case 0:
        keep(m, ad_mul(1 / size, ad_sum(x)));
        break;
    case 1:
        keep(m, ad_mul(1.0 / (double)ad_rows(x), ad_sum_rows(x)));
        break;
    case 2:
        keep(m, ad_mul(1.0 / (double)ad_cols(x), ad_sum_cols(x)));
        break;
    case 3:
        keep(m, ad_mean(x));
        break;
    default:
        keep(m, ad_mul(1 / size, ad_dot(x, y)));
    }
}

enum { LIST = 40 };

static void scatter(struct maker *m)
{
    ad_var x = any(m);
    uint32_t list[LIST];
    size_t height = 1 + pick(m, 6);
    if (ad_rows(x) > LIST || height * ad_cols(x) > m->most)
        return;
    for (size_t k = 0; k < ad_rows(x); k++)
        list[k] = (uint32_t)pick(m, height);
    ad_var y = ad_scatter_rows(x, list, height);
    if (pick(m, 2)) { /* sums of sums share their memory */
        for (size_t k = 0; k < ad_rows(x); k++)
            list[k] = (uint32_t)pick(m, height);
        ad_var z = ad_scatter_rows(ad_sin(x), list, height);
        y = pick(m, 2) ? ad_add(y, z) : ad_sub(y, z);
    }
    keep(m, y);
}

static void matmul(struct maker *m)
{
    ad_var a = any(m), b = any(m);
    bool ta = pick(m, 2), tb = pick(m, 2);
    if ((ta ? ad_rows(a) : ad_cols(a)) != (tb ? ad_cols(b) : ad_rows(b))) {
        b = a;
        tb = !ta;
    }
    size_t rows = ta ? ad_cols(a) : ad_rows(a), cols = tb ? ad_rows(b) : ad_cols(b),
           inner = ta ? ad_rows(a) : ad_cols(a);
    if (rows * cols > m->most || rows * cols * inner > 20 * m->most)
        return;
    ad_var y = ad_mul(1 / (double)inner, ad_matmul(a, ta, b, tb));
    if (pick(m, 2) && rows == ad_rows(a) && cols == ad_cols(a))
        y = ad_add(y, a);
    keep(m, y);
}

/* ---- structure ---- */

static void slice(struct maker *m)
{
    ad_var x = any(m);
    bool rows = pick(m, 2);
    size_t n = rows ? ad_rows(x) : ad_cols(x), first = pick(m, n), count = 1 + pick(m, n - first);
    keep(m, rows ? ad_slice_rows(x, first, count) : ad_slice_cols(x, first, count));
}

static void gather(struct maker *m)
{
    ad_var x = any(m);
    uint32_t list[LIST];
    size_t n = 1 + pick(m, LIST);
    if (n * ad_cols(x) > m->most)
        return;
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)pick(m, ad_rows(x));
    keep(m, ad_gather_rows(x, n, list));
}

static void columns(struct maker *m)
{
    ad_var x = any(m);
    size_t n = ad_cols(x), width = 1 + pick(m, 12);
    uint32_t *list = malloc(n * sizeof *list), few[LIST];
    if (!list)
        abort();
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)pick(m, width);
    for (size_t k = 0; k < LIST; k++)
        few[k] = (uint32_t)pick(m, n);
    if (pick(m, 2) && LIST * ad_rows(x) <= m->most)
        keep(m, ad_gather_cols(x, 1 + pick(m, LIST), few));
    else if (width * ad_rows(x) <= m->most)
        keep(m, ad_scatter_cols(x, list, width));
    free(list);
}

/* Made of other operations, but for the cumulative sums. */
static void reductions(struct maker *m)
{
    static ad_var (*const record[])(ad_var) = {
        ad_max_rows,         ad_max_cols,         ad_min_rows,     ad_min_cols,    ad_arg_max_rows,
        ad_log_sum_exp_rows, ad_log_sum_exp_cols, ad_softmax_rows, ad_softmax_cols};
    bool cumulative = pick(m, 3) == 0;
    ad_var x = any(m);
    if (cumulative)
        keep(m, pick(m, 2) ? ad_cumsum_rows(x) : ad_cumsum_cols(x));
    else
        keep(m, record[pick(m, sizeof record / sizeof *record)](x));
}

/* Small systems of matrices near 2, or 2 beside the diagonal, in each column. */
static void systems(struct maker *m)
{
    ad_var x = any(m), b = any(m);
    size_t n = 1 + pick(m, 4), sides = 1 + pick(m, 2), cols = ad_cols(x);
    enum ad_factors factors = pick(m, 2) ? AD_CHOLESKY : AD_LU;
    uint32_t list[LIST];
    double unit[16] = {0};
    if (n * n * cols > m->most || (ad_cols(b) != cols && ad_cols(b) != 1))
        return;
    for (size_t k = 0; k < LIST; k++)
        list[k] = (uint32_t)pick(m, ad_rows(x));
    for (size_t i = 0; i < n; i++)
        unit[i * n + (factors == AD_LU ? (i + 1) % n : i)] = 2;
    ad_var a = ad_add(ad_mul(0.2, ad_tanh(ad_gather_rows(x, n * n, list))),
                      ad_const(m->r->tape, n * n, 1, unit));
    for (size_t k = 0; k < LIST; k++)
        list[k] = (uint32_t)pick(m, ad_rows(b));
    switch (pick(m, 3)) {
    case 0:
        keep(m, ad_solve(a, ad_gather_rows(b, n * sides, list), factors));
        break;
    case 1:
        keep(m, ad_inverse(a, factors));
        break;
    default:
        keep(m, ad_logdet(a, factors));
    }
}

/* A pair law: differences of gathered rows, brought back by a scatter. */
static void pairs(struct maker *m)
{
    ad_var x = any(m);
    uint32_t first[LIST], second[LIST];
    size_t n = ad_rows(x);
    if (n < 2 || LIST * ad_cols(x) > m->most)
        return;
    for (size_t k = 0; k < LIST; k++) {
        first[k] = (uint32_t)pick(m, n);
        second[k] = (uint32_t)pick(m, n);
    }
    ad_var d = ad_sub(ad_gather_rows(x, LIST, first), ad_gather_rows(x, LIST, second));
    ad_var f = ad_div(d, ad_add(0.5, ad_square(d)));
    keep(m, ad_mul(0.1, ad_sub(ad_scatter_rows(f, first, n), ad_scatter_rows(f, second, n))));
}

static void reshape(struct maker *m)
{
    ad_var x = any(m);
    size_t size = ad_rows(x) * ad_cols(x), rows = 1 + pick(m, 8);
    if (size % rows == 0)
        keep(m, ad_reshape(x, rows, size / rows));
}

static void broadcast(struct maker *m)
{
    ad_var x = any(m);
    if (fits(ad_rows(x), m->rows) && fits(ad_cols(x), m->cols) && ad_rows(x) <= m->rows &&
        ad_cols(x) <= m->cols)
        keep(m, ad_broadcast(x, m->rows, m->cols));
}

static void concat(struct maker *m)
{
    ad_var part[3];
    size_t n = 2 + pick(m, 2), extent = 0;
    bool rows = pick(m, 2);
    part[0] = any(m);
    for (size_t k = 0; k < n; k++) {
        ad_var x = any(m);
        bool same = rows ? ad_cols(x) == ad_cols(part[0]) : ad_rows(x) == ad_rows(part[0]);
        part[k] = k && same ? x : part[0];
        extent += rows ? ad_rows(part[k]) : ad_cols(part[k]);
    }
    if (extent * (rows ? ad_cols(part[0]) : ad_rows(part[0])) <= m->most)
        keep(m, rows ? ad_concat_rows(n, part) : ad_concat_cols(n, part));
}

static void place(struct maker *m)
{
    ad_var part[2] = {any(m), any(m)};
    size_t rows = larger(ad_rows(part[0]), ad_rows(part[1])) + pick(m, 3);
    size_t cols = larger(ad_cols(part[0]), ad_cols(part[1])) + pick(m, 3);
    size_t row[2], col[2];
    for (int k = 0; k < 2; k++) {
        row[k] = pick(m, rows - ad_rows(part[k]) + 1);
        col[k] = pick(m, cols - ad_cols(part[k]) + 1);
    }
    if (rows * cols <= m->most)
        keep(m, ad_place(m->r->tape, rows, cols, 2, part, row, col));
}

static void difference(struct maker *m)
{
    ad_var x = any(m);
    bool repeat = pick(m, 2);
    double scale = number(m, 0.3, 0.9);
    if (ad_cols(x) < 2)
        return;
    if (pick(m, 2))
        keep(m, ad_diff(x, scale, repeat));
    else
        keep(m, ad_diff_adjoint(x, scale, repeat, ad_cols(x) + !repeat));
}

static void transpose(struct maker *m) { keep(m, ad_transpose(any(m))); }

static const struct {
    void (*record)(struct maker *m);
    size_t weight;
} operations[] = {
    {elementwise, 14}, {chain, 14},    {sums, 5},    {scatter, 2},    {matmul, 1},    {slice, 3},
    {gather, 2},       {pairs, 1},     {reshape, 1}, {concat, 2},     {broadcast, 2}, {place, 1},
    {difference, 3},   {transpose, 1}, {columns, 2}, {reductions, 2}, {systems, 1},
};

/* One of `smooth` operations, 0: any, may need a value whole: few of them make long segments. */
static void step(struct maker *m, size_t smooth)
{
    size_t total = 0, k = 0;
    for (size_t i = 0; i < sizeof operations / sizeof *operations; i++)
        total += operations[i].weight;
    size_t at = pick(m, total);
    if (smooth && pick(m, smooth)) {
        (pick(m, 4) ? chain : pick(m, 3) ? elementwise : sums)(m);
        return;
    }
    for (; at >= operations[k].weight; k++)
        at -= operations[k].weight;
    operations[k].record(m);
}

/* ---- programs ---- */

static void add_inputs(struct maker *m)
{
    struct random_tape *r = m->r;
    r->n_inputs = 1 + pick(m, TAPE_INPUTS);
    r->n_held = pick(m, 3) ? 0 : pick(m, r->n_inputs);
    for (size_t k = 0; k < r->n_inputs; k++) {
        size_t rows = k == 0 || pick(m, 3) ? m->rows : 1, cols = k == 0 || pick(m, 3) ? m->cols : 1;
        r->in[k] = ad_input(r->tape, rows, cols, NULL);
        if (k < r->n_held)
            ad_hold(r->in[k]);
        for (int v = 0; v < 2; v++)
            r->values[v][k] = random_values(&m->random, rows * cols, -1.5, 1.5);
        plain_set(&r->plain, r->in[k], r->values[0][k]);
        keep(m, r->in[k]);
    }
    double *c = random_values(&m->random, m->rows * m->cols, -1, 1);
    keep(m, ad_const(r->tape, m->rows, m->cols, c));
    free(c);
}

static ad_var objective(struct maker *m)
{
    ad_var y = ad_mean(m->pool[m->n - 1]);
    size_t terms = 2 + m->n / 10;
    for (size_t k = 0; k < terms; k++) {
        ad_var x = k < 4 ? any(m) : m->pool[pick(m, m->n)];
        y = ad_add(y, ad_mul(number(m, 0.5, 1.5), ad_mean(ad_mul(x, ad_add(1.0, x)))));
    }
    return y;
}

static ad_var add_gradient(struct maker *m, ad_var y)
{
    struct random_tape *r = m->r;
    ad_var g[TAPE_INPUTS], next = ad_scalar(r->tape, 0);
    ad_grad(y, r->n_inputs, r->in, g);
    for (size_t k = 0; k < r->n_inputs; k++) {
        r->out[r->n_out++] = g[k];
        next = ad_add(next, ad_dot(g[k], g[k]));
    }
    return next;
}

void random_tape_init(struct random_tape *r, uint64_t seed, size_t nodes)
{
    static const size_t rows[] = {1, 1, 2, 3, 5, 8, 12, 40, 300};
    static const size_t cols[] = {1, 1, 2, 3, 7, 8, 16, 17, 33, 100, 257, 1000};
    struct maker m = {.r = r, .random = seed * 2 + 1};
    *r = (struct random_tape){.tape = ad_tape_new(pick(&m, 4) ? AD_F64 : AD_F32)};
    plain_init(&r->plain, r->tape);
    size_t budget = pick(&m, 4) ? 60000 : 400000; /* elements of all nodes */
    size_t smooth = nodes < 400 ? 12 * pick(&m, 2) : pick(&m, 8) ? 40 : 0;
    r->order = (int)pick(&m, 5) / 2;
    do {
        m.rows = rows[pick(&m, sizeof rows / sizeof *rows)];
        m.cols = cols[pick(&m, sizeof cols / sizeof *cols)];
    } while (m.rows * m.cols * (nodes + 20) > budget && m.rows * m.cols > 8);
    m.most = 2 * m.rows * m.cols + 64;
    add_inputs(&m);
    size_t own = r->order == 0 ? nodes : r->order == 1 ? nodes / 4 : nodes / 12;
    for (size_t k = 0; r->plain.n < own + 8 && k < 20 * own + 20; k++)
        step(&m, smooth);
    for (size_t k = 0; k < 5; k++)
        r->out[r->n_out++] = k ? any(&m) : m.pool[m.n - 1];
    r->out[r->n_out++] = m.pool[pick(&m, m.n)];
    ad_var y = objective(&m);
    r->out[r->n_out++] = y;
    for (int k = 0; k < r->order; k++)
        y = add_gradient(&m, y);
    plain_run(&r->plain);
    free(m.pool);
}

void random_tape_release(struct random_tape *r)
{
    plain_release(&r->plain);
    for (int v = 0; v < 2; v++)
        for (size_t k = 0; k < r->n_inputs; k++)
            free(r->values[v][k]);
    ad_tape_free(r->tape);
}
