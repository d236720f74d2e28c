/* Coefficients 0 of the jets, as C (emit.c). */
#include "emit.h"

/* Coefficient 0 of jet `id`: arithmetic as in ad_jet_evaluate, which is called for functions. */
static void evaluate(const struct emit *e, uint32_t id)
{
    const struct jet *it = &e->s->jets[id];
    const uint32_t a = it->a, b = it->b;
    const size_t n = e->s->n_flow, cuts = ad_jet_cuts(it, n);
    if (it->kind == JET_INTEGRAL && (it->op == AD_OP_sin || it->op == AD_OP_cos)) {
        fprintf(e->out, "real y%u; turn(y%u, %zu, y%u, %d);\n", id, id, id * sizeof *it, a,
                it->op == AD_OP_cos);
        return;
    }
    fprintf(e->out, "const real y%u = ", id);
    switch (it->kind) {
    case JET_COMBINE:
        if (it->number == 1 || it->number == -1)
            fprintf(e->out, "y%u %c y%u", a, it->number == 1 ? '+' : '-', b);
        else
            fprintf(e->out, "y%u + u[%u] * y%u", a, id, b);
        break;
    case JET_NUMBER:
        fprintf(e->out, "u[%u]", id);
        break;
    case JET_INPUT:
        fprintf(e->out, id < e->s->n_flow ? "c[%u]" : "m[%u * M]", id);
        break;
    case JET_SCALE:
        fprintf(e->out, "u[%u] * y%u", id, a);
        break;
    case JET_SHIFT:
        fprintf(e->out, "y%u + u[%u]", a, id);
        break;
    case JET_PRODUCT:
        fprintf(e->out, "y%u * y%u", a, b);
        break;
    case JET_SQUARE:
        fprintf(e->out, "y%u * y%u", a, a);
        break;
    case JET_QUOTIENT:
        fprintf(e->out, "y%u / y%u", a, b);
        break;
    case JET_RECIP:
        fprintf(e->out, "1 / y%u", a);
        break;
    case JET_ROOT:
        fprintf(e->out, "root(y%u)", a);
        break;
    case JET_SLOPE:
        fputs("zero", e->out);
        break;
    case JET_SELECT:
        fprintf(e->out, "pick(y%u != 0, y%u, y%u)", a, it->da, it->db);
        break;
    default:
        if (it->kind == JET_POWER && it->number == -1.5)
            fprintf(e->out, "power(%zu, y%u)", id * sizeof *it, a);
        else
            fprintf(e->out,
                    it->b == JET_NONE ? "call(%zu, y%u, zero, zero, zero)"
                                      : "call(%zu, y%u, y%u, zero, zero)",
                    id * sizeof *it, a, b);
    }
    if (cuts == 1)
        fprintf(e->out, " + c[%zu]", n + a);
    if (cuts == 2)
        fprintf(e->out, " + (c[%zu] %c c[%zu])", n + a, it->number == 1 ? '+' : '-', n + b);
    fputs(";\n", e->out);
}

void ad_emit_values(const struct emit *e)
{
    const ad_series *s = e->s;
    for (uint32_t id = 0; id < s->n; id++)
        evaluate(e, id);
    for (size_t i = s->n_input; i < s->n_output; i++)
        fprintf(e->out, "m[%u * M] = y%u;\n", s->output[i], s->output[i]);
}
