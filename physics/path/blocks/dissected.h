/* A Newton step of a path by nested dissection: where L couples each coordinate to few others, the
   unknowns, coordinates by nodes, are cut by slices in time and by separators of the coordinates,
   whichever is smaller, and eliminated by fronts. */
#ifndef PHYSICS_PATH_BLOCKS_DISSECTED_H
#define PHYSICS_PATH_BLOCKS_DISSECTED_H

#include "physics/action/hessian.h"
#include "physics/linear/fronts.h"

struct phys_dissected_path {
    const struct phys_hessian *hessian;
    size_t first; /* unknown u is place (first + u) % dof of node (first + u) / dof */
    struct phys_fronts fronts;
    uint32_t *place; /* among the values, of each entry between unknowns; NONE: its mirror has it */
};

/* Whether L couples few enough coordinates for n unknowns from `first` on. */
bool phys_dissected_serves(const struct phys_hessian *hessian, size_t n);
/* Ends with phys_dissected_free, whatever it returned. False: no memory. */
bool phys_dissected_new(struct phys_dissected_path *path, const struct phys_hessian *hessian,
                        size_t first, size_t n);
void phys_dissected_free(struct phys_dissected_path *path);
/* The memory of factors of numbers of `parts` parts. */
double phys_dissected_bytes(const struct phys_dissected_path *path, size_t parts);
/* Factors D^-1 H D^-1 - i damping, D^-1 being scale [dof]; 1 for unknowns that are `held` (NULL:
   none is). */
bool phys_dissected_factor(struct phys_dissected_path *path, const double *scale, double damping,
                           const bool *held, bool *no_memory);
/* right [n] becomes the real part of the solution; x [2 n] is room. */
void phys_dissected_solve(struct phys_dissected_path *path, const double *scale, const bool *held,
                          double *right, double *x);

#endif
