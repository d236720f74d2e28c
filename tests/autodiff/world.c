#include "world.h"

#include <stdlib.h>

/* Values stay of order one, and no operation amplifies rounding much: a wrong program is off by far
   more than a different order of additions. */
enum { LARGEST = 20000, ROWS = 7 };

static struct matrix matrix(size_t rows, size_t cols)
{
    struct matrix m = {rows, cols, calloc(rows * cols, sizeof *m.v)};
    assert_non_null(m.v);
    return m;
}

static double at(const struct matrix *m, size_t r, size_t c)
{
    return m->v[(m->rows == 1 ? 0 : r) * m->cols + (m->cols == 1 ? 0 : c)];
}

static size_t pick(struct world *w, size_t n) { return below(&w->structure, n); }

static double number(struct world *w, double lo, double hi)
{
    return (float)uniform(&w->structure, lo, hi);
}

static void add(struct world *w, ad_var var, struct matrix m)
{
    assert_tape_ok(w->tape);
    assert_int_equal(ad_rows(var), m.rows);
    assert_int_equal(ad_cols(var), m.cols);
    w->var[w->n] = var;
    w->m[w->n++] = m;
}

/* Recent values are the more likely ones, so that programs get deep. */
static size_t any(struct world *w)
{
    return pick(w, 3) ? w->n - 1 - pick(w, w->n < 6 ? w->n : 6) : pick(w, w->n);
}

/* ---- elementwise ---- */

#define UNARY(X)                                                                                   \
    X(true, ad_neg(x), -x)                                                                         \
    X(true, ad_sin(ad_mul(1.25, x)), sin(1.25 * x))                                                \
    X(true, ad_cos(x), cos(x))                                                                     \
    X(true, ad_tanh(x), tanh(x))                                                                   \
    X(true, ad_sigmoid(x), 1 / (1 + exp(-x)))                                                      \
    X(true, ad_sub(ad_softplus(x), 1.0), log1p(exp(x)) - 1)                                        \
    X(true, ad_mul(ad_square(x), 0.25), 0.25 * x * x)                                              \
    X(true, ad_recip(ad_add(1.0, ad_square(x))), 1 / (1 + x * x))                                  \
    X(true, ad_sqrt(ad_add(ad_square(x), 1.0)), sqrt(1 + x * x))                                   \
    X(true, ad_exp(ad_mul(-0.5, ad_square(x))), exp(-0.5 * x * x))                                 \
    X(true, ad_log(ad_add(2.0, ad_sin(x))), log(2 + sin(x)))                                       \
    X(true, ad_log1p(ad_square(x)), log1p(x *x))                                                   \
    X(true, ad_expm1(ad_tanh(x)), expm1(tanh(x)))                                                  \
    X(true, ad_atan(x), atan(x))                                                                   \
    X(true, ad_asin(ad_mul(0.75, ad_sin(x))), asin(0.75 * sin(x)))                                 \
    X(true, ad_acos(ad_mul(0.75, ad_cos(x))), acos(0.75 * cos(x)))                                 \
    X(true, ad_tan(ad_tanh(x)), tan(tanh(x)))                                                      \
    X(true, ad_sinh(ad_sin(x)), sinh(sin(x)))                                                      \
    X(true, ad_cosh(ad_sin(x)), cosh(sin(x)))                                                      \
    X(true, ad_pow(ad_mul(0.5, x), 3.0), 0.125 * x * x * x)                                        \
    X(true, ad_pow(ad_add(1.5, ad_sin(x)), -1.5), pow(1.5 + sin(x), -1.5))                         \
    X(true, ad_div(x, ad_add(ad_square(x), 0.75)), x / (x * x + 0.75))                             \
    X(false, ad_abs(ad_sub(x, 0.1337)), fabs(x - 0.1337))                                          \
    X(false, ad_relu(ad_sub(0.2337, x)), fmax(0.2337 - x, 0))                                      \
    X(false, ad_step(ad_sub(x, 0.3337)), x > 0.3337)                                               \
    X(false, ad_select(ad_lt(x, 0.0337), ad_square(x), ad_recip(x)), x < 0.0337 ? x * x : 1 / x)   \
    X(false, ad_min(ad_max(x, -0.777), 0.888), fmin(fmax(x, -0.777), 0.888))

