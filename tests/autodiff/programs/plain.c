/* Plain evaluation with bounds of rounding (plain.h). */
#include "plain.h"

#include "autodiff/internal.h"
#include "tests/autodiff/references.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *taken(void *memory)
{
    if (!memory) {
        fputs("out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

void plain_init(struct plain *p, const ad_tape *tape) { *p = (struct plain){.tape = tape}; }

void plain_release(struct plain *p)
{
    for (size_t k = 0; k < p->max; k++) {
        free(p->value[k]);
        free(p->error[k]);
    }
    free(p->value);
    free(p->error);
}

static void make_room(struct plain *p)
{
    size_t n = p->tape->n_nodes;
    if (n <= p->max)
        return;
    n += n / 2;
    p->value = taken(realloc(p->value, n * sizeof *p->value));
    p->error = taken(realloc(p->error, n * sizeof *p->error));
    memset(p->value + p->max, 0, (n - p->max) * sizeof *p->value);
    memset(p->error + p->max, 0, (n - p->max) * sizeof *p->error);
    p->max = n;
}

static void allocate(struct plain *p, uint32_t id)
{
    size_t size = node_size(node_at(p->tape, id));
    free(p->value[id]);
    free(p->error[id]);
    p->value[id] = taken(calloc(size, sizeof(double)));
    p->error[id] = taken(calloc(size, sizeof(double)));
}

void plain_set(struct plain *p, ad_var input, const double *values)
{
    make_room(p);
    allocate(p, input.id);
    memcpy(p->value[input.id], values, ad_rows(input) * ad_cols(input) * sizeof *values);
}

static double unit(const struct plain *p) { return p->tape->type == AD_F32 ? 0x1p-24 : 0x1p-53; }

/* ---- elementwise ---- */

static double operate(enum ad_op op, const double x[3])
{
    switch (op) {
#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    case AD_OP_##name:                                                                             \
        return name##_reference(x[0], x[1], x[2]);
#define AD_BINARY(name, value, da, db, lo, hi) AD_UNARY(name, value, da, lo, hi)
#define AD_TERNARY(name, value, da, db, dc, lo, hi) AD_UNARY(name, value, da, lo, hi)
#include "autodiff/ops.def"
    default:
        return NAN;
    }
}

/* Of the operation alone, in units: 0 where it only chooses; libmvec has functions to 4 ulp. */
static double roundings(enum ad_op op)
{
    switch (op) {
    case AD_OP_copy:
    case AD_OP_detach:
    case AD_OP_neg:
    case AD_OP_abs:
    case AD_OP_sign:
    case AD_OP_step:
    case AD_OP_relu:
    case AD_OP_min:
    case AD_OP_max:
    case AD_OP_lt:
    case AD_OP_le:
    case AD_OP_eq:
    case AD_OP_ne:
    case AD_OP_select:
        return 0;
    case AD_OP_add:
    case AD_OP_sub:
    case AD_OP_mul:
    case AD_OP_mul0:
    case AD_OP_div:
    case AD_OP_square:
    case AD_OP_sqrt:
    case AD_OP_recip:
    case AD_OP_recip0:
        return 1;
    case AD_OP_powi:
        return 12;
    default:
        return 8;
    }
}

static double own_error(const struct plain *p, enum ad_op op, const double x[3], double y)
{
    double n = roundings(op), least = p->tape->type == AD_F32 ? FLT_MIN : DBL_MIN, size = fabs(y);
    bool product = op == AD_OP_mul || op == AD_OP_mul0;
    bool exact = n == 0 || (y == 0 && (op == AD_OP_add || op == AD_OP_sub || op == AD_OP_recip0 ||
                                       (product && (x[0] == 0 || x[1] == 0)) || x[0] == 0));
    if (op == AD_OP_tanh_slope) /* 1 - x^2 cancels */
        size = 1 + x[0] * x[0];
    if (op == AD_OP_mul_tanh_slope)
        size = fabs(x[0]) * (1 + x[1] * x[1]);
    return exact ? 0 : n * unit(p) * size + (size < least / unit(p) ? least : 0);
}

/* An operand that is anything, where that makes no difference. */
static bool is_left_out(enum ad_op op, const double x[3], const double e[3], int k)
{
    if (op == AD_OP_select && k > 0 && e[0] == 0)
        return (k == 1) != (x[0] != 0);
    return op == AD_OP_mul0 && x[1 - k] == 0 && e[1 - k] == 0;
}

/* What is special lies between the ends: equal operands, a condition of 0, a pole. */
static bool is_inside(enum ad_op op, const double x[3], const double e[3])
{
    switch (op) {
    case AD_OP_eq:
    case AD_OP_ne:
        return e[0] + e[1] > 0 && fabs(x[0] - x[1]) <= e[0] + e[1];
    case AD_OP_select:
    case AD_OP_recip:
    case AD_OP_recip0:
    case AD_OP_powi:
    case AD_OP_pow:
        return e[0] > 0 && fabs(x[0]) <= e[0];
    case AD_OP_div:
        return e[1] > 0 && fabs(x[1]) <= e[1];
    default:
        return false;
    }
}

/* The largest change of the result at the ends of the operands' intervals, of one alone and of all.
   atan2 turns on the sign of a zero, which no bound knows. */
static double sensitivity(enum ad_op op, int arity, const double x[3], const double e[3], double y)
{
    double error = 0;
    if (op == AD_OP_atan2 && fabs(x[0]) <= e[0] && x[1] <= e[1])
        return 7;
    if (is_inside(op, x, e))
        return op == AD_OP_select                 ? fabs(x[1] - x[2]) + e[1] + e[2]
               : op == AD_OP_eq || op == AD_OP_ne ? 1
                                                  : INFINITY;
    for (int corner = 1; corner < (arity == 1 ? 3 : arity == 2 ? 9 : 27); corner++) {
        double at[3] = {x[0], x[1], x[2]};
        bool moved = false;
        for (int k = 0, digits = corner; k < arity; k++, digits /= 3) {
            if (isinf(e[k]) && !is_left_out(op, x, e, k))
                return INFINITY;
            if (isinf(e[k]) || digits % 3 == 0)
                continue;
            at[k] += digits % 3 == 1 ? e[k] : -e[k];
            moved = moved || e[k] != 0;
        }
        double change = moved ? fabs(operate(op, at) - y) : 0;
        error = isnan(change) ? INFINITY : fmax(error, change);
    }
    return error;
}

static size_t spread(const struct node *x, size_t r, size_t c)
{
    return (x->rows == 1 ? 0 : r) * x->cols + (x->cols == 1 ? 0 : c);
}

static void elementwise(struct plain *p, uint32_t id, const struct node *n)
{
    enum ad_op op = (enum ad_op)n->op;
    int arity = ad_ops[op].arity;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            double x[3] = {0}, e[3] = {0};
            for (int k = 0; k < arity; k++) {
                size_t at = spread(node_at(p->tape, n->in[k]), r, c);
                x[k] = p->value[n->in[k]][at];
                e[k] = p->error[n->in[k]][at];
            }
            double y = operate(op, x), error = own_error(p, op, x, y);
            if (e[0] != 0 || e[1] != 0 || e[2] != 0 || op == AD_OP_atan2)
                error += sensitivity(op, arity, x, e, y);
            p->value[id][r * n->cols + c] = y;
            p->error[id][r * n->cols + c] = error;
        }
}

/* ---- structure ---- */

/* Element (r, c) of a result is a sum of some elements: terms are added one by one. */
struct total {
    double value, size, error, n;
};

static void add(struct total *t, double factor, double x, double error)
{
    t->value += factor * x;
    t->size += fabs(factor * x);
    t->error += fabs(factor) * error;
    t->n += x != 0;
}

static void put(struct plain *p, uint32_t id, size_t at, const struct total *t, double each)
{
    p->value[id][at] = t->value;
    p->error[id][at] = t->error + (t->n > 1 ? t->n * each * t->size : 0);
}

static void view(struct plain *p, uint32_t id, const struct node *n)
{
    const struct node *x = node_at(p->tape, n->in[0]);
    const uint32_t *list = p->tape->lists ? p->tape->lists + n->aux + 1 : NULL;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            size_t to = r * n->cols + c, from = to;
            if (n->op == AD_OP_slice)
                from = (r + n->in[1]) * x->cols + c + n->in[2];
            else if (n->op == AD_OP_gather)
                from = list[r] * x->cols + c;
            else if (n->op == AD_OP_gather_cols)
                from = r * x->cols + list[c];
            else if (n->op == AD_OP_broadcast)
                from = spread(x, r, c);
            else if (n->op == AD_OP_transpose)
                from = c * x->cols + r;
            p->value[id][to] = p->value[n->in[0]][from];
            p->error[id][to] = p->error[n->in[0]][from];
        }
}

/* Where element (r, c) of the operand is added: sums, scatters, adjoints of differences. */
static void additions(struct plain *p, uint32_t id, const struct node *n)
{
    const struct node *x = node_at(p->tape, n->in[0]);
    const uint32_t *list = p->tape->lists ? p->tape->lists + n->aux + 1 : NULL;
    const double *v = p->value[n->in[0]], *e = p->error[n->in[0]];
    bool doubles = n->op == AD_OP_sum || n->op == AD_OP_sum_cols,
         diff = n->op == AD_OP_diff_adjoint;
    double scale = diff ? p->tape->numbers[n->aux] : 1;
    struct total *t = taken(calloc(node_size(n), sizeof *t));
    for (size_t r = 0; r < x->rows; r++)
        for (size_t c = 0; c < x->cols; c++) {
            size_t from = r * x->cols + c;
            size_t row = n->rows == 1 ? 0 : n->op == AD_OP_scatter ? list[r] : r;
            row = n->op == AD_OP_scatter ? list[r] : row;
            size_t col = n->op == AD_OP_scatter_cols ? list[c] : n->cols == 1 ? 0 : c;
            if (diff) {
                col = c < (size_t)n->cols - 1 ? c : (size_t)n->cols - 2;
                add(&t[row * n->cols + col + 1], scale, v[from], e[from]);
            }
            add(&t[row * n->cols + col], diff ? -scale : scale, v[from], e[from]);
        }
    for (size_t k = 0; k < node_size(n); k++) {
        /* of doubles: of sums of up to a tile in the tape's type */
        double each = (t[k].n > 1024 ? 1024 / t[k].n : 1) * unit(p) + 0x1p-53;
        put(p, id, k, &t[k], doubles ? each : (diff ? 2 : 1) * unit(p));
        p->error[id][k] +=
            (doubles && x->rows * x->cols > 1) || diff ? unit(p) * fabs(t[k].value) : 0;
    }
    free(t);
}

static void place(struct plain *p, uint32_t id, const struct node *n)
{
    const uint32_t *list = p->tape->lists + n->aux;
    struct total *t = taken(calloc(node_size(n), sizeof *t));
    for (size_t k = 0; k < list[0]; k++) {
        const uint32_t *part = list + 1 + 3 * k;
        const struct node *x = node_at(p->tape, part[0]);
        for (size_t r = 0; r < x->rows; r++)
            for (size_t c = 0; c < x->cols; c++)
                add(&t[(r + part[1]) * n->cols + c + part[2]], 1,
                    p->value[part[0]][r * x->cols + c], p->error[part[0]][r * x->cols + c]);
    }
    for (size_t k = 0; k < node_size(n); k++)
        put(p, id, k, &t[k], unit(p));
    free(t);
}

static void difference(struct plain *p, uint32_t id, const struct node *n)
{
    const struct node *x = node_at(p->tape, n->in[0]);
    double scale = p->tape->numbers[n->aux];
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            size_t from = r * x->cols + (c < (size_t)x->cols - 1 ? c : (size_t)x->cols - 2);
            struct total t = {0};
            add(&t, scale, p->value[n->in[0]][from + 1], p->error[n->in[0]][from + 1]);
            add(&t, -scale, p->value[n->in[0]][from], p->error[n->in[0]][from]);
            t.n = t.n > 0 ? 2 : 0;
            put(p, id, r * n->cols + c, &t, unit(p));
        }
}

