/* Work-precision curves: measured runs, one curve per method; the fastest method at each accuracy,
   and the picture. */
#ifndef APPS_BENCH_MEASURE_WORK_PRECISION_H
#define APPS_BENCH_MEASURE_WORK_PRECISION_H

#include "apps/output/figure.h"

enum { WORK_POINTS = 64, WORK_CURVES = 32 };

/* One setting of a method. */
struct work_point {
    double setting; /* step, or tolerance of a step */
    double steps, evaluations, seconds;
    double error;
};

/* A method, coarse to fine. */
struct work_curve {
    const char *name, *knob; /* knob: what a setting is, "dt" or "tol" */
    size_t n;
    struct work_point point[WORK_POINTS];
};

/* What it takes to err by `error` at most: between two runs that enclose it, on a straight line of
   logarithms. False if the method does not get there. */
bool work_at(const struct work_curve *curve, double error, struct work_point *at);
/* The curve that gets there in the fewest seconds; n if none does. */
size_t work_best(size_t n, const struct work_curve curves[], double error, struct work_point *at);

/* Left seconds, right evaluations against error, from 0.1 to 1e-14; under the left the fastest
   method of every decade, named. Errors under `doubt` (0: none) are marked as not to be trusted. */
void work_draw(const char *title, size_t n, const struct work_curve curves[], double doubt,
               struct plot *plot);
/* An element of a method's curve with a block of data, `error seconds evaluations`, of which
   columns such as "1:2" are drawn. Methods look the same in every picture: families by colour,
   members by shade and mark. Runs with a larger error than a coarser one, from rounding or by
   chance, are left out. */
void work_curve_element(struct figure *figure, const struct work_curve *curve, const char *columns,
                        double width, double size);
/* The families of methods among the curves. */
void work_legend(struct figure *figure, size_t n, const struct work_curve curves[]);
/* The fastest at 1e-3, 1e-6, 1e-9 and 1e-12: setting, steps, seconds. */
void work_print(FILE *out, const char *title, size_t n, const struct work_curve curves[]);

#endif
