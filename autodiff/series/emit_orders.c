/* The loop over orders, as C (emit.c): one loop sums the middles of all convolutions, whose
   coefficients are known, and straight code does the rest. */
#include "emit.h"
#include "autodiff/free.h"

#include <stdlib.h>
#include <string.h>

/* ---- the middles of convolutions ---- */

static bool is_half(const struct group *g) { return g->kind == JET_SQUARE || g->kind == JET_ROOT; }

static size_t accumulators(const struct group *g) { return is_half(g) ? 1 : g->n_operands; }

/* Adds the product of orders x and y to accumulator p or q of pair `pair` of operands; in the loop,
   where x and y differ, these were loaded. */
static void add(const struct emit *e, uint32_t k, uint32_t pair, char to, const char *x,
                const char *y, char index)
{
    const struct group *g = &e->l.groups[k];
    const uint32_t a = g->operand[2 * pair], b = g->operand[is_half(g) ? 0 : 2 * pair + 1];
    const char *const form = *x == *y ? "a%u(%s)" : "l%u%s";
    char first[24], second[24];
    snprintf(first, sizeof first, form, a, x);
    snprintf(second, sizeof second, form, b, y);
    fprintf(e->out, "%c%u_%u += ", to, k, pair);
    if (g->kind == JET_PRODUCT0)
        fprintf(e->out, "z(%s, %s);\n", first, second);
    else if (g->kind == JET_POWER)
        fprintf(e->out, "(w%u * %c - K) * %s * %s;\n", k, index, first, second);
    else
        fprintf(e->out, "%s * %s;\n", first, second);
}

static uint32_t pairs(const struct group *g) { return g->n_operands > 2 ? 2 : 1; }

/* The groups of one loop, which load operands that they share once: from the first that is not done
   on, always the one that has most in common with those taken. */
struct pass {
    uint32_t *groups, n; /* [n_groups] */
    bool *done;          /* [n_groups] */
    uint32_t *loaded;    /* [n_packs] the last loop that has it */
    uint32_t *held;      /* [n_packs] and whose text does */
    uint32_t number;
};

/* Loads orders i and j of a pack before their first use in the loop: once, as compilers do not by
   themselves, and loads are what limits it. */
static void load(const struct emit *e, const struct pass *loop, uint32_t pack)
{
    if (loop->held[pack] == loop->number)
        return;
    loop->held[pack] = loop->number;
    fprintf(e->out, "v%u l%ui = a%u(i), l%uj = a%u(j);\nhold(l%ui);\nhold(l%uj);\n",
            e->l.packs[pack].width, pack, pack, pack, pack, pack, pack);
}

static void take(const struct emit *e, struct pass *loop, uint32_t k)
{
    const struct group *g = &e->l.groups[k];
    loop->groups[loop->n++] = k;
    loop->done[k] = true;
    for (uint32_t i = 0; i < g->n_operands; i++)
        loop->loaded[g->operand[i]] = loop->number;
}

static bool next_loop(const struct emit *e, struct pass *loop)
{
    size_t room = e->accumulators;
    loop->number++;
    for (loop->n = 0;;) {
        uint32_t best = JET_NONE, common = 0;
        for (uint32_t k = 0; k < e->l.n_groups; k++) {
            const struct group *g = &e->l.groups[k];
            uint32_t shared = 1;
            if (loop->done[k] || (loop->n > 0 && accumulators(g) > room))
                continue;
            for (uint32_t i = 0; i < g->n_operands; i++)
                shared += loop->loaded[g->operand[i]] == loop->number;
            if (shared > common) {
                best = k;
                common = shared;
            }
        }
        if (best == JET_NONE)
            return loop->n > 0;
        const size_t needed = accumulators(&e->l.groups[best]);
        room -= needed < room ? needed : room;
        take(e, loop, best);
    }
}

