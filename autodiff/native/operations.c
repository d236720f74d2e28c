/* Expressions of compiled instructions: those of ops.def, and time differences. */
#include "writer.h"

#include <string.h>

/* The exponent of an integer power, where it is a constant. */
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

/* ---- sine and cosine of one argument ---- */

static enum ad_op op_of(const struct writer *w, const struct instruction *in)
{
    return (enum ad_op)w->p->values[in->value].op;
}

/* The first sine or cosine of this one's argument, if both occur; else NULL. */
static const struct instruction *first_of_both(const struct writer *w, const struct instruction *in)
{
    const struct instruction *first = NULL;
    bool sine = false, cosine = false;
    if (w->p->type != AD_F64 || w->walk->lanes == 1 || w->halves)
        return NULL;
    for (const struct instruction *other = w->first; other < w->end; other++) {
        if (other->kind != DO_ELEMENTWISE || other->loc[1] != in->loc[1])
            continue;
        sine = sine || op_of(w, other) == AD_OP_sin;
        cosine = cosine || op_of(w, other) == AD_OP_cos;
        first = !first && (sine || cosine) ? other : first;
    }
    return sine && cosine ? first : NULL;
}

static bool is_of_both(const struct writer *w, const struct instruction *in)
{
    enum ad_op op = op_of(w, in);
    return (op == AD_OP_sin || op == AD_OP_cos) && first_of_both(w, in);
}

/* ---- reciprocals and square roots by Newton's method ---- */

static bool is_of(const struct writer *w, const struct instruction *in, enum ad_op op)
{
    return in->kind == DO_ELEMENTWISE && in->loc[0] == in->value && op_of(w, in) == op;
}

static bool is_recip(const struct writer *w, const struct instruction *in)
{
    return is_of(w, in, AD_OP_recip) || is_of(w, in, AD_OP_recip0);
}

/* A division takes 16 cycles, beside which 32 other operations run; its 7 corrections are as many
   more of these. */
bool ad_native_newton(const struct writer *w)
{
    enum { BESIDE = 32, CORRECTIONS = 7 };
    size_t slow = 0, others = 0;
    for (const struct instruction *in = w->first; in < w->end; in++)
        (is_recip(w, in) || is_of(w, in, AD_OP_sqrt) ? &slow : &others)[0]++;
    return w->p->type == AD_F64 && w->walk->lanes > 1 && !w->crosses &&
           strcmp(w->p->kernels->isa, "avx512") == 0 && slow * (BESIDE - CORRECTIONS) > others;
}

/* Its reciprocal is 0 where the root is. */
static bool is_zero_inverted(const struct writer *w, uint32_t root)
{
    for (const struct instruction *in = w->first; in < w->end; in++)
        if (in->loc[1] == root && is_of(w, in, AD_OP_recip0))
            return true;
    return false;
}

/* The root that an instruction is, or is the reciprocal of: computed together. */
static bool root_of(const struct writer *w, const struct instruction *in, uint32_t *root)
{
    *root = in->loc[is_of(w, in, AD_OP_sqrt) ? 0 : 1];
    for (const struct instruction *r = w->first; w->newton && r < w->end; r++)
        if (is_of(w, r, AD_OP_sqrt) && r->loc[0] == *root)
            return r == in || is_of(w, in, is_zero_inverted(w, *root) ? AD_OP_recip0 : AD_OP_recip);
    return false;
}

/* Guesses, corrected; what they cannot do is found for four rows together. */
static void write_newton(struct writer *w, const struct instruction *in, uint32_t from, uint32_t to)
{
    const bool root = is_of(w, in, AD_OP_sqrt);
    const bool zero = root ? is_zero_inverted(w, in->loc[0]) : is_of(w, in, AD_OP_recip0);
    const char *name = root ? "root" : "recip";
    const uint32_t y = in->loc[0], last = to - 1;
    for (w->k = from; w->k < to; w->k++) {
        ad_native_say(w, "struct newton@ y%u_%u = newton_%s@(", y, w->k, name);
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, ");\n");
    }
    ad_native_say(w, "if (__builtin_expect(nan@(");
    for (uint32_t k = from; k < from + MAX_BESIDE; k++)
        ad_native_say(w, "%sy%u_%u.recip", k > from ? ", " : "", y, k < to ? k : last);
    ad_native_say(w, "), 0)) {\n");
    for (w->k = from; w->k < to; w->k++) {
        ad_native_say(w, "y%u_%u = exact_%s@(y%u_%u, ", y, w->k, name, y, w->k);
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, ", %d);\n", zero);
    }
    ad_native_say(w, "}\n");
}

/* ---- time differences ---- */

/* scale*(x[i+1] - x[i]); a repeated last column is the one before. `at` numbers the columns of a
   vector that contains such a column. */
