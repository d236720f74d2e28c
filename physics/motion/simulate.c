/* The driver of a simulation: steps, events, samples and energy. */
#include "physics/lagrangian/constraints.h"
#include "physics/ode/internal.h"
#include "run.h"
#include "autodiff/sized.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static enum ad_status begin(struct run *run, const struct phys_ode *ode, const double *y,
                            struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    double span = s->t1 - s->t0;
    run->direction = span < 0 ? -1 : 1;
    if (phys_stepper_begin(&run->stepper, s->integrator, ode, y, error) != AD_OK)
        return error->status;
    run->stepper.t = s->t0;
    if (!(run->point = calloc(ode->n, sizeof *run->point)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_run_events_begin(run, error) != AD_OK)
        return error->status;
    if (s->integrator->adaptive)
        return s->dt > 0 ? (run->h = run->direction * s->dt, AD_OK)
                         : phys_run_first_step(run, error);
    run->n_steps = (size_t)ceil(fabs(span) / s->dt * (1 - 1e-9));
    if (run->n_steps == 0)
        run->n_steps = span != 0;
    return AD_OK;
}

static void release(struct run *run)
{
    phys_stepper_end(&run->stepper);
    free(run->point);
    phys_run_events_end(run);
}

static void interrupt(struct run *run)
{
    run->stop = true;
    run->info->stop = PHYS_SIMULATION_INTERRUPTED;
}

static double clock_of(const struct run *run) { return run->begun > 0 ? ad_now() : 0; }

static void give(struct run *run, double t, const double *y)
{
    const struct phys_simulation *s = run->settings;
    run->info->samples++;
    if (!s->sample)
        return;
    double before = clock_of(run);
    run->given = t == run->end;
    if (!s->sample(s->context, t, y))
        interrupt(run);
    run->away += clock_of(run) - before;
}

/* After which of the fixed steps the next sample is due. */
static size_t step_of_sample(const struct run *run)
{
    double share = (double)run->next_sample / (double)run->settings->n_samples;
    return (size_t)floor(share * (double)run->n_steps + 0.5);
}

/* Whether a sample is due after this many fixed steps: the nearest to its time. Of several that
   share a step one is given. */
static bool due(struct run *run)
{
    size_t step = 0;
    for (; run->next_sample <= run->settings->n_samples; run->next_sample++) {
        const size_t next = step_of_sample(run);
        if (next > run->info->steps)
            break;
        step = next;
    }
    return step == run->info->steps;
}

bool phys_run_looks(const struct run *run)
{
    const struct phys_simulation *s = run->settings;
    const size_t steps = run->info->steps + 1;
    return s->n_events > 0 || steps == run->n_steps ||
           (s->every > 0 ? steps % s->every == 0
                         : run->next_sample <= s->n_samples && step_of_sample(run) <= steps);
}

double phys_run_sample_time(const struct run *run, size_t i)
{
    const struct phys_simulation *s = run->settings;
    if (s->times)
        return s->times[i - 1];
    return i == s->n_samples ? s->t1 : s->t0 + (s->t1 - s->t0) * (double)i / (double)s->n_samples;
}

static void set_due(struct run *run)
{
    run->due = run->next_sample <= run->settings->n_samples
                   ? phys_run_sample_time(run, run->next_sample)
                   : run->direction * INFINITY;
}

/* Samples at times within an adaptive step, and at its end. */
static enum ad_status sample_within(struct run *run, struct ad_error *error)
{
    double theta;
    while (phys_run_sample_within(run, &theta)) {
        if (phys_run_dense(run, theta, error) != AD_OK)
            return error->status;
        phys_run_give_within(run, run->point);
    }
    if (run->due == run->end && run->info->stop != PHYS_SIMULATION_INTERRUPTED)
        phys_run_give_within(run, run->stepper.next);
    return AD_OK;
}

/* The samples that this step reaches; its end is settled, `steps` counts it. */
static enum ad_status sample(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    const double *next = run->stepper.next;
    run->given = false;
    if (s->every > 0) {
        if (run->info->steps % s->every == 0)
            give(run, run->end, next);
    } else if (!s->integrator->adaptive) {
        if (due(run))
            give(run, run->end, next);
    } else {
        sample_within(run, error);
    }
    if (run->info->stop == PHYS_SIMULATION_EVENT && !run->given && (s->every || s->n_samples))
        give(run, run->end, next);
    return error->status;
}

