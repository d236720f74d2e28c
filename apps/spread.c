/* The spread of a number over the runs of an ensemble (spread.h). */
#include "spread.h"

#include <math.h>

struct spread spread_of(size_t n, const double values[], size_t stride)
{
    struct spread s = {0, 0, NAN, INFINITY, -INFINITY};
    double squares = 0;
    for (size_t k = 0; k < n; k++) {
        const double value = values[k * stride], away = value - s.mean;
        if (!isfinite(value))
            continue;
        s.mean += away / (double)++s.n;
        squares += away * (value - s.mean);
        s.least = fmin(s.least, value);
        s.most = fmax(s.most, value);
    }
    if (s.n > 1)
        s.deviation = sqrt(squares / (double)(s.n - 1));
    if (s.n == 0)
        s.mean = NAN;
    return s;
}
