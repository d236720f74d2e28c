/* Events within a fixed step that its polynomial does not resolve, for example a step of many
   periods: they are found on a dop853 run over the step, corrected so that it ends at the step's
   end. */
#include "run.h"

#include <stdlib.h>
#include <string.h>

static const double tolerance = 1e-10;

/* The finer run, and one of the outer events in it. */
struct within {
    struct run *outer;
    const struct phys_events *events;
    double t, h;
    double *miss;  /* [n] where the step ends less where the finer run does */
    double *moved; /* [n] */
    struct ad_error *error;
};

static const double *move(const struct within *w, double t, const double *y)
{
    double share = (t - w->t) / w->h;
    for (size_t k = 0; k < w->outer->stepper.n; k++)
        w->moved[k] = y[k] + share * w->miss[k];
    return w->moved;
}

static void values(void *context, double t, const double *y, double *g)
{
    const struct within *w = context;
    w->events->values(w->events->context, t, move(w, t, y), g);
}

static bool keep(const struct within *w, size_t which, int kind, double t, const double *y)
{
    size_t bytes = w->outer->stepper.n * sizeof *y;
    struct found_event f = {
        .theta = (t - w->t) / w->h, .events = w->events, .which = which, .kind = kind};
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

static enum ad_status follow(struct within *w, const struct phys_events *events, double *y,
                             struct ad_error *error)
{
    const struct run *run = w->outer;
    const struct phys_integrator *method = phys_integrator_find("dop853", error);
    const struct phys_simulation settings = {.integrator = method,
                                             .t0 = w->t,
                                             .t1 = w->t + w->h,
                                             .rtol = tolerance,
                                             .proceed = run->settings->proceed,
                                             .context = run->settings->context,
                                             .events = events,
                                             .n_events = events != NULL};
    struct phys_simulation_info info;
    memcpy(y, run->stepper.y, run->stepper.n * sizeof *y);
    phys_simulate(&settings, run->stepper.ode, y, &info, error);
    w->outer->stepper.interpolations += info.evaluations + info.interpolations;
    return error->status;
}

enum ad_status phys_run_within(struct run *run, struct ad_error *error)
{
    const struct phys_stepper *m = &run->stepper;
    size_t n = m->n;
    int *signs = run->signs;
    double *memory = malloc(3 * n * sizeof *memory), *y = memory;
    struct within w = {.outer = run, .t = m->t, .h = m->h, .error = error};
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    w.miss = memory + n;
    w.moved = memory + 2 * n;
    if (follow(&w, NULL, y, error) == AD_OK)
        for (size_t k = 0; k < n; k++)
            w.miss[k] = m->next[k] - y[k];
    for (size_t e = 0; e < run->settings->n_events && error->status == AD_OK; e++) {
        w.events = &run->settings->events[e];
        const struct phys_events inner = {.n = w.events->n,
                                          .values = values,
                                          .direction = w.events->direction,
                                          .found = found,
                                          .touched = w.events->touched ? touched : NULL,
                                          .context = &w};
        if (!w.events->coarse && w.events->n > 0 && follow(&w, &inner, y, error) == AD_OK)
            phys_run_signs(w.events, m->t + m->h, m->next, run->values, signs);
        signs += w.events->n;
    }
    free(memory);
    return error->status;
}
