/* Common factors of sums: w a b + w c d becomes w (a b + c d), which has a product less. A product
   of series is a convolution, a sum is one addition; and what recordings of forces hold apart, as
   sums over adjoints, often has factors that are the same sum. Horner's scheme in many unknowns,
   greedily (Hosangadi, Fallah, Kastner, IEEE Transactions on Computer-Aided Design 25 (2006)
   2012). */
#include "autodiff/free.h"
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FACTORS = 6, TERMS = 16 };

/* c f[0] f[1] ..., factors in order; `whole`: without c, where it is there already. */
struct term {
    double c;
    uint32_t n, f[FACTORS], whole;
};
struct sum {
    size_t n;
    struct term term[TERMS];
};

struct factoring {
    struct ad_series *from;
    struct jet_builder to;
    uint32_t *at, *uses; /* [from->n] jets of `to`; how often it is an operand or an output */
};

static bool is_linear(const struct jet *it)
{
    return it->kind == JET_COMBINE || it->kind == JET_SCALE;
}

/* Looked into from its only user. */
static bool is_open(const struct factoring *w, uint32_t k, bool linear)
{
    const struct jet *it = &w->from->jets[k];
    return w->uses[k] == 1 && (it->kind == JET_PRODUCT || (linear && is_linear(it)));
}

static bool has_product(const struct factoring *w, uint32_t k)
{
    const struct jet *it = &w->from->jets[k];
    for (size_t depth = 0; depth < TERMS && is_open(w, k, true); depth++) {
        if (it->kind == JET_PRODUCT)
            return true;
        if (it->kind == JET_COMBINE && has_product(w, it->b))
            return true;
        it = &w->from->jets[k = it->a];
    }
    return false;
}

static bool put_factor(struct term *t, uint32_t f)
{
    size_t i = t->n;
    if (t->n == FACTORS)
        return false;
    for (; i > 0 && t->f[i - 1] > f; i--)
        t->f[i] = t->f[i - 1];
    t->f[i] = f;
    t->n++;
    return true;
}

static bool gather_factors(const struct factoring *w, uint32_t k, bool first, struct term *t)
{
    const struct jet *it = &w->from->jets[k];
    if (!first && !is_open(w, k, false))
        return put_factor(t, w->at[k]);
    return gather_factors(w, it->a, false, t) && gather_factors(w, it->b, false, t);
}

/* Adds c times jet k; false: it is too long. */
static bool gather_terms(const struct factoring *w, uint32_t k, double c, bool first, struct sum *s)
{
    const struct jet *it = &w->from->jets[k];
    const bool open = first || is_open(w, k, true);
    if (open && is_linear(it) && (first || has_product(w, k)))
        return gather_terms(w, it->a, it->kind == JET_SCALE ? c * it->number : c, false, s) &&
               (it->kind == JET_SCALE || gather_terms(w, it->b, c * it->number, false, s));
    if (s->n == TERMS)
        return false;
    struct term *t = &s->term[s->n++];
    *t = (struct term){.c = c, .whole = w->at[k]};
    return open && it->kind == JET_PRODUCT ? gather_factors(w, k, true, t)
                                           : put_factor(t, w->at[k]);
}

static bool has_factor(const struct term *t, uint32_t f)
{
    for (size_t i = 0; t->n > 1 && i < t->n; i++)
        if (t->f[i] == f)
            return true;
    return false;
}

/* The factor of most terms, inputs before what is made of them; JET_NONE: none of two. */
static uint32_t common_factor(const struct sum *s)
{
    uint32_t best = JET_NONE;
    size_t most = 1;
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; s->term[i].n > 1 && k < s->term[i].n; k++) {
            const uint32_t f = s->term[i].f[k];
            size_t count = 0;
            for (size_t j = 0; j < s->n; j++)
                count += has_factor(&s->term[j], f);
            if (count > most || (count == most && count > 1 && f < best)) {
                best = f;
                most = count;
            }
        }
    return best;
}

static void divide(struct term *t, uint32_t f)
{
    size_t i = 0;
    while (t->f[i] != f)
        i++;
    memmove(t->f + i, t->f + i + 1, (--t->n - i) * sizeof *t->f);
    t->whole = JET_NONE;
}

static int by_factors(const void *x, const void *y)
{
    const struct term *p = x, *q = y;
    for (size_t k = 0; k < p->n && k < q->n; k++)
        if (p->f[k] != q->f[k])
            return p->f[k] < q->f[k] ? -1 : 1;
    return p->n < q->n ? -1 : p->n > q->n;
}

