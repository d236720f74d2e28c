/* Scenes with constraints and their motions; an error fails the test. */
#ifndef TESTS_PHYSICS_MOTION_CONSTRAINED_H
#define TESTS_PHYSICS_MOTION_CONSTRAINED_H

#include "tests/physics/systems.h"

enum { CONSTRAINED_SAMPLES = 60 };

/* Of unit mass, with its last coordinate upwards, and without weight. */
extern const double constrained_g;
phys_lagrangian constrained_falls, constrained_coasts;
/* |q| = 1, in any dimension; a wire through the origin that turns at the rate 2, on which r = cosh
   2t from rest; bars of 1, 2.5 and 2 from (0, 0) by the joints A and B to (3, 0). */
phys_constraint constrained_sphere, constrained_wire, constrained_bars;
/* In a plane at 2 from the bottom, at a rate of .7; the bars with the crank at 1, at a rate of 3.
 */
scene_start constrained_tilted, constrained_cranked;
/* B of an angle of the crank, and its change with that. */
void constrained_joint(double angle, double *B, double *slope);

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