#define BINARY(X)                                                                                  \
    X(true, ad_mul(0.5, ad_add(x, y)), 0.5 * (x + y))                                              \
    X(true, ad_sub(x, ad_mul(y, 0.5)), x - 0.5 * y)                                                \
    X(true, ad_mul(x, ad_sin(y)), x *sin(y))                                                       \
    X(true, ad_div(x, ad_add(ad_square(y), 1.5)), x / (y * y + 1.5))                               \
    X(true, ad_hypot(x, ad_add(ad_sin(y), 2.0)), hypot(x, sin(y) + 2))                             \
    X(true, ad_atan2(x, ad_add(ad_square(y), 0.5)), atan2(x, y *y + 0.5))                          \
    X(true, ad_pow(ad_add(2.0, ad_sin(x)), ad_sin(y)), pow(2 + sin(x), sin(y)))                    \
    X(false, ad_min(x, y), fmin(x, y))                                                             \
    X(false, ad_max(x, y), fmax(x, y))                                                             \
    X(false, ad_select(ad_lt(x, 0.4337), y, x), x < 0.4337 ? y : x)

static ad_var unary_record(size_t k, ad_var x)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return recorded;
    UNARY(X)
#undef X
    return x;
}

static double unary_plain(size_t k, double x)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return plain;
    UNARY(X)
#undef X
    return x;
}

static ad_var binary_record(size_t k, ad_var x, ad_var y)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return recorded;
    BINARY(X)
#undef X
    return x;
}

static double binary_plain(size_t k, double x, double y)
{
    size_t i = 0;
#define X(smooth, recorded, plain)                                                                 \
    if (i++ == k)                                                                                  \
        return plain;
    BINARY(X)
#undef X
    return x;
}

#define X(smooth, recorded, plain) smooth,
static const bool unary_smooth[] = {UNARY(X)}, binary_smooth[] = {BINARY(X)};
#undef X
enum { N_UNARY = sizeof unary_smooth, N_BINARY = sizeof binary_smooth };

static size_t pick_function(struct world *w, size_t n, const bool *smooth)
{
    size_t k;
    do
        k = pick(w, n);
    while (w->smooth && !smooth[k]);
    return k;
}

static void unary(struct world *w)
{
    size_t a = any(w), k = pick_function(w, N_UNARY, unary_smooth);
    struct matrix m = matrix(w->m[a].rows, w->m[a].cols);
    for (size_t i = 0; i < m.rows * m.cols; i++)
        m.v[i] = unary_plain(k, w->m[a].v[i]);
    add(w, unary_record(k, w->var[a]), m);
}

static bool fits(size_t a, size_t b) { return a == b || a == 1 || b == 1; }

static size_t larger(size_t a, size_t b) { return a > b ? a : b; }

/* A value that broadcasts with value a (and b); a itself if none turns up. */
static size_t partner(struct world *w, size_t a, size_t b)
{
    for (int attempt = 0; attempt < 20; attempt++) {
        size_t c = any(w), rows = larger(w->m[a].rows, w->m[b].rows);
        size_t cols = larger(w->m[a].cols, w->m[b].cols);
        if (fits(rows, w->m[c].rows) && fits(cols, w->m[c].cols) &&
            larger(rows, w->m[c].rows) * larger(cols, w->m[c].cols) <= LARGEST)
            return c;
    }
    return a;
}

static void binary(struct world *w)
{
    size_t a = any(w), b = partner(w, a, a), k = pick_function(w, N_BINARY, binary_smooth);
    if (pick(w, 2)) {
        size_t swap = a;
        a = b;
        b = swap;
    }
    struct matrix m =
        matrix(larger(w->m[a].rows, w->m[b].rows), larger(w->m[a].cols, w->m[b].cols));
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = binary_plain(k, at(&w->m[a], r, c), at(&w->m[b], r, c));
    add(w, binary_record(k, w->var[a], w->var[b]), m);
}

/* The condition is a random constant: smooth in the branches. */
static void select_by_constant(struct world *w)
{
    size_t a = any(w), b = partner(w, a, a);
    struct matrix m =
        matrix(larger(w->m[a].rows, w->m[b].rows), larger(w->m[a].cols, w->m[b].cols));
    double *mask = random_values(&w->structure, m.cols, -1, 1);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = mask[c] > 0 ? at(&w->m[a], r, c) : at(&w->m[b], r, c);
    ad_var condition = ad_gt(ad_const(w->tape, 1, m.cols, mask), 0.0);
    add(w, ad_select(condition, w->var[a], w->var[b]), m);
    free(mask);
}

/* ---- sums, products ---- */

