/* Scenes with constraints and their motions; an error fails the test. */
#ifndef TESTS_PHYSICS_MOTION_CONSTRAINED_H
#define TESTS_PHYSICS_MOTION_CONSTRAINED_H

#include "tests/physics/systems.h"

enum { CONSTRAINED_SAMPLES = 60 };

struct phys_scene constrained_scene(const char *name, size_t dof, phys_lagrangian *L,
                                    scene_start *start, phys_constraint *g, size_t n,
                                    const char *const *names);
struct phys_system constrained_system(const struct phys_scene *scene);
/* By a method (NULL: the default) with fixed steps dt, or to an error. */
struct phys_motion_solution constrained_motion(const struct phys_system *system, const char *method,
                                               double dt, double error, double time);
/* The status of a motion that does not begin. */
enum ad_status constrained_refused(const struct phys_scene *scene, const char *method,
                                   struct ad_error *error);

#endif
