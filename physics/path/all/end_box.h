/* A box of velocities with an end map (end_map.h) at its centre: what the linear part of the map
   says of roots in it. */
#ifndef PHYSICS_PATH_ALL_END_BOX_H
#define PHYSICS_PATH_ALL_END_BOX_H

#include "end_map.h"

struct phys_end_box {
    double x[PHYS_END_MAP_DOF], half; /* centre, in the directions of the edges; half an edge */
    double g[PHYS_END_MAP_DOF], J[PHYS_END_MAP_DOF * PHYS_END_MAP_DOF]; /* by x */
    bool lost;
    int depth;
};

/* x = J^-1 g; false: J is singular. */
bool phys_end_solve(size_t n, const double *J, const double *g, double *x);
/* Whether the map has no root in the box where it departs from its linear part by at most `off`. */
bool phys_end_box_left_out(size_t n, const struct phys_end_box *b, double off);
/* How far the map departs from its linear part at `at` on boxes `child`, the divided `at`, at
   most. */
double phys_end_box_departure(size_t n, const struct phys_end_box *at,
                              const struct phys_end_box *child, size_t children);
/* The largest row sum of J^-1 (other - J). */
double phys_end_box_varies(size_t n, const double *J, const double *other);

#endif
