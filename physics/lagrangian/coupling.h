/* Which coordinates L couples, found on the tape whatever the values. */
#ifndef PHYSICS_LAGRANGIAN_COUPLING_H
#define PHYSICS_LAGRANGIAN_COUPLING_H

#include "physics/linear/pattern.h"
#include "physics/system/system.h"

/* Up to so many coordinates nothing is saved by looking: everything counts as coupled. */
enum { PHYS_COUPLING_FEW = 6 };

enum phys_coupling_by {
    PHYS_COUPLING_MASSES, /* L_vv */
    PHYS_COUPLING_L,      /* L_qq, L_qv, L_vq or L_vv */
    PHYS_COUPLING_RATES,  /* the same, or a derivative of the forces beside L */
};

/* Pairs (i, j) of coordinates for which one of these may be other than 0 at some point; of more
   than `few` coordinates, and where that is known, else all. Ends with phys_pattern_free, whatever
   it returned. False: no memory. */
bool phys_coupling_new(struct phys_pattern *coupling, const struct phys_system *system,
                       enum phys_coupling_by by, size_t few);

#endif
