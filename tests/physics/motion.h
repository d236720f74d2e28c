/* A scene in motion for tests: opened, started, simulated. */
#ifndef TESTS_PHYSICS_MOTION_H
#define TESTS_PHYSICS_MOTION_H

#include "physics/physics.h"

enum { MOTION_DOF = 8 };

struct motion {
    struct phys_system system;
    struct phys_ode ode;
    double y[2 * MOTION_DOF]; /* the scene's start, then where it was simulated to */
    struct phys_simulation settings;
    struct phys_simulation_info info;
    struct ad_error error;
};

/* g = l = 1, from the bottom at 1.8: it swings to 128 degrees. */
extern const struct phys_setting unit_pendulum[];

/* Opens a scene with NAME, VALUE pairs set, the last name NULL. In y = (q, p) if `canonical`. */
void motion_open(struct motion *m, const char *scene, bool canonical,
                 const struct phys_setting *set);
void motion_close(struct motion *m);
/* From y at t0 to t1: fixed steps dt, or the tolerance dt of an adaptive method. Fails the test
   unless it ends with `status`. */
void motion_run(struct motion *m, const char *integrator, double dt, double t1,
                enum ad_status status);
/* As before with a struct, and settings (events, samples) that are there already. */
void motion_run_by(struct motion *m, const struct phys_integrator *integrator, double dt, double t1,
                   enum ad_status status);

#endif
