/* Sine and cosine as machine code of many points has them. */
#include "internal.h"

#include <math.h>
#include <string.h>

typedef double real;
typedef int64_t mask;

static inline mask bits_of(real x)
{
    mask bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

#define pick(condition, x, y) ((condition) ? (x) : (y))
#define CIRCLE(...) __VA_ARGS__
#include "circle.def"

double ad_jet_circle(double x, int quarter)
{
    return fabs(x) < 1e5 ? circle(x, quarter) : quarter ? cos(x) : sin(x);
}