static void sum(struct world *w)
{
    size_t a = any(w), which = pick(w, 4);
    const struct matrix *x = &w->m[a];
    bool rows = which != 1, cols = which != 0;
    struct matrix m = matrix(rows ? 1 : x->rows, cols ? 1 : x->cols);
    double scale = (double)(m.rows * m.cols) / (double)(x->rows * x->cols);
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; c < x->cols; c++)
            m.v[(rows ? 0 : r) * m.cols + (cols ? 0 : c)] += scale * at(x, r, c);
    ad_var y = which == 0   ? ad_sum_rows(w->var[a])
               : which == 1 ? ad_sum_cols(w->var[a])
               : which == 2 ? ad_sum(w->var[a])
                            : ad_mean(w->var[a]);
    add(w, which == 3 ? y : ad_mul(scale, y), m);
}

static void dot(struct world *w)
{
    size_t a = any(w), b = partner(w, a, a);
    size_t rows = larger(w->m[a].rows, w->m[b].rows), cols = larger(w->m[a].cols, w->m[b].cols);
    struct matrix m = matrix(1, 1);
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            *m.v += at(&w->m[a], r, c) * at(&w->m[b], r, c);
    double scale = 1.0 / (double)(rows * cols);
    *m.v *= scale;
    add(w, ad_mul(ad_dot(w->var[a], w->var[b]), scale), m);
}

/* Transposition flags are drawn until the inner dimensions agree; x' x always does. */
static void matmul(struct world *w)
{
    size_t a = any(w), b = any(w);
    bool ta = pick(w, 2), tb = pick(w, 2);
    const struct matrix *x = &w->m[a], *y = &w->m[b];
    if ((ta ? x->rows : x->cols) != (tb ? y->cols : y->rows)) {
        b = a;
        y = x;
        tb = !ta;
    }
    size_t rows = ta ? x->cols : x->rows, cols = tb ? y->rows : y->cols;
    size_t inner = ta ? x->rows : x->cols;
    if (rows * cols > LARGEST || rows * cols * inner > 2000000)
        return;
    struct matrix m = matrix(rows, cols);
    double scale = 1.0 / (double)inner;
    for (size_t r = 0; r < rows; r++)
        for (size_t c = 0; c < cols; c++)
            for (size_t k = 0; k < inner; k++)
                m.v[r * cols + c] += scale * (ta ? x->v[k * x->cols + r] : x->v[r * x->cols + k]) *
                                     (tb ? y->v[c * y->cols + k] : y->v[k * y->cols + c]);
    add(w, ad_mul(ad_matmul(w->var[a], ta, w->var[b], tb), scale), m);
}

static void transpose(struct world *w)
{
    size_t a = any(w);
    struct matrix m = matrix(w->m[a].cols, w->m[a].rows);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = w->m[a].v[c * m.rows + r];
    add(w, ad_transpose(w->var[a]), m);
}

/* ---- views ---- */

static void slice(struct world *w)
{
    size_t a = any(w);
    const struct matrix *x = &w->m[a];
    bool by_rows = pick(w, 2);
    size_t length = by_rows ? x->rows : x->cols, first = pick(w, length);
    size_t count = 1 + pick(w, length - first);
    if (!by_rows && length > 8 && pick(w, 2)) { /* nearly all: neighbouring columns */
        first = pick(w, 2);
        count = length - 1;
    }
    struct matrix m = matrix(by_rows ? count : x->rows, by_rows ? x->cols : count);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] =
                x->v[(r + (by_rows ? first : 0)) * x->cols + c + (by_rows ? 0 : first)];
    add(w,
        by_rows ? ad_slice_rows(w->var[a], first, count) : ad_slice_cols(w->var[a], first, count),
        m);
}

static void reshape(struct world *w)
{
    size_t a = any(w), size = w->m[a].rows * w->m[a].cols, rows = 1 + pick(w, ROWS);
    if (pick(w, 4) == 0)
        rows = w->m[a].cols;
    while (size % rows)
        rows--;
    struct matrix m = matrix(rows, size / rows);
    for (size_t i = 0; i < size; i++)
        m.v[i] = w->m[a].v[i];
    add(w, ad_reshape(w->var[a], m.rows, m.cols), m);
}

static void broadcast(struct world *w)
{
    size_t a = any(w), b = any(w);
    const struct matrix *x = &w->m[a];
    struct matrix m = matrix(x->rows == 1 ? 1 + pick(w, ROWS) : x->rows,
                             x->cols == 1 && x->rows < 50 ? w->m[b].cols : x->cols);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++)
            m.v[r * m.cols + c] = at(x, r, c);
    add(w, ad_broadcast(w->var[a], m.rows, m.cols), m);
}

/* ---- indices and places ---- */

