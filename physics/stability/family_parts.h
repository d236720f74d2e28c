/* For physics/stability/ only: a family of periodic motions while it is followed (family.c), points
   of it (family_point.c), members and marks (family_marks.c, family_rest.c), and what changes sign
   where it bifurcates (family_tests.c). */
#ifndef PHYSICS_STABILITY_FAMILY_PARTS_H
#define PHYSICS_STABILITY_FAMILY_PARTS_H

#include "family.h"
#include "internal.h"
#include "physics/lagrangian/internal.h"

enum family_test {
    TEST_TARGET, /* value - to */
    TEST_FOLD,   /* change of the value with the arc length */
    TEST_ONE,    /* product of mu - 1 over the multipliers that are not 1 all along */
    TEST_MINUS,  /* product of mu + 1 */
    TEST_TORUS,  /* discriminant of the sums mu + 1/mu, or product of mu_i mu_j - 1 */
    TESTS
};

#define FAMILY_FINE 1e-15 /* tolerance of motions */

enum family_along { ALONG_ENERGY, ALONG_PERIOD, ALONG_PARAMETER };

/* u [columns] is x [d], the parameter if there is one, and the period; in units of unit[]. */
struct family_point {
    double *u, *tangent;        /* tangent: of length 1 */
    double *rate;               /* [d] */
    double *re, *im;            /* [d] multipliers, */
    size_t aside;               /* first those of blocks in which the motion does not move */
    double grown;               /* size of the state-transition matrix */
    double value, slope;        /* change of the value with the arc length, all in units */
    double doubt, doubt_period; /* of value and period, for what is left to close */
    double test[TESTS], noise[TESTS];
};

struct family_run {
    const struct phys_family_settings *settings;
    struct phys_system system; /* a copy, with parameters of its own */
    struct phys_ode ode;
    phys_motion *motion; /* for the energy */
    struct phys_family *family;
    enum family_along along;
    bool timeless, symplectic;
    bool crossed;                     /* as the settings want it */
    size_t d, rows, columns, trivial; /* trivial: multipliers that are 1 all along */
    double tolerance;                 /* of motions */
    double held, power;               /* value held; unit of energies */
    double *unit;                     /* [columns] */
    double *y, *J, *U, *s, *V, *left, *step, *slope, *trial; /* room */
};

/* Room for one point. */
bool phys_family_point_new(const struct family_run *run, struct family_point *point);
void phys_family_point_free(struct family_point *point);
void phys_family_point_copy(const struct family_run *run, const struct family_point *from,
                            struct family_point *to);
/* The energy of u. */
double phys_family_energy(struct family_run *run, const double *u);
/* A parameter that neither forces nor energy depend on, as those of the start, has no family. */
enum ad_status phys_family_refuse_unused(struct family_run *run, const double *u,
                                         struct ad_error *error);
/* Change of the value with u [columns], in units. */
void phys_family_value_slope(struct family_run *run, const double *u, double *slope);
/* From to->u, Newton's method to a periodic motion on the plane row . (u - base) = along, in units;
   *moved is how far it went. Then the tangent, with row . tangent > 0, rates, multipliers, tests.
   AD_E_ACCURACY: it does not converge. */
enum ad_status phys_family_correct(struct family_run *run, const struct family_point *base,
                                   const double *row, double along, struct family_point *to,
                                   double *moved, struct ad_error *error);
/* Goes from a, before the k-th branch point, to a motion of the family that crosses there, if it
   was marked by now: run->crossed. The members after it are removed. (family_cross.c) */
enum ad_status phys_family_cross(struct family_run *run, struct family_point *a,
                                 struct ad_error *error);
/* Adds the member of a point, by phys_periodic_find from there: closure, multipliers. */
enum ad_status phys_family_add(struct family_run *run, const struct family_point *p,
                               enum phys_family_mark mark, double uncertainty,
                               struct ad_error *error);
/* Adds the members between two points, `length` apart, that are marked; true: it ends there. */
bool phys_family_mark_between(struct family_run *run, const struct family_point *a,
                              const struct family_point *b, double length, struct ad_error *error);
/* Whether all of a motion with a slow start is slow: half a period of a small oscillation takes it
   1/pi of what its rate would in a period, one that lingers near a saddle goes much farther. */
bool phys_family_is_small(struct family_run *run, const struct family_point *p,
                          struct ad_error *error);
/* Adds the point at rest that the last three members shrink to. */
enum ad_status phys_family_rest(struct family_run *run, struct family_point *p,
                                struct ad_error *error);
/* AD_E_ARGUMENT: what can be seen before anything is recorded; and by what conserves. */
enum ad_status phys_family_check_numbers(const struct phys_system *system,
                                         const struct phys_family_settings *settings,
                                         struct ad_error *error);
enum ad_status phys_family_check(struct family_run *run, struct ad_error *error);
/* Multipliers that are 1 within what is known of them; that are clearly outside the unit circle. */
size_t phys_family_trivial(const struct phys_periodic *motion);
size_t phys_family_outside(const struct phys_periodic *motion);
/* Multipliers of the point that was followed last; shake: of that share of its matrix, as rounding
   does. */
enum ad_status phys_family_multipliers(const struct family_run *run, double shake,
                                       struct family_point *p, struct ad_error *error);
/* The tests of a point, by its multipliers. */
void phys_family_test(const struct family_run *run, struct family_point *point);
/* Whether that is a torus' bifurcation: the multipliers that meet, or are inverse, are on the unit
   circle. */
bool phys_family_is_torus(const struct family_run *run, const struct family_point *point);

#endif