static void cumulative(struct plain *p, uint32_t id, const struct node *n)
{
    const double *v = p->value[n->in[0]], *e = p->error[n->in[0]];
    bool rows = n->aux & CUMSUM_ROWS, reversed = n->aux & CUMSUM_REVERSED;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            struct total t = {0};
            size_t at = rows ? r : c, n_all = rows ? n->rows : n->cols;
            for (size_t k = reversed ? at : 0; k < (reversed ? n_all : at + 1); k++) {
                size_t i = rows ? k * n->cols + c : r * n->cols + k;
                add(&t, 1, v[i], e[i]);
            }
            put(p, id, r * n->cols + c, &t, unit(p));
        }
}

static void product(struct plain *p, uint32_t id, const struct node *n)
{
    const struct node *a = node_at(p->tape, n->in[0]), *b = node_at(p->tape, n->in[1]);
    const double *va = p->value[n->in[0]], *vb = p->value[n->in[1]];
    const double *ea = p->error[n->in[0]], *eb = p->error[n->in[1]];
    bool ta = n->aux & 1, tb = n->aux & 2;
    for (size_t r = 0; r < n->rows; r++)
        for (size_t c = 0; c < n->cols; c++) {
            struct total t = {0};
            for (size_t k = 0; k < (ta ? a->rows : a->cols); k++) {
                size_t i = ta ? k * a->cols + r : r * a->cols + k;
                size_t j = tb ? c * b->cols + k : k * b->cols + c;
                add(&t, va[i], vb[j], eb[j]);
                t.error += (fabs(vb[j]) + eb[j]) * ea[i];
                t.n += 0.5;
            }
            t.n += 1;
            put(p, id, r * n->cols + c, &t, unit(p));
        }
}

