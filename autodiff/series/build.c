/* Jets, each once: numbers are folded, and what is there is found by its hash. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t hash(const struct jet *j)
{
    uint64_t number, h = j->kind;
    memcpy(&number, &j->number, sizeof number);
    const uint64_t words[] = {j->op, j->a, j->b, number};
    for (size_t k = 0; k < LENGTH(words); k++)
        h = (h ^ words[k]) * UINT64_C(0x9e3779b97f4a7c15), h ^= h >> 29;
    return h;
}

/* Of INTEGRAL the derivatives follow from the rest; of SELECT they are operands. */
static bool same(const struct jet *x, const struct jet *y)
{
    return x->kind == y->kind && x->op == y->op && x->a == y->a && x->b == y->b &&
           (x->kind != JET_SELECT || (x->da == y->da && x->db == y->db)) &&
           memcmp(&x->number, &y->number, sizeof x->number) == 0;
}

static uint32_t *slot_of(const struct jet_builder *b, const struct jet *it)
{
    size_t at = hash(it) & (b->room - 1);
    while (b->table[at] && !same(&b->series->jets[b->table[at] - 1], it))
        at = (at + 1) & (b->room - 1);
    return &b->table[at];
}

static bool grow(struct jet_builder *b)
{
    uint32_t *old = b->table;
    b->room = b->room ? 2 * b->room : 1024;
    b->table = calloc(b->room, sizeof *b->table);
    if (b->table)
        for (uint32_t k = 0; k < b->series->n; k++)
            *slot_of(b, &b->series->jets[k]) = k + 1;
    free(old);
    return b->table;
}

jet ad_jet_make(struct jet_builder *b, struct jet made, bool *is_new)
{
    struct ad_series *s = b->series;
    *is_new = false;
    if (b->failed || (2 * s->n >= b->room && !grow(b)) ||
        !ad_reserve((void **)&s->jets, s->n, &s->max, 1, sizeof *s->jets) || s->n >= JET_NONE - 1) {
        b->failed = true;
        return (jet){0};
    }
    uint32_t *slot = slot_of(b, &made);
    if (*slot)
        return (jet){*slot - 1};
    s->jets[s->n] = made;
    *slot = (uint32_t)++s->n;
    *is_new = true;
    return (jet){*slot - 1};
}

static jet make(struct jet_builder *b, enum jet_kind kind, jet x, jet y, double number)
{
    bool is_new;
    return ad_jet_make(b,
                       (struct jet){.kind = (uint16_t)kind,
                                    .a = x.id,
                                    .b = y.id,
                                    .da = JET_NONE,
                                    .db = JET_NONE,
                                    .ea = JET_NONE,
                                    .eb = JET_NONE,
                                    .number = number},
                       &is_new);
}

static const jet none = {JET_NONE};

bool ad_jet_is_number(const struct jet_builder *b, jet x, double *number)
{
    if (b->failed || b->series->jets[x.id].kind != JET_NUMBER)
        return false;
    *number = b->series->jets[x.id].number;
    return true;
}

jet ad_jet_number(struct jet_builder *b, double number)
{
    return make(b, JET_NUMBER, none, none, number == 0 ? 0 : number);
}

/* Numbers that move through a formula: others over- or underflow where they did not. */
static bool is_moderate(double c) { return fabs(c) > 1e-30 && fabs(c) < 1e30; }

static jet shift(struct jet_builder *b, jet x, double c)
{
    return c == 0 ? x : make(b, JET_SHIFT, x, none, c);
}

static jet combine(struct jet_builder *b, jet x, jet y, double c)
{
    double p, q;
    bool x_number = ad_jet_is_number(b, x, &p), y_number = ad_jet_is_number(b, y, &q);
    if (x_number && y_number)
        return ad_jet_number(b, p + c * q);
    if (x_number)
        return shift(b, ad_jet_scale(b, c, y), p);
    if (y_number)
        return shift(b, x, c * q);
    const struct jet *scaled = b->failed ? NULL : &b->series->jets[y.id];
    if (scaled && scaled->kind == JET_SCALE && is_moderate(c * scaled->number))
        return make(b, JET_COMBINE, x, (jet){scaled->a}, c * scaled->number);
    return make(b, JET_COMBINE, x, y, c);
}

jet ad_jet_add(struct jet_builder *b, jet x, jet y) { return combine(b, x, y, 1); }
jet ad_jet_sub(struct jet_builder *b, jet x, jet y) { return combine(b, x, y, -1); }

jet ad_jet_scale(struct jet_builder *b, double c, jet x)
{
    double number;
    if (ad_jet_is_number(b, x, &number))
        return ad_jet_number(b, c * number);
    if (c == 0)
        return ad_jet_number(b, 0);
    const struct jet *scaled = b->failed ? NULL : &b->series->jets[x.id];
    if (scaled && scaled->kind == JET_SCALE && is_moderate(scaled->number) && is_moderate(c)) {
        c *= scaled->number;
        x.id = scaled->a;
    }
    return c == 1 ? x : make(b, JET_SCALE, x, none, c);
}

