/* The loop over orders, as C (emit.c): one loop sums the middles of all convolutions, whose
   coefficients are known, and straight code does the rest. */
#include "emit.h"

#include <string.h>

/* Accumulators of one loop: what registers hold. */
enum { ACCUMULATORS = 12 };

/* ---- the middles of convolutions ---- */

static bool is_half(const struct group *g) { return g->kind == JET_SQUARE || g->kind == JET_ROOT; }

static size_t accumulators(const struct group *g) { return is_half(g) ? 1 : g->n_operands; }

/* Adds the product of orders x and y to accumulator p or q of pair `pair` of operands. */
static void add(const struct emit *e, uint32_t k, uint32_t pair, char to, const char *x,
                const char *y, char index)
{
    const struct group *g = &e->l.groups[k];
    const uint32_t a = g->operand[2 * pair], b = g->operand[is_half(g) ? 0 : 2 * pair + 1];
    fprintf(e->out, "%c%u_%u += ", to, k, pair);
    if (g->kind == JET_PRODUCT0)
        fprintf(e->out, "z(a%u[%s], a%u[%s]);\n", a, x, b, y);
    else if (g->kind == JET_POWER)
        fprintf(e->out, "(w%u * %c - K) * a%u[%s] * a%u[%s];\n", k, index, a, x, b, y);
    else
        fprintf(e->out, "a%u[%s] * a%u[%s];\n", a, x, b, y);
}

static uint32_t pairs(const struct group *g) { return g->n_operands > 2 ? 2 : 1; }

static void middles(const struct emit *e)
{
    for (uint32_t first = 0, end; first < e->l.n_groups; first = end) {
        size_t room = 0;
        for (end = first; end < e->l.n_groups; end++) {
            room += accumulators(&e->l.groups[end]);
            if (end > first && room > ACCUMULATORS)
                break;
        }
        for (uint32_t k = first; k < end; k++)
            for (uint32_t r = 0; r < pairs(&e->l.groups[k]); r++) {
                const uint32_t w = e->l.groups[k].width;
                fprintf(e->out, "v%u p%u_%u = {0};\n", w, k, r);
                if (!is_half(&e->l.groups[k]))
                    fprintf(e->out, "v%u q%u_%u = {0};\n", w, k, r);
            }
        fputs("{\nsize_t i = 1, j = k - 1;\ndouble I = 1, J = K - 1;\n"
              "for (; i < j; i++, j--, I++, J--) {\n",
              e->out);
        for (uint32_t k = first; k < end; k++)
            for (uint32_t r = 0; r < pairs(&e->l.groups[k]); r++) {
                add(e, k, r, 'p', "i", "j", 'I');
                if (!is_half(&e->l.groups[k]))
                    add(e, k, r, 'q', "j", "i", 'J');
            }
        fputs("}\n", e->out);
        for (uint32_t k = first; k < end; k++)
            for (uint32_t r = 0; r < pairs(&e->l.groups[k]); r++)
                fprintf(e->out, is_half(&e->l.groups[k]) ? "p%u_%u *= 2;\n" : "p%u_%u += q%u_%u;\n",
                        k, r, k, r);
        fputs("if (i == j) {\n", e->out);
        for (uint32_t k = first; k < end; k++)
            for (uint32_t r = 0; r < pairs(&e->l.groups[k]); r++)
                add(e, k, r, 'p', "i", "i", 'I');
        fputs("}\n}\n", e->out);
    }
}

/* ---- the rest of one order ---- */

/* The coefficients of a pack at the order under way: where they are the results of one group, as
   they are. */
static void now(const struct emit *e, const struct pack *p)
{
    const uint32_t group = e->l.group_of[p->jets[0]];
    const struct group *g = group == JET_NONE ? NULL : &e->l.groups[group];
    if (g && g->kind != JET_ROOT && g->n == p->n && g->width == p->width &&
        memcmp(g->jets, p->jets, p->n * sizeof *p->jets) == 0)
        fprintf(e->out, "r%u", group);
    else
        ad_emit_vector(e, p, ad_emit_name);
}

/* Operand a or b of each jet of a group, as it is now. */
static void operand(const struct emit *e, const char *variable, uint32_t k, bool second)
{
    const struct group *g = &e->l.groups[k];
    struct pack p = {.n = g->n, .width = g->width};
    for (uint32_t i = 0; i < g->n; i++)
        p.jets[i] = second ? e->s->jets[g->jets[i]].b : e->s->jets[g->jets[i]].a;
    fprintf(e->out, "const v%u %s%u = ", g->width, variable, k);
    now(e, &p);
    fputs(";\n", e->out);
}

/* Pack k of a group at the order under way, stored. */
static void ready(struct emit *e, uint32_t pack)
{
    const struct pack *p = &e->l.packs[pack];
    if (e->stored[pack])
        return;
    e->stored[pack] = true;
    fprintf(e->out, "const v%u t%u = a%u[k] = ", p->width, pack, pack);
    now(e, p);
    fputs(";\n", e->out);
}

