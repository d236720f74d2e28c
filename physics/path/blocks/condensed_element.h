/* Blocks of a Newton step (block_tridiagonal.h): elements without their inner nodes
   (condensed_element.c) and the elimination of slices (block_tridiagonal.c). */
#ifndef PHYSICS_PATH_BLOCKS_CONDENSED_ELEMENT_H
#define PHYSICS_PATH_BLOCKS_CONDENSED_ELEMENT_H

#include "block_tridiagonal.h"

/* Inner nodes of element e and slice s in a right side. */
static inline double *phys_inner_of(double *x, const struct phys_block_tridiagonal *b, size_t e)
{
    return x + b->parts * e * (b->dof + b->inner);
}

static inline double *phys_at_slice(double *x, const struct phys_block_tridiagonal *b, size_t s)
{
    return phys_inner_of(x, b, s) + b->parts * b->inner;
}

/* Slice `side` of element e; NULL where it is held. */
static inline double *phys_slice_beside(double *x, const struct phys_block_tridiagonal *b, size_t e,
                                        size_t side)
{
    return e + side == 0 || e + side == b->count ? NULL : phys_at_slice(x, b, e + side - 1);
}

/* Eliminates the inner nodes of element e. What remains over both slices, [dof x dof] by columns:
   `before` of the slice before, `behind` of the one behind, and rows of the first by columns of the
   second in `both`. False: the inner block is singular or not finite. */
bool phys_condense(const struct phys_block_tridiagonal *b, size_t e, double damping, double *before,
                   double *both, double *behind);
/* Of a right side: inner nodes become K^-1 b, in the order of the band; slices b - C^T K^-1 b. */
void phys_condense_right(const struct phys_block_tridiagonal *b, size_t e, double *y);
/* Inner nodes become K^-1 b - K^-1 C (slices), node by node again. */
void phys_condensed_expand(const struct phys_block_tridiagonal *b, size_t e, double *y);

#endif
