/* Which coordinates L couples: pairs (i, j) where L_qq, L_qv, L_vq or L_vv may be other than 0 at
   some point, found on the tape whatever the values; and colours of the coordinates, such that no
   row couples two of the same colour: one product with the sum of their unit vectors gives all
   columns of a colour (Curtis, Powell, Reid, J. Inst. Math. Appl. 13, 1974). */
#ifndef PHYSICS_ACTION_COUPLING_H
#define PHYSICS_ACTION_COUPLING_H

#include "action.h"

#include <stdbool.h>

struct phys_coupling {
    size_t *start; /* [dof + 1] */
    size_t *row;   /* those coupled to coordinate j are row[start[j]] up to row[start[j + 1] - 1] */
    size_t *colour; /* [dof]: below `colours` */
    size_t colours;
};

/* Ends with phys_coupling_free, whatever it returned. False: no memory. An L whose pattern is not
   known couples everything. */
bool phys_coupling_new(struct phys_coupling *coupling, const struct phys_system *system);
void phys_coupling_free(struct phys_coupling *coupling);

#endif
