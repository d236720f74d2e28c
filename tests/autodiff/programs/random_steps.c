/* One random operation, of every kind there is (random_tape.h). */
#include "random_steps.h"
#include "tests/autodiff/ring.h"

#include <stdlib.h>

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
    ad_var a = maker_into(m, maker_any(m), domain[op].lo, domain[op].hi);
    if (domain[op].arity == 1) {
        maker_keep(m, ad_unary(op, a));
        return;
    }
    if (op == AD_OP_powi) {
        static const double exponents[] = {-3, -2, -1, 2, 3, 4, 5, 7};
        maker_keep(m, ad_pow(a, exponents[pick(m, 8)]));
        return;
    }
    ad_var b = maker_into(m, maker_partner(m, a), domain[op].lo, domain[op].hi);
    if (domain[op].arity == 2) {
        bool constant = pick(m, 5) == 0;
        double c = number(m, domain[op].lo, domain[op].hi);
        if (constant)
            maker_keep(m, pick(m, 2) ? ad_binary(op, AD_ARG(a), AD_ARG(c))
                                     : ad_binary(op, AD_ARG(c), AD_ARG(a)));
        else
            maker_keep(m, ad_binary(op, AD_ARG(a), AD_ARG(b)));
        return;
    }
    ad_var c = maker_partner(m, b);
    if (!fits(ad_rows(a), ad_rows(c)) || !fits(ad_cols(a), ad_cols(c)))
        c = a;
    ad_var condition = pick(m, 2) ? ad_lt(a, number(m, -1, 1)) : ad_le(b, c);
    if (larger(larger(ad_rows(a), ad_rows(b)), ad_rows(c)) *
            larger(larger(ad_cols(a), ad_cols(b)), ad_cols(c)) <=
        m->most)
        maker_keep(m, ad_select(condition, pick(m, 4) ? b : a, c));
}

/* Plain arithmetic and few functions, of the program's main shape: segments get long. */
static void chain(struct maker *m)
{
    ad_var a = maker_any(m), b = maker_any(m);
    for (int attempt = 0; attempt < 8 && (ad_rows(a) != m->rows || ad_cols(a) != m->cols);
         attempt++)
        a = maker_any(m);
    if (!fits(ad_rows(a), ad_rows(b)) || !fits(ad_cols(a), ad_cols(b)) ||
        larger(ad_rows(a), ad_rows(b)) * larger(ad_cols(a), ad_cols(b)) > m->most)
        b = a;
    switch (pick(m, 6)) {
    case 0:
        maker_keep(m, ad_mul(number(m, 0.3, 0.9), ad_add(a, b)));
        break;
    case 1:
        maker_keep(m, ad_sub(a, ad_mul(0.5, b)));
        break;
    case 2:
        maker_keep(m, ad_mul(a, ad_sin(b)));
        break;
    case 3:
        maker_keep(m, ad_cos(a));
        break;
    case 4:
        maker_keep(m, ad_div(a, ad_add(1.25, ad_square(b))));
        break;
    default:
        maker_keep(m, ad_tanh(ad_add(a, b)));
    }
}

/* ---- sums ---- */

static void sums(struct maker *m)
{
    ad_var x = maker_any(m), y = maker_partner(m, x);
    double size = (double)(ad_rows(x) * ad_cols(x));
    switch (pick(m, 5)) {
    case 0:
        maker_keep(m, ad_mul(1 / size, ad_sum(x)));
        break;
    case 1:
        maker_keep(m, ad_mul(1.0 / (double)ad_rows(x), ad_sum_rows(x)));
        break;
    case 2:
        maker_keep(m, ad_mul(1.0 / (double)ad_cols(x), ad_sum_cols(x)));
        break;
    case 3:
        maker_keep(m, ad_mean(x));
        break;
    default:
        maker_keep(m, ad_mul(1 / size, ad_dot(x, y)));
    }
}

enum { LIST = 40 };

static void scatter(struct maker *m)
{
    ad_var x = maker_any(m);
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
    maker_keep(m, y);
}

static void matmul(struct maker *m)
{
    ad_var a = maker_any(m), b = maker_any(m);
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
    maker_keep(m, y);
}

/* ---- structure ---- */

static void slice(struct maker *m)
{
    ad_var x = maker_any(m);
    bool rows = pick(m, 2);
    size_t n = rows ? ad_rows(x) : ad_cols(x), first = pick(m, n), count = 1 + pick(m, n - first);
    maker_keep(m, rows ? ad_slice_rows(x, first, count) : ad_slice_cols(x, first, count));
}

static void gather(struct maker *m)
{
    ad_var x = maker_any(m);
    uint32_t list[LIST];
    size_t n = 1 + pick(m, LIST);
    if (n * ad_cols(x) > m->most)
        return;
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)pick(m, ad_rows(x));
    maker_keep(m, ad_gather_rows(x, n, list));
}

