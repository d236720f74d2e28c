/* Condition of the mass matrix (mass.h). */
#include "mass.h"

#include <math.h>

void phys_mass_columns(size_t n, const double *M, double *column)
{
    for (size_t k = 0; k < n; k++) {
        column[k] = 0;
        for (size_t i = 0; i < n; i++)
            column[k] = fmax(column[k], fabs(M[k * n + i]));
    }
}

double phys_mass_condition(size_t n, const double *column, const double *factor, size_t stride,
                           size_t *worst)
{
    double most = 1;
    *worst = 0;
    for (size_t k = 0; k < n; k++) {
        double pivot = fabs(factor[k * stride]);
        double ratio = pivot > 0 ? column[k] / pivot : (double)INFINITY;
        if (ratio > most) {
            most = ratio;
            *worst = k;
        }
    }
    return most;
}
