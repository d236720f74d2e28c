#ifndef PHYSICS_INTEGRATORS_KEPLER_STEP_H
#define PHYSICS_INTEGRATORS_KEPLER_STEP_H

#include <stddef.h>

/* q, v [dims] about a fixed centre that attracts by mu / r^2, moved on by h, of any sign and
   length; cut_q, cut_v [dims] is what rounding cut off them. */
void phys_kepler_step(size_t dims, double mu, double h, double *q, double *v, double *cut_q,
                      double *cut_v);

#endif
