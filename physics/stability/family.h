/* Families of periodic motions: one of them followed in its energy, its period or a parameter,
   around folds, with its bifurcations.

   The family is followed by its arc length (Keller, in Applications of Bifurcation Theory, 1977;
   with conserved quantities: Munoz-Almaraz, Freire, Galan, Doedel, Vanderbauwhede, Physica D 181,
   2003), the phase fixed. Where more than one family leads on, as symmetries and further conserved
   quantities have it, it is the shortest way, or, where that is asked for, along the null vector of
   the equations across it.

   Units are the scene's. Errors: AD_E_MEMORY, and those named. Threads: calls may run at once, on
   one system, too. */
#ifndef PHYSICS_STABILITY_FAMILY_H
#define PHYSICS_STABILITY_FAMILY_H

#include "periodic.h"

AD_HEADER_BEGIN

enum phys_family_hold {
    PHYS_HOLD_NOTHING,
    PHYS_HOLD_PERIOD,
    PHYS_HOLD_ENERGY,
    PHYS_HOLD_PRODUCT /* of period and parameter: a drive of that frequency */
};

enum { PHYS_BRANCHES_MOST = 1000 };

struct phys_family_settings {
    size_t size;     /* sizeof(struct phys_family_settings) */
    const double *x; /* [2 dof] q, v near the first motion, ... */
    double period;   /* ... and its period */
    /* "energy", "period", or a parameter that L has by PHYS_PARAM: what the family is followed in
       until it is `to`. A parameter begins at the system's value. */
    const char *along;
    double to;
    /* With a parameter: of a conservative system its energy or period, of a driven one its period
       or the product; else nothing. */
    enum phys_family_hold hold;
    int cross;                      /* k: it goes on along the family that crosses at the k-th
                                       PHYS_MARK_BRANCH or _DOUBLING, where periods double,
                                       -k: to its other side; 0: past them all.
                                       PHYS_FAMILY_LOST where there are fewer */
    size_t steps;                   /* at most; 0: 500 */
    bool (*proceed)(void *context); /* as in phys_simulation */
    void *context;
};

/* What is found between two steps of a family, located. */
enum phys_family_mark {
    PHYS_MARK_NONE,
    PHYS_MARK_FOLD,     /* the value turns back */
    PHYS_MARK_BRANCH,   /* a multiplier passes 1: another family of this period crosses */
    PHYS_MARK_DOUBLING, /* a multiplier passes -1: one of twice the period begins */
    PHYS_MARK_TORUS,    /* two leave the unit circle elsewhere: Neimark-Sacker, Krein */
    PHYS_MARK_HALVING,  /* an end: half the period, or less, is one already */
    PHYS_MARK_REST,     /* an end: the motion shrinks to a point at rest */
    PHYS_MARK_CHANGE    /* stability changes before it, and none of these was found */
};

struct phys_family_member {
    enum phys_family_mark mark;
    double value, uncertainty; /* uncertainty: of the value at a mark, else NaN */
    double energy;
    struct phys_periodic motion; /* at rest and where it halves: without multipliers */
};

enum phys_family_end {
    PHYS_FAMILY_REACHED,
    PHYS_FAMILY_RETURNED, /* the value is beyond that of the first, on the other side */
    PHYS_FAMILY_CLOSED,   /* it is the first motion again */
    PHYS_FAMILY_ENDS,     /* at PHYS_MARK_HALVING or PHYS_MARK_REST */
    PHYS_FAMILY_LOST,     /* no periodic motion is found at the shortest step; `lost` says why */
    PHYS_FAMILY_STEPS     /* no end after the steps allowed */
};

struct phys_family {
    size_t n;
    struct phys_family_member *member; /* [n] along the family, the first motion first */
    enum phys_family_end end;
    char lost[256];
};

/* AD_E_ACCURACY where phys_periodic_find finds no first motion, and "interrupted"; AD_E_ARGUMENT
   for what cannot be followed or held in this system, for a parameter without derivatives, and what
   phys_periodic_find refuses. However the family ends, that is no error. Ends with
   phys_family_free. */
enum ad_status phys_family_follow(const struct phys_system *system,
                                  const struct phys_family_settings *settings,
                                  struct phys_family *family, struct ad_error *error);
void phys_family_free(struct phys_family *family);             /* takes zero-initialised ones */
const char *phys_family_mark_word(enum phys_family_mark mark); /* NULL: no such mark */

AD_HEADER_END
#endif
