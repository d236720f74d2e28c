/* Limited-memory BFGS descent in f64: J. Nocedal, S. Wright, Numerical Optimization, 2nd ed.,
   algorithms 7.4 and 7.5, the strong Wolfe conditions found by bracketing. */
#ifndef AUTODIFF_LBFGS_H
#define AUTODIFF_LBFGS_H

#include "autodiff.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The objective at x [n], its gradient to g [n]. May round x to what it was evaluated at. */
typedef double ad_objective(void *context, double *x, double *g);

typedef struct ad_lbfgs ad_lbfgs;

/* Of n variables. NULL when memory is exhausted. */
ad_lbfgs *ad_lbfgs_new(size_t n);
void ad_lbfgs_free(ad_lbfgs *method); /* takes NULL */

/* One step from x [n], where the gradient is g [n] and the objective *value: all three become those
   of the new point, the last that was evaluated. `first` bounds the move of each variable in the
   first step, which has no scale yet. False, and all three as they were, if the objective falls no
   further along the direction. */
bool ad_lbfgs_step(ad_lbfgs *method, ad_objective *evaluate, void *context, double first, double *x,
                   double *g, double *value);

/* State for checkpoints: pairs taken so far, and [size] numbers, owned by the method. Writing both
   back resumes bitwise. */
uint64_t *ad_lbfgs_pairs(ad_lbfgs *method);
double *ad_lbfgs_state(ad_lbfgs *method, size_t *size);

#ifdef __cplusplus
}
#endif
#endif
