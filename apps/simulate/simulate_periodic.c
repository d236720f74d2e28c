/* --periodic, --mode: the periodic motion near the start, or of a mode, and its multipliers. */
#include "simulate.h"
#include "physics/modes/modes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double amplitude = 1e-3; /* of small oscillations, of the largest coordinate, or 1 */

static enum ad_status refuse_mode(const struct simulate_run *run, const double *q,
                                  const struct phys_mode *mode, struct ad_error *error)
{
    char text[200] = "", name[64];
    size_t used = 0;
    for (size_t i = 0; i < run->system.dof && used < sizeof text / 2; i++) {
        phys_coordinate_name(&run->system, i, name, sizeof name);
        used += (size_t)snprintf(text + used, sizeof text - used, "%s%s %.6g", i ? ", " : "", name,
                                 q[i]);
    }
    return ad_fail(error, AD_E_ARGUMENT,
                   "mode %zu at %s does not oscillate: frequency %g, growth %g; expected another, "
                   "or a start near another equilibrium",
                   run->options->mode, text, mode->frequency, mode->growth);
}

/* A small oscillation about the equilibrium that Newton's method goes to from the scene's start. */
static enum ad_status oscillate(const struct simulate_run *run, double *x, double *period,
                                struct ad_error *error)
{
    const size_t dof = run->system.dof, k = run->options->mode - 1;
    const struct phys_equilibria_settings how = {
        .size = sizeof how, .starts = 1, .proceed = run->settings.proceed};
    struct phys_equilibria found;
    double size = 0;
    if (phys_equilibria_find(&run->system, &how, &found, error) == AD_OK && found.n == 0)
        ad_fail(error, AD_E_ACCURACY, "no equilibrium found from the scene's start");
    if (error->status == AD_OK && found.one->n_modes == 0)
        ad_fail(error, AD_E_ACCURACY,
                "L has no second derivatives at the equilibrium near the start, and so no modes");
    if (error->status == AD_OK && k >= found.one->n_modes)
        ad_fail(error, AD_E_ARGUMENT, "expected at most %zu, got %zu", found.one->n_modes, k + 1);
    if (error->status == AD_OK) {
        const struct phys_mode *mode = &found.one->mode[k];
        if (mode->growth != 0 || !(mode->frequency > 0))
            refuse_mode(run, found.one->q, mode, error);
        for (size_t i = 0; i < dof; i++)
            size = fmax(size, fabs(found.one->q[i]));
        size = amplitude * (size > 0 ? size : 1);
        for (size_t i = 0; i < dof; i++) {
            x[i] = found.one->q[i] + size * mode->shape[2 * i];
            x[dof + i] = -size * mode->frequency * mode->shape[2 * i + 1];
        }
        *period = 2 * M_PI / mode->frequency;
    }
    phys_equilibria_free(&found);
    return error->status;
}

/* The first motion: near the start, or one of small oscillations. */
static enum ad_status begin(const struct simulate_run *run, double *x, double *period,
                            struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    *period = o->periodic;
    return o->mode != OPTION_NO_COUNT ? oscillate(run, x, period, error)
                                      : run->system.scene->start(run->system.params, o->common.seed,
                                                                 x, x + run->system.dof, error);
}

static enum ad_status find(struct simulate_run *run, const double *x, double period,
                           struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    if (o->hold && strcmp(o->hold, "period") != 0 && strcmp(o->hold, "energy") != 0)
        return ad_fail(error, AD_E_ARGUMENT, "--hold: expected period or energy, got '%s'",
                       o->hold);
    const struct phys_periodic_settings how = {.size = sizeof how,
                                               .x = x,
                                               .period = period,
                                               .hold_period = o->hold && *o->hold == 'p',
                                               .hold_energy = o->hold && *o->hold == 'e',
                                               .proceed = run->settings.proceed,
                                               .choreography = o->choreography};
    struct ad_error cause = {0};
    return phys_periodic_find(&run->system, &how, &run->periodic, &cause) == AD_OK
               ? AD_OK
               : simulate_refuse("--periodic: ", &cause, error);
}

enum ad_status simulate_periodic(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *o = run->options;
    const size_t dof = run->system.dof;
    const bool of_mode = o->mode != OPTION_NO_COUNT;
    struct ad_error cause = {0};
    double period;
    if (isnan(o->periodic) && !of_mode)
        return AD_OK;
    if (o->follow && simulate_family_read(run, error) != AD_OK)
        return error->status;
    if (!(run->start = calloc(2 * dof, sizeof *run->start)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (begin(run, run->start, &period, &cause) != AD_OK)
        return simulate_refuse(of_mode ? "--mode: " : "--periodic: ", &cause, error);
    if ((o->follow ? simulate_family : find)(run, run->start, period, error) != AD_OK)
        return error->status;
    memcpy(run->start, run->periodic.x, 2 * dof * sizeof *run->start);
    run->settings.q = run->start;
    run->settings.v = run->start + dof;
    run->settings.time = isnan(o->time) ? run->periodic.period : o->time;
    return AD_OK;
}

void simulate_periodic_free(struct simulate_run *run)
{
    if (run->family.n == 0)
        phys_periodic_free(&run->periodic);
    phys_family_free(&run->family);
}
