/* Opens scenes for tests; any error fails the test. */
#ifndef TESTS_PHYSICS_SYSTEMS_H
#define TESTS_PHYSICS_SYSTEMS_H

#include "physics/physics.h"

struct phys_system system_opened(const char *name);
void system_set(struct phys_system *system, const char *name, double value);
/* q, v [dof] of the scene's start. */
void system_start(const struct phys_system *system, uint64_t seed, double *q, double *v);
/* Derivatives of first and second order and slice locality, at irregular states. */
void system_check(const struct phys_system *system);
/* T and V of one state. */
void system_energies(const struct phys_system *system, const double *q, const double *v, double *T,
                     double *V);

#endif
