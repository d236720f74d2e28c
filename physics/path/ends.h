/* The directions in which the ends of a path may move: z = (q(0), q(T)), of which some coordinates
   are given and the others keep linear relations. A path is stationary if the gradient of S,
   (-p(0), p(T)), is 0 along these directions: the natural boundary conditions, which are
   transversality for relations (Gelfand, Fomin, Calculus of Variations, section 14). */
#ifndef PHYSICS_PATH_ENDS_H
#define PHYSICS_PATH_ENDS_H

#include "internal.h"
#include "physics/path/constrained/surface.h"

struct phys_end_space {
    const struct phys_ends *ends;
    size_t n, dof; /* relations; coordinates of an end */
    double *row;   /* [n][2 dof + 1] the relations, orthonormal over what moves, and their values */
};

/* Whether a coordinate moves; ends NULL: none does. */
static inline bool phys_end_moves(const struct phys_ends *ends, size_t end, size_t coordinate)
{
    return ends && ends->free[end] && ends->free[end][coordinate];
}

/* Room for the relations of `ends`, which stay the caller's; in plain coordinates. Ends with
   phys_end_space_free. */
enum ad_status phys_end_space_new(struct phys_end_space *space, const struct phys_ends *ends,
                                  size_t dof, struct ad_error *error);
void phys_end_space_free(struct phys_end_space *space);
/* The same for coordinates order[k] in units of unit[k] at place k, [dof] each; NULL: k, and 1. The
   first relation that the others imply; n: none. */
size_t phys_end_space_scale(struct phys_end_space *space, const uint32_t *order,
                            const double *unit);
/* Of x [2 dof] what lies in the directions that are free, given coordinates included as 0. */
void phys_end_space_project(const struct phys_end_space *space, const uint32_t *order, double *x);
/* The nearest z that keeps the relations, what is given included. */
void phys_end_space_meet(const struct phys_end_space *space, double *z);
/* The same for the slices at the ends of a path [rows x slices]. */
void phys_end_space_meet_path(const struct phys_end_space *space, size_t slices, double *path);
/* Projects those of a gradient [n] of such a path; its norm. */
double phys_end_space_gradient(const struct phys_end_space *space, size_t slices, size_t n,
                               double *g);

/* The tangent coordinates of constraints that move at the ends: `ends` must live as long as the
   surface, whose Hessian keeps it. Does nothing for NULL, and where both ends are given. */
void phys_ends_of_surface(struct phys_surface *surface, struct phys_ends *ends);

/* AD_E_ARGUMENT where relations are not finite, follow from others, or contradict them or the ends
   of the path [rows x slices] that are given. */
enum ad_status phys_ends_check(const struct phys_system *system, const struct phys_ends *ends,
                               size_t slices, const double *path, struct ad_error *error);
/* What to try where an eigenvalue of the second variation is zero. */
const char *phys_ends_advice(const struct phys_ends *ends);

#endif
