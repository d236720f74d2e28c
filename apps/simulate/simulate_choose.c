/* --tol E: a setting that meets an error. A run is judged by its distance from a finer one; from
   two such the setting that meets E is predicted, so that the search costs about three runs of the
   answer (Hairer, Norsett, Wanner, section II.4). It goes on as long as finer runs come nearer. */
#include "simulate.h"
#include "apps/interrupt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    POINTS = 512,   /* times at which runs of fixed steps are compared: whole steps */
    SAMPLES = 2000, /* adaptive runs are interpolated */
    ROUNDS = 12,
    MOST_STEPS = 1000000,
    MOST_IDLE = 2, /* rounds in a row that come no nearer */
    MOST_LOST = 4  /* that do not get through */
};

static const double caution = 2;        /* the finer run errs too, if less */
static const double aim = 0.3;          /* of E: predictions are not exact */
static const double least_gain = 0.7;   /* of the estimate before, or rounding has taken over */
static const double least_tol = 1e-16;  /* of a step */
static const double finer_tol = 0.3162; /* of a run, for the one it is judged by */
static const double near = 1e-3;        /* sizes of the motion: a longer run is worth it */

/* First the method for high accuracy; where its rounding stops it, one whose steps are few. */
static const char *const candidates[] = {"dop853", "gauss5"};

enum { N_CANDIDATES = sizeof candidates / sizeof *candidates };

struct trial_run {
    struct simulate_samples samples;
    size_t evaluations;
    bool complete;
};

static size_t points_of(const struct phys_integrator *integrator)
{
    return integrator->adaptive ? SAMPLES : POINTS;
}

/* A run judged by another: by a tenth of its tolerance, or by twice its steps. */
static double finer(const struct phys_integrator *integrator, double setting)
{
    return setting * (integrator->adaptive ? finer_tol : 0.5);
}

static bool possible(const struct simulate_run *run, const struct phys_integrator *integrator,
                     double setting)
{
    return integrator->adaptive ? setting >= least_tol : run->time / setting <= MOST_STEPS;
}

/* The setting to try after one that errs by `estimate`. Steps fill the time between two points. */
static double predict(const struct simulate_run *run, const struct phys_integrator *integrator,
                      double setting, double estimate)
{
    double ratio = isnan(estimate) ? 1e-3 : aim * run->options->tolerance / estimate;
    if (integrator->adaptive)
        return fmax(setting * fmax(ratio, 1e-6), fmin(setting * finer_tol, 10 * least_tol));
    double steps = run->time / POINTS / setting;
    double times = pow(ratio, -1 / (double)integrator->order);
    return run->time / POINTS / ceil(steps * fmin(fmax(times, 1.1), 64));
}

static bool proceed(void *unused)
{
    (void)unused;
    return !interrupted();
}

/* One run of a candidate; incomplete where the motion was lost on the way. Other failures are
   errors. */
static enum ad_status attempt(const struct simulate_run *run, const struct phys_ode *ode,
                              const struct phys_integrator *integrator, double setting,
                              struct trial_run *trial, struct simulate_trial *sum,
                              struct ad_error *error)
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
        settings.n_samples = points_of(integrator);
        settings.max_steps = MOST_STEPS;
        settings.sample = simulate_sample;
        settings.proceed = proceed;
        settings.context = &trial->samples;
        phys_simulate(&settings, ode, y, &info, &lost);
    }
    free(y);
    trial->evaluations = info.evaluations;
    sum->searched += info.evaluations;
    trial->complete = lost.status == AD_OK && trial->samples.n == points_of(integrator) + 1;
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        ad_fail(error, lost.status, "%s", lost.message);
    if (error->status == AD_OK && interrupted())
        ad_fail(error, AD_E_ACCURACY, "interrupted while --tol was looking for a method");
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

/* Whether a round brought the trial further; it keeps the best setting. */
static bool judge(struct simulate_trial *trial, double setting, const struct trial_run *coarse,
                  double estimate)
{
    bool gain = !(estimate > least_gain * trial->estimate);
    if (isnan(estimate) || estimate >= trial->estimate)
        return gain;
    trial->estimate = estimate;
    trial->setting = setting;
    trial->evaluations = coarse->evaluations;
    return gain;
}

