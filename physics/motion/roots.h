/* All roots of a smooth function on an interval, isolated (roots.c; docs/theory.md, Events). */
#ifndef PHYSICS_MOTION_ROOTS_H
#define PHYSICS_MOTION_ROOTS_H

#include <stddef.h>

enum { PHYS_ROOTS_MOST = 256, PHYS_ROOTS_N = 8 };

/* Polynomials of degree N - 1 on [0, 1]: Bernstein coefficients from values at the Chebyshev
   points, values at the extrema of T_N from coefficients. */
struct phys_roots_table {
    double coefficient[PHYS_ROOTS_N][PHYS_ROOTS_N];
    double value[PHYS_ROOTS_N + 1][PHYS_ROOTS_N];
};
void phys_roots_fill(struct phys_roots_table *table);

struct phys_root {
    double x;
    int kind; /* +1: the function rises through zero, -1: it falls, 0: it touches zero */
};

typedef double phys_root_function(void *context, double x);

/* Roots inside (a, b), ascending, at most PHYS_ROOTS_MOST; returns their number. 0 where values are
   not finite. */
size_t phys_roots(const struct phys_roots_table *table, phys_root_function *f, void *context,
                  double a, double b, struct phys_root roots[]);

#endif
