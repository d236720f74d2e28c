/* Where motions that begin at one place end: a map of their initial velocities, with its
   derivatives. */
#ifndef PHYSICS_PATH_ALL_END_MAP_H
#define PHYSICS_PATH_ALL_END_MAP_H

#include "physics/motion/motion.h"
#include "physics/path/internal.h"

enum { PHYS_END_MAP_DOF = 3 };
#define PHYS_END_MAP_TIGHT 1e-13 /* tolerance of motions to roots, per step */

struct phys_end_map {
    size_t dof;
    double time, reach; /* of the motion; a length of its size */
    const double *from; /* q [dof] */
    double to[PHYS_END_MAP_DOF];
    double *unit; /* [dof x dof]: v = unit w has the kinetic energy |w|^2 / 2 */
    double speed; /* a natural size of w */
    struct phys_ode motion, varied;
    bool has_variations; /* else derivatives are differences */
    double *y, *scale;
    size_t steps; /* taken in all */
    bool (*proceed)(void *context);
    void *context;
};

/* From q [dof] to `to` [dof]; reach is a length. Ends with phys_end_map_free, whatever it returned.
 */
enum ad_status phys_end_map_new(struct phys_end_map *map, const struct phys_system *system,
                                const double *from, const double *to, double time, double reach,
                                struct ad_error *error);
void phys_end_map_free(struct phys_end_map *map);
/* miss [dof] = d / (reach + |d|), d = q(time) - to, and its derivatives J [dof x dof] by w, from
   a motion with a relative error of `tolerance` a step. Where the motion leaves to infinity miss
   has length 1 and J is 0. False: the motion is lost, as by a collision. */
bool phys_end_map_at(struct phys_end_map *map, const double *w, double tolerance, double *miss,
                     double *J);

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
