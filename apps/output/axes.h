/* Axes of pictures in gnuplot's words: ranges, powers of ten, labels with units. */
#ifndef APPS_AXES_H
#define APPS_AXES_H

#include <stdio.h>

struct range {
    double low, high;
};

/* Takes a value in; a range begins as {INFINITY, -INFINITY}. */
void range_widen(struct range *range, double value);
/* With margins in units of its span. */
struct range range_with_margins(struct range range, double below, double above);
/* The power of ten that an axis is labelled in; 0 where plain numbers are short. */
int range_exponent(struct range range);

/* Range and label of axis `which` (x, y, ...): "x / 10^{11} m"; pure numbers have the unit 1. */
void axis_set(FILE *out, const char *which, const char *name, const char *unit, struct range range,
              int power);

#endif
