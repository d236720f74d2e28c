/* A user's own operation in a compiled program: in blocks of columns, so that threads change no
   result. */
#include "exec.h"
#include "pool.h"

struct blocks {
    const ad_program *p;
    const struct value *v;
    struct custom_matrix operand[3], out;
    size_t block, first; /* columns of a block; where the first failed one begins, SIZE_MAX: none */
    enum custom_fault fault;
};

static void run_block(void *context, size_t thread, size_t k)
{
    struct blocks *b = context;
    const struct value *v = b->v;
    const size_t from = k * b->block, left = v->cols - from;
    const enum custom_fault fault =
        ad_custom_run(&b->p->customs[v->aux], b->p->type, v->op == AD_OP_custom_adjoint, from,
                      left < b->block ? left : b->block, b->operand, b->out);
    (void)thread;
    if (fault == CUSTOM_DONE)
        return;
#pragma omp critical(ad_custom)
    if (from < b->first) {
        b->first = from;
        b->fault = fault;
    }
}

void ad_run_custom(const ad_program *p, const struct segment *g)
{
    const struct instruction *in = &p->instructions[g->first];
    const struct value *v = &p->values[in->value];
    const struct loc *o = &p->locs[in->loc[0]];
    struct blocks b = {.p = p,
                       .v = v,
                       .out = {p->memory + o->off, o->rs},
                       .block = ad_custom_block(&p->customs[v->aux]),
                       .first = SIZE_MAX};
    for (size_t k = 0; k < ad_ops[v->op].arity; k++)
        b.operand[k] =
            (struct custom_matrix){p->memory + p->locs[v->in[k]].off, p->locs[v->in[k]].rs};
    ad_parallel(p->threads, (v->cols - 1) / b.block + 1, run_block, &b);
    p->factors[in->loc[2]].found.singular = b.first;
    p->factors[in->loc[2]].fault = b.fault;
}
