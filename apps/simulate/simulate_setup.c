/* A simulation made definite (simulate.h). */
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double default_tolerance = 1e-9;

static enum ad_status check(const struct simulate_options *options, struct ad_error *error)
{
    const struct {
        const char *name;
        double value, example;
    } positive[] = {{"dt", options->dt, 0.01},
                    {"tol", options->tolerance, 1e-9},
                    {"time", options->time, 10},
                    {"horizon", options->horizon, 1e-6}};
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++)
        if (!isnan(positive[k].value) && !(positive[k].value > 0))
            return ad_fail(error, AD_E_ARGUMENT, "--%s: expected more than 0, such as %g, got %g",
                           positive[k].name, positive[k].example, positive[k].value);
    if (options->horizon >= simulate_lost)
        return ad_fail(error, AD_E_ARGUMENT, "--horizon: expected less than %g, got %g",
                       simulate_lost, options->horizon);
    if (!isnan(options->dt) && !isnan(options->tolerance))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--dt and --tol: expected one of them; leave the other out");
    if (!isnan(options->dt) && !options->integrator)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--dt needs --integrator NAME, one with fixed steps such as rk4");
    if (options->every != OPTION_NO_COUNT && options->samples != OPTION_NO_COUNT)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--every and --samples: expected one of them; leave the other out");
    if (!options->data && (options->from || options->rough || options->days != OPTION_NO_COUNT))
        return ad_fail(error, AD_E_ARGUMENT, "--%s needs --data DIR, a folder of Horizons tables",
                       options->from    ? "from"
                       : options->rough ? "rough"
                                        : "days");
    if (options->every == 0 || options->samples == 0)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: expected at least 1, got 0",
                       options->every == 0 ? "every" : "samples");
    return AD_OK;
}

static enum ad_status start(struct simulate_run *run, struct ad_error *error)
{
    size_t dof = run->system.dof;
    run->q = calloc(2 * dof, sizeof *run->q);
    if (!run->q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    run->v = run->q + dof;
    return run->system.scene->start(run->system.params, run->options->common.seed, run->q, run->v,
                                    error);
}

static enum ad_status choose_steps(struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_options *options = run->options;
    run->dt = options->dt;
    run->tolerance = options->tolerance;
    if (!run->integrator && isnan(options->tolerance)) {
        run->integrator = phys_integrator_find("dop853", error);
        run->tolerance = default_tolerance;
    } else if (run->integrator && run->integrator->adaptive) {
        if (!isnan(options->dt))
            return ad_fail(error, AD_E_ARGUMENT, "--dt: %s chooses its steps; give --tol E",
                           run->integrator->name);
        if (isnan(options->tolerance))
            run->tolerance = default_tolerance;
    } else if (run->integrator && isnan(options->dt) && isnan(options->tolerance)) {
        run->dt = run->system.scene->dt;
    }
    return error->status;
}

enum ad_status simulate_setup(const struct simulate_options *options, struct simulate_run *run,
                              struct ad_error *error)
{
    *run = (struct simulate_run){.options = options};
    if (check(options, error) != AD_OK ||
        phys_system_open(options->common.argument[0], &run->system, error) != AD_OK ||
        phys_system_set_all(&run->system, options->set.n, options->set.setting, error) != AD_OK ||
        event_questions_read(&options->events, options->until, &run->system, &run->questions,
                             error) != AD_OK)
        return error->status;
    const struct phys_scene *scene = run->system.scene;
    run->time = option_number_or(options->time, (double)(scene->slices - 1) * scene->dt);
    if (options->integrator)
        run->integrator = phys_integrator_find(options->integrator, error);
    if (options->data && (simulate_ephemeris(run, error) != AD_OK || run->model))
        return error->status;
    if (error->status == AD_OK && start(run, error) == AD_OK && choose_steps(run, error) == AD_OK &&
        options->data)
        simulate_ephemeris_steps(run, error);
    return error->status;
}

void simulate_free(struct simulate_run *run)
{
    phys_ode_free(&run->ode);
    event_questions_free(&run->questions);
    simulate_ephemeris_free(run);
    free(run->q);
    phys_system_close(&run->system);
}

enum ad_status simulate_ode(const struct simulate_run *run,
                            const struct phys_integrator *integrator, struct phys_ode *ode,
                            struct ad_error *error)
{
    if (integrator->lagrangian)
        return phys_ode_canonical(&run->system, ode, error);
    if (phys_ode_lagrangian(&run->system, ode, error) != AD_OK)
        return error->status;
    bool splits = integrator->separable || strcmp(integrator->name, "semi-implicit") == 0;
    if (ode->canonical || !integrator->symplectic || splits)
        return AD_OK;
    phys_ode_free(ode);
    return phys_ode_canonical(&run->system, ode, error);
}

enum ad_status simulate_settings(const struct simulate_run *run,
                                 const struct phys_integrator *integrator, double setting,
                                 const struct phys_ode *ode, const double *y, double *scale,
                                 struct phys_simulation *settings, struct ad_error *error)
{
    *settings = (struct phys_simulation){.integrator = integrator, .t1 = run->time};
    if (!integrator->adaptive) {
        settings->dt = setting;
        return AD_OK;
    }
    settings->rtol = settings->atol = setting;
    settings->scale = scale;
    return phys_typical_sizes(ode, 0, y, scale, error);
}
