/* A simulation run and measured (simulate.h). */
#include "simulate.h"
#include "apps/interrupt.h"
#include "apps/output/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 1000, SAMPLES_OF_MANY = 200, MOST_COMPARED = 4000 };

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

static bool proceed(void *unused)
{
    (void)unused;
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
    settings->proceed = proceed;
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
        settings.proceed = proceed;
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

/* Of many samples every so many are compared, and the last: the reference lands on each. */
struct compared {
    size_t stride, n;
    double *times; /* [n] */
};

static size_t sample_of(const struct compared *c, const struct simulate_samples *s, size_t i)
{
    return i + 1 == c->n ? s->n - 1 : i * c->stride;
}

static enum ad_status choose_compared(const struct simulate_samples *s, struct compared *c,
                                      struct ad_error *error)
{
    c->stride = (s->n + MOST_COMPARED - 1) / MOST_COMPARED;
    c->n = (s->n - 1 + c->stride - 1) / c->stride + 1;
    if (!(c->times = malloc(c->n * sizeof *c->times)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < c->n; i++)
        c->times[i] = s->t[sample_of(c, s, i)];
    return AD_OK;
}

/* Distances, to which the reference's own uncertainty is added: bounds as far as that is one. From
   the horizon on none are known. */
static void measure_distance(const struct phys_reference *reference, const struct compared *c,
                             struct simulate_result *result)
{
    const struct simulate_samples *found = &result->samples;
    size_t row = 2 * found->dof;
    for (size_t i = 0; i < found->n; i++)
        result->distance[i] = (double)NAN;
    result->error = result->error_end = result->reference_uncertainty = 0;
    for (size_t i = 0; i < reference->n; i++) {
        double sum = 0;
        size_t at = sample_of(c, found, i);
        if (found->t[at] >= reference->horizon)
            break;
        for (size_t k = 0; k < found->dof; k++)
            sum += pow(found->x[at * row + k] - reference->x[i * row + k], 2);
        result->reference_uncertainty =
            fmax(result->reference_uncertainty, reference->uncertainty[i]);
        result->distance[at] = result->error_end = sqrt(sum) + reference->uncertainty[i];
        result->error = fmax(result->error, result->error_end);
    }
    result->known_until = reference->horizon;
    result->reference_reversal = reference->reversal;
    result->seen = reference->seen;
    result->size = reference->size;
    if (isfinite(reference->horizon))
        result->error = result->error_end = (double)NAN;
}

/* Distances of coordinates at the samples from what is known better. */
static enum ad_status compare(const struct simulate_run *run, struct simulate_result *result,
                              struct ad_error *error)
{
    struct phys_reference reference = {0};
    struct compared c = {0};
    struct ad_error cause = {0};
    if (result->samples.n < 2 && !run->tables.n)
        return AD_OK; /* it did not begin */
    result->distance = calloc(result->samples.n, sizeof *result->distance);
    if (!result->distance)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (run->tables.n)
        return simulate_ephemeris_compare(run, result, error);
    if (choose_compared(&result->samples, &c, error) == AD_OK &&
        phys_reference(&run->system, run->q, run->v, c.n, c.times, simulate_lost, proceed, NULL,
                       &reference, &cause) == AD_OK)
        measure_distance(&reference, &c, result);
    else if (interrupted())
        result->info.stop = PHYS_SIMULATION_INTERRUPTED;
    else if (cause.status != AD_OK)
        ad_fail(error, cause.status, "the reference run: %.200s (--no-reference leaves it out)",
                cause.message);
    if (isnan(result->known_until)) { /* nothing was measured */
        free(result->distance);
        result->distance = NULL;
    }
    phys_reference_free(&reference);
    free(c.times);
    return error->status;
}

enum ad_status simulate_run(const struct simulate_run *run, struct simulate_result *result,
                            struct ad_error *error)
{
    *result = (struct simulate_result){.error = NAN,
                                       .error_end = NAN,
                                       .reversal = NAN,
                                       .known_until = NAN,
                                       .seen = NAN,
                                       .reference_uncertainty = NAN,
                                       .reference_reversal = NAN,
                                       .closest = {.distance = INFINITY}};
    size_t n = run->ode.n;
    double *y = malloc(2 * n * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *scale = y + n;
    result->gas.on = strcmp(run->system.scene->name, "gas") == 0;
    /* the gas has equations of its own, whose friction is known */
    result->keeps_energy =
        run->ode.friction == 0 && (result->gas.on || phys_keeps_energy(&run->system));
    if (forward(run, y, scale, result, error) == AD_OK && run->options->reverse)
        reverse(run, y, scale, result, error);
    bool few = simulate_few(run);
    if (error->status == AD_OK && few && !run->options->no_reference)
        compare(run, result, error);
    const struct simulate_samples *s = &result->samples;
    if (error->status == AD_OK && few)
        phys_conserved(&run->system, s->n, s->x, s->t, &result->conserved, error);
    if (error->status == AD_OK)
        simulate_gas(run, result, error);
    free(y);
    return error->status;
}
