/* Machine code of a series: the coefficients of all jets as C for one point. Values come first
   (coefficients 0, emit_values.c), then the loop over orders (emit_orders.c). Operations and their
   order are those of advance.c. gcc 12 takes wrong lanes where a vector is made of those of a
   longer one, unless forward propagation is off (flow.c compares the first results in any case).
   Scheduling would take a tenth of the time to compile, and processors do it by themselves. */
#include "emit.h"

#include <stdlib.h>
#include <string.h>

/* The words that the text is written in: of one point, and of many. */
static const char one_point[] =
    "typedef double real;\ntypedef long long mask;\n#define root(x) __builtin_sqrt(x)\n"
    "#define pick(c, x, y) ((c) ? (x) : (y))\n"
    "static inline mask bits_of(real x)\n"
    "{ mask bits; __builtin_memcpy(&bits, &x, sizeof bits); return bits; }\n"
    "static inline int is_near(real x) { return x > -1e5 && x < 1e5; }\n"
    "#define call(j, a, b, c, d) value(jets + (j), (const double[]){a, b, c, d})\n"
    "#define power(j, x) ((x) > 1e-200 && (x) < 1e200 ? 1 / ((x) * root(x))"
    " : call(j, x, 0, 0, 0))\n";
static const char many_points[] =
    "typedef double real __attribute__((vector_size(64)));\n"
    "typedef long long mask __attribute__((vector_size(64)));\n"
    "typedef double function(const char *, const double *);\n"
    "static inline real pick(mask c, real x, real y)\n"
    "{ return (real)(((mask)x & c) | ((mask)y & ~c)); }\n"
    "#define bits_of(x) (mask)(x)\n"
    "static inline int is_near(real x)\n"
    "{ int near = 1; for (int l = 0; l < 8; l++) near &= x[l] > -1e5 && x[l] < 1e5; return near; "
    "}\n"
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

/* Of both: turn sets y to the sine or cosine of x, the value of jet j. */
#define CIRCLE(...) #__VA_ARGS__
static const char both[] =
#include "circle.def"
    "\n#define turn(y, j, x, quarter) y = circle(x, quarter); "
    "if (!is_near(x)) y = call(j, x, zero, zero, zero)\n";

#define NAME(name) "real *" #name ";"
#define STEPS(...) #__VA_ARGS__
static const char steps[] = "struct steps {" AD_POINTS_VECTORS(NAME) "};\n"
#include "steps.def"
    ;

void ad_emit_name(const struct emit *e, uint32_t id)
{
    if (e->s->jets[id].kind == JET_NUMBER || e->s->jets[id].kind == JET_PIECEWISE)
        fputs("zero", e->out);
    else
        fprintf(e->out, "x%u", id);
}

void ad_emit_value(const struct emit *e, uint32_t id) { fprintf(e->out, "y%u", id); }

void ad_emit_vector(const struct emit *e, const struct pack *p,
                    void (*lane)(const struct emit *e, uint32_t id))
{
    fprintf(e->out, p->width > 1 ? "(v%u){" : "(", p->width);
    for (uint32_t i = 0; i < p->width; i++) {
        fputs(i ? ", " : "", e->out);
        lane(e, p->jets[i < p->n ? i : 0]);
    }
    fputs(p->width > 1 ? "}" : ")", e->out);
}

static void number_plus(const struct emit *e, uint32_t id) { fprintf(e->out, "(u[%u] + 1)", id); }

/* ---- before the orders ---- */

static void declare(const struct emit *e, size_t n)
{
    const ad_series *s = e->s;
    for (uint32_t w = 2; w <= MOST_LANES; w *= 2)
        fprintf(e->out, "typedef double v%u __attribute__((vector_size(%zu)));\n", w,
                w * sizeof(double));
    fputs("#ifdef __clang__\n#pragma STDC FP_CONTRACT OFF\n#else\n"
          "#pragma GCC optimize(\"fp-contract=off\", \"no-tree-forwprop\", "
          "\"no-schedule-insns2\")\n#endif\n",
          e->out);
    fputs(e->many ? many_points : one_point, e->out);
    fputs(both, e->out);
    fprintf(e->out,
            "typedef real v1;\ntypedef __SIZE_TYPE__ size_t;\nenum { M = %zu, ROW = %zu };\n"
            "#if defined __AVX512F__ && %d\n#define hold(x) __asm__(\"\" : \"+v\"(x))\n#else\n"
            "#define hold(x)\n#endif\n"
            "static const real zero;\n#define keep(c, x) pick(c, x, zero)\n"
            "#define z(x, y) keep(((x) != 0) & ((y) != 0), (x) * (y))\n",
            e->many ? 1 : s->stride, e->l.row, e->many);
    fputs("void run0(double value(const char *, const double *), const char *jets,"
          " real *restrict m, const real *restrict u, real *restrict packs,"
          " real *restrict c, size_t order)\n{\n",
          e->out);
    ad_emit_values(e);
    for (uint32_t i = 0; i < s->n_input; i++) {
        fprintf(e->out, "real n%u = ", i);
        ad_emit_value(e, s->output[i]);
        fputs(";\n", e->out);
    }
    for (uint32_t i = 0; i < n; i++)
        fprintf(e->out, "c[%zu] = n%u;\n", n + i, i);
    fputs("if (order == 1)\nreturn;\n", e->out); /* a force costs little more than its values */
    for (uint32_t k = 0; k < e->l.n_packs; k++) {
        const struct pack *p = &e->l.packs[k];
        fprintf(e->out, "#define a%u(row) (*(v%u *)((row) + %zu))\na%u(packs) = ", k, p->width,
                p->at, k);
        ad_emit_vector(e, p, ad_emit_value);
        fputs(";\n", e->out);
    }
    for (uint32_t k = 0; k < e->l.n_groups; k++) {
        const struct group *g = &e->l.groups[k];
        if (g->kind == JET_QUOTIENT || g->kind == JET_POWER)
            fprintf(e->out, "const v%u i%u = 1 / a%u(packs);\n", g->width, k, g->operand[0]);
        if (g->kind == JET_ROOT)
            fprintf(e->out, "const v%u i%u = 0.5 / a%u(packs);\n", g->width, k, g->operand[0]);
        if (g->kind == JET_POWER) {
            struct pack p = {.n = g->n, .width = g->width};
            memcpy(p.jets, g->jets, sizeof p.jets);
            fprintf(e->out, "const v%u w%u = ", g->width, k);
            ad_emit_vector(e, &p, number_plus);
            fputs(";\n", e->out);
        }
    }
}

/* ---- all ---- */

char *ad_series_source(const ad_series *series, size_t most, bool many, size_t *packs)
{
    struct emit e = {.s = series, .many = many, .accumulators = most < MOST_LANES ? 12 : 16};
    char *text = NULL;
    size_t bytes;
    bool done = ad_series_lanes(series, many ? 1 : most, many ? 1 : MOST_LANES, &e.l);
    e.stored = calloc(e.l.n_packs + 1, sizeof *e.stored);
    e.out = open_memstream(&text, &bytes);
    done = done && e.stored && e.out;
    if (done) {
        declare(&e, series->n_flow);
        done = ad_emit_orders(&e, series->n_flow);
        if (many)
            fprintf(e.out, "enum { N = %zu };\n%s", series->n_flow, steps);
        *packs = e.l.row * (series->order + 1);
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
