/* Coefficient k of every jet, from those before it (Griewank and Walther, Evaluating Derivatives,
   2nd edition, table 13.2). Machine code (emit.c) does the same operations in the same order: what
   is changed here is changed there. Coefficients k of operands come last, so that little waits for
   them. */
#include "internal.h"

#include <math.h>

/* The sum of TERM(i, k - i) over 0 < i < k: from both ends in turn, then the middle. */
#define MIDDLE(k, TERM)                                                                            \
    double p = 0, q = 0;                                                                           \
    size_t i = 1, j = k - 1;                                                                       \
    for (; i < j; i++, j--) {                                                                      \
        p += TERM(i, j);                                                                           \
        q += TERM(j, i);                                                                           \
    }                                                                                              \
    p += q;                                                                                        \
    if (i == j)                                                                                    \
    p += TERM(i, i)

/* Of a b. */
static inline double middle(const double *a, const double *b, size_t k)
{
#define TERM(i, j) a[i] * b[j]
    MIDDLE(k, TERM);
#undef TERM
    return p;
}

static inline double times0(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

static double product0(const double *a, const double *b, size_t k)
{
#define TERM(i, j) times0(a[i], b[j])
    MIDDLE(k, TERM);
#undef TERM
    return (p + times0(a[k], b[0])) + times0(a[0], b[k]);
}

/* Of a a. */
static inline double middle_square(const double *a, size_t k)
{
    double p = 0;
    size_t i = 1, j = k - 1;
    for (; i < j; i++, j--)
        p += a[i] * a[j];
    return i == j ? 2 * p + a[i] * a[i] : 2 * p;
}

/* y y = a. */
static double root(const double *a, const double *y, size_t k)
{
    double rest = a[k] - middle_square(y, k);
    return rest == 0 ? 0 : rest * (0.5 / y[0]);
}

/* a y' = exponent y a': the weights of a_i y_j are (exponent + 1) i - k. */
static double raise(const double *a, const double *y, double exponent, size_t k)
{
    const double K = (double)k, plus = exponent + 1, over = 1 / a[0] * (1 / K);
#define TERM(i, j) (plus * (double)(i)-K) * a[i] * y[j]
    MIDDLE(k, TERM);
#undef TERM
    return p * over + a[k] * ((plus * K - K) * y[0] * over);
}

static inline double reciprocal(const double *a, const double *y, size_t k)
{
    return middle(a, y, k) * -y[0] + a[k] * (y[0] * -y[0]);
}

static double quotient(const double *a, const double *b, const double *y, size_t k)
{
    const double over = 1 / b[0];
    return (a[k] - middle(b, y, k)) * over - b[k] * (y[0] * over);
}

static double integral(const struct jet *it, const double *c, size_t stride, size_t k)
{
    const double R = 1 / (double)k, *d = c + it->da * stride;
    double sum = middle(c + it->ea * stride, d, k) * R + c[it->a * stride + k] * d[0];
    if (it->b == JET_NONE)
        return sum;
    d = c + it->db * stride;
    return sum + (middle(c + it->eb * stride, d, k) * R + c[it->b * stride + k] * d[0]);
}

/* a^number; the exponents of distances without pow, where nothing over- or underflows. */
static double power_of(double a, double number)
{
    if (number == -0.5)
        return 1 / sqrt(a);
    if (number == -1.5 && a > 1e-200 && a < 1e200)
        return 1 / (a * sqrt(a));
    return pow(a, number);
}

static inline double value_of(const struct jet *it, double a, double b)
{
    switch (it->kind) {
    case JET_COMBINE:
        return a + it->number * b;
    case JET_SCALE:
        return it->number * a;
    case JET_SHIFT:
        return a + it->number;
    case JET_SLOPE:
        return 0;
    case JET_PRODUCT:
        return a * b;
    case JET_PRODUCT0:
        return times0(a, b);
    case JET_SQUARE:
        return a * a;
    case JET_QUOTIENT:
        return a / b;
    case JET_RECIP:
        return 1 / a;
    case JET_RECIP0:
        return a == 0 ? 0 : 1 / a;
    case JET_ROOT:
        return sqrt(a);
    case JET_POWER:
        return power_of(a, it->number);
    default: /* JET_INTEGRAL, JET_PIECEWISE */
        return ad_jet_value((enum ad_op)it->op, a, it->b == JET_NONE ? a : b, 0);
    }
}

double ad_jet_evaluate(const struct jet *it, const double x[4])
{
    if (it->kind == JET_SELECT)
        return x[0] != 0 ? x[2] : x[3];
    return value_of(it, x[0], x[1]);
}

/* The values: coefficients 0. Numbers are set once, inputs by the caller. */
static void evaluate(ad_series *series)
{
    const size_t stride = series->stride;
    double *c = series->coefficients, *y = c;
    for (const struct jet *it = series->jets; it < series->jets + series->n; it++, y += stride) {
        const double a = it->a == JET_NONE ? 0 : c[it->a * stride],
                     b = it->b == JET_NONE ? 0 : c[it->b * stride];
        if (it->kind == JET_SELECT)
            *y = c[(a != 0 ? it->da : it->db) * stride];
        else if (it->kind != JET_NUMBER && it->kind != JET_INPUT)
            *y = value_of(it, a, b);
        if (ad_jet_cuts(it, series->n_cut))
            *y += it->kind == JET_SHIFT ? series->cut[it->a]
                                        : series->cut[it->a] + it->number * series->cut[it->b];
    }
}

void ad_series_advance(ad_series *series, size_t k)
{
    if (!series || k > series->order)
        return;
    if (k == 0) {
        evaluate(series);
        return;
    }
    const size_t stride = series->stride;
    double *c = series->coefficients, *y = c;
    for (const struct jet *it = series->jets; it < series->jets + series->n; it++, y += stride) {
        const double *a = c + (it->a == JET_NONE ? 0 : it->a) * stride,
                     *b = c + (it->b == JET_NONE ? 0 : it->b) * stride;
        switch (it->kind) {
        case JET_NUMBER: /* 0 */
        case JET_PIECEWISE:
        case JET_INPUT:
            break;
        case JET_COMBINE:
            y[k] = a[k] + it->number * b[k];
            break;
        case JET_SCALE:
            y[k] = it->number * a[k];
            break;
        case JET_SHIFT:
            y[k] = a[k];
            break;
        case JET_SLOPE:
            y[k] = (double)k * a[k];
            break;
        case JET_PRODUCT:
            y[k] = (middle(a, b, k) + a[k] * b[0]) + a[0] * b[k];
            break;
        case JET_PRODUCT0:
            y[k] = product0(a, b, k);
            break;
        case JET_SQUARE:
            y[k] = middle_square(a, k) + 2 * a[0] * a[k];
            break;
        case JET_QUOTIENT:
            y[k] = quotient(a, b, y, k);
            break;
        case JET_RECIP:
        case JET_RECIP0:
            y[k] = reciprocal(a, y, k);
            break;
        case JET_ROOT:
            y[k] = root(a, y, k);
            break;
        case JET_POWER:
            y[k] = raise(a, y, it->number, k);
            break;
        case JET_INTEGRAL:
            y[k] = integral(it, c, stride, k);
            break;
        case JET_SELECT:
            y[k] = c[(a[0] != 0 ? it->da : it->db) * stride + k];
            break;
        }
    }
}
