/* A simulation run and measured (simulate.h). */
#include "simulate.h"
#include "apps/interrupt.h"
#include "apps/output/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 1000, SAMPLES_OF_MANY = 200 };

static const double reference_tolerance = 1e-13;

/* ---- samples ---- */

static bool grow(struct simulate_samples *s)
{
    size_t room = s->room ? 2 * s->room : 256, row = 2 * s->dof;
    double *t = realloc(s->t, room * sizeof *t);
    if (t)
        s->t = t;
    double *energy = realloc(s->energy, room * sizeof *energy);
    if (energy)
        s->energy = energy;
    double *x = room <= SIZE_MAX / sizeof *x / row ? realloc(s->x, room * row * sizeof *x) : NULL;
    if (x)
        s->x = x;
    s->room = t && energy && x ? room : s->room;
    return t && energy && x;
}

bool simulate_sample(void *samples, double t, const double *y)
{
    struct simulate_samples *s = samples;
    const struct phys_ode *ode = s->ode;
    struct ad_error error = {0};
    if (s->n == s->room && !grow(s)) {
        s->failed = true;
        return false;
    }
    double *x = s->x + 2 * s->n * s->dof;
    s->t[s->n] = t;
    s->energy[s->n] = ode->energy ? ode->energy(ode->context, t, y) : (double)NAN;
    if (phys_ode_leave(ode, t, y, x, x + s->dof, &error) != AD_OK) {
        s->failed = true;
        return false;
    }
    s->n++;
    return !s->progress || s->progress(s->context, t);
}

void simulate_samples_free(struct simulate_samples *samples)
{
    free(samples->t);
    free(samples->x);
    free(samples->energy);
    *samples = (struct simulate_samples){0};
}

void simulate_result_free(struct simulate_result *result)
{
    simulate_samples_free(&result->samples);
    event_answers_free(&result->events);
    free(result->distance);
}

/* ---- the run ---- */

struct watch {
    struct progress progress;
    double time;
};

static bool watch(void *context, double t)
{
    struct watch *w = context;
    if (progress_due(&w->progress))
        progress_line(&w->progress, "t = %.6g of %.6g", t, w->time);
    return !interrupted();
}

static void choose_samples(const struct simulate_run *run, struct phys_simulation *settings)
{
    const struct simulate_options *options = run->options;
    if (run->tables.n)
        settings->n_samples = run->tables.days;
    else if (options->every != OPTION_NO_COUNT)
        settings->every = options->every;
    else
        settings->n_samples = options->samples != OPTION_NO_COUNT ? options->samples
                              : simulate_few(run)                 ? SAMPLES
                                                                  : SAMPLES_OF_MANY;
}

/* The run itself; its settings know tolerance and events. */
static void follow(const struct simulate_run *run, struct phys_simulation *settings, double *y,
                   struct simulate_result *result, struct ad_error *error)
{
    struct watch w = {.time = run->time};
    choose_samples(run, settings);
    progress_start(&w.progress, run->options->common.quiet);
    result->samples = (struct simulate_samples){
        .ode = &run->ode, .dof = run->system.dof, .progress = watch, .context = &w};
    settings->sample = simulate_sample;
    settings->context = &result->samples;
    settings->watch_energy = true;
    phys_simulate(settings, &run->ode, y, &result->info, error);
    progress_end(&w.progress);
}

static enum ad_status forward(const struct simulate_run *run, double *y, double *scale,
                              struct simulate_result *result, struct ad_error *error)
{
    const struct phys_ode *ode = &run->ode;
    struct phys_simulation settings;
    struct phys_approach *approach = NULL;
    struct event_watch *watches = NULL;
    size_t n = run->questions.n;
    struct phys_events *events = malloc((n + 1) * sizeof *events);
    double setting = run->integrator->adaptive ? run->tolerance : run->dt;
    if (!events)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_ode_enter(ode, 0, run->q, run->v, y, error) == AD_OK &&
             simulate_settings(run, run->integrator, setting, ode, y, scale, &settings, error) ==
                 AD_OK &&
             event_watch_all(&run->questions, ode, &result->events, &watches, events, error) ==
                 AD_OK &&
             (!simulate_few(run) || phys_approach_new(ode, 0, y, &approach, error) == AD_OK)) {
        settings.events = events;
        settings.n_events = n + (approach != NULL);
        if (approach)
            events[n] = *phys_approach_events(approach);
        follow(run, &settings, y, result, error);
    }
    if (approach)
        result->closest = phys_approach_closest(approach);
    phys_approach_free(approach);
    event_watches_free(watches);
    free(events);
    if (result->samples.failed || result->events.failed)
        ad_fail(error, AD_E_MEMORY, "out of memory for samples and events");
    return error->status;
}