/* ---- small systems ---- */

enum { SIDE = 32 };

/* The inverse of the matrix of column c, by elimination with pivots; returns log |det|. */
static double invert(const struct plain *p, const struct node *n, size_t c, double inverse[])
{
    size_t side = n->aux & SYSTEM_SIDE, width = 2 * side;
    const struct node *x = node_at(p->tape, n->in[0]);
    double *m = taken(calloc(side * width, sizeof *m)), log_of = 0;
    for (size_t i = 0; i < side; i++) {
        for (size_t j = 0; j < side; j++)
            m[i * width + j] = p->value[n->in[0]][(i * side + j) * x->cols + c];
        m[i * width + side + i] = 1;
    }
    for (size_t k = 0; k < side; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < side; i++)
            best = fabs(m[i * width + k]) > fabs(m[best * width + k]) ? i : best;
        for (size_t j = 0; j < width; j++) {
            double swap = m[k * width + j];
            m[k * width + j] = m[best * width + j];
            m[best * width + j] = swap;
        }
        double pivot = m[k * width + k];
        log_of += log(fabs(pivot));
        for (size_t j = 0; j < width; j++)
            m[k * width + j] /= pivot;
        for (size_t i = 0; i < side; i++)
            for (size_t j = width; i != k && j-- > k;)
                m[i * width + j] -= m[i * width + k] * m[k * width + j];
    }
    for (size_t i = 0; i < side; i++)
        for (size_t j = 0; j < side; j++)
            inverse[i * side + j] = m[i * width + side + j];
    free(m);
    return log_of;
}

