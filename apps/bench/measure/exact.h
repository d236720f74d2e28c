/* Motions with exact solutions, to the last digits of a double. */
#ifndef APPS_BENCH_MEASURE_EXACT_H
#define APPS_BENCH_MEASURE_EXACT_H

#include <stddef.h>

/* The ellipse of a = GM = 1 and eccentricity e at time t after pericentre: q, v [2]. */
void exact_kepler(double e, double t, double *q, double *v);
/* The pendulum of g = l = 1 at time t after it passed the bottom at rate 2k, 0 < k < 1: q, v [1].
 */
void exact_pendulum(double k, double t, double *q, double *v);

/* Root mean square of the difference of x [n] from an answer, relative to that of the answer. */
double relative_distance(size_t n, const double *x, const double *answer);

#endif