/* So that sums which differ by a number alone are one: what is left of the number. */
static double normalise(struct sum *s)
{
    qsort(s->term, s->n, sizeof *s->term, by_factors);
    double c = s->term[0].c;
    for (size_t i = 1; i < s->n; i++)
        c = fabs(s->term[i].c) == fabs(s->term[0].c) ? c : copysign(1, c);
    for (size_t i = 0; i < s->n; i++)
        s->term[i].c /= c;
    return c;
}

static jet add_up(struct jet_builder *b, const struct sum *s)
{
    jet y = {JET_NONE};
    for (size_t i = 0; i < s->n; i++) {
        const struct term *t = &s->term[i];
        jet product = {t->whole != JET_NONE ? t->whole : t->f[0]};
        for (size_t k = 1; t->whole == JET_NONE && k < t->n; k++)
            product = ad_jet_mul(b, product, (jet){t->f[k]});
        product = ad_jet_scale(b, t->c, product);
        y = i > 0 ? ad_jet_add(b, y, product) : product;
    }
    return y;
}

/* Leaves the sum without common factors; returns whether there were any. Each time it has a term
   less. */
static bool factor(struct jet_builder *b, struct sum *s)
{
    uint32_t f;
    bool any = false;
    for (; (f = common_factor(s)) != JET_NONE; any = true) {
        struct sum inner = {0}, rest = {0};
        size_t place = TERMS;
        for (size_t i = 0; i < s->n; i++) {
            if (!has_factor(&s->term[i], f)) {
                rest.term[rest.n++] = s->term[i];
                continue;
            }
            if (place == TERMS)
                place = rest.n++;
            inner.term[inner.n++] = s->term[i];
            divide(&inner.term[inner.n - 1], f);
        }
        struct term *product = &rest.term[place];
        *product = (struct term){.c = normalise(&inner), .whole = JET_NONE};
        factor(b, &inner);
        put_factor(product, f);
        put_factor(product, add_up(b, &inner).id);
        *s = rest;
    }
    return any;
}

static jet copy(struct factoring *w, const struct jet *it)
{
    struct jet made = *it;
    bool is_new;
    for (size_t k = 0; k < JET_OPERANDS; k++) {
        uint32_t *x = ad_jet_operand(&made, k);
        *x = *x == JET_NONE ? JET_NONE : w->at[*x];
    }
    return ad_jet_make(&w->to, made, &is_new);
}

/* Operands come first, but for derivatives of integrals. */
static bool rebuild(struct factoring *w)
{
    struct ad_series *s = w->from;
    bool any = false;
    for (uint32_t k = 0; k < s->n && !w->to.failed; k++) {
        struct sum sum = {0};
        if (s->jets[k].kind == JET_COMBINE && gather_terms(w, k, 1, true, &sum) &&
            factor(&w->to, &sum)) {
            w->at[k] = add_up(&w->to, &sum).id;
            any = true;
        } else {
            w->at[k] = copy(w, &s->jets[k]).id;
        }
    }
    for (uint32_t k = 0; k < s->n && !w->to.failed; k++)
        if (s->jets[k].kind == JET_INTEGRAL)
            for (size_t i = 2; i < JET_OPERANDS; i++) {
                const uint32_t x = *ad_jet_operand(&s->jets[k], i);
                *ad_jet_operand(&w->to.series->jets[w->at[k]], i) =
                    x == JET_NONE ? JET_NONE : w->at[x];
            }
    return any;
}

static void count_uses(struct factoring *w)
{
    struct ad_series *s = w->from;
    for (uint32_t k = 0; k < s->n; k++)
        for (size_t i = 0; i < JET_OPERANDS; i++) {
            const uint32_t x = *ad_jet_operand(&s->jets[k], i);
            if (x != JET_NONE)
                w->uses[x]++;
        }
    for (size_t k = 0; k < s->n_output; k++)
        w->uses[s->output[k]]++;
}

bool ad_series_factor(struct ad_series *s, struct ad_series *made)
{
    struct factoring w = {.from = s, .to.series = made};
    bool done = false;
    w.at = malloc((s->n + 1) * sizeof *w.at);
    w.uses = calloc(s->n + 1, sizeof *w.uses);
    made->output = malloc((s->n_output + 1) * sizeof *made->output);
    if (w.at && w.uses && made->output) {
        memset(w.at, 0xff, (s->n + 1) * sizeof *w.at);
        count_uses(&w);
        done = rebuild(&w) && !w.to.failed;
        made->n_output = s->n_output;
        for (size_t k = 0; done && k < s->n_output; k++)
            made->output[k] = w.at[s->output[k]];
    }
    AD_FREE(w.at, w.uses, w.to.table);
    return done;
}