static void gather(struct world *w)
{
    size_t a = any(w), n = 1 + pick(w, 2 * ROWS);
    const struct matrix *x = &w->m[a];
    uint32_t list[2 * ROWS];
    if (n * x->cols > LARGEST)
        return;
    struct matrix m = matrix(n, x->cols);
    for (size_t k = 0; k < n; k++) {
        list[k] = (uint32_t)pick(w, x->rows);
        for (size_t c = 0; c < x->cols; c++)
            m.v[k * x->cols + c] = x->v[list[k] * x->cols + c];
    }
    add(w, ad_gather_rows(w->var[a], n, list), m);
}

/* One row picked by index, and repeated. */
static void gather_one(struct world *w)
{
    size_t a = any(w), rows = 1 + pick(w, ROWS);
    const struct matrix *x = &w->m[a];
    uint32_t row = (uint32_t)pick(w, x->rows);
    if (rows * x->cols > LARGEST)
        return;
    struct matrix m = matrix(rows, x->cols);
    for (size_t i = 0; i < rows * x->cols; i++)
        m.v[i] = x->v[row * x->cols + i % x->cols];
    add(w, ad_broadcast(ad_gather_rows(w->var[a], 1, &row), rows, x->cols), m);
}

static void scatter(struct world *w)
{
    size_t a = any(w), height = 1 + pick(w, ROWS);
    const struct matrix *x = &w->m[a];
    if (x->rows > 4 * ROWS)
        return;
    uint32_t list[4 * ROWS];
    struct matrix m = matrix(height, x->cols);
    for (size_t k = 0; k < x->rows; k++) {
        list[k] = (uint32_t)pick(w, height);
        for (size_t c = 0; c < x->cols; c++)
            m.v[list[k] * x->cols + c] += x->v[k * x->cols + c];
    }
    add(w, ad_scatter_rows(w->var[a], list, height), m);
}

/* Sums over rows and scatters of one value and its sine, added or subtracted: the compiler lets
   such sums of sums share one total, but for those that are read elsewhere too. */
static void sum_of_sums(struct world *w)
{
    enum { TERMS = 3 };
    size_t a = any(w), height = pick(w, 3) ? 1 + pick(w, ROWS) : 1, n = 2 + pick(w, TERMS - 1);
    const struct matrix *x = &w->m[a];
    if (x->rows > 4 * ROWS)
        return;
    bool scatters = pick(w, 3);
    struct matrix m = matrix(scatters ? height : 1, x->cols);
    ad_var total = {0}, sine = ad_sin(w->var[a]);
    for (size_t k = 0; k < n; k++) {
        uint32_t list[4 * ROWS] = {0};
        bool negative = pick(w, 2);
        struct matrix term = matrix(m.rows, m.cols);
        for (size_t r = 0; r < x->rows; r++) {
            list[r] = (uint32_t)pick(w, m.rows);
            for (size_t c = 0; c < x->cols; c++) {
                double v = x->v[r * x->cols + c];
                term.v[list[r] * x->cols + c] += k % 2 ? v : sin(v);
            }
        }
        for (size_t i = 0; i < m.rows * m.cols; i++)
            m.v[i] += negative && k ? -term.v[i] : term.v[i];
        ad_var from = k % 2 ? w->var[a] : sine;
        ad_var sum = scatters ? ad_scatter_rows(from, list, height) : ad_sum_rows(from);
        total = k == 0 ? sum : negative ? ad_sub(total, sum) : ad_add(total, sum);
        if (pick(w, 4) == 0 && w->n < MAX_NODES - 1)
            add(w, sum, term);
        else
            free(term.v);
    }
    double scale = 1.0 / (double)(x->rows + 1);
    for (size_t i = 0; i < m.rows * m.cols; i++)
        m.v[i] *= scale;
    add(w, ad_mul(total, scale), m);
}

static void copy_to(struct matrix *m, const struct matrix *x, size_t row, size_t col)
{
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; c < x->cols; c++)
            m->v[(r + row) * m->cols + c + col] += x->v[r * x->cols + c];
}

static void concat(struct world *w)
{
    size_t a = any(w), b = partner(w, a, a);
    const struct matrix *x = &w->m[a], *y = &w->m[b];
    bool by_rows = x->cols == y->cols;
    if ((!by_rows && x->rows != y->rows) || x->rows * x->cols + y->rows * y->cols > LARGEST ||
        (by_rows && x->rows + y->rows > 60))
        return;
    struct matrix m = matrix(x->rows + (by_rows ? y->rows : 0), x->cols + (by_rows ? 0 : y->cols));
    copy_to(&m, x, 0, 0);
    copy_to(&m, y, by_rows ? x->rows : 0, by_rows ? 0 : x->cols);
    const ad_var parts[] = {w->var[a], w->var[b]};
    add(w, by_rows ? ad_concat_rows(2, parts) : ad_concat_cols(2, parts), m);
}