/* Results of a group, from its middles and ends. */
static void finish(struct emit *e, uint32_t k)
{
    const struct group *g = &e->l.groups[k];
    const uint32_t a = g->operand[0], b = g->operand[1];
    if (g->kind != JET_ROOT && g->kind != JET_INTEGRAL)
        ready(e, a);
    if (g->kind == JET_PRODUCT || g->kind == JET_PRODUCT0)
        ready(e, b);
    if (g->kind == JET_QUOTIENT || g->kind == JET_ROOT || g->kind == JET_INTEGRAL)
        operand(e, "d", k, false);
    if (g->kind == JET_INTEGRAL && g->n_operands > 2)
        operand(e, "f", k, true);
    fprintf(e->out, "const v%u r%u = ", g->width, k);
    switch (g->kind) {
    case JET_PRODUCT:
        fprintf(e->out, "(p%u_0 + t%u * a%u[0]) + a%u[0] * t%u", k, a, b, a, b);
        break;
    case JET_PRODUCT0:
        fprintf(e->out, "(p%u_0 + z(t%u, a%u[0])) + z(a%u[0], t%u)", k, a, b, a, b);
        break;
    case JET_SQUARE:
        fprintf(e->out, "p%u_0 + 2 * a%u[0] * t%u", k, a, a);
        break;
    case JET_QUOTIENT:
        fprintf(e->out, "(d%u - p%u_0) * i%u - t%u * (a%u[0] * i%u)", k, k, k, a, b, k);
        break;
    case JET_RECIP:
    case JET_RECIP0:
        fprintf(e->out, "p%u_0 * -a%u[0] + t%u * (a%u[0] * -a%u[0])", k, b, a, b, b);
        break;
    case JET_ROOT:
        fprintf(e->out, "d%u - p%u_0", k, k);
        break;
    case JET_POWER:
        fprintf(e->out, "p%u_0 * (i%u * R) + t%u * ((w%u * K - K) * a%u[0] * (i%u * R))", k, k, a,
                k, b, k);
        break;
    default: /* JET_INTEGRAL */
        fprintf(e->out, "p%u_0 * R + d%u * a%u[0]", k, k, b);
        if (g->n_operands > 2)
            fprintf(e->out, " + (p%u_1 * R + f%u * a%u[0])", k, k, g->operand[3]);
    }
    fputs(";\n", e->out);
    for (uint32_t i = 0; i < g->n; i++) {
        char lane[16] = "";
        if (g->width > 1)
            snprintf(lane, sizeof lane, "[%u]", i);
        if (g->kind == JET_ROOT)
            fprintf(e->out, "const real x%u = keep(r%u%s != 0, r%u%s * i%u%s);\n", g->jets[i], k,
                    lane, k, lane, k, lane);
        else
            fprintf(e->out, "const real x%u = r%u%s;\n", g->jets[i], k, lane);
    }
}

static void linear(const struct emit *e, uint32_t id)
{
    const struct jet *it = &e->s->jets[id];
    if (it->kind == JET_NUMBER || it->kind == JET_INPUT || it->kind == JET_PIECEWISE)
        return;
    fprintf(e->out, "const real x%u = ", id);
    if (it->kind == JET_SELECT) {
        fprintf(e->out, "pick(y%u != 0, ", it->a);
        ad_emit_name(e, it->da);
        fputs(", ", e->out);
        ad_emit_name(e, it->db);
        fputs(")", e->out);
    } else if (it->kind == JET_COMBINE) {
        ad_emit_name(e, it->a);
        if (it->number == 1 || it->number == -1)
            fputs(it->number == 1 ? " + " : " - ", e->out);
        else
            fprintf(e->out, " + u[%u] * ", id);
        ad_emit_name(e, it->b);
    } else {
        if (it->kind == JET_SCALE)
            fprintf(e->out, "u[%u] * ", id);
        if (it->kind == JET_SLOPE)
            fputs("K * ", e->out);
        ad_emit_name(e, it->a);
    }
    fputs(";\n", e->out);
}

void ad_emit_orders(struct emit *e, size_t n)
{
    const ad_series *s = e->s;
    fputs("for (size_t k = 1; k < order; k++) {\nconst double K = k, R = 1 / K, S = 1 / (K + 1);\n",
          e->out);
    for (uint32_t i = 0; i < s->n_input; i++)
        fprintf(e->out, "const real x%u = n%u;\n", i, i);
    middles(e);
    for (size_t i = 0; i < s->n; i++) {
        const uint32_t id = e->l.order[i], group = e->l.group_of[id];
        if (group == JET_NONE)
            linear(e, id);
        else if (e->l.groups[group].jets[0] == id)
            finish(e, group);
    }
    for (uint32_t k = 0; k < e->l.n_packs; k++)
        ready(e, k);
    for (uint32_t i = 0; i < s->n_input; i++) {
        fprintf(e->out, "n%u = ", i);
        ad_emit_name(e, s->output[i]);
        fputs(" * S;\n", e->out);
    }
    for (uint32_t i = 0; i < n; i++)
        fprintf(e->out, "c[%zu * (k + 1) + %u] = n%u;\n", n, i, i);
    fputs("}\n}\n", e->out);
}
