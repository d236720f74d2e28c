/* Small linear systems, one per column, in chunks of columns, so that the number of threads changes
   no result. */
#include "exec.h"

#include <stdlib.h>

enum { CHUNK = 256 }; /* columns */

static void note(const ad_program *p, uint32_t value, size_t col)
{
    if (p->singular->value == UINT32_MAX || value < p->singular->value)
        *p->singular = (struct singular){value, (uint32_t)col};
}

/* Columns [from, from + n) of the segment; returns the first singular one. */
static size_t run_columns(const ad_program *p, const struct segment *g,
                          const struct instruction *in, size_t from, size_t n)
{
    const struct loc *o = &p->locs[in->loc[0]], *a = &p->locs[in->loc[1]],
                     *b = &p->locs[in->loc[2]];
    const uint32_t aux = in->loc[3];
    const size_t side = aux & SYSTEM_SIDE, at = from * p->element;
    const bool cholesky = aux & SYSTEM_CHOLESKY;
    char *y = p->memory + o->off + at;
    const char *x = p->memory + a->off + at;
    if (in->kind == DO_FACTOR)
        return p->kernels->factor(side, n, y, o->rs, x, a->rs, cholesky);
    if (in->kind == DO_SOLVE)
        p->kernels->solve(side, g->rows / side, n, y, o->rs, x, a->rs, p->memory + b->off + at,
                          b->rs, cholesky, aux & SYSTEM_TRANSPOSED);
    else
        p->kernels->logdet(side, n, y, x, a->rs, cholesky);
    return SIZE_MAX;
}

void ad_run_system(const ad_program *p, const struct segment *g)
{
    const struct instruction *in = &p->instructions[g->first];
    const size_t chunks = (g->cols - 1) / CHUNK + 1;
    size_t first = SIZE_MAX;
#pragma omp parallel for num_threads((int)p->threads) schedule(static, 1)                          \
    reduction(min                                                                                  \
              : first) if (p->threads > 1 && chunks > 1)
    for (size_t k = 0; k < chunks; k++) {
        size_t from = k * CHUNK, n = g->cols - from < CHUNK ? g->cols - from : CHUNK;
        size_t bad = run_columns(p, g, in, from, n);
        if (bad != SIZE_MAX && from + bad < first)
            first = from + bad;
    }
    if (first != SIZE_MAX)
        note(p, in->value, first);
}

void ad_forget_singular(ad_program *p, bool again)
{
    uint32_t value = p->singular->value;
    bool stands = value != UINT32_MAX && again && (p->values[value].flags & VALUE_HELD);
    if (!stands)
        p->singular->value = UINT32_MAX;
    p->error.status = AD_OK;
    p->error.message[0] = '\0';
}

enum ad_status ad_report_singular(const ad_program *p, struct ad_error *error)
{
    uint32_t value = p->singular->value;
    if (value == UINT32_MAX)
        return AD_OK;
    const struct value *v = &p->values[value];
    return ad_fail(error, AD_E_NONFINITE, "node %u (%s): the matrix of column %u is %s", v->node,
                   ad_op_name((enum ad_op)v->op), p->singular->col,
                   v->aux & SYSTEM_CHOLESKY ? "not positive definite" : "singular");
}
