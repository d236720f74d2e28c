/* Plain evaluation with bounds of rounding (plain.h). */
#include "plain_parts.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void *plain_memory(void *memory)
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
    p->value = plain_memory(realloc(p->value, n * sizeof *p->value));
    p->error = plain_memory(realloc(p->error, n * sizeof *p->error));
    memset(p->value + p->max, 0, (n - p->max) * sizeof *p->value);
    memset(p->error + p->max, 0, (n - p->max) * sizeof *p->error);
    p->max = n;
}

static void allocate(struct plain *p, uint32_t id)
{
    size_t size = node_size(node_at(p->tape, id));
    free(p->value[id]);
    free(p->error[id]);
    p->value[id] = plain_memory(calloc(size, sizeof(double)));
    p->error[id] = plain_memory(calloc(size, sizeof(double)));
}

void plain_set(struct plain *p, ad_var input, const double *values)
{
    make_room(p);
    allocate(p, input.id);
    memcpy(p->value[input.id], values, ad_rows(input) * ad_cols(input) * sizeof *values);
}

double plain_unit(const struct plain *p) { return p->tape->type == AD_F32 ? 0x1p-24 : 0x1p-53; }

size_t plain_element(const struct node *x, size_t r, size_t c)
{
    return (x->rows == 1 ? 0 : r) * x->cols + (x->cols == 1 ? 0 : c);
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
                from = plain_element(x, r, c);
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
    struct total *t = plain_memory(calloc(node_size(n), sizeof *t));
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
        double each = (t[k].n > 1024 ? 1024 / t[k].n : 1) * plain_unit(p) + 0x1p-53;
        put(p, id, k, &t[k], doubles ? each : (diff ? 2 : 1) * plain_unit(p));
        p->error[id][k] +=
            (doubles && x->rows * x->cols > 1) || diff ? plain_unit(p) * fabs(t[k].value) : 0;
    }
    free(t);
}

static void place(struct plain *p, uint32_t id, const struct node *n)
{
    const uint32_t *list = p->tape->lists + n->aux;
    struct total *t = plain_memory(calloc(node_size(n), sizeof *t));
    for (size_t k = 0; k < list[0]; k++) {
        const uint32_t *part = list + 1 + 3 * k;
        const struct node *x = node_at(p->tape, part[0]);
        for (size_t r = 0; r < x->rows; r++)
            for (size_t c = 0; c < x->cols; c++)
                add(&t[(r + part[1]) * n->cols + c + part[2]], 1,
                    p->value[part[0]][r * x->cols + c], p->error[part[0]][r * x->cols + c]);
    }
    for (size_t k = 0; k < node_size(n); k++)
        put(p, id, k, &t[k], plain_unit(p));
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
            put(p, id, r * n->cols + c, &t, plain_unit(p));
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
            put(p, id, r * n->cols + c, &t, plain_unit(p));
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
            put(p, id, r * n->cols + c, &t, plain_unit(p));
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
        plain_small_system(p, id, n);
        break;
    case AD_OP_custom:
    case AD_OP_custom_adjoint:
        plain_custom(p, id, n);
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
        plain_elementwise(p, id, n);
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