/* Refines one candidate from `setting` on. */
static enum ad_status refine(const struct simulate_run *run, const struct phys_ode *ode,
                             double setting, struct simulate_trial *trial, struct ad_error *error)
{
    const struct phys_integrator *method = trial->integrator;
    struct trial_run coarse = {0}, fine = {0};
    size_t lost = 0, idle = 0;
    bool again = true;
    trial->estimate = (double)NAN;
    for (size_t round = 0; again && round < ROUNDS && possible(run, method, setting); round++) {
        double estimate = (double)NAN;
        if (!coarse.samples.n && attempt(run, ode, method, setting, &coarse, trial, error) != AD_OK)
            break;
        if (attempt(run, ode, method, finer(method, setting), &fine, trial, error) != AD_OK)
            break;
        if (coarse.complete && fine.complete)
            estimate = caution * distance(&coarse.samples, &fine.samples);
        lost = fine.complete ? 0 : lost + 1;
        idle = judge(trial, setting, &coarse, estimate) ? 0 : idle + 1;
        again = idle < MOST_IDLE && lost < MOST_LOST && !(estimate <= run->options->tolerance);
        double next = predict(run, method, setting, estimate);
        simulate_samples_free(&coarse.samples);
        coarse = (struct trial_run){0};
        if (next >= finer(method, setting)) { /* it has been run */
            next = finer(method, setting);
            coarse = fine;
            fine = (struct trial_run){0};
        }
        simulate_samples_free(&fine.samples);
        setting = next;
    }
    simulate_samples_free(&coarse.samples);
    simulate_samples_free(&fine.samples);
    return error->status;
}

/* Where to begin: a tenth of E in units of the motion, or the coarsest steps. */
static enum ad_status first_setting(const struct simulate_run *run,
                                    const struct phys_integrator *method,
                                    const struct phys_ode *ode, double *size, double *setting,
                                    struct ad_error *error)
{
    double *y = malloc(2 * ode->n * sizeof *y), E = run->options->tolerance;
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_enter(ode, 0, run->q, run->v, y, error) == AD_OK &&
        phys_typical_sizes(ode, 0, y, y + ode->n, error) == AD_OK) {
        *size = y[ode->n];
        *setting = method->adaptive ? fmin(fmax(0.1 * E / *size, 100 * least_tol), 1e-2)
                                    : run->time / POINTS;
    }
    free(y);
    return error->status;
}

static enum ad_status try_candidate(struct simulate_run *run, const char *name, double *size,
                                    struct ad_error *error)
{
    struct simulate_trial *trial = &run->trial[run->n_trials];
    struct phys_ode ode = {0};
    double setting = 0;
    trial->integrator = phys_integrator_find(name, error);
    if (simulate_ode(run, trial->integrator, &ode, error) == AD_OK &&
        first_setting(run, trial->integrator, &ode, size, &setting, error) == AD_OK) {
        run->n_trials++;
        refine(run, &ode, setting, trial, error);
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
    double size = 0;
    for (size_t k = 0; k < N_CANDIDATES && !best(run) && error->status == AD_OK; k++) {
        bool rounding = k == 0 || run->trial[0].estimate <= near * size;
        if (!rounding || (run->integrator && k > 0))
            break;
        try_candidate(run, run->integrator ? run->integrator->name : candidates[k], &size, error);
    }
    if (error->status != AD_OK)
        return error->status;
    struct simulate_trial *chosen = best(run);
    if (!chosen)
        return out_of_reach(run, error);
    chosen->chosen = true;
    chosen->searched -= chosen->evaluations; /* the answer itself */
    run->integrator = chosen->integrator;
    *(chosen->integrator->adaptive ? &run->tolerance : &run->dt) = chosen->setting;
    return AD_OK;
}

bool simulate_tighten(struct simulate_run *run, double error)
{
    for (size_t k = 0; k < run->n_trials; k++) {
        struct simulate_trial *trial = &run->trial[k];
        double next = predict(run, trial->integrator, trial->setting, error);
        if (!trial->chosen || !possible(run, trial->integrator, next))
            continue;
        trial->searched += trial->evaluations;
        trial->estimate = (double)NAN; /* of another run */
        trial->setting = next;
        *(trial->integrator->adaptive ? &run->tolerance : &run->dt) = next;
        return true;
    }
    return false;
}
