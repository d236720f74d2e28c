/* Axes of pictures (axes.h). */
#include "axes.h"
#include "plot.h"
#include "unit.h"

#include <math.h>

void range_widen(struct range *range, double value)
{
    range->low = fmin(range->low, value);
    range->high = fmax(range->high, value);
}

struct range range_with_margins(struct range range, double below, double above)
{
    double span = range.high > range.low ? range.high - range.low : fabs(range.high) + 1;
    return (struct range){range.low - below * span, range.high + above * span};
}

int range_exponent(struct range range)
{
    double most = fmax(fabs(range.low), fabs(range.high));
    return most >= 1e5 || (most > 0 && most < 1e-2) ? (int)floor(log10(most)) : 0;
}

void axis_set(FILE *out, const char *which, const char *name, const char *unit, struct range range,
              int power)
{
    double scale = pow(10, power);
    unit = unit_shown(unit);
    fprintf(out, "set %srange [%.9g:%.9g]\nset %slabel ", which, range.low / scale,
            range.high / scale, which);
    quote_gnuplot_label(out, name);
    if (power)
        fprintf(out, ".\" / 10^{%d}\"", power);
    if (*unit) {
        fputs(power ? ".\" \"." : ".\" / \".", out);
        quote_gnuplot_label(out, unit);
    }
    fputc('\n', out);
}
