/* Pairs of near bodies in the plane, found in time proportional to the number of bodies. */
#ifndef PHYSICS_GAS_CELL_LIST_H
#define PHYSICS_GAS_CELL_LIST_H

#include "autodiff/autodiff.h"

/* Pairs first[k] < second[k]; zero-initialised is empty. */
struct phys_near {
    size_t n, room;
    uint32_t *first, *second;
};
void phys_near_free(struct phys_near *near);

/* All pairs not farther than `reach` apart, of x [bodies][2]; the list's memory is used again.
   Their order depends on x alone. AD_E_NONFINITE names a body whose place is not finite. */
enum ad_status phys_near_pairs(size_t bodies, const double *x, double reach, struct phys_near *near,
                               struct ad_error *error);

#endif