/* What is uncertain in element (i, j) of the matrix: operands, and the elimination, which is
   backward stable. */
static double unsure(const struct plain *p, const struct node *n, size_t i, size_t j, size_t c)
{
    size_t side = n->aux & SYSTEM_SIDE, cols = node_at(p->tape, n->in[0])->cols;
    double largest = 0;
    for (size_t k = 0; k < side * side; k++)
        largest = fmax(largest, fabs(p->value[n->in[0]][k * cols + c]));
    return p->error[n->in[0]][(i * side + j) * cols + c] +
           16 * (double)(side * side) * unit(p) * largest;
}

/* Right side k of column c: x = inverse b, and what is uncertain in b and the matrix through the
   inverse, to first order; where that is no longer small it says nothing. */
static void solution(struct plain *p, uint32_t id, const struct node *n, size_t c, size_t k,
                     const double inverse[])
{
    size_t side = n->aux & SYSTEM_SIDE, m = n->rows / side, cols = n->cols;
    bool turned = n->aux & SYSTEM_TRANSPOSED;
    double *x = p->value[id] + k * cols + c, *e = p->error[id] + k * cols + c, off[SIDE];
    const double *b = p->value[n->in[2]] + k * cols + c, *eb = p->error[n->in[2]] + k * cols + c;
    for (size_t i = 0; i < side; i++)
        for (size_t j = 0; j < side; j++)
            x[i * m * cols] += inverse[turned ? j * side + i : i * side + j] * b[j * m * cols];
    for (size_t i = 0; i < side; i++) {
        off[i] = eb[i * m * cols];
        for (size_t j = 0; j < side; j++)
            off[i] +=
                (turned ? unsure(p, n, j, i, c) : unsure(p, n, i, j, c)) * fabs(x[j * m * cols]);
    }
    double most = 0;
    for (size_t i = 0; i < side; i++)
        for (size_t j = 0; j < side; j++) {
            double factor = fabs(inverse[turned ? j * side + i : i * side + j]);
            e[i * m * cols] += 1.5 * factor * off[j];
            most = fmax(most, (double)(side * side) * factor * unsure(p, n, i, j, c));
        }
    for (size_t i = 0; i < side && !(most < 0.1); i++)
        e[i * m * cols] = INFINITY;
}

