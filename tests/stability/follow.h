/* Motions that may be lost, and the errors that report it. */
#ifndef TESTS_STABILITY_FOLLOW_H
#define TESTS_STABILITY_FOLLOW_H

#include "physics/stability/stability.h"
#include "tests/physics/motion.h"

/* A scene with one parameter set (NULL: none) at its start, in y = (q, v). */
void follow_open(struct motion *m, const char *scene, const char *parameter, double value);

/* Follows y from t = 0 for `steps` steps dt, or with error control to t1; whether it got there. If
   not, m->error and m->info tell. */
bool follow_steps(struct motion *m, const char *integrator, double dt, size_t steps);
bool follow_to(struct motion *m, const char *integrator, double tolerance, double t1);

/* (E - E0) / |E0| at y, E0 that of the start of the last run. */
double follow_energy_error(const struct motion *m);

/* What is to be expected of these steps from y. */
void follow_advice(struct motion *m, const char *integrator, double dt,
                   struct phys_step_advice *advice);

/* The error has this status and mentions these names (tests/mentions.h). */
void assert_told(const struct ad_error *error, enum ad_status status, const char *names);

#endif
