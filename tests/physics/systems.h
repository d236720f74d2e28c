/* Opens scenes for tests; any error fails the test. */
#ifndef TESTS_PHYSICS_SYSTEMS_H
#define TESTS_PHYSICS_SYSTEMS_H

#include "physics/physics.h"

typedef enum ad_status scene_start(const void *params, uint64_t seed, double *q, double *v,
                                   struct ad_error *error);

/* A scene of coordinates x1, x2, ... without parameters and units. */
struct phys_scene scene_of(const char *name, size_t dof, phys_lagrangian *L, size_t slices,
                           double dt, scene_start *start);
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