static void write_diff(struct writer *w, const struct instruction *in, uint32_t from, uint32_t to)
{
    const uint32_t last = w->g->cols - 1, x = in->loc[0];
    for (w->k = from; w->k < to; w->k++) {
        ad_native_say(w, "const char *x%u_%u = ", x, w->k);
        ad_native_address(w, &w->p->locs[in->loc[1]]);
        ad_native_say(w, "; V@ h%u_%u = %sx%u_%u), n%u_%u = load@(x%u_%u + sizeof(R));\n", x, w->k,
                      ad_native_loads(w, &w->p->locs[in->loc[1]]), x, w->k, x, w->k, x, w->k);
    }
    if (!in->loc[3])
        return;
    ad_native_say(w, "if (c + @ > %u) { const I@ at = columns@(c);\n", last);
    for (uint32_t k = from; k < to; k++)
        ad_native_say(w,
                      "n%u_%u = pick@(at == %u, h%u_%u, n%u_%u);"
                      " h%u_%u = pick@(at == %u, load@(x%u_%u - sizeof(R)), h%u_%u);\n",
                      x, k, last, x, k, x, k, x, k, last, x, k, x, k);
    ad_native_say(w, "}\n");
}

/* scale*(u[i-1] - u[i]), where u is zero outside and a repeated column is added to the one before.
   Among several segments u comes from this vector of columns, and the lane before it from the
   vector before. */
static void write_diff_adjoint(struct writer *w, const struct instruction *in, uint32_t from,
                               uint32_t to)
{
    const uint32_t last = w->g->cols - 1, u = in->loc[0];
    for (w->k = from; w->k < to; w->k++) {
        ad_native_say(w, "const char *u%u_%u = ", u, w->k);
        ad_native_address(w, &w->p->locs[in->loc[1]]);
        ad_native_say(w, "; V@ h%u_%u = ", u, w->k);
        ad_native_fetch(w, &w->p->locs[in->loc[1]]);
        ad_native_say(w,
                      w->n_joined
                          ? ", b%u_%u = shift@(u%u_%u - (c - behind) * sizeof(R), h%u_%u);\n"
                          : ", b%u_%u = load@(u%u_%u - sizeof(R));\n",
                      u, w->k, u, w->k, u, w->k);
    }
    ad_native_say(w, "if (c == 0 || c + @ + 1 > %u) { const I@ at = columns@(c);\n", last);
    for (uint32_t k = from; k < to; k++) {
        if (w->n_joined && w->ragged)
            ad_native_say(w, "if (c != next) b%u_%u = load@(u%u_%u - sizeof(R));\n", u, k, u, k);
        ad_native_say(w, "b%u_%u = only@(at != 0, b%u_%u); h%u_%u = only@(at != %u, h%u_%u);\n", u,
                      k, u, k, u, k, last, u, k);
        if (in->loc[3])
            ad_native_say(
                w,
                "{ const V@ more = splat@(u%u_%u + (c + @ + 1 > %u ? %u - c : 0) * sizeof(R)); "
                "b%u_%u += only@(at == %u, more); h%u_%u += only@(at == %u, more); }\n",
                u, k, last, last, u, k, last, u, k, last - 1);
    }
    ad_native_say(w, "}\n");
}

/* ---- before the values of rows ---- */

void ad_native_prepare(struct writer *w, const struct instruction *in, uint32_t from, uint32_t to)
{
    uint32_t root;
    bool of_root = root_of(w, in, &root);
    if (of_root ? is_of(w, in, AD_OP_sqrt) : w->newton && is_recip(w, in)) {
        write_newton(w, in, from, to);
        return;
    }
    if (in->kind == DO_DIFF)
        write_diff(w, in, from, to);
    if (in->kind == DO_DIFF_ADJOINT)
        write_diff_adjoint(w, in, from, to);
    if (in->kind != DO_ELEMENTWISE || !is_of_both(w, in) || first_of_both(w, in) != in)
        return;
    for (w->k = from; w->k < to; w->k++) {
        ad_native_say(w, "const struct both@ b%u_%u = sincos@(", in->loc[0], w->k);
        ad_native_name(w, in->loc[1]);
        ad_native_say(w, ");\n");
    }
}

/* ---- any operation ---- */

static void elementwise(const struct writer *w, const struct instruction *in)
{
    enum ad_op op = op_of(w, in);
    uint32_t root;
    int exponent = 0;
    if (is_of_both(w, in)) {
        ad_native_say(w, "b%u_%u.%s", first_of_both(w, in)->loc[0], w->k, ad_op_name(op));
        return;
    }
    if (root_of(w, in, &root)) {
        ad_native_say(w, "y%u_%u.%s", root, w->k, op == AD_OP_sqrt ? "root" : "recip");
        return;
    }
    if (w->newton && is_recip(w, in)) {
        ad_native_say(w, "y%u_%u.recip", in->loc[0], w->k);
        return;
    }
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

void ad_native_operation(struct writer *w, const struct instruction *in)
{
    if (in->kind == DO_ELEMENTWISE)
        elementwise(w, in);
    else
        ad_native_say(w, "(R)%a * (%c%u_%u - %c%u_%u)", w->p->numbers[in->loc[2]],
                      in->kind == DO_DIFF ? 'n' : 'b', in->loc[0], w->k, 'h', in->loc[0], w->k);
}
