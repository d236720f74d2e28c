/* Finds kinks near a point. Central differences across a kink converge to the mean of the two
   slopes until their step is below its distance; a gradient that is right at the point is wrong
   beside it. */
#include "internal.h"

#include <math.h>

enum { ZOOMS = 10, FEWEST_ZOOMS = 5 };

double ad_section_value(const struct ad_section *s, double x)
{
    double before = *s->x;
    *s->x = x;
    ad_run(s->program);
    *s->x = before;
    return *s->y;
}

/* The error of a central difference falls by four when the step is halved, if y is smooth. */
static bool is_smooth(const struct ad_section *s, double h, double floor)
{
    double x = *s->x, before = NAN, change = NAN;
    for (int k = 0; k < 4; k++, h /= 2) {
        double d = (ad_section_value(s, x + h) - ad_section_value(s, x - h)) / (2 * h);
        double next = fabs(d - before);
        if (k >= 2 && !(next <= change / 2 + floor && next >= change / 8 - floor))
            return false;
        before = d;
        change = next;
    }
    return true;
}

/* Moves to the two quarters of five values, `step` apart from `at` on, between which the slope
   changes most; returns that change. */
static double zoom(const struct ad_section *s, double *at, double *step, double y[5])
{
    int most = 0;
    double change[3];
    for (int k = 0; k < 3; k++) {
        change[k] = fabs(y[k + 2] - 2 * y[k + 1] + y[k]) / *step;
        if (change[k] > change[most])
            most = k;
    }
    *at += most * *step;
    *step /= 2;
    y[4] = y[most + 2];
    double middle = y[most + 1];
    y[0] = y[most];
    y[2] = middle;
    y[1] = ad_section_value(s, *at + *step);
    y[3] = ad_section_value(s, *at + 3 * *step);
    return change[most];
}

/* Over half the interval a smooth slope changes by half as much, one near a pole by more, and that
   of a kink by the same. */
bool ad_kink_near(const struct ad_section *s, double h, double least, double *mean)
{
    double x = *s->x, at = x - h, step = h / 2, y[5], first = 0, last = 0;
    double rounding = 0x1p-50 * fabs(ad_section_value(s, x));
    if (is_smooth(s, h, least + 4 * rounding / h))
        return false;
    for (int k = 0; k < 5; k++)
        y[k] = ad_section_value(s, at + k * step);
    *mean = (y[4] - y[0]) / (2 * h);
    for (int k = 0; k < ZOOMS; k++) {
        double noise = 16 * rounding / step;
        last = zoom(s, &at, &step, y);
        if (k == 0)
            first = last;
        if (last <= noise)
            return false;
        if (k >= FEWEST_ZOOMS && last <= 16 * noise)
            break;
    }
    return last > least && last >= first / 4 && last <= 4 * first;
}
