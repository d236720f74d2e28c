/* Machine code of a series: the coefficients of all jets as C for one point. Values come first
   (coefficients 0). Then the loop over orders is outside; in it one loop sums the middles of
   all convolutions, whose coefficients are known, and straight code does the rest. Operations
   and their order are those of advance.c. gcc 12 takes wrong lanes where a vector is made of
   those of a longer one, unless forward propagation is off (flow.c compares the first results
   in any case). */
#include "lanes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Accumulators of one loop: what registers hold. */
enum { ACCUMULATORS = 12 };

struct emit {
    FILE *out;
    const ad_series *s;
    struct lanes l;
    bool *stored; /* packs of this order */
    bool many;    /* AD_SERIES_POINTS points: every number is a vector, of one each */
};

/* The words that the text is written in: of one point, and of many. */
static const char one_point[] =
    "typedef double real;\n#define root(x) __builtin_sqrt(x)\n"
    "#define pick(c, x, y) ((c) ? (x) : (y))\n"
    "#define call(j, a, b, c, d) value(jets + (j), (const double[]){a, b, c, d})\n"
    "#define power(j, x) ((x) > 1e-200 && (x) < 1e200 ? 1 / ((x) * root(x))"
    " : call(j, x, 0, 0, 0))\n";
static const char many_points[] =
    "typedef double real __attribute__((vector_size(64)));\n"
    "typedef long long mask __attribute__((vector_size(64)));\n"
    "typedef double function(const char *, const double *);\n"
    "static inline real pick(mask c, real x, real y)\n"
    "{ return (real)(((mask)x & c) | ((mask)y & ~c)); }\n"
    "static inline real root(real x)\n"
    "{ for (int l = 0; l < 8; l++) x[l] = __builtin_sqrt(x[l]); return x; }\n"
    "static inline real call_each(function *value, const char *jet, real a, real b, real c, real "
    "d)\n"
    "{ real y; for (int l = 0; l < 8; l++)\n"
    "y[l] = value(jet, (const double[]){a[l], b[l], c[l], d[l]}); return y; }\n"
    "static inline real power_each(function *value, const char *jet, real x)\n"
    "{ real y = 1 / (x * root(x)); for (int l = 0; l < 8; l++)\n"
    "if (!(x[l] > 1e-200 && x[l] < 1e200)) y[l] = value(jet, (const double[]){x[l], 0, 0, 0});"
    " return y; }\n"
    "#define call(j, a, b, c, d) call_each(value, jets + (j), a, b, c, d)\n"
    "#define power(j, x) power_each(value, jets + (j), x)\n";

/* The coefficient of a jet at the order under way. */
static void name(const struct emit *e, uint32_t id)
{
    if (e->s->jets[id].kind == JET_NUMBER || e->s->jets[id].kind == JET_PIECEWISE)
        fputs("zero", e->out);
    else
        fprintf(e->out, "x%u", id);
}

static void value(const struct emit *e, uint32_t id) { fprintf(e->out, "y%u", id); }

static void vector(const struct emit *e, const struct pack *p,
                   void (*lane)(const struct emit *e, uint32_t id))
{
    fprintf(e->out, p->width > 1 ? "(v%u){" : "(", p->width);
    for (uint32_t i = 0; i < p->width; i++) {
        fputs(i ? ", " : "", e->out);
        lane(e, p->jets[i < p->n ? i : 0]);
    }
    fputs(p->width > 1 ? "}" : ")", e->out);
}

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
        vector(e, p, name);
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

static void number_plus(const struct emit *e, uint32_t id) { fprintf(e->out, "(u[%u] + 1)", id); }

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

/* ---- coefficients 0 ---- */

/* Coefficient 0 of jet `id`: arithmetic as in ad_jet_evaluate, which is called for functions. */
static void evaluate(const struct emit *e, uint32_t id)
{
    const struct jet *it = &e->s->jets[id];
    const uint32_t a = it->a, b = it->b;
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
    fputs(";\n", e->out);
}

static void values(const struct emit *e)
{
    const ad_series *s = e->s;
    for (uint32_t id = 0; id < s->n; id++)
        evaluate(e, id);
    for (size_t i = s->n_input; i < s->n_output; i++)
        fprintf(e->out, "m[%u * M] = y%u;\n", s->output[i], s->output[i]);
}

/* ---- before the orders ---- */

