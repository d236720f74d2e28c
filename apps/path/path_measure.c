/* How good a path is (path.h): action and energies, distance to the reference, drift of energy. */
#include "path.h"

#include <math.h>
#include <stdlib.h>

/* One tape that gives the figures of any path, and the energy of each of its slices. */
struct meter {
    ad_tape *tape;
    ad_program *program;
    struct phys_action action;
    ad_var gradient, energy;
};

/* [1 x points of the rule] */
static ad_var record_energy(const struct path_run *run, ad_var path)
{
    ad_var kinetic, potential;
    struct phys_rule_points at;
    phys_rule_points(run->settings.rule, path, run->settings.dt, &at);
    phys_system_energies(&run->system, at.q, at.v, at.t, &kinetic, &potential);
    return ad_add(kinetic, potential);
}

static enum ad_status meter_new(const struct path_run *run, struct meter *meter,
                                struct ad_error *error)
{
    const struct phys_path_settings *settings = &run->settings;
    *meter = (struct meter){.tape = ad_tape_new(AD_F64)};
    if (!meter->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct phys_action *action = &meter->action;
    phys_action_record(meter->tape, &run->system, settings->rule, settings->slices, settings->dt,
                       settings->energy_weight, action);
    ad_grad(action->objective, 1, &action->path, &meter->gradient);
    meter->energy = record_energy(run, action->path);
    const ad_var out[] = {action->action,         action->action_mean,  action->kinetic_mean,
                          action->potential_mean, action->first_energy, action->objective,
                          meter->gradient,        meter->energy};
    if (ad_compile(meter->tape, sizeof out / sizeof *out, out, &meter->program) == AD_OK)
        return AD_OK;
    const struct ad_error *found = ad_tape_error(meter->tape);
    return ad_fail(error, found->status, "%s", found->message);
}

static void meter_free(struct meter *meter)
{
    ad_program_free(meter->program);
    ad_tape_free(meter->tape);
}

static double scalar(const struct meter *meter, ad_var x)
{
    double value = NAN;
    ad_get(meter->program, x, &value);
    return value;
}

/* Norm of the gradient with respect to what may move: the slices but the first and the last, and
   the nodes between them (those of the last column are not used). */
static double inner_norm(const struct path_run *run, const double *gradient)
{
    size_t n = run->settings.slices, dof = run->system.dof;
    double sum = 0;
    for (size_t k = 0; k < run->settings.rule->degree * dof; k++)
        for (size_t i = k < dof; i + 1 < n; i++)
            sum += gradient[k * n + i] * gradient[k * n + i];
    return sqrt(sum);
}

static void run_path(struct meter *meter, const double *path)
{
    ad_set(meter->program, meter->action.path, path);
    ad_run(meter->program);
}

/* A penalty on the change of energy is against that of the start. */
static void hold_energy(const struct path_run *run, struct meter *meter)
{
    run_path(meter, run->start);
    double energy = scalar(meter, meter->action.first_energy);
    ad_set(meter->program, meter->action.start_energy, &energy);
}

static struct path_figures figures(const struct path_run *run, struct meter *meter,
                                   const double *path)
{
    run_path(meter, path);
    return (struct path_figures){
        .action = scalar(meter, meter->action.action),
        .action_mean = scalar(meter, meter->action.action_mean),
        .kinetic_mean = scalar(meter, meter->action.kinetic_mean),
        .potential_mean = scalar(meter, meter->action.potential_mean),
        .objective = scalar(meter, meter->action.objective),
        .grad_norm = inner_norm(run, ad_data(meter->program, meter->gradient)),
    };
}

/* Largest change of energy along the path last run, relative to its start. */
static double energy_drift(const struct meter *meter)
{
    const double *energy = ad_data(meter->program, meter->energy);
    double drift = 0;
    for (size_t i = 1; i < ad_cols(meter->energy); i++)
        drift = fmax(drift, fabs(energy[i] - energy[0]));
    return energy[0] != 0 ? drift / fabs(energy[0]) : drift;
}

static double mean_square(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum / (double)n;
}

static double largest(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

enum ad_status path_measure(const struct path_run *run, struct path_result *result,
                            struct ad_error *error)
{
    struct meter meter;
    if (meter_new(run, &meter, error) == AD_OK) {
        size_t n = run->system.dof * run->settings.slices;
        hold_energy(run, &meter);
        result->reference = figures(run, &meter, run->reference);
        result->start = figures(run, &meter, run->start);
        result->found = figures(run, &meter, run->path);
        result->energy_drift = energy_drift(&meter);
        result->mse_initial = mean_square(run->start, run->reference, n);
        result->mse_final = mean_square(run->path, run->reference, n);
        result->max_error = largest(run->path, run->reference, n);
    }
    meter_free(&meter);
    return error->status == AD_OK ? path_judge_kind(run, result, error) : error->status;
}
