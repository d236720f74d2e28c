/* For physics/ only: names of the components of a state. */
#ifndef PHYSICS_ODE_INTERNAL_H
#define PHYSICS_ODE_INTERNAL_H

#include "ode.h"
#include "physics/lagrangian/internal.h"

/* The name of component k of a state: a coordinate, or `what` (velocity, momentum) of one. */
void phys_state_name(const struct phys_system *system, size_t k, const char *what, char *name,
                     size_t size);

/* phys_ode_canonical of a scene that is given by its H. */
enum ad_status phys_ode_scene_hamiltonian(const struct phys_system *system, struct phys_ode *ode,
                                          struct ad_error *error);
/* phys_motion_round_mass; of other ways than phys_ode_lagrangian, nothing. */
void phys_ode_round_mass(const struct phys_ode *ode, double share);
/* Rates of few coordinates, where L has a series, by that: the same to rounding in a fifth of the
   time. Not for references, which are to share no code with the method they are compared with. */
void phys_ode_thin(const struct phys_ode *ode);
/* The motion of phys_ode_lagrangian where it has constraints, else NULL. */
phys_motion *phys_ode_constrained_motion(const struct phys_ode *ode);
/* The series of phys_ode_lagrangian, once it was evaluated; NULL: none. */
struct phys_motion_series *phys_ode_motion_series(const struct phys_ode *ode);
/* Which coordinates the rates of y = (q, v) or (q, p) couple; where that is not known, which
   components of y: all. Ends with phys_pattern_free, whatever it returned. False: no memory. */
bool phys_ode_coupling(const struct phys_ode *ode, struct phys_pattern *coupling);

#endif
