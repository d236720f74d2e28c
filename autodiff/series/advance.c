/* Coefficient k of every jet, from those before it (Griewank and Walther, Evaluating Derivatives,
   2nd edition, table 13.2). */
#include "internal.h"

#include <math.h>

/* sum of a_j b_(k-j) over from <= j <= to. Four sums at once, added in a fixed order. */
static double convolve(const double *a, const double *b, size_t k, size_t from, size_t to)
{
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    size_t j = from;
    for (; j + 3 <= to; j += 4) {
        s0 += a[j] * b[k - j];
        s1 += a[j + 1] * b[k - j - 1];
        s2 += a[j + 2] * b[k - j - 2];
        s3 += a[j + 3] * b[k - j - 3];
    }
    for (; j <= to; j++)
        s0 += a[j] * b[k - j];
    return (s0 + s1) + (s2 + s3);
}

/* sum of j a_j d_(k-j) over 1 <= j <= k. */
static double integrate(const double *a, const double *d, size_t k)
{
    double s0 = 0, s1 = 0, j = 1;
    size_t i = 1;
    for (; i + 1 <= k; i += 2, j += 2) {
        s0 += j * a[i] * d[k - i];
        s1 += (j + 1) * a[i + 1] * d[k - i - 1];
    }
    return i <= k ? s0 + j * a[i] * d[k - i] + s1 : s0 + s1;
}

static double square(const double *a, size_t k)
{
    if (k == 0)
        return a[0] * a[0];
    double half = convolve(a, a, k, 0, (k - 1) / 2);
    return k % 2 ? 2 * half : 2 * half + a[k / 2] * a[k / 2];
}

static double product0(const double *a, const double *b, size_t k)
{
    double sum = 0;
    for (size_t j = 0; j <= k; j++)
        if (a[j] != 0 && b[k - j] != 0)
            sum += a[j] * b[k - j];
    return sum;
}

/* y y = a. */
static double root(const double *a, const double *y, size_t k)
{
    if (k == 0)
        return sqrt(a[0]);
    double rest = a[k];
    if (k > 1) {
        double half = convolve(y, y, k, 1, (k - 1) / 2);
        rest -= k % 2 ? 2 * half : 2 * half + y[k / 2] * y[k / 2];
    }
    return a[0] == 0 && rest == 0 ? 0 : rest / (2 * y[0]);
}

/* a y' = exponent y a'. */
static double raise(const double *a, const double *y, double exponent, size_t k)
{
    if (k == 0)
        return pow(a[0], exponent);
    double sum = 0;
    for (size_t j = 1; j <= k; j++)
        sum += (exponent * (double)j - (double)(k - j)) * a[j] * y[k - j];
    return sum / ((double)k * a[0]);
}

static double reciprocal(const double *a, const double *y, size_t k)
{
    return k == 0 ? 1 / a[0] : -convolve(a, y, k, 1, k) * y[0];
}

static double quotient(const double *a, const double *b, const double *y, size_t k)
{
    return (k == 0 ? a[0] : a[k] - convolve(b, y, k, 1, k)) / b[0];
}

static double integral(const struct jet *it, const double *c, size_t stride, size_t k)
{
    const double *a = c + it->a * stride, *b = it->b == JET_NONE ? a : c + it->b * stride;
    if (k == 0)
        return ad_jet_value((enum ad_op)it->op, a[0], b[0], 0);
    double sum = integrate(a, c + it->da * stride, k);
    if (it->b != JET_NONE)
        sum += integrate(b, c + it->db * stride, k);
    return sum / (double)k;
}

static double piecewise(const struct jet *it, const double *c, size_t stride, size_t k)
{
    return k ? 0
             : ad_jet_value((enum ad_op)it->op, c[it->a * stride],
                            it->b == JET_NONE ? 0 : c[it->b * stride], 0);
}

void ad_series_advance(ad_series *series, size_t k)
{
    if (!series || k > series->order)
        return;
    const size_t stride = series->stride;
    double *c = series->coefficients, *y = c;
    for (const struct jet *it = series->jets; it < series->jets + series->n; it++, y += stride) {
        const double *a = c + (it->a == JET_NONE ? 0 : it->a) * stride,
                     *b = c + (it->b == JET_NONE ? 0 : it->b) * stride;
        switch (it->kind) {
        case JET_NUMBER: /* set once */
        case JET_INPUT:
            break;
        case JET_COMBINE:
            y[k] = a[k] + it->number * b[k];
            break;
        case JET_SCALE:
            y[k] = it->number * a[k];
            break;
        case JET_SHIFT:
            y[k] = k ? a[k] : a[k] + it->number;
            break;
        case JET_PRODUCT:
            y[k] = convolve(a, b, k, 0, k);
            break;
        case JET_PRODUCT0:
            y[k] = product0(a, b, k);
            break;
        case JET_SQUARE:
            y[k] = square(a, k);
            break;
        case JET_QUOTIENT:
            y[k] = quotient(a, b, y, k);
            break;
        case JET_RECIP:
            y[k] = reciprocal(a, y, k);
            break;
        case JET_RECIP0:
            y[k] = a[0] == 0 ? 0 : reciprocal(a, y, k);
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
        case JET_PIECEWISE:
            y[k] = piecewise(it, c, stride, k);
            break;
        case JET_SELECT:
            y[k] = c[(a[0] != 0 ? it->da : it->db) * stride + k];
            break;
        }
    }
}