static void declare(const struct emit *e, size_t n)
{
    const ad_series *s = e->s;
    for (uint32_t w = 2; w <= MOST_LANES; w *= 2)
        fprintf(e->out, "typedef double v%u __attribute__((vector_size(%zu)));\n", w,
                w * sizeof(double));
    fputs("#ifdef __clang__\n#pragma STDC FP_CONTRACT OFF\n#else\n"
          "#pragma GCC optimize(\"fp-contract=off\", \"no-tree-forwprop\")\n#endif\n",
          e->out);
    fputs(e->many ? many_points : one_point, e->out);
    fprintf(e->out,
            "typedef real v1;\ntypedef __SIZE_TYPE__ size_t;\nenum { M = %zu };\n"
            "static const real zero;\n#define keep(c, x) pick(c, x, zero)\n"
            "#define z(x, y) keep(((x) != 0) & ((y) != 0), (x) * (y))\n",
            e->many ? 1 : s->stride);
    fputs("void run0(double value(const char *, const double *), const char *jets,"
          " real *restrict m, const real *restrict u, real *restrict packs,"
          " real *restrict c, size_t order)\n{\n",
          e->out);
    values(e);
    for (uint32_t k = 0; k < e->l.n_packs; k++) {
        const struct pack *p = &e->l.packs[k];
        fprintf(e->out, "v%u *const a%u = (v%u *)(packs + %zu);\n", p->width, k, p->width, p->at);
        fprintf(e->out, "a%u[0] = ", k);
        vector(e, p, value);
        fputs(";\n", e->out);
    }
    for (uint32_t k = 0; k < e->l.n_groups; k++) {
        const struct group *g = &e->l.groups[k];
        if (g->kind == JET_QUOTIENT || g->kind == JET_POWER)
            fprintf(e->out, "const v%u i%u = 1 / a%u[0];\n", g->width, k, g->operand[0]);
        if (g->kind == JET_ROOT)
            fprintf(e->out, "const v%u i%u = 0.5 / a%u[0];\n", g->width, k, g->operand[0]);
        if (g->kind == JET_POWER) {
            struct pack p = {.n = g->n, .width = g->width};
            memcpy(p.jets, g->jets, sizeof p.jets);
            fprintf(e->out, "const v%u w%u = ", g->width, k);
            vector(e, &p, number_plus);
            fputs(";\n", e->out);
        }
    }
    for (uint32_t i = 0; i < s->n_input; i++) {
        fprintf(e->out, "real n%u = ", i);
        value(e, s->output[i]);
        fputs(";\n", e->out);
    }
    for (uint32_t i = 0; i < n; i++)
        fprintf(e->out, "c[%zu] = n%u;\n", n + i, i);
}

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
        name(e, it->da);
        fputs(", ", e->out);
        name(e, it->db);
        fputs(")", e->out);
    } else if (it->kind == JET_COMBINE) {
        name(e, it->a);
        if (it->number == 1 || it->number == -1)
            fputs(it->number == 1 ? " + " : " - ", e->out);
        else
            fprintf(e->out, " + u[%u] * ", id);
        name(e, it->b);
    } else {
        if (it->kind == JET_SCALE)
            fprintf(e->out, "u[%u] * ", id);
        if (it->kind == JET_SLOPE)
            fputs("K * ", e->out);
        name(e, it->a);
    }
    fputs(";\n", e->out);
}

static void orders(struct emit *e, size_t n)
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
        name(e, s->output[i]);
        fputs(" * S;\n", e->out);
    }
    for (uint32_t i = 0; i < n; i++)
        fprintf(e->out, "c[%zu * (k + 1) + %u] = n%u;\n", n, i, i);
    fputs("}\n}\n", e->out);
}

/* Sums of series whose order differs from point to point: terms beyond it are left out. */
static void sums(const struct emit *e)
{
    fprintf(e->out,
            "void run1(const real *restrict c, const real *restrict least, const real *restrict h,"
            " size_t order, real *restrict sum, real *restrict slope, real *restrict power)\n"
            "{\nreal f[order + 1], g[order + 1];\nf[1] = g[1] = *h;\n"
            "*power = pick(*least == 1, *h, zero);\n"
            "for (size_t k = 2; k <= order; k++) {\nf[k] = f[k / 2] * f[k - k / 2];\n"
            "g[k] = (double)k * f[k];\n*power = pick(*least == (double)k, f[k], *power);\n}\n"
            "for (size_t i = 0; i < %zu; i++) {\nreal y = zero, d = zero;\n"
            "for (size_t k = order; k > 0; k--) {\n"
            "const real x = c[k * %zu + i];\nconst mask in = *least >= (double)k;\n"
            "y = pick(in, y + x * f[k], y);\nd = pick(in, d + x * g[k], d);\n}\n"
            "sum[i] = y;\nslope[i] = d;\n}\n}\n"
            "void run2(const real *restrict c, const real *restrict least, size_t order,"
            " real *restrict none)\n{\nreal sum = zero;\n"
            "for (size_t k = 1; k <= order; k++)\nfor (size_t i = 0; i < %zu; i++)\n"
            "sum += keep(*least >= (double)k, 0 * c[k * %zu + i]);\n*none = sum;\n}\n",
            e->s->n_flow, e->s->n_flow, e->s->n_flow, e->s->n_flow);
}

char *ad_series_source(const ad_series *series, size_t most, bool many, size_t *packs)
{
    struct emit e = {.s = series, .many = many};
    char *text = NULL;
    size_t bytes;
    bool done = ad_series_lanes(series, many ? 1 : most, many ? 1 : MOST_LANES, &e.l);
    e.stored = calloc(e.l.n_packs + 1, sizeof *e.stored);
    e.out = open_memstream(&text, &bytes);
    done = done && e.stored && e.out;
    if (done) {
        declare(&e, series->n_flow);
        orders(&e, series->n_flow);
        if (many)
            sums(&e);
        *packs = e.l.doubles;
    }
    if (e.out)
        done = fclose(e.out) == 0 && done;
    free(e.stored);
    ad_series_lanes_free(&e.l);
    if (done)
        return text;
    free(text);
    return NULL;
}
