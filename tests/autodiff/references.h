/* NAME_reference(x, b, c): the expressions of ops.def, evaluated here one element at a time. */
#ifndef TESTS_AUTODIFF_REFERENCES_H
#define TESTS_AUTODIFF_REFERENCES_H

#include <math.h>

typedef double R;
#define F(name) name

static inline double power(double a, double b)
{
    double y = 1;
    for (double k = 0; k < fabs(b); k++)
        y *= a;
    return b < 0 ? 1 / y : y;
}

#define AD_UNARY(name, value, dx, lo, hi)                                                          \
    static inline double name##_reference(double x, double b, double c)                            \
    {                                                                                              \
        (void)b, (void)c;                                                                          \
        return value;                                                                              \
    }
#define AD_BINARY(name, value, da, db, lo, hi)                                                     \
    static inline double name##_reference(double a, double b, double c)                            \
    {                                                                                              \
        (void)c;                                                                                   \
        return value;                                                                              \
    }
#define AD_TERNARY(name, value, da, db, dc, lo, hi)                                                \
    static inline double name##_reference(double a, double b, double c) { return value; }
#include "autodiff/ops.def"

#endif
