/* Decimal text to double, correctly rounded and independent of the locale.

   Nearly all printed numbers have at most 19 significant digits w and a small exponent, w 10^q with
   |q| <= 27: then w 5^|q| is a product or quotient of 64-bit integers whose 128-bit result is exact
   or has a sticky bit, and one conversion rounds it. All other numbers go to strtod, which is five
   times slower, as digits without a decimal point, because the locale's decimal point is unknown.
 */
#include "numbers.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    FAST_DIGITS = 19,    /* fit in 64 bits */
    FAST_POWER = 27,     /* 5^27 < 2^63 */
    ENOUGH_DIGITS = 800, /* no halfway point between doubles has more than 767 */
    HUGE_EXPONENT = 100000000
};

/* The number is w 10^exponent if `exact`; else w holds only its first digits. */
struct decimal {
    const char *first; /* first significant digit */
    uint64_t w;
    int digits;    /* in w */
    long exponent; /* of w */
    bool exact, negative;
};

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* Appends digits to w while it has room; returns where they end. */
static const char *scan_digits(const char *p, const char *end, struct decimal *d)
{
    uint64_t w = d->w;
    int digits = d->digits;
    if (digits == 0) /* zeros in front are not significant */
        while (p < end && *p == '0')
            p++;
    if (digits == 0)
        d->first = p;
    for (; p < end && is_digit(*p) && digits < FAST_DIGITS; p++, digits++)
        w = 10 * w + (uint64_t)(*p - '0');
    d->w = w;
    d->digits = digits;
    return p;
}

/* Passes digits for which w has no room. */
static const char *pass_digits(const char *p, const char *end, struct decimal *d)
{
    for (; p < end && is_digit(*p); p++)
        d->exact = d->exact && *p == '0';
    return p;
}

/* Sign and digits; NULL if there are no digits. */
static const char *scan_mantissa(const char *p, const char *end, struct decimal *d)
{
    *d = (struct decimal){.exact = true};
    if (p < end && (*p == '+' || *p == '-'))
        d->negative = *p++ == '-';
    const char *start = p, *full = scan_digits(p, end, d);
    p = pass_digits(full, end, d);
    d->exponent = p - full;
    if (p == end || *p != '.')
        return p > start ? p : NULL;
    p++;
    full = scan_digits(p, end, d);
    d->exponent -= full - p;
    p = pass_digits(full, end, d);
    return p - start > 1 ? p : NULL;
}

/* An exponent without digits is none: the number ends before its letter. */
static const char *scan_exponent(const char *p, const char *end, struct decimal *d)
{
    const char *q = p;
    if (q == end || (*q != 'e' && *q != 'E' && *q != 'd' && *q != 'D'))
        return p;
    q++;
    bool negative = q < end && *q == '-';
    if (q < end && (*q == '+' || *q == '-'))
        q++;
    if (q == end || !is_digit(*q))
        return p;
    long exponent = 0;
    for (; q < end && is_digit(*q); q++)
        if (exponent < HUGE_EXPONENT)
            exponent = 10 * exponent + (*q - '0');
    d->exponent += negative ? -exponent : exponent;
    return q;
}

#ifdef __SIZEOF_INT128__
__extension__ typedef unsigned __int128 uint128;

static uint64_t power_of_5(int n)
{
    uint64_t power = 1;
    for (uint64_t square = 5; n; n >>= 1, square *= square)
        if (n & 1)
            power *= square;
    return power;
}

/* Nearest double to x 2^exponent; `sticky`: bits below x were lost. */
static double round_to_double(uint128 x, bool sticky, int exponent)
{
    uint64_t high = (uint64_t)(x >> 64);
    if (high) {
        int shift = 64 - __builtin_clzll(high);
        sticky = sticky || (uint128)(x << (128 - shift)) != 0;
        x >>= shift;
        exponent += shift;
    }
    return ldexp((double)((uint64_t)x | sticky), exponent);
}

/* w 10^q = w 5^q 2^q, if it is one of the usual numbers. */
static bool fast_value(const struct decimal *d, double *value)
{
    if (!d->exact || labs(d->exponent) > FAST_POWER)
        return false;
    int q = (int)d->exponent;
    if (q >= 0) {
        *value = round_to_double((uint128)d->w * power_of_5(q), false, q);
        return true;
    }
    int shift = __builtin_clzll(d->w); /* then the quotient has more than 64 bits */
    uint128 x = (uint128)(d->w << shift) << 64, power = power_of_5(-q);
    uint128 quotient = x / power;
    *value = round_to_double(quotient, quotient * power != x, q - shift - 64);
    return true;
}
#else
static bool fast_value(const struct decimal *d, double *value)
{
    return (void)d, (void)value, false;
}
#endif

static double slow_value(const struct decimal *d, const char *end)
{
    char text[ENOUGH_DIGITS + 32];
    size_t n = 0;
    long exponent = d->exponent + d->digits; /* of 0.ddd... */
    bool lost = false;
    for (const char *p = d->first; p < end && (is_digit(*p) || *p == '.'); p++) {
        if (*p == '.')
            continue;
        if (n < ENOUGH_DIGITS)
            text[n++] = *p;
        else
            lost = lost || *p != '0';
    }
    exponent -= (long)n;
    if (lost) { /* a last digit represents all that follow */
        text[n++] = '1';
        exponent--;
    }
    snprintf(text + n, sizeof text - n, "e%ld", exponent);
    return strtod(text, NULL);
}

const char *phys_text_number(const char *text, const char *end, double *value)
{
    struct decimal d;
    const char *p = scan_mantissa(text, end, &d);
    if (!p)
        return NULL;
    p = scan_exponent(p, end, &d);
    double magnitude = 0;
    if (d.w && !fast_value(&d, &magnitude))
        magnitude = slow_value(&d, p);
    *value = d.negative ? -magnitude : magnitude;
    return p;
}

const char *phys_text_skip(const char *text, const char *end)
{
    while (text < end && (*text == ' ' || *text == '\t' || *text == '\r'))
        text++;
    return text;
}

struct phys_quote phys_text_quote(const char *text, const char *end)
{
    struct phys_quote quote = {"the end of the line"};
    text = phys_text_skip(text, end);
    size_t n = 0;
    while (text + n < end && (text[n] == '\0' || !strchr(" \t\r\n,;", text[n])))
        n++;
    if (n == 0 && text < end && *text != '\n')
        n = 1;
    if (n == 0)
        return quote;
    char *q = quote.text;
    *q++ = '\'';
    for (size_t k = 0; k < n && k < sizeof quote.text - 6; k++)
        *q++ = text[k] >= ' ' && text[k] <= '~' ? text[k] : '?';
    strcpy(q, n > sizeof quote.text - 6 ? "...'" : "'");
    return quote;
}
