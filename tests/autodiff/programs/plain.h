/* Plain evaluation of any recording, gradients included: node by node in double, with a bound of
   the rounding error for every element: errors of operands, from the operation at both ends of
   their intervals, plus the operation's own, in units of the tape's type. A condition within its
   error makes the error as large as the difference of its branches. */
#ifndef TESTS_AUTODIFF_PROGRAMS_PLAIN_H
#define TESTS_AUTODIFF_PROGRAMS_PLAIN_H

#include "autodiff/autodiff.h"

struct plain {
    const ad_tape *tape;
    size_t n, max; /* nodes evaluated so far */
    double **value, **error;
};

void plain_init(struct plain *p, const ad_tape *tape);
void plain_release(struct plain *p);
/* Values of an input, exact; before plain_run comes to it. */
void plain_set(struct plain *p, ad_var input, const double *values);
/* Evaluates what was recorded since. */
void plain_run(struct plain *p);

#endif
