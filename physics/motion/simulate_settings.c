/* Settings of a simulation: checks, and sizes that tolerances are relative to (run.h). */
#include "run.h"

#include <math.h>
#include <stdlib.h>

/* Samples at times that are not reached would be missing. */
static enum ad_status check_times(const struct phys_simulation *s, struct ad_error *error)
{
    double last = s->t0, direction = s->t1 < s->t0 ? -1 : 1;
    for (size_t k = 0; s->times && s->every == 0 && k < s->n_samples; last = s->times[k++])
        if (!((s->times[k] - last) * direction >= 0 && (s->t1 - s->times[k]) * direction >= 0))
            return ad_fail(
                error, AD_E_ARGUMENT,
                "times[%zu] = %.17g behind %.17g: expected one in order, from t0 = %.17g "
                "to t1 = %.17g",
                k, s->times[k], last, s->t0, s->t1);
    return AD_OK;
}

enum ad_status phys_run_check(const struct phys_simulation *s, size_t n, struct ad_error *error)
{
    if (!isfinite(s->t0) || !isfinite(s->t1))
        return ad_fail(error, AD_E_ARGUMENT, "time t0 = %g to t1 = %g, expected finite numbers",
                       s->t0, s->t1);
    if (s->n_events && !s->events)
        return ad_fail(error, AD_E_ARGUMENT, "%zu events: got NULL", s->n_events);
    if (s->integrator->adaptive) {
        if (!(s->rtol >= 0 && s->atol >= 0 && s->rtol + s->atol > 0))
            return ad_fail(error, AD_E_ARGUMENT,
                           "tolerances %g relative, %g absolute; expected positive numbers",
                           s->rtol, s->atol);
        if (!isfinite(s->dt) || !(s->min_step >= 0 && isfinite(s->min_step)))
            return ad_fail(error, AD_E_ARGUMENT,
                           "first step dt = %g, min_step = %g: expected numbers, 0 for the default",
                           s->dt, s->min_step);
        for (size_t k = 0; s->scale && k < n; k++)
            if (!(s->scale[k] > 0))
                return ad_fail(error, AD_E_ARGUMENT, "scale[%zu]: expected more than 0, got %g", k,
                               s->scale[k]);
        return check_times(s, error);
    } else if (!(s->dt > 0 && isfinite(s->dt))) {
        return ad_fail(error, AD_E_ARGUMENT, "%s: time step dt = %g, expected a positive number",
                       s->integrator->name, s->dt);
    } else if (!(fabs(s->t1 - s->t0) / s->dt < 1e15)) {
        return ad_fail(error, AD_E_ARGUMENT,
                       "time step %g is too small for a time of %g; expected a longer one", s->dt,
                       fabs(s->t1 - s->t0));
    }
    return AD_OK;
}

/* Of an ode without halves each component has a size of its own: what it starts with, or, from 0,
   its rate over the shortest time of the others. */
static enum ad_status sizes_of_start(const struct phys_simulation *s, const struct phys_ode *ode,
                                     const double *y, double *size, struct ad_error *error)
{
    double time = fabs(s->t1 - s->t0);
    if (ode->field(ode->context, s->t0, y, size, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < ode->n; k++)
        if (y[k] != 0 && size[k] != 0)
            time = fmin(time, fabs(y[k] / size[k]));
    for (size_t k = 0; k < ode->n; k++)
        size[k] = y[k] != 0 ? fabs(y[k]) : time * fabs(size[k]);
    return AD_OK;
}

enum ad_status phys_run_sizes(struct run *run, struct phys_simulation *s,
                              const struct phys_ode *ode, const double *y, double **sizes,
                              struct ad_error *error)
{
    bool halves = ode->canonical || ode->kick || ode->system;
    bool given = s->atol > 0;
    s->atol = given ? s->atol : s->rtol;
    if (s->scale)
        return AD_OK;
    s->rtol = s->rtol > 0 || halves ? s->rtol : s->atol;
    if (!(*sizes = malloc(ode->n * sizeof **sizes)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->scale = *sizes;
    run->halves = halves;
    run->growing = halves && !given ? NULL : *sizes;
    if ((halves ? phys_typical_sizes(ode, s->t0, y, *sizes, error)
                : sizes_of_start(s, ode, y, *sizes, error)) != AD_OK) {
        free(*sizes);
        *sizes = NULL;
    }
    return error->status;
}
