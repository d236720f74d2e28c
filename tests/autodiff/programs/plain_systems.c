/* Small systems of equations, and what rounding makes of their solutions (plain.h). */
#include "plain_parts.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = 32 };

/* The inverse of the matrix of column c, by elimination with pivots; returns log |det|. */
static double invert(const struct plain *p, const struct node *n, size_t c, double inverse[])
{
    size_t side = n->aux & SYSTEM_SIDE, width = 2 * side;
    const struct node *x = node_at(p->tape, n->in[0]);
    double *m = plain_memory(calloc(side * width, sizeof *m)), log_of = 0;
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
           16 * (double)(side * side) * plain_unit(p) * largest;
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

void plain_small_system(struct plain *p, uint32_t id, const struct node *n)
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
        p->error[id][c] = error < 0.1 ? error + 16 * plain_unit(p) * (1 + fabs(log_of)) : INFINITY;
    }
}