enum { THIN = 24 }; /* numbers of a state whose energy takes little time */

static void watch_energy(struct run *run, double t, const double *y)
{
    const struct phys_ode *ode = run->stepper.ode;
    struct phys_simulation_info *info = run->info;
    if (!run->settings->watch_energy || !ode->energy || run->unseen)
        return;
    const bool timed = ode->n > THIN; /* else the clock takes as long */
    double before = timed ? clock_of(run) : 0, E = ode->energy(ode->context, t, y);
    if (info->steps == 0)
        info->energy_start = E;
    double drift = fabs(E - info->energy_start);
    if (info->energy_start != 0)
        drift /= fabs(info->energy_start);
    if (!(drift <= info->energy_drift))
        info->energy_drift = drift;
    if (timed)
        run->away += clock_of(run) - before;
}

/* Adaptive steps look at themselves; those of fixed length are looked at here. */
static enum ad_status check_finite(const struct run *run, struct ad_error *error)
{
    const struct phys_stepper *m = &run->stepper;
    char name[64];
    double none = 0; /* NaN if one is not */
    for (size_t k = 0; k < m->n; k++)
        none += 0 * m->next[k];
    for (size_t k = 0; none != 0 && k < m->n; k++)
        if (!isfinite(m->next[k])) {
            phys_ode_component(m->ode, k, name, sizeof name);
            return ad_fail(error, AD_E_NONFINITE,
                           "step %zu: %s is no longer finite at t = %.9g: the step of %.3g is too "
                           "long for this motion, or the motion ends there",
                           run->info->steps + 1, name, m->t + m->h, fabs(m->h));
        }
    return AD_OK;
}

static void count(struct phys_simulation_info *info, double h)
{
    h = fabs(h);
    info->steps++;
    if (info->steps == 1 || h < info->min_step)
        info->min_step = h;
    info->max_step = phys_larger(info->max_step, h);
}

/* Where the step ends; the last one ends at t1 to the last bit. */
static double end_of_step(const struct run *run)
{
    const struct phys_simulation *s = run->settings;
    const struct phys_stepper *m = &run->stepper;
    if (run->stop)
        return m->t + m->h;
    if (s->integrator->adaptive)
        return run->last ? run->target : s->integrator->scheme->longest ? m->end : m->t + m->h;
    if (run->info->steps == run->n_steps)
        return s->t1;
    return s->t0 + (s->t1 - s->t0) * ((double)run->info->steps / (double)run->n_steps);
}

/* Sizes follow the motion: of each component, or of each half. */
static void grow_sizes(struct run *run)
{
    const struct phys_stepper *m = &run->stepper;
    const size_t group = run->halves ? m->n / 2 : 1;
    for (size_t first = 0; run->growing && first < m->n; first += group) {
        double size = 0, next = 0;
        for (size_t k = first; k < first + group; k++) {
            size = phys_larger(run->growing[k], size);
            next = phys_larger(fabs(m->next[k]), next);
        }
        for (size_t k = first; next > size && k < first + group; k++)
            run->growing[k] = size > 0 ? run->growing[k] * (next / size) : next; /* of one ratio */
    }
}

static enum ad_status out_of_steps(const struct run *run, struct ad_error *error)
{
    const struct phys_stepper *m = &run->stepper;
    char name[64];
    phys_ode_component(m->ode, m->worst, name, sizeof name);
    return ad_fail(error, AD_E_ACCURACY,
                   "%zu steps did not get beyond t = %.9g, where %s = %.6g changes fastest: a "
                   "collision or another singularity, or many periods; stop before it, or soften "
                   "the law",
                   run->info->steps, m->t, name, m->y[m->worst]);
}

/* Onto the constraints, where the method does not keep them itself. */
static enum ad_status project(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    phys_motion *motion = phys_ode_constrained_motion(m->ode);
    if (m->ode->project && !m->integrator->scheme->constrains) {
        m->has_next_rate = false;
        m->ode->project(m->ode->context, m->t + m->h, m->next, error);
    }
    return error->status == AD_OK && motion
               ? phys_motion_check_step(motion, m->t, m->h, m->y, m->next, error)
               : error->status;
}

