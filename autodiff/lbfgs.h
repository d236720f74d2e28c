/* Limited-memory BFGS descent in f64: J. Nocedal, S. Wright, Numerical Optimization, 2nd ed.,
   algorithms 7.4 and 7.5, with a bracketing search for the strong Wolfe conditions.

   Lifetime: what *_new makes lives until its *_free. Threads: as in autodiff.h. */
#ifndef AUTODIFF_LBFGS_H
#define AUTODIFF_LBFGS_H

#include "autodiff.h"

AD_HEADER_BEGIN

/* Returns the objective at x [n] and writes its gradient to g [n]. May round x to the point at
   which it was evaluated. */
typedef double ad_objective(void *context, double *x, double *g);

typedef struct ad_lbfgs ad_lbfgs;

/* A descent of n variables. NULL when memory is exhausted. */
ad_lbfgs *ad_lbfgs_new(size_t n);
void ad_lbfgs_free(ad_lbfgs *method); /* takes NULL */

/* One step from x [n], where the gradient is g [n] and the objective *value; all three become those
   of the new point, which was evaluated last. `first` bounds the change of each variable in the
   first step, which has no scale yet. Returns false, with all three unchanged, if the objective
   does not decrease along the direction. */
bool ad_lbfgs_step(ad_lbfgs *method, ad_objective *evaluate, void *context, double first, double *x,
                   double *g, double *value);

/* Of vectors that processes share: the product of a and b [n] over all of them, the same number on
   each. From then on all processes take steps together, and `first` bounds the norm of the first
   step. The method is read during calls of ad_lbfgs_step. */
typedef double ad_inner_product(void *context, const double *a, const double *b);
void ad_lbfgs_share(ad_lbfgs *method, ad_inner_product *product, void *context);

/* A symmetric, positive definite approximation of the inverse of the second derivatives: d [n], a
   gradient, becomes its product. Directions begin with it, and the first step with that direction
   as it is. Of vectors that processes share, all call it together. */
typedef void ad_inverse_times(void *context, double *d);
void ad_lbfgs_precondition(ad_lbfgs *method, ad_inverse_times *inverse, void *context);

/* State for checkpoints: the number of pairs so far, and [size] numbers, owned by the method.
   Writing both back resumes bitwise. */
uint64_t *ad_lbfgs_pairs(ad_lbfgs *method);
double *ad_lbfgs_state(ad_lbfgs *method, size_t *size);

AD_HEADER_END
#endif
