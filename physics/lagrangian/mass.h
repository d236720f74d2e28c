/* Condition of the mass matrix L_vv: how accurately it can be solved with. */
#ifndef PHYSICS_LAGRANGIAN_MASS_H
#define PHYSICS_LAGRANGIAN_MASS_H

#include <stddef.h>

/* A mass matrix of a larger condition number is singular but for rounding: of accelerations fewer
   than four digits would be known. */
#define PHYS_MASS_SINGULAR 1e12

/* Largest entries of the columns of a symmetric M [n x n]. */
void phys_mass_columns(size_t n, const double *M, double *column);
/* A pivot of P L U, factor[k * stride], against the largest entry of its column: what elimination
   cancelled, a lower bound of the condition number of M in scaled coordinates, INFINITY where a
   pivot is zero. *worst: the coordinate. */
double phys_mass_condition(size_t n, const double *column, const double *factor, size_t stride,
                           size_t *worst);

#endif
