/* The search for equilibria, inside of physics/modes/: steps (approach.c), what they lead to
   (equilibria.c). Places y are in units of the box. */
#ifndef PHYSICS_MODES_SEARCH_H
#define PHYSICS_MODES_SEARCH_H

#include "internal.h"
#include "physics/lagrangian/internal.h"

struct search {
    const struct phys_system *system;
    const struct phys_equilibria_settings *settings;
    struct phys_curvature curvature;
    phys_motion *motion;
    size_t n;
    double *middle, *size;                        /* of the box: [n] each */
    double *y, *next;                             /* place in units of `size` [n] */
    double *q, *zero;                             /* [n] */
    double *force, *turn;                         /* [n], [n x n] at y */
    double *vector, *value, *unit, *along, *step; /* [n x n], [n], [n x n], [n], [n] */
    double typical;                               /* length of the force at places of the box */
    struct phys_equilibria *found;
    size_t room;
};

/* Forces and their derivatives at y. False: not finite, or L_vv is singular. */
bool phys_equilibrium_evaluate(struct search *s, const double *y);
/* Eigenvectors of the derivatives, and the force along them. */
bool phys_equilibrium_decompose(struct search *s);
/* From s->y: true if it ends at an equilibrium; *off: the next step there. */
bool phys_equilibrium_approach(struct search *s, double *off);
/* Makes the energy at rest less, with curvatures taken as positive: to where clusters are bound,
   which few steps towards small forces reach. */
void phys_equilibrium_descend(struct search *s);
/* Whether force and derivatives at y agree with those beside it: not where L has kinks. */
bool phys_equilibrium_is_smooth(struct search *s);
/* How far the place may be off, in s->step: Newton's next step, and the rounding of the forces
   against their change, which is little where the equilibrium is degenerate. */
void phys_equilibrium_doubt(struct search *s, double off);

#endif
