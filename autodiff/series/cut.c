/* What rounding cut off coefficients 0: a jet's own rounding, which sums, products, quotients and
   roots show exactly (exact.h), and what was cut off its operands, to first order. */
#include "autodiff/exact.h"
#include "internal.h"

#include <math.h>
#include <string.h>

/* a - b c where it nearly cancels. */
static double off_difference(double a, double b, double c)
{
    const double product = b * c;
    return (a - product) - ad_off_product(b, c, product);
}

/* Of y = a^number, off which `cut` was cut: from 1 - a y^2 and 1 - a^3 y^2 for distances. */
static double off_power(double a, double y, double number, double cut)
{
    if (number != -0.5 && number != -1.5)
        return number * y / a * cut;
    const double h = a * y, g = number == -0.5 ? y : h * a, miss = ad_off_product(a, y, h),
                 off_g = number == -0.5 ? 0 : ad_off_product(h, a, g) + miss * a;
    const double rest = off_difference(1, h, g) - (h * off_g + miss * g);
    return y * (0.5 * rest + number * cut / a);
}

static double off(const struct ad_series *s, const struct jet *it, double y)
{
    const double *c = s->coefficients, *low = s->low, u = it->number;
    const size_t stride = s->stride;
#define VALUE(x) (it->x == JET_NONE ? 0 : c[it->x * stride])
#define CUT(x) (it->x == JET_NONE ? 0 : low[it->x])
    const double a = VALUE(a), b = VALUE(b), p = CUT(a), q = CUT(b);
    double z;
    switch (it->kind) {
    case JET_COMBINE:
        z = a + u * b;
        return ad_off_sum(a, u * b, z) + (fabs(u) == 1 ? 0 : ad_off_product(u, b, u * b)) +
               (p + u * q) - (y - z);
    case JET_SHIFT:
        z = a + u;
        return ad_off_sum(a, u, z) + p - (y - z);
    case JET_SCALE:
        return ad_off_product(u, a, y) + u * p;
    case JET_PRODUCT:
        return ad_off_product(a, b, y) + (a * q + b * p);
    case JET_SQUARE:
        return ad_off_product(a, a, y) + 2 * a * p;
    case JET_QUOTIENT:
        return (off_difference(a, b, y) + (p - y * q)) / b;
    case JET_RECIP:
        return y * (off_difference(1, a, y) - y * p);
    case JET_ROOT:
        return (off_difference(a, y, y) + p) / (2 * y);
    case JET_POWER:
        return off_power(a, y, u, p);
    case JET_INTEGRAL:
        return VALUE(da) * p + VALUE(db) * q;
    case JET_SELECT:
        return a != 0 ? CUT(da) : CUT(db);
    default:
        return 0;
    }
}

void ad_series_rates_cut(ad_series *series, size_t n, const double *c, const double *cut,
                         double *rest)
{
    ad_series *s = series;
    if (!s || n > s->n_input)
        return;
    for (size_t i = 0; i < n; i++)
        s->coefficients[i * s->stride] = c[i];
    s->cut = cut;
    s->n_cut = n;
    ad_series_advance(s, 0);
    s->cut = NULL;
    s->n_cut = 0;
    memset(s->low, 0, s->n_input * sizeof *s->low);
    memcpy(s->low, cut, n * sizeof *cut);
    for (size_t k = s->n_input; k < s->n; k++) {
        const double x = off(s, &s->jets[k], s->coefficients[k * s->stride]);
        s->low[k] = isfinite(x) ? x : 0;
    }
    for (size_t i = 0; i < n; i++)
        rest[i] = s->low[s->output[i]];
}
