/* Expressions of compiled operations: those of the table, and time differences. */
#include "native_writer.h"

/* The exponent of a whole power, where it is a constant. */
static bool whole_exponent(const struct writer *w, const struct loc *l, int *exponent)
{
    double b;
    if (l->base == BASE_TILE || l->rs || l->cs || l->list ||
        !(w->p->values[l->root].flags & VALUE_CONSTANT))
        return false;
    w->p->kernels->to_double(1, &b, w->p->memory + l->off);
    *exponent = (int)b;
    return true;
}

static void elementwise(const struct writer *w, const struct instruction *in)
{
    bool spread = in->loc[0] != in->value; /* of a number, for an operation that comes after */
    enum ad_op op = spread ? AD_OP_copy : (enum ad_op)w->p->values[in->value].op;
    int exponent = 0;
    bool whole = op == AD_OP_powi && whole_exponent(w, &w->p->locs[in->loc[2]], &exponent);
    ad_native_say(w, whole ? "whole_@(" : "op_%s_@(", ad_op_name(op));
    for (uint32_t k = 1; k <= in->n_in && !(whole && k == 2); k++) {
        ad_native_say(w, k > 1 ? ", " : "");
        ad_native_name(w, in->loc[k]);
    }
    if (whole)
        ad_native_say(w, ", %d", exponent);
    ad_native_say(w, ")");
}

/* scale*(x[i+1] - x[i]); the last column, repeated, is the one before. `at` numbers the columns of
   a vector that holds a special one. */
static void diff(const struct writer *w, const struct instruction *in)
{
    uint32_t last = w->g->cols - 1;
    ad_native_say(w, "({ const char *x = ");
    ad_native_address(w, &w->p->locs[in->loc[1]]);
    ad_native_say(w, "; V@ here = load@(x), next = load@(x + sizeof(R)); ");
    if (in->loc[3])
        ad_native_say(w,
                      "if (c + @ > %u) { const I@ at = columns@(c); const V@ before = load@(x - "
                      "sizeof(R)); next = pick@(at == %u, here, next); here = pick@(at == %u, "
                      "before, here); } ",
                      last, last, last);
    ad_native_say(w, "(R)%a * (next - here); })", w->p->numbers[in->loc[2]]);
}

/* scale*(u[i-1] - u[i]), where u is zero outside and a repeated column counts to the one before. */
static void diff_adjoint(const struct writer *w, const struct instruction *in)
{
    uint32_t last = w->g->cols - 1;
    ad_native_say(w, "({ const char *u = ");
    ad_native_address(w, &w->p->locs[in->loc[1]]);
    ad_native_say(w,
                  "; V@ before = load@(u - sizeof(R)), here = load@(u); "
                  "if (c == 0 || c + @ + 1 > %u) { const I@ at = columns@(c); "
                  "before = only@(at != 0, before); here = only@(at != %u, here); ",
                  last, last);
    if (in->loc[3])
        ad_native_say(w,
                      "const V@ more = splat@(u + (%u - c) * sizeof(R)); "
                      "before += only@(at == %u, more); here += only@(at == %u, more); ",
                      last, last, last - 1);
    ad_native_say(w, "} (R)%a * (before - here); })", w->p->numbers[in->loc[2]]);
}

void ad_native_operation(const struct writer *w, const struct instruction *in)
{
    if (in->kind == DO_ELEMENTWISE)
        elementwise(w, in);
    else if (in->kind == DO_DIFF)
        diff(w, in);
    else
        diff_adjoint(w, in);
}
