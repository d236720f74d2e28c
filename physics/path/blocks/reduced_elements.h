/* A Newton step of a path by elements that are reduced to their ends, where L couples all
   coordinates and nothing is damped: symmetric factors of each element without its slices (Bunch,
   Kaufman), then a band over the slices. A third of the operations of one band, or less. */
#ifndef PHYSICS_PATH_BLOCKS_REDUCED_ELEMENTS_H
#define PHYSICS_PATH_BLOCKS_REDUCED_ELEMENTS_H

#include "physics/action/hessian.h"

struct phys_reduced {
    const struct phys_hessian *hessian;
    const double *scale;       /* [dof]: D^-1, the caller's */
    size_t first, count;       /* elements with nodes that move */
    size_t dof, inner, side;   /* of a slice, inside an element, and in all of it */
    size_t lead;               /* of the unknowns, those of the first slice */
    double *element;           /* [count][side x side]: inner nodes, slice before, slice behind */
    double *band;              /* over [count + 1] slices, what is held by itself */
    double *slices, *work;     /* [count + 1][dof], [side] */
    int *pivots, *band_pivots; /* [count][inner], [count + 1][dof] */
};

/* Whether elements of this Hessian may be reduced. */
bool phys_reduced_serves(const struct phys_hessian *hessian);
/* For paths whose first and last `hold` slices are held, but for what the Hessian has free. False:
   no memory. Ends with phys_reduced_free. */
bool phys_reduced_new(struct phys_reduced *reduced, const struct phys_hessian *hessian, size_t hold,
                      const double *scale);
void phys_reduced_free(struct phys_reduced *reduced);
/* Factors D^-1 H D^-1. False: it is singular or not finite, or the inner nodes of an element alone
   nearly are. */
bool phys_reduced_factor(struct phys_reduced *reduced);
/* x, unknowns by node, becomes (D^-1 H D^-1)^-1 x. */
void phys_reduced_solve(struct phys_reduced *reduced, double *x);

#endif
