/* Levenberg's step of a path: solves H - i m over the free nodes, H being the sum of the element
   matrices, by block elimination in order of time. Block e holds all nodes of its element but the
   first, which is the last of block e - 1; adjacent blocks are coupled through one slice. */
#ifndef PHYSICS_BLOCK_TRIDIAGONAL_H
#define PHYSICS_BLOCK_TRIDIAGONAL_H

#include "physics/action/hessian.h"

struct phys_block_tridiagonal {
    const struct phys_hessian *hessian;
    const double *scale;     /* [dof]: D^-1, the caller's */
    size_t first, count;     /* elements with nodes that move, one a block */
    size_t dof, size;        /* of a block, degree * dof; the last has a slice less */
    double *factor;          /* [count][size x size] complex */
    int *pivots;             /* [count][size] */
    double *right;           /* [count][size] complex */
    double *coupling, *work; /* room: [size x size] complex each */
};

/* For paths whose first and last `hold` slices are held. Ends with phys_block_tridiagonal_free. */
bool phys_block_tridiagonal_new(struct phys_block_tridiagonal *blocks,
                                const struct phys_hessian *hessian, size_t hold,
                                const double *scale);
void phys_block_tridiagonal_free(struct phys_block_tridiagonal *blocks);
/* Factors D^-1 H D^-1 - i damping, damping > 0. False: a block is singular or not finite. */
bool phys_block_tridiagonal_factor(struct phys_block_tridiagonal *blocks, double damping);
/* x [unknowns] becomes the real part of (D^-1 H D^-1 - i damping)^-1 x. */
void phys_block_tridiagonal_solve(struct phys_block_tridiagonal *blocks, double *x);

#endif