static void place(struct world *w)
{
    size_t id[] = {any(w), any(w), any(w)}, row[3], col[3];
    size_t rows = 1, cols = 1;
    ad_var parts[3];
    for (int k = 0; k < 3; k++) {
        row[k] = pick(w, 3);
        col[k] = pick(w, 3);
        rows = larger(rows, w->m[id[k]].rows + row[k]);
        cols = larger(cols, w->m[id[k]].cols + col[k]);
        parts[k] = w->var[id[k]];
    }
    if (rows * cols > LARGEST)
        return;
    struct matrix m = matrix(rows, cols);
    for (int k = 0; k < 3; k++)
        copy_to(&m, &w->m[id[k]], row[k], col[k]);
    for (size_t i = 0; i < rows * cols; i++)
        m.v[i] *= 0.5;
    add(w, ad_mul(0.5, ad_place(w->tape, rows, cols, 3, parts, row, col)), m);
}

static void diff(struct world *w)
{
    size_t a = any(w);
    const struct matrix *x = &w->m[a];
    bool repeat = pick(w, 2);
    double scale = number(w, 0.2, 0.6);
    if (x->cols < 2)
        return;
    struct matrix m = matrix(x->rows, x->cols - !repeat);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < m.cols; c++) {
            const double *row = x->v + r * x->cols;
            size_t i = c < x->cols - 1 ? c : x->cols - 2;
            m.v[r * m.cols + c] = scale * (row[i + 1] - row[i]);
        }
    add(w, ad_diff(w->var[a], scale, repeat), m);
}

static void diff_adjoint(struct world *w)
{
    size_t a = any(w);
    const struct matrix *x = &w->m[a];
    bool repeat = pick(w, 2);
    double scale = number(w, 0.2, 0.6);
    if (x->cols < 2)
        return;
    struct matrix m = matrix(x->rows, x->cols + !repeat);
    for (size_t r = 0; r < m.rows; r++)
        for (size_t c = 0; c < x->cols; c++) {
            size_t i = c < m.cols - 1 ? c : m.cols - 2;
            m.v[r * m.cols + i + 1] += scale * x->v[r * x->cols + c];
            m.v[r * m.cols + i] -= scale * x->v[r * x->cols + c];
        }
    add(w, ad_diff_adjoint(w->var[a], scale, repeat, m.cols), m);
}

/* ---- worlds ---- */

typedef void operation(struct world *w);

static const struct {
    operation *record;
    size_t weight;
} operations[] = {
    {unary, 6},        {binary, 8},      {sum, 1},
    {dot, 1},          {matmul, 2},      {slice, 4},
    {transpose, 1},    {reshape, 1},     {broadcast, 1},
    {gather, 2},       {gather_one, 1},  {scatter, 2},
    {concat, 2},       {place, 1},       {diff, 3},
    {diff_adjoint, 1}, {sum_of_sums, 2}, {select_by_constant, 1},
};

static operation *pick_operation(struct world *w)
{
    size_t total = 0, k = 0;
    for (size_t i = 0; i < sizeof operations / sizeof operations[0]; i++)
        total += operations[i].weight;
    for (total = pick(w, total); total >= operations[k].weight; k++)
        total -= operations[k].weight;
    return operations[k].record;
}

static struct matrix random_matrix(uint64_t *state, size_t rows, size_t cols)
{
    return (struct matrix){rows, cols, random_values(state, rows * cols, -1.5, 1.5)};
}

void world_init(struct world *w, enum ad_type type, uint64_t structure, uint64_t values,
                size_t cols, size_t n_operations, bool smooth)
{
    *w = (struct world){.tape = ad_tape_new(type), .structure = structure, .values = values};
    w->smooth = smooth;
    w->n_inputs = 1 + pick(w, MAX_INPUTS);
    for (size_t k = 0; k < w->n_inputs; k++) {
        size_t rows = pick(w, 3) ? 1 + pick(w, ROWS) : 1, wide = pick(w, 4);
        struct matrix m = random_matrix(&w->values, rows, k == 0 || wide ? cols : 1);
        add(w, ad_input(w->tape, m.rows, m.cols, NULL), m);
    }
    struct matrix constant = random_matrix(&w->structure, 1 + pick(w, 3), pick(w, 2) ? cols : 1);
    add(w, ad_const(w->tape, constant.rows, constant.cols, constant.v), constant);
    for (size_t k = 0; k < n_operations && w->n < MAX_NODES - 4; k++)
        pick_operation(w)(w);
}

void world_release(struct world *w)
{
    for (size_t k = 0; k < w->n; k++)
        free(w->m[k].v);
    ad_tape_free(w->tape);
}
