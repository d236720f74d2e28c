/* Internals of a search for a path that verifies it: all of it (find.c), the motion from its start
   (find_motion.c). */
#ifndef PHYSICS_PATH_VERIFY_FIND_H
#define PHYSICS_PATH_VERIFY_FIND_H

#include "physics/path/newton.h"
#include "physics/path/path_units.h"

struct phys_search {
    const struct phys_system *system;
    const struct phys_path_settings *settings;
    const double *path;
    struct phys_newton *newton;   /* that found it; NULL: another solver did */
    struct phys_refined *refined; /* whose path it is; or NULL */
    struct phys_path_found *found;
    double *unit; /* [dof] (path_units.h) */
    size_t dof, slices;
};

static const double PHYS_SEARCH_SAME =
    1e-6; /* of the extent: two stationary paths of one grid are one */

/* Largest difference of paths a and b; the largest distance of places of one. */
static inline double phys_search_apart(const struct phys_search *s, const double *a,
                                       const double *b)
{
    return phys_path_apart(s->unit, a, b, s->dof, s->slices);
}

static inline double phys_search_extent(const struct phys_search *s, const double *path)
{
    return phys_path_extent(s->unit, path, s->dof, s->slices);
}

/* The distance of s->path from the motion from its own start into s->found, or why there is none.
 */
enum ad_status phys_search_motion(const struct phys_search *s, struct ad_error *error);

#endif