/* What x is a power of, by its exponent; 0: no power. `zero`: 0 where its base is. */
static double exponent_of(const struct jet_builder *b, jet x, jet *base, bool *zero)
{
    const struct jet *it = b->failed ? NULL : &b->series->jets[x.id];
    double inner;
    *zero = false;
    if (!it || (it->kind != JET_ROOT && it->kind != JET_RECIP && it->kind != JET_RECIP0 &&
                it->kind != JET_POWER))
        return 0;
    *base = (jet){it->a};
    *zero = it->kind == JET_RECIP0;
    if (it->kind == JET_RECIP0 && b->series->jets[it->a].kind == JET_ROOT) {
        inner = 0.5;
        *base = (jet){b->series->jets[it->a].a};
        return -inner;
    }
    return it->kind == JET_ROOT ? 0.5 : it->kind == JET_POWER ? it->number : -1;
}

/* Negative powers of one base are one power, and singular where the base is 0, as they are. */
static bool merge_powers(struct jet_builder *b, jet x, jet y, jet *product)
{
    jet p, q;
    bool zero_x, zero_y;
    double r = exponent_of(b, x, &p, &zero_x), s = exponent_of(b, y, &q, &zero_y);
    bool whole = r == floor(r) && s == floor(s);
    if (!(r < 0 && s < 0) || p.id != q.id || (zero_x && zero_y) || whole)
        return false;
    *product = ad_jet_power(b, p, r + s);
    return true;
}

jet ad_jet_mul(struct jet_builder *b, jet x, jet y)
{
    double c;
    jet power;
    if (ad_jet_is_number(b, x, &c))
        return ad_jet_scale(b, c, y);
    if (ad_jet_is_number(b, y, &c))
        return ad_jet_scale(b, c, x);
    if (b->failed)
        return x;
    const struct jet *jets = b->series->jets, p = jets[x.id], q = jets[y.id];
    if (p.kind == JET_SCALE && is_moderate(p.number))
        return ad_jet_scale(b, p.number, ad_jet_mul(b, (jet){p.a}, y));
    if (q.kind == JET_SCALE && is_moderate(q.number))
        return ad_jet_scale(b, q.number, ad_jet_mul(b, x, (jet){q.a}));
    if (merge_powers(b, x, y, &power))
        return power;
    if (x.id == y.id)
        return ad_jet_square(b, x);
    return x.id < y.id ? make(b, JET_PRODUCT, x, y, 0) : make(b, JET_PRODUCT, y, x, 0);
}

jet ad_jet_square(struct jet_builder *b, jet x)
{
    double c;
    jet power;
    return ad_jet_is_number(b, x, &c)      ? ad_jet_number(b, c * c)
           : merge_powers(b, x, x, &power) ? power
                                           : make(b, JET_SQUARE, x, none, 0);
}

jet ad_jet_slope(struct jet_builder *b, jet x) { return make(b, JET_SLOPE, x, none, 0); }

/* Of a root it is a power of the root's base. */
jet ad_jet_recip(struct jet_builder *b, jet x)
{
    jet base;
    bool zero;
    double r = exponent_of(b, x, &base, &zero);
    return r != 0 && r != floor(r) && !zero ? ad_jet_power(b, base, -r)
                                            : make(b, JET_RECIP, x, none, 0);
}

jet ad_jet_div(struct jet_builder *b, jet x, jet y)
{
    double c;
    if (ad_jet_is_number(b, y, &c) && is_moderate(c))
        return ad_jet_scale(b, 1 / c, x);
    if (ad_jet_is_number(b, x, &c) && is_moderate(c))
        return ad_jet_scale(b, c, ad_jet_recip(b, y));
    return make(b, JET_QUOTIENT, x, y, 0);
}

/* Whole positive exponents by products, which hold at 0, too. */
jet ad_jet_power(struct jet_builder *b, jet x, double exponent)
{
    double c;
    if (ad_jet_is_number(b, x, &c))
        return ad_jet_number(b, pow(c, exponent));
    if (exponent == 0.5)
        return make(b, JET_ROOT, x, none, 0);
    if (exponent == -1)
        return make(b, JET_RECIP, x, none, 0);
    if (!(exponent >= 0 && exponent <= 32 && exponent == floor(exponent)))
        return make(b, JET_POWER, x, none, exponent);
    jet y = ad_jet_number(b, 1);
    for (unsigned n = (unsigned)exponent; n; n >>= 1, x = n ? ad_jet_square(b, x) : x)
        if (n & 1)
            y = ad_jet_mul(b, y, x);
    return y;
}

jet ad_jet_select(struct jet_builder *b, jet condition, jet x, jet y)
{
    double c;
    bool is_new;
    if (ad_jet_is_number(b, condition, &c))
        return c != 0 ? x : y;
    if (x.id == y.id)
        return x;
    return ad_jet_make(b,
                       (struct jet){.kind = JET_SELECT,
                                    .a = condition.id,
                                    .b = JET_NONE,
                                    .da = x.id,
                                    .db = y.id,
                                    .ea = JET_NONE,
                                    .eb = JET_NONE},
                       &is_new);
}
