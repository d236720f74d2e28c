/* Taylor coefficients of recorded values along a curve: from the power series in s of the inputs
   follow those of the recorded values.

       ad_series *series;
       ad_series_new(1, &y, 1, &x, order, &series);
       for (size_t k = 0; k <= order; k++) {
           ad_series_input(series, 0, i)[k] = ...;        for all elements i of x
           ad_series_advance(series, k);                  then ad_series_output(series, 0, i)[k]
       }

   Coefficient k of y needs coefficients 0 to k of x alone, so for a differential equation x' = f(x)
   coefficient k of f gives coefficient k + 1 of x, f[k] / (k + 1) (Jorba and Zou, Experimental
   Mathematics 14 (2005) 99).

   Errors: the tape's, or those named. Lifetime: what *_new makes lives until its *_free. Threads:
   as in autodiff.h. */
#ifndef AUTODIFF_SERIES_H
#define AUTODIFF_SERIES_H

#include "autodiff/autodiff.h"

AD_HEADER_BEGIN

typedef struct ad_series ad_series;

/* Series up to coefficient `order` of y[0..n_y-1] in x[0..n_x-1], which are all inputs that y
   depends on, each once, on one tape of AD_F64. The recording is read now and not kept. Each
   element is a series of its own: memory grows with elements times order, time with elements times
   order squared. On failure *series is NULL, and the status is returned and kept in the tape:
   AD_E_ARGUMENT for small systems (ad_solve, ad_logdet), which have no rule, AD_E_TAPE,
   AD_E_MEMORY. */
enum ad_status ad_series_new(size_t n_y, const ad_var y[], size_t n_x, const ad_var x[],
                             size_t order, ad_series **series);
void ad_series_free(ad_series *series); /* takes NULL */
/* Coefficients [order + 1] of element i (row-major) of x[k], to be set by the caller: entry j
   before ad_series_advance(series, j). Valid as long as the series. */
double *ad_series_input(ad_series *series, size_t k, size_t i);
/* Coefficients of element i of y[k], computed up to the last advance. Valid as long as the series;
   may be the array of an input. */
const double *ad_series_output(const ad_series *series, size_t k, size_t i);
/* True if element i of y[k] is a constant, whatever the inputs. */
bool ad_series_is_number(const ad_series *series, size_t k, size_t i);
/* Computes coefficient k of all values, for k = 0, 1, ... in turn; k = 0 begins another point.
   Coefficients of values that are not finite are not finite. They mean nothing at points where a
   derivative is infinite: sqrt, hypot and atan2 at 0, asin and acos at 1, other than whole powers
   of 0. */
void ad_series_advance(ad_series *series, size_t k);
/* The solution of x' = y, whose first n_x outputs are the rates of the inputs, of their shapes:
   c [order + 1][n], coefficients 0 to `order` of the first n elements of all inputs, the first row
   given; of the other elements coefficient 0 is set as above. order is from 1 to that of _new. What
   runs for long becomes machine code (LEASTACTION_NATIVE=0: never), to the same bits. */
void ad_series_flow(ad_series *series, size_t n, size_t order, double *c);
/* The same, with what rounding cut off the first row given in the second: it goes into sums and
   differences of two of the elements, and of one and a number. */
void ad_series_flow_cut(ad_series *series, size_t n, size_t order, double *c);
/* What rounding cut off the second row, rest [n], to less than a tenth of it, where the first row
   is c [n], off which it cut `cut` [n]: rates are then known to more digits than c can hold. Exact
   to first order for arithmetic, square roots, and their inverses and those of their cubes; other
   functions pass on what was cut off their operands. By the interpreter. */
void ad_series_rates_cut(ad_series *series, size_t n, const double *c, const double *cut,
                         double *rest);
/* Compiles that for n now; false, with the reason in `note` unless NULL. */
bool ad_series_native(ad_series *series, size_t n, struct ad_error *note);
/* Whether ad_series_flow runs as machine code now. */
bool ad_series_compiled(const ad_series *series);

