/* Where motions that begin at one place end: a map of their initial velocities, with its
   derivatives. Where coordinates of the ends are free it is one of what is not known of the start;
   where the end time is, one of directions and durations. */
#ifndef PHYSICS_PATH_ALL_END_MAP_H
#define PHYSICS_PATH_ALL_END_MAP_H

#include "physics/lagrangian/curvature.h"
#include "physics/motion/motion.h"
#include "physics/path/internal.h"

enum { PHYS_END_MAP_DOF = 3 };
#define PHYS_END_MAP_TIGHT 1e-13 /* tolerance of motions to roots, per step */

struct phys_end_map {
    size_t dof;
    double time, reach; /* of the motion, the longest where it is free; a length of its size */
    const struct phys_ends *ends; /* without relations; NULL: nothing is free */
    double from[PHYS_END_MAP_DOF], to[PHYS_END_MAP_DOF];
    double *unit; /* [dof x dof]: v = unit w has the kinetic energy |w|^2 / 2 */
    double speed; /* a natural size of w */
    struct phys_curvature at;
    phys_legendre *legendre; /* where coordinates are free */
    struct phys_ode motion, varied;
    bool has_variations; /* else derivatives are differences */
    double *y, *scale;
    size_t steps; /* taken in all */
    bool (*proceed)(void *context);
    void *context;
};

/* From q [dof] to `to` [dof], but for what `ends`, which outlives the map, leaves free; reach is a
   length. AD_E_ACCURACY where no motion of the energy asked for begins at q. Ends with
   phys_end_map_free, whatever it returned. */
enum ad_status phys_end_map_new(struct phys_end_map *map, const struct phys_system *system,
                                const struct phys_ends *ends, const double *from, const double *to,
                                double time, double reach, struct ad_error *error);
void phys_end_map_free(struct phys_end_map *map);
/* miss [dof] = d / (reach + |d|), d = q(time) - to, or as a length the momentum of what is free
   there, and its derivatives J [dof x dof] by w, from a motion with a relative error of `tolerance`
   a step. Where the motion leaves to infinity miss has length 1 and J is 0. False: the motion is
   lost, as by a collision, or none begins so. */
bool phys_end_map_at(struct phys_end_map *map, const double *w, double tolerance, double *miss,
                     double *J);
/* How the motion of w begins (end_start.c): q, v [dof], and its duration. With free end time w is
   the direction of the velocity at that energy, and |w| / speed the share of the longest time; with
   coordinates free at the start w has their places, and the momenta of the others; else v = unit w.
   by [dof][2 dof + 1]: derivatives of (q, v, time) by each w, or NULL. False: there is none. */
bool phys_end_map_start(struct phys_end_map *map, const double *w, double *q, double *v,
                        double *time, double *by);

double phys_end_norm(size_t n, const double *a);
double phys_end_distance(size_t n, const double *a, const double *b);
/* |a - b| < by, in loops over all roots. */
static inline bool phys_end_near(size_t n, const double *a, const double *b, double by)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum < by * by;
}

/* J [n x n] = sum of size_k left_k right_k^T, row k of left and right being left_k and right_k;
   sizes descend. */
struct phys_singular {
    double size[PHYS_END_MAP_DOF], left[PHYS_END_MAP_DOF][PHYS_END_MAP_DOF],
        right[PHYS_END_MAP_DOF][PHYS_END_MAP_DOF];
};
void phys_singular_values(size_t n, const double *J, struct phys_singular *s);

#endif
