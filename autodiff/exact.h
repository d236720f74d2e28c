/* What rounding cut off a sum (Knuth) or a product (Dekker, Numerische Mathematik 18 (1971) 224),
   exactly, where nothing over- or underflows: without multiply-add, so to the same bits everywhere.
 */
#ifndef AUTODIFF_EXACT_H
#define AUTODIFF_EXACT_H

/* a + b - sum. */
static inline double ad_off_sum(double a, double b, double sum)
{
    const double x = sum - a;
    return (a - (sum - x)) + (b - x);
}

static inline double ad_upper_half(double x)
{
    const double y = 0x1.0000002p27 * x;
    return y - (y - x);
}

/* a b - product. */
static inline double ad_off_product(double a, double b, double product)
{
    const double p = ad_upper_half(a), q = ad_upper_half(b), r = a - p, s = b - q;
    return (((p * q - product) + p * s) + r * q) + r * s;
}

#endif