/* ---- many points at once (points.c) ---- */

/* The same at AD_SERIES_POINTS points, by machine code for vectors that have one number of each
   point; element i of a matrix [n] of them is at [AD_SERIES_POINTS * i]. Each point's bits are
   those of ad_series_flow, whatever the others are. */
enum { AD_SERIES_POINTS = 8 };
typedef struct ad_points ad_points;
/* For the flow of the first n elements of all inputs of `model`, which was evaluated at a point.
   build: else only what was compiled before. NULL, with the reason in `note` unless NULL, where
   there is no machine code, or it does not agree with the interpreter. */
ad_points *ad_points_new(ad_series *model, size_t n, bool build, struct ad_error *note);
void ad_points_free(ad_points *points); /* takes NULL */
/* From now on point p is one of this series, which may differ from the model by numbers, such as
   parameters of a formula; false if it differs by more. */
bool ad_points_put(ad_points *points, size_t p, const ad_series *series);
/* [AD_SERIES_POINTS] coefficients 0 of element i of x[k], which is not of the flow, to be set by
   the caller; and of element i of y[k], which is no rate, from the last flow. */
double *ad_points_input(ad_points *points, size_t k, size_t i);
const double *ad_points_output(const ad_points *points, size_t k, size_t i);
/* c [order + 1][n], the first two rows given, as above. */
void ad_points_flow_cut(ad_points *points, size_t order, double *c);
/* Steps of the solution along its series at all points (Jorba and Zou), each of its own order and
   length: of vectors, [order + 1][n], [n] and [1]. */
#define AD_POINTS_VECTORS(_)                                                                       \
    _(start)       /* [order + 1][n] coefficients about the steps' starts */                       \
    _(end)         /* and about their ends */                                                      \
    _(y)           /* [n] the starts */                                                            \
    _(cut)         /* what rounding cut off them */                                                \
    _(next)        /* ends */                                                                      \
    _(next_cut)    /* and of those */                                                              \
    _(slope)       /* h times the slopes of the series at the ends */                              \
    _(least)       /* what a number may err where it is 0 */                                       \
    _(share)       /* [1] what it may err more, in units of it */                                  \
    _(tolerance)   /* relative, of a step */                                                       \
    _(orders)      /* of series about starts; 0: no step */                                        \
    _(next_orders) /* and ends */                                                                  \
    _(h)           /* lengths */                                                                   \
    _(power)       /* h to the order */                                                            \
    _(radius)      /* of convergence, its binary logarithm */                                      \
    _(last)        /* largest of the last coefficients, in units of what is allowed */             \
    _(worst)       /* which that is */                                                             \
    _(norm)        /* of the errors, in the same units */                                          \
    _(lost)        /* 0 where coefficients about the end are finite */
struct ad_points_steps {
#define AD_POINTS_VECTOR(name) double *name;
    AD_POINTS_VECTORS(AD_POINTS_VECTOR)
#undef AD_POINTS_VECTOR
};
/* radius, last and worst, from start, y and orders; next, next_cut, slope and power, from start, y,
   cut, orders and h; norm, worst and lost, from these and end. orders: the least that is not 0, and
   the largest; of the ends. */
void ad_points_radius(const ad_points *points, const struct ad_points_steps *steps, size_t least,
                      size_t most);
void ad_points_sum(const ad_points *points, const struct ad_points_steps *steps, size_t most);
void ad_points_norm(const ad_points *points, const struct ad_points_steps *steps, size_t most);

/* Number of kinks that values depend on: comparisons (abs, relu, min, max, select), and |x| by
   another name, such as sqrt(x^2), hypot(x, 0), acos(cos x). A series follows the branch taken at
   its point and does not see a kink nearby. */
size_t ad_series_branches(const ad_series *series);
/* The kind of the first of them, in words, such as "a root of a square"; NULL: none. */
const char *ad_series_kink(const ad_series *series);

AD_HEADER_END
#endif
