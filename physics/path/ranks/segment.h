/* A segment: the Newton system of a part of a path between two slices, all nodes in between
   eliminated. Two segments that share a slice join to one without it, which is both the step of an
   elimination in order of time and that of a tree over blocks of a path. */
#ifndef PHYSICS_PATH_RANKS_SEGMENT_H
#define PHYSICS_PATH_RANKS_SEGMENT_H

#include <stdbool.h>
#include <stddef.h>

/* A segment has `side` = 2 dof + 1 columns of as many rows, of which the lower triangle counts:
   the first slice, the last one, and as the last row the gradient; then the number of negative
   eigenvalues of what was eliminated, and of pivots that were zero. */
static inline size_t phys_segment_side(size_t dof) { return 2 * dof + 1; }
static inline size_t phys_segment_numbers(size_t dof)
{
    return phys_segment_side(dof) * phys_segment_side(dof) + 2;
}
static inline double *phys_segment_counts(size_t dof, double *segment)
{
    return segment + phys_segment_side(dof) * phys_segment_side(dof);
}

struct phys_joints {
    size_t dof, most; /* inner unknowns of a right side, at most */
    double shift;     /* the matrix is less this */
    double *work;     /* [dof + most + side]^2 */
    int *pivots;
    size_t *place[2]; /* of rows of left and right in the work */
};

bool phys_joints_new(struct phys_joints *joints, size_t dof, size_t most);
void phys_joints_free(struct phys_joints *joints);
/* `whole` becomes left and right joined, and may be left. right: rows and columns of its first
   slice, `inner` unknowns more, its last slice, and the gradient; without the two counts where
   inner is not 0. left NULL: only the inner unknowns are eliminated. `solved` [side][(left ? dof :
   0) + inner] is what phys_segment_expand needs. */
void phys_segment_join(struct phys_joints *joints, const double *left, const double *right,
                       const double *counts, size_t inner, double *whole, double *solved);
/* Newton's step x [n] of the n unknowns of a joint, from that of both ends [2 dof]. */
void phys_segment_expand(size_t dof, size_t n, const double *solved, const double *ends, double *x);

#endif
