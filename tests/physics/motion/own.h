/* A Lagrangian of a test's own, of one coordinate, that starts at q = 0.5, v = 0.25. */
#ifndef TESTS_PHYSICS_MOTION_OWN_H
#define TESTS_PHYSICS_MOTION_OWN_H

#include "tests/physics/systems.h"
#include "physics/physics.h"

enum ad_status begin_own(const void *params, uint64_t seed, double *q, double *v,
                         struct ad_error *error);
/* Its state y at time t by a method, at a tolerance of 1e-14. */
enum ad_status follow_own(const struct phys_scene *scene, const char *method, double t,
                          double y[2]);

#endif