static void columns(struct maker *m)
{
    ad_var x = maker_any(m);
    size_t n = ad_cols(x), width = 1 + pick(m, 12);
    uint32_t *list = malloc(n * sizeof *list), few[LIST];
    if (!list)
        abort();
    for (size_t k = 0; k < n; k++)
        list[k] = (uint32_t)pick(m, width);
    for (size_t k = 0; k < LIST; k++)
        few[k] = (uint32_t)pick(m, n);
    if (pick(m, 2) && LIST * ad_rows(x) <= m->most)
        maker_keep(m, ad_gather_cols(x, 1 + pick(m, LIST), few));
    else if (width * ad_rows(x) <= m->most)
        maker_keep(m, ad_scatter_cols(x, list, width));
    free(list);
}

/* Made of other operations, but for the cumulative sums. */
static void reductions(struct maker *m)
{
    static ad_var (*const record[])(ad_var) = {
        ad_max_rows,         ad_max_cols,         ad_min_rows,     ad_min_cols,    ad_arg_max_rows,
        ad_log_sum_exp_rows, ad_log_sum_exp_cols, ad_softmax_rows, ad_softmax_cols};
    bool cumulative = pick(m, 3) == 0;
    ad_var x = maker_any(m);
    if (cumulative)
        maker_keep(m, pick(m, 2) ? ad_cumsum_rows(x) : ad_cumsum_cols(x));
    else
        maker_keep(m, record[pick(m, sizeof record / sizeof *record)](x));
}

/* An operation of one's own, of all rows of a value. */
static void own(struct maker *m)
{
    ad_var x = maker_any(m);
    if (ad_rows(x) <= RING_MOST)
        maker_keep(m, ring(x));
}

/* Small systems of matrices near 2, or 2 beside the diagonal, in each column. */
static void systems(struct maker *m)
{
    ad_var x = maker_any(m), b = maker_any(m);
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
        maker_keep(m, ad_solve(a, ad_gather_rows(b, n * sides, list), factors));
        break;
    case 1:
        maker_keep(m, ad_inverse(a, factors));
        break;
    default:
        maker_keep(m, ad_logdet(a, factors));
    }
}

/* A pair law: differences of gathered rows, brought back by a scatter. */
static void pairs(struct maker *m)
{
    ad_var x = maker_any(m);
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
    maker_keep(m, ad_mul(0.1, ad_sub(ad_scatter_rows(f, first, n), ad_scatter_rows(f, second, n))));
}

static void reshape(struct maker *m)
{
    ad_var x = maker_any(m);
    size_t size = ad_rows(x) * ad_cols(x), rows = 1 + pick(m, 8);
    if (size % rows == 0)
        maker_keep(m, ad_reshape(x, rows, size / rows));
}

static void broadcast(struct maker *m)
{
    ad_var x = maker_any(m);
    if (fits(ad_rows(x), m->rows) && fits(ad_cols(x), m->cols) && ad_rows(x) <= m->rows &&
        ad_cols(x) <= m->cols)
        maker_keep(m, ad_broadcast(x, m->rows, m->cols));
}

static void concat(struct maker *m)
{
    ad_var part[3];
    size_t n = 2 + pick(m, 2), extent = 0;
    bool rows = pick(m, 2);
    part[0] = maker_any(m);
    for (size_t k = 0; k < n; k++) {
        ad_var x = maker_any(m);
        bool same = rows ? ad_cols(x) == ad_cols(part[0]) : ad_rows(x) == ad_rows(part[0]);
        part[k] = k && same ? x : part[0];
        extent += rows ? ad_rows(part[k]) : ad_cols(part[k]);
    }
    if (extent * (rows ? ad_cols(part[0]) : ad_rows(part[0])) <= m->most)
        maker_keep(m, rows ? ad_concat_rows(n, part) : ad_concat_cols(n, part));
}

static void place(struct maker *m)
{
    ad_var part[2] = {maker_any(m), maker_any(m)};
    size_t rows = larger(ad_rows(part[0]), ad_rows(part[1])) + pick(m, 3);
    size_t cols = larger(ad_cols(part[0]), ad_cols(part[1])) + pick(m, 3);
    size_t row[2], col[2];
    for (int k = 0; k < 2; k++) {
        row[k] = pick(m, rows - ad_rows(part[k]) + 1);
        col[k] = pick(m, cols - ad_cols(part[k]) + 1);
    }
    if (rows * cols <= m->most)
        maker_keep(m, ad_place(m->r->tape, rows, cols, 2, part, row, col));
}

static void difference(struct maker *m)
{
    ad_var x = maker_any(m);
    bool repeat = pick(m, 2);
    double scale = number(m, 0.3, 0.9);
    if (ad_cols(x) < 2)
        return;
    if (pick(m, 2))
        maker_keep(m, ad_diff(x, scale, repeat));
    else
        maker_keep(m, ad_diff_adjoint(x, scale, repeat, ad_cols(x) + !repeat));
}

static void transpose(struct maker *m) { maker_keep(m, ad_transpose(maker_any(m))); }

static const struct {
    void (*record)(struct maker *m);
    size_t weight;
} operations[] = {
    {elementwise, 14}, {chain, 14},    {sums, 5},    {scatter, 2},    {matmul, 1},    {slice, 3},
    {gather, 2},       {pairs, 1},     {reshape, 1}, {concat, 2},     {broadcast, 2}, {place, 1},
    {difference, 3},   {transpose, 1}, {columns, 2}, {reductions, 2}, {systems, 1},   {own, 1},
};

void random_step(struct maker *m, size_t smooth)
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
