/* Whether L_vv is definite along a path. */
#ifndef PHYSICS_PATH_DEFINITE_H
#define PHYSICS_PATH_DEFINITE_H

#include "internal.h"
#include "physics/action/hessian.h"

/* Of h->mass, which it destroys: positive or negative definite at all points, else indefinite from
   `time` on, the first point where it is not. */
enum phys_definite phys_hessian_definite(struct phys_hessian *h, double *time);

#endif
