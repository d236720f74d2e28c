/* The closest approach of two bodies: where d/dt r^2 / 2 = (x_i - x_j) . (v_i - v_j) rises through
   zero, for every pair. */
#include "motion.h"
#include "physics/ode/internal.h"

#include <math.h>
#include <stdlib.h>

struct phys_closest_approach {
    const struct phys_ode *ode;
    size_t bodies, dims;
    double *q, *v; /* [dof] each */
    struct phys_closest closest;
    struct phys_events events;
};

static bool get_state(struct phys_closest_approach *a, double t, const double *y)
{
    struct ad_error ignored = {0}; /* of the same state the next step will complain */
    return phys_ode_leave(a->ode, t, y, a->q, a->v, &ignored) == AD_OK;
}

static double pair_product(const struct phys_closest_approach *a, const double *u, const double *w,
                           size_t i, size_t j)
{
    double sum = 0;
    for (size_t k = 0; k < a->dims; k++)
        sum +=
            (u[i * a->dims + k] - u[j * a->dims + k]) * (w[i * a->dims + k] - w[j * a->dims + k]);
    return sum;
}

static void values(void *context, double t, const double *y, double *g)
{
    struct phys_closest_approach *a = context;
    bool known = get_state(a, t, y);
    for (size_t i = 0; i < a->bodies; i++)
        for (size_t j = i + 1; j < a->bodies; j++)
            *g++ = known ? pair_product(a, a->q, a->v, i, j) : 0;
}

static void keep(struct phys_closest_approach *a, size_t i, size_t j, double t)
{
    double distance = sqrt(pair_product(a, a->q, a->q, i, j));
    if (distance < a->closest.distance)
        a->closest = (struct phys_closest){distance, t, i, j};
}

static bool found(void *context, size_t k, double t, const double *y)
{
    struct phys_closest_approach *a = context;
    size_t i = 0;
    for (; k >= a->bodies - 1 - i; i++)
        k -= a->bodies - 1 - i;
    if (get_state(a, t, y))
        keep(a, i, i + 1 + k, t);
    return true;
}

enum ad_status phys_closest_approach_new(const struct phys_ode *ode, double t, const double *y,
                                         struct phys_closest_approach **approach,
                                         struct ad_error *error)
{
    *approach = NULL;
    if (phys_lacks(ode, "ode", error) || phys_lacks(y, "state", error))
        return error->status;
    const struct phys_system *system = ode->system;
    struct phys_closest_approach *a = *approach = calloc(1, sizeof *a);
    double *state = system ? malloc(2 * system->dof * sizeof *state) : NULL;
    if (!a || (system && !state)) {
        free(state);
        free(a);
        *approach = NULL;
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    a->ode = ode;
    a->closest.distance = INFINITY;
    a->q = state;
    if (!system || system->scene->picture != PHYS_PICTURE_PLANE ||
        !get_state((a->v = state + system->dof, a), t, y))
        return AD_OK;
    a->bodies = system->bodies;
    a->dims = system->dims;
    for (size_t i = 0; i < a->bodies; i++)
        for (size_t j = i + 1; j < a->bodies; j++)
            keep(a, i, j, t);
    a->events = (struct phys_events){.n = a->bodies * (a->bodies - 1) / 2,
                                     .values = values,
                                     .direction = 1,
                                     .found = found,
                                     .context = a,
                                     .coarse = true};
    return AD_OK;
}

const struct phys_events *phys_closest_approach_events(const struct phys_closest_approach *approach)
{
    return approach ? &approach->events : NULL;
}

struct phys_closest phys_closest_approach_found(const struct phys_closest_approach *approach)
{
    return approach ? approach->closest : (struct phys_closest){.distance = NAN};
}

void phys_closest_approach_free(struct phys_closest_approach *approach)
{
    if (!approach)
        return;
    free(approach->q);
    free(approach);
}
