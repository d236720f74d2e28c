/* Averages the parameters over the last steps of a training. With a constant step the parameters
   keep fluctuating about a minimum, and their mean is nearer to it than any of them (B. Polyak, A.
   Juditsky, "Acceleration of stochastic approximation by averaging", SIAM J. Control Optim. 30,
   1992). The first steps must be forgotten: with weight 1/(f k) at step k, about the last fraction
   f of the steps counts, however long the training is (O. Shamir, T. Zhang, "Stochastic gradient
   descent for non-smooth optimization", ICML 2013).

   The mean is in f64 whatever the type of the parameters: in f32 a small weight times a small
   difference would be lost. */
#include "train.h"

#include <math.h>
#include <stdlib.h>

bool hnn_average_new(hnn_trainer *t)
{
    t->average = calloc(t->problem.n, sizeof *t->average);
    t->rounded = malloc(t->problem.n * hnn_type_bytes(t->problem.type));
    return t->average && t->rounded;
}

void hnn_average_restart(hnn_trainer *t)
{
    if (t->average)
        hnn_to_double(t->problem.type, t->problem.n, hnn_problem_point(&t->problem), t->average);
}

void hnn_average_step(hnn_trainer *t)
{
    double weight = 1 / fmax(1, t->settings.average * (double)t->step), *mean = t->average;
    const void *point = hnn_problem_point(&t->problem);
    if (t->problem.type == AD_F32) {
        const float *x = point;
#pragma omp simd
        for (size_t k = 0; k < t->problem.n; k++)
            mean[k] += weight * ((double)x[k] - mean[k]);
    } else {
        const double *x = point;
#pragma omp simd
        for (size_t k = 0; k < t->problem.n; k++)
            mean[k] += weight * (x[k] - mean[k]);
    }
}

const void *hnn_trainer_outcome(const hnn_trainer *t)
{
    if (!t->average || t->step == 0)
        return hnn_problem_point(&t->problem);
    hnn_from_double(t->problem.type, t->problem.n, t->average, t->rounded);
    return t->rounded;
}
