/* The method of motions that others are held against. */
#ifndef PHYSICS_MOTION_METHOD_H
#define PHYSICS_MOTION_METHOD_H

#include "motion.h"

/* taylor where the motion has a series at y, and a small one; else dop853. */
const struct phys_integrator *phys_motion_method(const struct phys_ode *ode, const double *y,
                                                 struct ad_error *error);

#endif
