/* The ring of tests/autodiff/ring.h and its adjoint (plain.h). */
#include "plain_parts.h"
#include "tests/autodiff/ring.h"

#include <math.h>

/* What is uncertain in gy_i (1 - y_i^2). */
static double slope_error(const struct plain *p, const struct node *n, size_t at)
{
    double y = p->value[n->in[1]][at], g = p->value[n->in[2]][at];
    double ey = p->error[n->in[1]][at], eg = p->error[n->in[2]][at];
    return (eg + (fabs(g) + eg) * (2 * fabs(y) + ey) * ey) + 8 * plain_unit(p) * fabs(g);
}

void plain_custom(struct plain *p, uint32_t id, const struct node *n)
{
    const size_t rows = n->rows, cols = n->cols;
    const double *x = p->value[n->in[0]], *ex = p->error[n->in[0]];
    for (size_t i = 0; i < rows; i++)
        for (size_t c = 0; c < cols; c++) {
            size_t at = i * cols + c, next = (i + 1) % rows * cols + c,
                   before = (i + rows - 1) % rows * cols + c;
            if (n->op == AD_OP_custom) {
                p->value[id][at] = ring_element(x, rows, cols, i, c);
                p->error[id][at] =
                    ex[at] + ex[next] + 8 * plain_unit(p) * (1 + fabs(x[at]) + fabs(x[next]));
            } else {
                p->value[id][at] =
                    ring_adjoint_element(p->value[n->in[1]], p->value[n->in[2]], rows, cols, i, c);
                p->error[id][at] = slope_error(p, n, at) + slope_error(p, n, before);
            }
        }
}
