/* Measures of order in the plane: disordered like a gas, or in the hexagons of a crystal.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_GAS_ORDER_H
#define PHYSICS_GAS_ORDER_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

enum phys_state {
    PHYS_STATE_GAS,   /* fewer than two neighbours */
    PHYS_STATE_DENSE, /* clustered or liquid: neighbours, but no lasting directions */
    PHYS_STATE_SOLID  /* four and more, in hexagons: hexatic over a half */
};

/* Means over the bodies. */
struct phys_order {
    double neighbours; /* others within the first shell; 6 inside a crystal, less at its edge */
    /* |sum over neighbours of exp(6 i angle)| / max(6, their number): 1 in a perfect crystal, small
       where neighbours are few or disordered. */
    double hexatic;
    enum phys_state state;
};
/* Order of x [bodies][2], where bodies nearer than `shell` are neighbours. neighbours and hexatic
   [bodies]: the values of each body, or NULL. */
enum ad_status phys_order(size_t bodies, const double *x, double shell, uint32_t *neighbours,
                          double *hexatic, struct phys_order *order, struct ad_error *error);
const char *phys_state_text(enum phys_state state); /* "gas-like", ... */

/* The pair distribution g [bins]: the number of pairs at distances k reach/bins to (k + 1)
   reach/bins, divided by that expected of random points in a rectangle of these sides; g is thus 1
   for random points, edges included. reach: at most the shorter side. AD_E_ARGUMENT. */
enum ad_status phys_pair_distribution(size_t bodies, const double *x, const double sides[2],
                                      double reach, size_t bins, double *g, struct ad_error *error);

/* ---- of a gas (gas_order.c) ---- */

enum { PHYS_GAS_BINS = 100 };

struct phys_gas_order {
    struct phys_order mean;
    double reach;            /* of g: 5 sigma or the side of the rectangle if that is less */
    double g[PHYS_GAS_BINS]; /* in the rectangle that holds the bodies */
    double peak, peak_at;    /* the largest value of g, and its distance */
};
/* Bodies nearer than this are neighbours: the geometric mean of the first and the second shell of a
   crystal at the distance of least pair energy. */
double phys_gas_shell(const struct phys_system *system);
/* Order of a system of the scene gas with its bodies at q [dof]. */
enum ad_status phys_gas_order(const struct phys_system *system, const double *q,
                              struct phys_gas_order *order, struct ad_error *error);

AD_HEADER_END
#endif
