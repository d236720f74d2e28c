/* What chart_linear.c measures and chart_linear_draw.c draws. */
#ifndef APPS_CHART_LINEAR_H
#define APPS_CHART_LINEAR_H

#include "charts.h"

enum { LINEAR_WAYS = 2, LINEAR_SIZES = 16 };

extern const char *const linear_ways[LINEAR_WAYS];

/* The gradient of the action at one size. */
struct linear_point {
    size_t units;                /* slices, or pairs of bodies in all slices */
    double seconds[LINEAR_WAYS]; /* of a call: interpreted, compiled */
    double record_seconds;       /* of the processor: recording, gradient and compiling */
    double program_bytes, tape_bytes;
    double resident_bytes; /* what the process grew by, both programs and the tape together */
};

struct linear_curve {
    const char *name, *unit, *title, *axis;
    size_t n;
    struct linear_point point[LINEAR_SIZES];
};

enum { LINEAR_SLICES, LINEAR_PAIRS, LINEAR_CURVES };

/* Exponent of seconds against units by least squares over the points from `least` units on; 1 is
   linear. NaN with fewer than two points. */
double linear_exponent(const struct linear_curve *curve, int way, double least);
/* Where the last decade of units begins. */
double linear_end(const struct linear_curve *curve);

/* Gradients and a training step on one thread and on two: threads.csv. *same: both have the same
   bits, in every job. */
enum ad_status chart_threads(const struct chart_settings *settings, bool *same,
                             struct ad_error *error);

/* Time a unit above, memory a unit below; a column a curve. */
void linear_draw(const struct linear_curve curves[LINEAR_CURVES], struct plot *plot);

#endif
