/* The mass matrix L_vv, and how accurately it can be solved with. */
#ifndef PHYSICS_LAGRANGIAN_MASS_H
#define PHYSICS_LAGRANGIAN_MASS_H

#include "coupling.h"

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

/* M of any number of coordinates: by its columns of each colour, factored as a diagonal, a band or
   a whole. */
struct phys_mass {
    struct phys_pattern pattern;
    double *values;   /* [n x colours]: the sum of its columns of each colour, which share no row */
    bool diagonal;    /* at the last values */
    double *factor;   /* M as factored */
    int *pivots;      /* [n] */
    double *column;   /* [n]: largest entries of M's columns, in the order of the pattern */
    double *work;     /* [n] */
    double condition; /* what elimination cancels at most, of the column of coordinate `worst` */
    size_t worst;
    double largest; /* entry of that column */
};

/* Of up to `few` coordinates M has all entries, beyond those that L couples. Ends with
   phys_mass_free, whatever it returned. False: no memory. */
enum {
    PHYS_MASS_FEW = 64,   /* a pattern takes longer to find than a constant M to evaluate once */
    PHYS_MASS_VARYING = 8 /* the same of one that is evaluated in every step */
};
bool phys_mass_new(struct phys_mass *mass, const struct phys_system *system, size_t few);
/* Whether it has all entries where `few` would leave some out, if L couples few. */
bool phys_mass_is_whole(const struct phys_mass *mass, size_t few);
void phys_mass_free(struct phys_mass *mass);
/* Entry (i, j) of `values`. */
double phys_mass_entry(const struct phys_mass *mass, size_t i, size_t j);
/* Whether `values` have no entry beside the diagonal. */
bool phys_mass_is_diagonal(const struct phys_mass *mass);
/* Factors `values`, the entries changed by relative amounts between `rounding` and twice that where
   M is not diagonal. */
void phys_mass_factor(struct phys_mass *mass, double rounding);
/* b [n] becomes M^-1 b. */
void phys_mass_solve(const struct phys_mass *mass, double *b);

#endif