/* How far from the start the motion ends when it is run back. */
static enum ad_status reverse(const struct simulate_run *run, double *y, double *scale,
                              struct simulate_result *result, struct ad_error *error)
{
    const struct phys_ode *ode = &run->ode;
    struct phys_simulation settings;
    struct phys_simulation_info info;
    double *x = malloc(2 * run->system.dof * sizeof *x), sum = 0;
    double setting = run->integrator->adaptive ? run->tolerance : run->dt;
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (simulate_settings(run, run->integrator, setting, ode, y, scale, &settings, error) ==
        AD_OK) {
        settings.t0 = result->info.t;
        settings.t1 = 0;
        if (phys_simulate(&settings, ode, y, &info, error) == AD_OK)
            phys_ode_leave(ode, 0, y, x, x + run->system.dof, error);
    }
    for (size_t k = 0; k < run->system.dof; k++)
        sum += (x[k] - run->q[k]) * (x[k] - run->q[k]);
    result->reversal = sqrt(sum);
    free(x);
    return error->status;
}

/* ---- comparison ---- */

/* The same samples, found by a run of small tolerance. */
static enum ad_status follow_reference(const struct simulate_run *run,
                                       const struct simulate_samples *found,
                                       const struct phys_ode *ode, double *y, double *scale,
                                       struct simulate_samples *reference, struct ad_error *error)
{
    struct phys_simulation settings;
    struct phys_simulation_info info;
    const struct phys_integrator *method = phys_integrator_find("dop853", error);
    *reference = (struct simulate_samples){.ode = ode, .dof = found->dof};
    if (phys_ode_enter(ode, 0, run->q, run->v, y, error) != AD_OK ||
        simulate_settings(run, method, reference_tolerance, ode, y, scale, &settings, error) !=
            AD_OK)
        return error->status;
    settings.t1 = found->t[found->n - 1];
    settings.times = found->t + 1;
    settings.n_samples = found->n - 1;
    settings.sample = simulate_sample;
    settings.context = reference;
    if (found->n > 1 && phys_simulate(&settings, ode, y, &info, error) != AD_OK) {
        struct ad_error cause = *error;
        *error = (struct ad_error){0};
        ad_fail(error, cause.status, "the reference run: %.200s (--no-reference leaves it out)",
                cause.message);
    }
    return error->status;
}

static void measure_distance(const struct simulate_samples *reference,
                             struct simulate_result *result)
{
    const struct simulate_samples *found = &result->samples;
    size_t row = 2 * found->dof;
    for (size_t i = 0; i < reference->n && i < found->n; i++) {
        double sum = 0;
        for (size_t k = 0; k < found->dof; k++)
            sum += pow(found->x[i * row + k] - reference->x[i * row + k], 2);
        result->distance[i] = result->error_end = sqrt(sum);
        result->error = fmax(result->error, result->error_end);
    }
}

/* Distances of coordinates at every sample from what is known better. */
static enum ad_status compare(const struct simulate_run *run, struct simulate_result *result,
                              double *y, double *scale, struct ad_error *error)
{
    struct phys_ode ode = {0};
    struct simulate_samples reference = {0};
    result->distance = calloc(result->samples.n, sizeof *result->distance);
    if (!result->distance)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (run->tables.n)
        return simulate_ephemeris_compare(run, result, error);
    if (phys_ode_lagrangian(&run->system, &ode, error) == AD_OK)
        follow_reference(run, &result->samples, &ode, y, scale, &reference, error);
    measure_distance(&reference, result);
    simulate_samples_free(&reference);
    phys_ode_free(&ode);
    return error->status;
}

static enum ad_status total(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error)
{
    const struct simulate_samples *s = &result->samples;
    phys_legendre *legendre;
    if (phys_legendre_new(&run->system, &legendre, error) != AD_OK)
        return error->status;
    const double *end = s->x + 2 * (s->n - 1) * s->dof;
    phys_totals(legendre, run->q, run->v, 0, &result->start);
    phys_totals(legendre, end, end + s->dof, s->t[s->n - 1], &result->end);
    result->has_totals = result->start.mass != 0;
    phys_legendre_free(legendre);
    return AD_OK;
}

enum ad_status simulate_run(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error)
{
    *result = (struct simulate_result){
        .error = NAN, .error_end = NAN, .reversal = NAN, .closest = {.distance = INFINITY}};
    size_t n = run->ode.n;
    double *y = malloc(2 * n * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *scale = y + n;
    if (forward(run, y, scale, result, error) == AD_OK && run->options->reverse)
        reverse(run, y, scale, result, error);
    bool few = simulate_few(run);
    if (error->status == AD_OK && few)
        total(run, result, error);
    if (error->status == AD_OK && few && !run->options->no_reference)
        compare(run, result, y, scale, error);
    if (error->status == AD_OK)
        simulate_gas(run, result, error);
    free(y);
    return error->status;
}
