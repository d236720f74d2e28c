/* The motion of a Lagrangian and its variations, by their Taylor series. */
#include "autodiff/free.h"
#include "internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct context {
    size_t n;
    phys_motion *motion;
    struct phys_motion_series *series;
    double *rows; /* [2][n] */
};

static enum ad_status series(void *context, size_t order, double t, double *c, const double *cut,
                             struct ad_error *error)
{
    const struct context *x = context;
    return phys_motion_series(x->series, order, t, c, cut, error);
}

static void rest(void *context, double t, const double *y, const double *cut, double *off)
{
    phys_motion_series_rest(((struct context *)context)->series, t, y, cut, off);
}

/* The first coefficient. */
static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const struct context *x = context;
    memcpy(x->rows, y, x->n * sizeof *y);
    if (phys_motion_series(x->series, 1, t, x->rows, NULL, error) == AD_OK)
        memcpy(rate, x->rows + x->n, x->n * sizeof *rate);
    return error->status;
}

static void component(const void *context, size_t k, char *name, size_t size)
{
    const struct context *x = context;
    const struct phys_system *system = phys_motion_system(x->motion);
    const size_t n = 2 * system->dof;
    char of[64];
    phys_state_name(system, k % n, "velocity", of, sizeof of);
    snprintf(name, size, k < n ? "%s" : "the variation of %s", of);
}

static void release(void *context)
{
    struct context *x = context;
    phys_motion_series_free(x->series);
    phys_motion_free(x->motion);
    AD_FREE(x->rows, x);
}

enum ad_status phys_ode_variations(const struct phys_system *system, size_t columns,
                                   struct phys_ode *ode, struct ad_error *error)
{
    return phys_ode_parameters(system, columns, 0, NULL, ode, error);
}

/* The places of parameters that are variables. */
static enum ad_status find_params(const struct phys_system *system, size_t n,
                                  const char *const names[], size_t *which, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++) {
        if (phys_param_refuse(system, names[k], error) != AD_OK)
            return error->status;
        which[k] = phys_param_find(system, names[k], error);
    }
    return AD_OK;
}

enum ad_status phys_ode_parameters(const struct phys_system *system, size_t columns,
                                   size_t n_params, const char *const names[], struct phys_ode *ode,
                                   struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, system, system->scene) ||
        (n_params && AD_LACKS(error, names)))
        return error->status;
    if (n_params > system->scene->n_params)
        return ad_fail(error, AD_E_ARGUMENT, "%zu parameters; %s has %zu", n_params,
                       system->scene->name, system->scene->n_params);
    if (system->scene->ode)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s moves by a field of its own, not by L: its variations are not known",
                       system->scene->name);
    const size_t n = 2 * system->dof * (1 + columns + n_params);
    size_t *which = malloc((n_params + 1) * sizeof *which);
    struct context *x = calloc(1, sizeof *x);
    *ode = (struct phys_ode){.name = system->scene->name,
                             .n = n,
                             .field = field,
                             .series = series,
                             .rest = rest,
                             .component = component,
                             .context = x,
                             .free = x ? release : NULL};
    if (!x || !which || !(x->rows = malloc(2 * n * sizeof *x->rows)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (find_params(system, n_params, names, which, error) == AD_OK &&
             phys_motion_new_of(system, n_params, which, &x->motion, error) == AD_OK)
        phys_motion_series_new(x->motion, PHYS_SERIES_MOST, columns, &x->series, error);
    if (x)
        x->n = n;
    free(which);
    return error->status;
}
