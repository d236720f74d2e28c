/* The derivative of a scene's start by its parameters, by differences: starts are numbers. */
#include "autodiff/free.h"
#include "internal.h"
#include "physics/system/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The start (q, v) at value p of a parameter; not a number where there is none. */
static enum ad_status start_at(struct phys_system *copy, size_t which, double p, uint64_t seed,
                               double *x, struct ad_error *error)
{
    const struct phys_scene *scene = copy->scene;
    double *at = phys_param_value(copy, which), before = *at;
    struct ad_error refused = {0};
    *at = p;
    bool valid = (scene->dof ? scene->dof : scene->dof_of(copy->params)) == copy->dof &&
                 scene->start(copy->params, seed, x, x + copy->dof, &refused) == AD_OK;
    *at = before;
    for (size_t i = 0; i < 2 * copy->dof && !valid; i++)
        x[i] = NAN;
    return phys_keep_memory(&refused, error);
}

enum { HALVINGS = 12 };

/* The derivative [d] of the start by a parameter, by central differences of steps that are halved,
   extrapolated (Ridders, Advances in Engineering Software 4 (1982) 75), and what it may be off by.
   `work` [(HALVINGS + 2) d]. */
static enum ad_status start_slope(struct phys_system *copy, size_t which, uint64_t seed,
                                  double *work, double *slope, double *off, struct ad_error *error)
{
    const size_t d = 2 * copy->dof;
    const double p = *phys_param_value(copy, which);
    double *up = work, *down = work + d, h = exp2(floor(log2(p == 0 ? 1 : fabs(p))) - 4);
    for (size_t i = 0; i < d; i++)
        off[i] = INFINITY;
    for (int k = 0; k < HALVINGS; k++, h /= 2) {
        if (start_at(copy, which, p + h, seed, up, error) != AD_OK ||
            start_at(copy, which, p - h, seed, down, error) != AD_OK)
            return error->status;
        for (size_t i = 0; i < d; i++) {
            double *row = work + 2 * d + i * HALVINGS, factor = 4;
            const double rounding =
                DBL_EPSILON * (fabs(up[i]) + fabs(down[i])) / h * (up[i] != down[i]);
            double now = (up[i] - down[i]) / ((p + h) - (p - h)); /* row: of steps 2 h, in turn */
            for (int j = 0; j <= k; j++, factor *= 4) {
                const double coarser = row[j], next = (factor * now - coarser) / (factor - 1);
                const double change = fmax(fabs(next - now), fabs(next - coarser)) + rounding;
                row[j] = now;
                if (j < k && change < off[i]) {
                    off[i] = change;
                    slope[i] = next;
                }
                now = next;
            }
        }
    }
    for (size_t i = 0; i < d; i++)
        if (!isfinite(off[i]))
            return ad_fail(error, AD_E_NONFINITE, "%s: the start has no derivative by %s = %g",
                           copy->scene->name, copy->scene->params[which].name, p);
    return AD_OK;
}

enum ad_status phys_start_slopes(const struct phys_system *system, uint64_t seed, size_t n,
                                 const char *const names[], double *slope, double *uncertainty,
                                 struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, names, slope, uncertainty))
        return error->status;
    const size_t d = 2 * system->dof;
    struct phys_system copy = *system;
    double *work = calloc((HALVINGS + 2) * d, sizeof *work);
    copy.params = malloc(system->scene->params_bytes + 1);
    if (!work || !copy.params)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (!system->scene->start)
        ad_fail(error, AD_E_ARGUMENT, "%s has no start", system->scene->name);
    else
        memcpy(copy.params, system->params, system->scene->params_bytes);
    for (size_t k = 0; k < n && error->status == AD_OK; k++) {
        const size_t which = phys_param_find(system, names[k], error);
        if (which != SIZE_MAX)
            start_slope(&copy, which, seed, work, slope + k * d, uncertainty + k * d, error);
    }
    AD_FREE(copy.params, work);
    return error->status;
}
