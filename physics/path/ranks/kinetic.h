/* The inverse of the kinetic part of the action's second derivatives, by which lbfgs over ranks is
   preconditioned: of each coordinate alone a second difference in time, held at both ends. Where
   the forces vary little over the time of the path, it leaves little else to find. */
#ifndef PHYSICS_PATH_RANKS_KINETIC_H
#define PHYSICS_PATH_RANKS_KINETIC_H

#include "blocks.h"

struct phys_kinetic {
    struct phys_ranked_path *path;
    struct phys_rule_table table;
    /* Of the matrix of an element, in units of the stiffness, the part of its inner nodes. */
    double inverse[PHYS_RULE_MOST][PHYS_RULE_MOST];
    double *stiffness; /* [dof]: of neighbouring slices, mass / dt */
    double *sums;      /* [blocks of this rank + 1][2 dof] */
    double *slope;     /* [dof] */
    const double *gradient, *probed;
};

/* g: the gradient of the path x, in the same unit as p->g times `share`; room: of the shape of x.
   Evaluates a path beside x, from which the stiffness is found: p->g is that of another path then.
   Where it is not positive, that of another coordinate is taken. It becomes p->scale. Ends with
   phys_kinetic_free. */
enum ad_status phys_kinetic_new(struct phys_kinetic *kinetic, struct phys_ranked_path *p,
                                double share, const double *x, const double *g, double *room,
                                struct ad_error *error);
void phys_kinetic_free(struct phys_kinetic *kinetic);
/* d [of the shape of x], a gradient, becomes the step of the inverse; 0 where the path is held.
   Messages: one of 2 dof numbers from each rank to the next, and a broadcast of dof. */
enum ad_status phys_kinetic_solve(struct phys_kinetic *kinetic, double *d, struct ad_error *error);

#endif
