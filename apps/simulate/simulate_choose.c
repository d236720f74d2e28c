/* --tol E: the least work that meets an error. Each candidate is refined, coarse to fine; what a
   run errs is estimated by its distance from the next finer one. A candidate ends where it meets E,
   or where it has cost more than the best so far. */
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    POINTS = 512,     /* times at which runs are compared */
    LEVELS = 24,      /* of refinement */
    ADAPTIVE_GAP = 2, /* levels between a run and the one it is held against: a tenth */
    MOST_STEPS = 1000000,
    MOST_LOST = 4 /* runs in a row that do not get through */
};

/* The finer run errs too, if less. */
static const double caution = 2;

static const char *const candidates[] = {"dop853", "dopri5", "yoshida6", "yoshida4", "verlet"};

enum { N_CANDIDATES = sizeof candidates / sizeof *candidates };

struct trial_run {
    struct simulate_samples samples;
    size_t evaluations;
    bool complete;
};

static double setting_of(const struct simulate_run *run, const struct phys_integrator *integrator,
                         size_t level)
{
    if (integrator->adaptive)
        return pow(10, -1.0 - 0.5 * (double)level);
    return run->time / POINTS / pow(2, (double)level);
}

/* One run of a candidate; incomplete where the motion was lost on the way. Other failures are
   errors. */
static enum ad_status attempt(const struct simulate_run *run, const struct phys_ode *ode,
                              const struct phys_integrator *integrator, double setting,
                              struct trial_run *trial, struct ad_error *error)
{
    size_t n = ode->n;
    double *y = malloc(2 * n * sizeof *y);
    struct phys_simulation settings;
    struct phys_simulation_info info = {0};
    struct ad_error lost = {0};
    trial->samples = (struct simulate_samples){.ode = ode, .dof = run->system.dof};
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_enter(ode, 0, run->q, run->v, y, error) == AD_OK &&
        simulate_settings(run, integrator, setting, ode, y, y + n, &settings, error) == AD_OK) {
        settings.n_samples = POINTS;
        settings.max_steps = MOST_STEPS;
        settings.sample = simulate_sample;
        settings.context = &trial->samples;
        phys_simulate(&settings, ode, y, &info, &lost);
    }
    free(y);
    trial->evaluations = info.evaluations;
    trial->complete = lost.status == AD_OK && trial->samples.n == POINTS + 1;
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

static double distance(const struct simulate_samples *a, const struct simulate_samples *b)
{
    double most = 0;
    for (size_t i = 0; i < a->n; i++) {
        double sum = 0;
        for (size_t k = 0; k < a->dof; k++) {
            double d = a->x[2 * i * a->dof + k] - b->x[2 * i * a->dof + k];
            sum += d * d;
        }
        most = fmax(most, sqrt(sum));
    }
    return most;
}

/* Refines one candidate; trial->estimate is of the coarsest run that meets E, or of the best. */
static enum ad_status refine(const struct simulate_run *run, const struct phys_ode *ode, double E,
                             size_t budget, struct simulate_trial *trial, struct ad_error *error)
{
    const struct phys_integrator *integrator = trial->integrator;
    size_t gap = integrator->adaptive ? ADAPTIVE_GAP : 1, level = 0, lost = 0;
    struct trial_run runs[LEVELS] = {0};
    trial->estimate = (double)NAN;
    for (; level < LEVELS; level++) {
        struct trial_run *fine = &runs[level], *coarse = &runs[level < gap ? 0 : level - gap];
        if (attempt(run, ode, integrator, setting_of(run, integrator, level), fine, error) != AD_OK)
            break;
        if (level >= gap && coarse->complete && fine->complete) {
            double estimate = caution * distance(&coarse->samples, &fine->samples);
            if (!(estimate >= trial->estimate)) {
                trial->estimate = estimate;
                trial->setting = setting_of(run, integrator, level - gap);
                trial->evaluations = coarse->evaluations;
            }
        }
        lost = fine->complete ? 0 : lost + 1;
        if (trial->estimate <= E || fine->evaluations > 4 * budget || lost == MOST_LOST)
            break;
    }
    for (size_t k = 0; k < LEVELS; k++)
        simulate_samples_free(&runs[k].samples);
    return error->status;
}

static enum ad_status try_candidate(struct simulate_run *run, const char *name, size_t budget,
                                    struct ad_error *error)
{
    struct simulate_trial *trial = &run->trial[run->n_trials];
    struct phys_ode ode = {0};
    trial->integrator = phys_integrator_find(name, error);
    if (simulate_ode(run, trial->integrator, &ode, error) == AD_OK &&
        (ode.kick || !trial->integrator->separable || run->integrator)) {
        run->n_trials++;
        refine(run, &ode, run->options->tolerance, budget, trial, error);
    }
    phys_ode_free(&ode);
    return error->status;
}

static struct simulate_trial *best(struct simulate_run *run)
{
    struct simulate_trial *found = NULL;
    for (size_t k = 0; k < run->n_trials; k++) {
        struct simulate_trial *trial = &run->trial[k];
        if (trial->estimate <= run->options->tolerance &&
            (!found || trial->evaluations < found->evaluations))
            found = trial;
    }
    return found;
}

static enum ad_status out_of_reach(const struct simulate_run *run, struct ad_error *error)
{
    const struct simulate_trial *nearest = NULL;
    for (size_t k = 0; k < run->n_trials; k++)
        if (!isnan(run->trial[k].estimate) &&
            (!nearest || run->trial[k].estimate < nearest->estimate))
            nearest = &run->trial[k];
    if (!nearest)
        return ad_fail(error, AD_E_ACCURACY,
                       "--tol %g: no method gets through t = %g: a collision, or a motion that "
                       "ends before; try a shorter --time",
                       run->options->tolerance, run->time);
    return ad_fail(error, AD_E_ACCURACY,
                   "--tol %g is out of reach: %s comes to %.2g, where rounding, chaos or work take "
                   "over; allow a larger error or take a shorter --time",
                   run->options->tolerance, nearest->integrator->name, nearest->estimate);
}

enum ad_status simulate_choose(struct simulate_run *run, struct ad_error *error)
{
    size_t budget = SIZE_MAX / 8;
    for (size_t k = 0; k < N_CANDIDATES && error->status == AD_OK; k++) {
        const char *name = run->integrator ? run->integrator->name : candidates[k];
        try_candidate(run, name, budget, error);
        if (best(run))
            budget = best(run)->evaluations;
        else if (k == 0) /* what the method for high accuracy does not reach, none will */
            break;
        if (run->integrator)
            break;
    }
    if (error->status != AD_OK)
        return error->status;
    struct simulate_trial *chosen = best(run);
    if (!chosen)
        return out_of_reach(run, error);
    chosen->chosen = true;
    run->integrator = chosen->integrator;
    *(chosen->integrator->adaptive ? &run->tolerance : &run->dt) = chosen->setting;
    return AD_OK;
}
