/* Small linear systems, one per column, in chunks of columns, so that the number of threads changes
   no result. */
#include "exec.h"
#include "pool.h"
#include "autodiff/singular.h"

#include <math.h>

enum { CHUNK = 256 }; /* columns */

/* Columns [from, from + n) of the segment. */
static struct ad_factored run_columns(const ad_program *p, const struct segment *g,
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
    return (struct ad_factored){.singular = SIZE_MAX};
}

struct columns {
    const ad_program *p;
    const struct segment *g;
    struct ad_factored found; /* the first singular column, the largest condition */
};

static void run_piece(void *context, size_t thread, size_t k)
{
    struct columns *of = context;
    const size_t from = k * CHUNK, left = of->g->cols - from;
    struct ad_factored found = run_columns(of->p, of->g, &of->p->instructions[of->g->first], from,
                                           left < CHUNK ? left : CHUNK);
    (void)thread;
#pragma omp critical(ad_system)
    {
        if (found.singular != SIZE_MAX && from + found.singular < of->found.singular)
            of->found.singular = from + found.singular;
        if (found.condition > of->found.condition)
            of->found.condition = found.condition;
    }
}

void ad_run_system(const ad_program *p, const struct segment *g)
{
    const struct instruction *in = &p->instructions[g->first];
    struct columns all = {p, g, {.singular = SIZE_MAX}};
    ad_parallel(p->threads, (g->cols - 1) / CHUNK + 1, run_piece, &all);
    if (in->kind == DO_FACTOR)
        p->factors[in->loc[2]].found = all.found;
}

const struct factor *ad_report_singular(const ad_program *p, struct ad_error *error)
{
    const struct factor *first = NULL;
    for (size_t k = 0; k < p->n_factors; k++)
        if (p->factors[k].found.singular != SIZE_MAX &&
            (!first || p->factors[k].value < first->value))
            first = &p->factors[k];
    error->status = AD_OK;
    error->message[0] = '\0';
    if (!first)
        return NULL;
    const struct value *v = &p->values[first->value];
    const uint32_t node = p->nodes[first->value];
    if (ad_is_custom(v->op))
        ad_custom_report(error, node, v->op == AD_OP_custom_adjoint, &p->customs[v->aux],
                         first->fault, first->found.singular);
    else
        ad_name_singular(error, node, v->aux, first->found.singular);
    return first;
}

size_t ad_program_singular(const ad_program *p)
{
    size_t first = SIZE_MAX;
    for (size_t k = 0; p && k < p->n_factors; k++)
        first = p->factors[k].found.singular < first ? p->factors[k].found.singular : first;
    return first;
}

double ad_program_condition(const ad_program *p)
{
    double most = 0;
    for (size_t k = 0; p && k < p->n_factors; k++)
        most = fmax(most, p->factors[k].found.condition);
    return p ? most : (double)NAN;
}
