/* The closest approach of two bodies: events where d/dt r^2 / 2 = (x_i - x_j) . (v_i - v_j) rises
   through zero, for every pair. */
#include "motion.h"

#include <math.h>
#include <stdlib.h>

static bool get_state(const struct phys_closest_approach *a, double t, const double *y)
{
    struct ad_error ignored; /* of the same state the next step will complain */
    ignored.status = AD_OK;
    return phys_ode_leave(a->ode, t, y, a->state, a->state + a->ode->n / 2, &ignored) == AD_OK;
}

/* (x_i - x_j) . (v_i - v_j), or, of x twice, the square of the distance. */
static double pair_product(const struct phys_closest_approach *a, const double *u, const double *w,
                           size_t i, size_t j)
{
    size_t dims = a->ode->system->dims;
    double sum = 0;
    for (size_t k = 0; k < dims; k++)
        sum += (u[i * dims + k] - u[j * dims + k]) * (w[i * dims + k] - w[j * dims + k]);
    return sum;
}

static void values(void *context, double t, const double *y, double *g)
{
    const struct phys_closest_approach *a = context;
    size_t bodies = a->ode->system->bodies;
    const double *q = a->state, *v = q + a->ode->n / 2;
    bool known = get_state(a, t, y);
    for (size_t i = 0; i < bodies; i++)
        for (size_t j = i + 1; j < bodies; j++)
            *g++ = known ? pair_product(a, q, v, i, j) : 0;
}

static void keep(struct phys_closest_approach *a, size_t i, size_t j, double t)
{
    double distance = sqrt(pair_product(a, a->state, a->state, i, j));
    if (distance >= a->distance)
        return;
    a->distance = distance;
    a->t = t;
    a->first = i;
    a->second = j;
}

static bool found(void *context, size_t k, double t, const double *y)
{
    struct phys_closest_approach *a = context;
    size_t i = 0, others = a->ode->system->bodies - 1;
    for (; k >= others - i; i++)
        k -= others - i;
    if (get_state(a, t, y))
        keep(a, i, i + 1 + k, t);
    return true;
}

enum ad_status phys_closest_approach_begin(const struct phys_ode *ode, double t, const double *y,
                                           struct phys_closest_approach *closest,
                                           struct ad_error *error)
{
    if (AD_LACKS(error, closest))
        return error->status;
    *closest = (struct phys_closest_approach){.distance = INFINITY, .ode = ode};
    if (AD_LACKS(error, ode, y))
        return error->status;
    const struct phys_system *system = ode->system;
    if (!system || system->scene->picture != PHYS_PICTURE_PLANE)
        return AD_OK;
    if (!(closest->state = malloc(ode->n * sizeof *closest->state)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (!get_state(closest, t, y))
        return AD_OK;
    for (size_t i = 0; i < system->bodies; i++)
        for (size_t j = i + 1; j < system->bodies; j++)
            keep(closest, i, j, t);
    closest->events = (struct phys_events){.n = system->bodies * (system->bodies - 1) / 2,
                                           .values = values,
                                           .direction = 1,
                                           .found = found,
                                           .context = closest,
                                           .coarse = true};
    return AD_OK;
}

void phys_closest_approach_end(struct phys_closest_approach *closest)
{
    if (!closest)
        return;
    free(closest->state);
    closest->state = NULL;
    closest->events = (struct phys_events){0};
}
