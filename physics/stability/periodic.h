/* Periodic motions and their Floquet multipliers.

   From a start and a period nearby, Newton's method goes to x = (q, v) and T with x(T) = x: the
   nearest, where there are families of them (phases, energies, symmetries). Its derivatives are the
   state-transition matrix over the period, whose eigenvalues are the multipliers: a small
   difference of the start in the direction of an eigenvector is multiplied by it in each period.

   Units are the scene's. Errors: AD_E_MEMORY, and those named. Threads: calls may run at once, on
   one system, too. */
#ifndef PHYSICS_STABILITY_PERIODIC_H
#define PHYSICS_STABILITY_PERIODIC_H

#include "stability.h"

AD_HEADER_BEGIN

enum { PHYS_PERIODIC_DOF = 30 };

struct phys_periodic_settings {
    size_t size;     /* sizeof(struct phys_periodic_settings) */
    const double *x; /* [2 dof] q, v to begin at */
    double period;   /* to begin with */
    bool hold_period, hold_energy;
    bool (*proceed)(void *context); /* as in phys_simulation */
    void *context;
    /* After a share of the period, one over the number of bodies, each of these is where another
       was at the start, the next one or the one before, whichever is nearer: all follow one curve.
       The bodies must be alike. */
    bool choreography;
    const double *energy; /* of hold_energy; NULL: that of x */
};

enum phys_periodic_kind {
    PHYS_PERIODIC_NEUTRAL,    /* no multiplier is known to be off the unit circle by more than 1 */
    PHYS_PERIODIC_ATTRACTING, /* all are inside, but for the one along the motion */
    PHYS_PERIODIC_UNSTABLE,   /* one is outside */
    PHYS_PERIODIC_UNKNOWN     /* 4 uncertainties of one are as much as the circle's radius */
};

struct phys_multiplier {
    double re, im, uncertainty;
};

struct phys_periodic {
    double *x; /* [2 dof] */
    double period, uncertainty;
    double closure; /* |x(T) - x| by another method, in units of sizes of coordinates and speeds */
    size_t iterations;                  /* of Newton's method */
    size_t turns;                       /* the motion repeats itself so often in a period */
    size_t n;                           /* 2 dof */
    struct phys_multiplier *multiplier; /* [n], by modulus, the largest first */
    enum phys_periodic_kind kind;
};

/* AD_E_ACCURACY where no motion near the start closes, or one at rest does; AD_E_ARGUMENT where the
   period of a motion whose forces depend on time is not held, and for more than PHYS_PERIODIC_DOF
   coordinates; what phys_ode_variations refuses is refused. Ends with phys_periodic_free. */
enum ad_status phys_periodic_find(const struct phys_system *system,
                                  const struct phys_periodic_settings *settings,
                                  struct phys_periodic *found, struct ad_error *error);
void phys_periodic_free(struct phys_periodic *found);         /* takes zero-initialised ones */
const char *phys_periodic_word(enum phys_periodic_kind kind); /* NULL: no such kind */

AD_HEADER_END
#endif
