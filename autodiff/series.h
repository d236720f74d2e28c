/* Taylor coefficients of recorded values along a curve: where the elements of the inputs are power
   series in s, so are those of what was recorded.

       ad_series *series;
       ad_series_new(1, &y, 1, &x, order, &series);
       for (size_t k = 0; k <= order; k++) {
           ad_series_input(series, 0, i)[k] = ...;        for all elements i of x
           ad_series_advance(series, k);                  then ad_series_output(series, 0, i)[k]
       }

   Coefficient k of y needs coefficients 0 to k of x alone, so a differential equation x' = f(x)
   gives x's next one, f's [k] / (k + 1), as it goes (Jorba and Zou, Experimental Mathematics 14
   (2005) 99). */
#ifndef AUTODIFF_SERIES_H
#define AUTODIFF_SERIES_H

#include "autodiff/autodiff.h"

AD_HEADER_BEGIN

typedef struct ad_series ad_series;

/* Up to coefficient `order` of y[0..n_y-1] by x[0..n_x-1], inputs of one tape of AD_F64: all that y
   depends on; the same input may come only once. The recording is read now and not kept. Each
   element is a series of its own, so memory and time grow with elements times order, and time with
   order squared. On failure *series is NULL, and the status is returned and kept in the tape:
   AD_E_ARGUMENT for small systems (ad_solve, ad_logdet), which have no rule, AD_E_TAPE,
   AD_E_MEMORY.
 */
enum ad_status ad_series_new(size_t n_y, const ad_var y[], size_t n_x, const ad_var x[],
                             size_t order, ad_series **series);
void ad_series_free(ad_series *series); /* takes NULL */
/* Coefficients [order + 1] of element i (row-major) of x[k], for the caller to set: entry j before
   ad_series_advance(series, j). Live as long as the series. */
double *ad_series_input(ad_series *series, size_t k, size_t i);
/* Coefficients of element i of y[k]; entries up to the last advance are known. The pointer is good
   as long as the series; it may be that of an input. */
const double *ad_series_output(const ad_series *series, size_t k, size_t i);
/* Whether element i of y[k] is a number whatever the inputs are. */
bool ad_series_is_number(const ad_series *series, size_t k, size_t i);
/* Coefficient k of all values, for k = 0, 1, ... in turn; k = 0 begins another point. Where values
   are not finite, coefficients are not. */
void ad_series_advance(ad_series *series, size_t k);
/* Comparisons on which values depend (abs, relu, min, max, select): a series is that of the branch
   taken at its point, and knows nothing of a kink nearby. */
size_t ad_series_branches(const ad_series *series);
/* Values carried, each a series. */
size_t ad_series_size(const ad_series *series);

AD_HEADER_END
#endif
