/* A Newton step of a path by blocks: solves H - i m over the free nodes, H being the sum of the
   element matrices. The inner nodes of each element are eliminated first, as a band where L couples
   neighbours alone; the blocks of the slices then in order of time. */
#ifndef PHYSICS_PATH_BLOCKS_BLOCK_TRIDIAGONAL_H
#define PHYSICS_PATH_BLOCKS_BLOCK_TRIDIAGONAL_H

#include "physics/action/hessian.h"

struct phys_block_tridiagonal {
    const struct phys_hessian *hessian;
    const double *scale;               /* [dof]: D^-1, the caller's */
    size_t parts;                      /* of a number: 1 where nothing is damped, else 2 */
    size_t first, count;               /* elements with nodes that move */
    size_t dof, inner;                 /* unknowns of a slice, and inside an element */
    size_t reach, width;               /* of the Hessian when it was made; of the inner band */
    size_t room;                       /* numbers of an inner band */
    double *slice, *coupling;          /* [count][dof x dof] */
    double *band;                      /* [count][room] */
    int *pivots;                       /* [count][dof + inner] */
    double *right;                     /* [count][dof + inner] */
    double *condensed, *solved, *work; /* room: [dof x dof], [2 dof x inner], [2][dof x dof] */
};

/* About how many operations on real numbers the factors take where damped. */
double phys_block_tridiagonal_cost(const struct phys_hessian *hessian);
/* Its memory, about. */
double phys_block_tridiagonal_bytes(const struct phys_hessian *hessian);
/* For paths whose first and last `hold` slices are held, coupled as far as the Hessian knows now.
   Ends with phys_block_tridiagonal_free. */
bool phys_block_tridiagonal_new(struct phys_block_tridiagonal *blocks,
                                const struct phys_hessian *hessian, size_t hold,
                                const double *scale);
void phys_block_tridiagonal_free(struct phys_block_tridiagonal *blocks);
/* Factors D^-1 H D^-1 - i damping. False: a block is singular or not finite. */
bool phys_block_tridiagonal_factor(struct phys_block_tridiagonal *blocks, double damping);
/* x [unknowns] becomes the real part of (D^-1 H D^-1 - i damping)^-1 x. */
void phys_block_tridiagonal_solve(struct phys_block_tridiagonal *blocks, double *x);

#endif