static void small_system(struct plain *p, uint32_t id, const struct node *n)
{
    size_t side = n->aux & SYSTEM_SIDE;
    double inverse[SIDE * SIDE];
    for (size_t c = 0; c < n->cols; c++) {
        double log_of = invert(p, n, c, inverse), error = 0;
        for (size_t k = 0; n->op == AD_OP_solve && k < n->rows / side; k++)
            solution(p, id, n, c, k, inverse);
        if (n->op == AD_OP_solve)
            continue;
        for (size_t i = 0; i < side; i++)
            for (size_t j = 0; j < side; j++)
                error += 1.5 * fabs(inverse[j * side + i]) * unsure(p, n, i, j, c);
        p->value[id][c] = log_of;
        p->error[id][c] = error < 0.1 ? error + 16 * unit(p) * (1 + fabs(log_of)) : INFINITY;
    }
}

static void evaluate_node(struct plain *p, uint32_t id)
{
    const struct node *n = node_at(p->tape, id);
    size_t size = node_size(n);
    allocate(p, id);
    switch (n->op) {
    case AD_OP_constant:
        for (size_t k = 0; k < size; k++) {
            double x = p->tape->numbers[n->aux + k];
            p->value[id][k] = x;
            p->error[id][k] = p->tape->type == AD_F32 ? fabs(x - (double)(float)x) : 0;
        }
        break;
    case AD_OP_slice:
    case AD_OP_reshape:
    case AD_OP_broadcast:
    case AD_OP_gather:
    case AD_OP_gather_cols:
    case AD_OP_transpose:
        view(p, id, n);
        break;
    case AD_OP_sum:
    case AD_OP_sum_rows:
    case AD_OP_sum_cols:
    case AD_OP_scatter:
    case AD_OP_scatter_cols:
    case AD_OP_diff_adjoint:
        additions(p, id, n);
        break;
    case AD_OP_cumsum:
        cumulative(p, id, n);
        break;
    case AD_OP_factor: /* nothing but the two below reads it */
        break;
    case AD_OP_solve:
    case AD_OP_logdet:
        small_system(p, id, n);
        break;
    case AD_OP_place:
        place(p, id, n);
        break;
    case AD_OP_diff:
        difference(p, id, n);
        break;
    case AD_OP_matmul:
        product(p, id, n);
        break;
    default:
        elementwise(p, id, n);
    }
    for (size_t k = 0; k < size; k++)
        if (!isfinite(p->value[id][k]) || isnan(p->error[id][k]) ||
            fabs(p->value[id][k]) + p->error[id][k] > (p->tape->type == AD_F32 ? FLT_MAX : DBL_MAX))
            p->error[id][k] = INFINITY;
}

void plain_run(struct plain *p)
{
    make_room(p);
    for (; p->n < p->tape->n_nodes; p->n++)
        if (!p->value[p->n])
            evaluate_node(p, (uint32_t)p->n);
}
