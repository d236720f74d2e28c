/* Equilibria of a Lagrangian that does not depend on time, and small oscillations about them.

       struct phys_equilibria found;
       phys_equilibria_find(&system, NULL, &found, error);   found.one[0].q, .mode[0].frequency
       phys_equilibria_free(&found);

   An equilibrium is a point q where L_q(q, 0) = 0. With M = L_vv, G = L_vq - L_qv, K = -L_qq there,
   a small motion x about it follows M x'' + G x' + K x = 0, and x = Re(shape e^(s t)) with s =
   growth + i frequency: the quadratic eigenproblem (Tisseur, Meerbergen, SIAM Rev. 43, 2001), by
   LAPACK. In a turning frame and in a magnetic field G is not 0.

   Units are the scene's. Errors: AD_E_MEMORY, and those named. Threads: calls may run at once, on
   one system, too. */
#ifndef PHYSICS_MODES_MODES_H
#define PHYSICS_MODES_MODES_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

enum { PHYS_MODES_DOF = 300 };

/* Zero means the default. */
struct phys_equilibria_settings {
    size_t size;   /* sizeof(struct phys_equilibria_settings) */
    size_t starts; /* of Newton's method, the scene's own and random ones; 0: 200 */
    uint64_t seed; /* of these */
    /* [dof] each: the box of the random starts; NULL: about the scene's start, as large as its
       largest coordinate, or 1; a whole turn for angles. NaN: the same for that coordinate. */
    const double *low, *high;
    bool (*proceed)(void *context); /* AD_E_ACCURACY where it is false */
    void *context;
};

/* s and -s, conj s and -conj s are motions of one Lagrangian: of them those with frequency >= 0,
   and of real pairs the growing one. */
struct phys_mode {
    double frequency, growth; /* 0 where it is not known to be more */
    double uncertainty;       /* of both: rounding, and the place of the equilibrium */
    size_t coordinate;        /* where the shape is largest */
    double *shape;            /* [dof][2], real and imaginary part; there 1 */
};

enum phys_equilibrium_kind {
    PHYS_EQUILIBRIUM_LEAST, /* energy has a strict minimum: stable (Dirichlet's theorem) */
    /* Minimum but for directions of zero frequency, in which the linear equations decide nothing.
     */
    PHYS_EQUILIBRIUM_NEUTRAL,
    /* All frequencies real, energy not a minimum: stable for the linear equations alone. */
    PHYS_EQUILIBRIUM_GYROSCOPIC,
    PHYS_EQUILIBRIUM_UNSTABLE, /* some motion grows */
    PHYS_EQUILIBRIUM_UNDECIDED /* no modes: L has no second derivatives, or L_vv is singular */
};

struct phys_equilibrium {
    enum phys_equilibrium_kind kind;
    double *q;              /* [dof]; angles in (-pi, pi] */
    double energy;          /* at rest there */
    double uncertainty;     /* Newton's next step, as a share of the box, largest coordinate */
    size_t reached;         /* starts that led there */
    bool family;            /* others beside it, not listed, differ by a motion of zero frequency */
    size_t n_modes;         /* dof; 0: undecided */
    struct phys_mode *mode; /* from the largest growth, then by frequency */
    double *shapes;         /* behind theirs */
};

struct phys_equilibria {
    size_t n; /* by energy, ascending */
    struct phys_equilibrium *one;
    size_t starts, lost; /* lost: starts that led nowhere */
    bool *angle;         /* [dof]: L is unchanged by a turn of 2 pi */
    double *low, *high;  /* [dof]: the box that starts were drawn in */
    /* Chance that one more start that leads to an equilibrium leads to one not listed, and its
       upper bound at 95 % confidence (phys_random_unseen). */
    double unseen, unseen_limit;
};

/* Newton's method on L_q(q, 0), damped, from many starts. What no start leads to is not found.
   AD_E_ARGUMENT for L that depends on time, and for more than PHYS_MODES_DOF coordinates;
   AD_E_NONFINITE where no start is at a place where L has derivatives at rest. The system must
   outlive the call only. Ends with phys_equilibria_free. */
enum ad_status phys_equilibria_find(const struct phys_system *system,
                                    const struct phys_equilibria_settings *settings,
                                    struct phys_equilibria *found, struct ad_error *error);
void phys_equilibria_free(struct phys_equilibria *found); /* takes zero-initialised ones */
const char *phys_equilibrium_word(enum phys_equilibrium_kind kind);

AD_HEADER_END
#endif