static void write_loop(const struct emit *e, const struct pass *loop)
{
    for (uint32_t i = 0; i < loop->n; i++)
        for (uint32_t k = loop->groups[i], r = 0; r < pairs(&e->l.groups[k]); r++) {
            const uint32_t w = e->l.groups[k].width;
            fprintf(e->out, "v%u p%u_%u = {0};\n", w, k, r);
            if (!is_half(&e->l.groups[k]))
                fprintf(e->out, "v%u q%u_%u = {0};\n", w, k, r);
        }
    fputs("{\nreal *i = packs + ROW, *j = packs + (k - 1) * ROW;\ndouble I = 1, J = K - 1;\n"
          "for (; i < j; i += ROW, j -= ROW, I++, J--) {\n",
          e->out);
    for (uint32_t i = 0; i < loop->n; i++)
        for (uint32_t k = loop->groups[i], r = 0; r < pairs(&e->l.groups[k]); r++) {
            for (uint32_t o = 2 * r; o < e->l.groups[k].n_operands && o < 2 * r + 2; o++)
                load(e, loop, e->l.groups[k].operand[o]);
            add(e, k, r, 'p', "i", "j", 'I');
            if (!is_half(&e->l.groups[k]))
                add(e, k, r, 'q', "j", "i", 'J');
        }
    fputs("}\n", e->out);
    for (uint32_t i = 0; i < loop->n; i++)
        for (uint32_t k = loop->groups[i], r = 0; r < pairs(&e->l.groups[k]); r++)
            fprintf(e->out, is_half(&e->l.groups[k]) ? "p%u_%u *= 2;\n" : "p%u_%u += q%u_%u;\n", k,
                    r, k, r);
    fputs("if (i == j) {\n", e->out);
    for (uint32_t i = 0; i < loop->n; i++)
        for (uint32_t k = loop->groups[i], r = 0; r < pairs(&e->l.groups[k]); r++)
            add(e, k, r, 'p', "i", "i", 'I');
    fputs("}\n}\n", e->out);
}

static bool middles(const struct emit *e)
{
    struct pass loop = {.groups = calloc(e->l.n_groups + 1, sizeof *loop.groups),
                        .done = calloc(e->l.n_groups + 1, sizeof *loop.done),
                        .loaded = calloc(e->l.n_packs + 1, sizeof *loop.loaded),
                        .held = calloc(e->l.n_packs + 1, sizeof *loop.held)};
    const bool done = loop.groups && loop.done && loop.loaded && loop.held;
    while (done && next_loop(e, &loop))
        write_loop(e, &loop);
    AD_FREE(loop.groups, loop.done, loop.loaded, loop.held);
    return done;
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
    fprintf(e->out, "const v%u t%u = a%u(packs + k * ROW) = ", p->width, pack, pack);
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
        fprintf(e->out, "(p%u_0 + t%u * a%u(packs)) + a%u(packs) * t%u", k, a, b, a, b);
        break;
    case JET_PRODUCT0:
        fprintf(e->out, "(p%u_0 + z(t%u, a%u(packs))) + z(a%u(packs), t%u)", k, a, b, a, b);
        break;
    case JET_SQUARE:
        fprintf(e->out, "p%u_0 + 2 * a%u(packs) * t%u", k, a, a);
        break;
    case JET_QUOTIENT:
        fprintf(e->out, "(d%u - p%u_0) * i%u - t%u * (a%u(packs) * i%u)", k, k, k, a, b, k);
        break;
    case JET_RECIP:
    case JET_RECIP0:
        fprintf(e->out, "p%u_0 * -a%u(packs) + t%u * (a%u(packs) * -a%u(packs))", k, b, a, b, b);
        break;
    case JET_ROOT:
        fprintf(e->out, "d%u - p%u_0", k, k);
        break;
    case JET_POWER:
        fprintf(e->out, "p%u_0 * (i%u * R) + t%u * ((w%u * K - K) * a%u(packs) * (i%u * R))", k, k,
                a, k, b, k);
        break;
    default: /* JET_INTEGRAL */
        fprintf(e->out, "p%u_0 * R + d%u * a%u(packs)", k, k, b);
        if (g->n_operands > 2)
            fprintf(e->out, " + (p%u_1 * R + f%u * a%u(packs))", k, k, g->operand[3]);
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

bool ad_emit_orders(struct emit *e, size_t n)
{
    const ad_series *s = e->s;
    fputs("for (size_t k = 1; k < order; k++) {\nconst double K = k, R = 1 / K, S = 1 / (K + 1);\n",
          e->out);
    for (uint32_t i = 0; i < s->n_input; i++)
        fprintf(e->out, "const real x%u = n%u;\n", i, i);
    const bool done = middles(e);
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
    return done;
}