enum ad_status phys_run_settle(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    run->dense = false;
    if (check_finite(run, error) != AD_OK || project(run, error) != AD_OK)
        return error->status;
    run->whole = m->h;
    if (phys_run_events(run, error) != AD_OK)
        return error->status;
    count(run->info, m->h);
    run->end = end_of_step(run);
    grow_sizes(run);
    watch_energy(run, run->end, m->next);
    return AD_OK;
}

bool phys_run_sample_within(const struct run *run, double *theta)
{
    if (!((run->due - run->end) * run->direction < 0) || run->settings->every ||
        run->info->stop == PHYS_SIMULATION_INTERRUPTED)
        return false;
    *theta = ((run->due - run->stepper.t) - run->late) / run->whole;
    return true;
}

void phys_run_give_within(struct run *run, const double *y)
{
    give(run, run->due, y);
    run->next_sample++;
    set_due(run);
}

enum ad_status phys_run_pass(struct run *run, struct ad_error *error)
{
    if (sample(run, error) == AD_OK)
        phys_stepper_accept(&run->stepper, run->end);
    run->late = run->next_late;
    return error->status;
}

enum ad_status phys_run_accept(struct run *run, struct ad_error *error)
{
    return phys_run_settle(run, error) == AD_OK ? phys_run_pass(run, error) : error->status;
}

bool phys_run_goes_on(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    if (run->stop)
        return false;
    if (run->stepper.t == s->t1)
        run->info->stop = PHYS_SIMULATION_END;
    else if (s->max_steps && run->info->steps == s->max_steps)
        out_of_steps(run, error);
    else if (s->proceed && !s->proceed(s->context))
        interrupt(run);
    else
        return true;
    return false;
}

enum ad_status phys_run_open(struct run *run, const struct phys_simulation *settings,
                             const struct phys_ode *ode, const double *y,
                             struct phys_simulation_info *info, bool timed, struct ad_error *error)
{
    *run = (struct run){.own = *settings, .info = info, .last_norm = 1e-4};
    run->settings = &run->own;
    *info = (struct phys_simulation_info){.t = settings->t0};
    if (phys_run_check(settings, ode->n, error) != AD_OK ||
        (settings->integrator->adaptive &&
         phys_run_sizes(run, &run->own, ode, y, &run->sizes, error) != AD_OK))
        return error->status;
    run->tolerance = (struct phys_tolerance){run->own.rtol, run->own.atol, run->own.scale};
    run->begun = timed ? ad_now() : 0;
    if (begin(run, ode, y, error) != AD_OK)
        return error->status;
    watch_energy(run, run->stepper.t, run->stepper.y);
    if (settings->every || settings->n_samples)
        give(run, run->stepper.t, run->stepper.y);
    run->next_sample = 1;
    set_due(run);
    return AD_OK;
}

void phys_run_close(struct run *run, double *y)
{
    struct phys_simulation_info *info = run->info;
    struct phys_stepper *m = &run->stepper;
    struct ad_error none = {0};
    if (run->unseen)
        m->integrator->scheme->observe(m, m->t, m->y, &none);
    info->seconds = run->begun > 0 ? ad_now() - run->begun - run->away : 0;
    if (m->memory) {
        memcpy(y, m->y, m->n * sizeof *y);
        info->t = m->t;
        info->evaluations = m->evaluations;
        info->interpolations = m->interpolations;
    }
    release(run);
    free(run->sizes);
}

enum ad_status phys_simulate(const struct phys_simulation *settings, const struct phys_ode *ode,
                             double *y, struct phys_simulation_info *info, struct ad_error *error)
{
    struct phys_simulation_info unwanted = {0};
    struct run run;
    if (AD_LACKS(error, settings, settings->integrator, ode, ode->field, y))
        return error->status;
    AD_OWN(phys_simulation, settings, proceed, error);
    if (phys_run_open(&run, settings, ode, y, info ? info : &unwanted, true, error) == AD_OK)
        while (phys_run_goes_on(&run, error))
            if (phys_run_step(&run, error) != AD_OK || phys_run_accept(&run, error) != AD_OK)
                break;
    phys_run_close(&run, y);
    return error->status;
}
