/* Events within a fixed step, which may have many periods: they are found on a dop853 run over the
   step, corrected so that it ends at the step's end. */
#include "autodiff/free.h"
#include "run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double tolerance = 1e-14;

/* The finer run. */
struct within {
    struct run *outer;
    double t, h;
    double *miss;  /* [n] where the step ends less where the finer run does */
    double *moved; /* [n] */
    struct ad_error *error;
};

/* One of the outer events in it. */
struct inner {
    const struct within *within;
    const struct phys_events *events;
};

/* Exact at the ends, so that the next step begins where this one ends. */
static const double *move(const struct within *w, double t, const double *y)
{
    const double rounding = 1e-14;
    const struct phys_stepper *m = &w->outer->stepper;
    double share = (t - w->t) / w->h;
    for (size_t k = 0; k < m->n; k++)
        w->moved[k] = share <= rounding       ? m->y[k]
                      : share >= 1 - rounding ? m->next[k]
                                              : y[k] + share * w->miss[k];
    return w->moved;
}

static void values(void *context, double t, const double *y, double *g)
{
    const struct inner *i = context;
    i->events->values(i->events->context, t, move(i->within, t, y), g);
}

static bool keep(const struct inner *i, size_t which, int kind, double t, const double *y)
{
    const struct within *w = i->within;
    size_t bytes = w->outer->stepper.n * sizeof *y;
    struct found_event f = {
        .theta = (t - w->t) / w->h, .events = i->events, .which = which, .kind = kind};
    if (!(f.y = malloc(bytes))) {
        ad_fail(w->error, AD_E_MEMORY, "out of memory for events");
        return false;
    }
    memcpy(f.y, move(w, t, y), bytes);
    if (phys_run_found(w->outer, &f, w->error) == AD_OK)
        return true;
    free(f.y);
    return false;
}

static bool found(void *context, size_t which, double t, const double *y)
{
    return keep(context, which, 1, t, y);
}

static bool touched(void *context, size_t which, double t, const double *y)
{
    return keep(context, which, 0, t, y);
}

static enum ad_status follow(struct within *w, const struct phys_events *events, size_t n_events,
                             double *y, struct ad_error *error)
{
    const struct run *run = w->outer;
    const struct phys_simulation settings = {.size = sizeof settings,
                                             .integrator = phys_integrator_find("dop853", error),
                                             .t0 = w->t,
                                             .t1 = w->t + w->h,
                                             .dt = fabs(w->h),
                                             .rtol = tolerance,
                                             .proceed = run->settings->proceed,
                                             .context = run->settings->context,
                                             .events = events,
                                             .n_events = n_events};
    struct phys_simulation_info info;
    memcpy(y, run->stepper.y, run->stepper.n * sizeof *y);
    phys_simulate(&settings, run->stepper.ode, y, &info, error);
    w->outer->stepper.interpolations += info.evaluations + info.interpolations;
    return error->status;
}

enum ad_status phys_run_within(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    const struct phys_stepper *m = &run->stepper;
    size_t n = m->n;
    int *signs = run->signs;
    double *memory = malloc(3 * n * sizeof *memory), *y = memory;
    struct phys_events *events = calloc(s->n_events, sizeof *events);
    struct inner *inner = malloc(s->n_events * sizeof *inner);
    struct within w = {.outer = run, .t = m->t, .h = m->h, .error = error};
    if (!memory || !events || !inner) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        goto release;
    }
    w.miss = memory + n;
    w.moved = memory + 2 * n;
    if (follow(&w, NULL, 0, y, error) != AD_OK)
        goto release;
    for (size_t k = 0; k < n; k++)
        w.miss[k] = m->next[k] - y[k];
    for (size_t e = 0; e < s->n_events; signs += s->events[e++].n) {
        inner[e] = (struct inner){&w, &s->events[e]};
        if (!s->events[e].coarse)
            events[e] = (struct phys_events){.n = s->events[e].n,
                                             .values = values,
                                             .direction = s->events[e].direction,
                                             .found = found,
                                             .touched = s->events[e].touched ? touched : NULL,
                                             .context = &inner[e],
                                             .signs = signs};
    }
    follow(&w, events, s->n_events, y, error);
release:
    AD_FREE(memory, events, inner);
    return error->status;
}
