/* Internals shared by the files that solve for a motion (solve.h). */
#ifndef PHYSICS_MOTION_SOLVING_H
#define PHYSICS_MOTION_SOLVING_H

#include "solve.h"

#include <stdlib.h>

/* A motion being solved. */
struct solving {
    const struct phys_motion_settings *settings;
    struct phys_motion_solution *solution;
    double *state;            /* [2 dof] for crossings */
    bool interrupted, failed; /* out of memory */
    size_t finer;             /* samples for each that was asked for */
    struct ad_error lost;     /* a sample that has no velocities */
    bool blind;               /* the series stepped over something: it is not tried again */
};

/* The callback of phys_simulation; its context is struct solving. */
static inline bool solving_proceed(void *context)
{
    struct solving *s = context;
    if (s->settings->proceed && !s->settings->proceed(s->settings->context))
        s->interrupted = true;
    return !s->interrupted;
}

static inline bool solving_widen(double **x, size_t count)
{
    double *more = count > SIZE_MAX / sizeof **x ? NULL : realloc(*x, count * sizeof **x);
    if (more)
        *x = more;
    return more != NULL;
}

/* Whether q and v satisfy the scene's constraints at t = 0. */
enum ad_status phys_motion_check_on_constraints(const struct phys_system *system, const double *q,
                                                const double *v, struct ad_error *error);
/* start [2 dof] = q, v; q NULL: the scene's start of this seed. */
enum ad_status phys_motion_start(const struct phys_system *system, uint64_t seed, const double *q,
                                 const double *v, double *start, struct ad_error *error);

/* AD_E_ARGUMENT for numbers out of range, and crossings that are counted and not there. */
enum ad_status phys_motion_refuse(const struct phys_motion_settings *settings,
                                  struct ad_error *error);

/* Finds a method and a setting for the error asked for, or a tighter setting than the one that
   erred by `missed`, or another method; false if there is none (choose.c). */
enum ad_status phys_motion_choose(struct solving *s, struct ad_error *error);
bool phys_motion_tighten(struct solving *s, double missed, struct ad_error *error);

/* Runs the reference, and measures distances from it at the samples (solve_error.c). */
enum ad_status phys_motion_compare(struct solving *s, struct ad_error *error);

/* The crossings as the integrators ask for them (crossings.c): watches and events [n_crossings]. */
struct crossing_watch {
    struct solving *solving;
    size_t number;
};
void phys_crossings_watch(struct solving *s, struct crossing_watch *watches,
                          struct phys_events *events);
/* The quantity less its value at x = (q, v); NaN outside of where it is defined. y [2 dof]: work.
 */
double phys_crossing_value(const struct phys_crossing *c, const struct phys_ode *ode, double t,
                           const double *x, double *y);

/* What the motion's error makes of its crossings (crossing_errors.c): drops those of quantities
   that do not change, and, given the rows of a reference and the samples they belong to, finds how
   far the times may be off. */
enum ad_status phys_crossings_settle(struct solving *s, struct ad_error *error);
enum ad_status phys_crossings_measure(struct solving *s, const struct phys_reference *reference,
                                      const size_t *samples, struct ad_error *error);

#endif
