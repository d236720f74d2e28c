/* Internals shared by the files that solve for a motion (solve.h). */
#ifndef PHYSICS_MOTION_SOLVING_H
#define PHYSICS_MOTION_SOLVING_H

#include "solve.h"

#include <stdlib.h>

/* A motion being solved. */
struct solving {
    const struct phys_motion_settings *settings;
    struct phys_motion_solution *solution;
    double *state; /* [2 dof] for crossings */
    bool interrupted, failed;
    bool blind; /* the series stepped over something: it is not tried again */
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

/* Finds a method and a setting for the error asked for, or a tighter setting than the one that
   erred by `missed`, or another method; false if there is none (choose.c). */
enum ad_status phys_motion_choose(struct solving *s, struct ad_error *error);
bool phys_motion_tighten(struct solving *s, double missed, struct ad_error *error);

/* The crossings as the integrators ask for them (crossings.c): watches and events [n_crossings]. */
struct crossing_watch {
    struct solving *solving;
    size_t number;
};
void phys_crossings_watch(struct solving *s, struct crossing_watch *watches,
                          struct phys_events *events);

#endif
