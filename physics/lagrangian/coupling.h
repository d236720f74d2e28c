/* Which coordinates L couples, found on the tape whatever the values. */
#ifndef PHYSICS_LAGRANGIAN_COUPLING_H
#define PHYSICS_LAGRANGIAN_COUPLING_H

#include "physics/linear/pattern.h"
#include "physics/system/system.h"

/* Up to so many coordinates nothing is saved by looking: everything counts as coupled. */
enum { PHYS_COUPLING_FEW = 4 };

/* Pairs (i, j) where L_qq, L_qv, L_vq or L_vv, or with `masses` L_vv alone, may be other than 0 at
   some point; of more than `few` coordinates, and where that is known, else all. Ends with
   phys_pattern_free, whatever it returned. False: no memory. */
bool phys_coupling_new(struct phys_pattern *coupling, const struct phys_system *system, bool masses,
                       size_t few);

#endif
