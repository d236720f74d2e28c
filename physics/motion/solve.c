/* Solves for a motion and measures its error (solve.h). */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "physics/integrators/stepper.h"
#include "solving.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 1000, SAMPLES_OF_MANY = 200, TRIES = 3 };

static const double default_tolerance = 1e-9;

static bool has_few(const struct phys_motion_solution *m)
{
    return m->system->bodies <= PHYS_MOTION_FEW;
}

/* ---- samples ---- */

static bool grow(struct phys_motion_solution *m)
{
    size_t room = m->room ? 2 * m->room : 256;
    bool grown = solving_widen(&m->t, room) && solving_widen(&m->energy, room) &&
                 solving_widen(&m->x, 2 * m->system->dof * room);
    m->room = grown ? room : m->room;
    return grown;
}

static bool sample(void *context, double t, const double *y)
{
    struct solving *s = context;
    struct phys_motion_solution *m = s->solution;
    const struct phys_ode *ode = &m->ode;
    if (m->n == m->room && !grow(m)) {
        s->failed = true;
        return false;
    }
    double *x = m->x + 2 * m->n * m->system->dof;
    m->t[m->n] = t;
    m->energy[m->n] = ode->energy ? ode->energy(ode->context, t, y) : (double)NAN;
    if (phys_ode_leave(ode, t, y, x, x + m->system->dof, &s->lost) != AD_OK)
        return false;
    m->n++;
    return !s->settings->progress || s->settings->progress(s->settings->context, t);
}

static void forget_samples(struct phys_motion_solution *m)
{
    AD_FREE(m->t, m->x, m->energy, m->distance, m->crossed.which, m->crossed.touch, m->crossed.t,
            m->crossed.x, m->crossed.uncertainty, m->crossed.constant);
    m->t = m->x = m->energy = m->distance = NULL;
    m->n = m->room = 0;
    m->crossed = (struct phys_crossed){0};
    m->error = m->error_end = m->reversal = m->known_until = m->seen = (double)NAN;
    m->reference_uncertainty = m->reference_reversal = m->reference_forward = (double)NAN;
    m->reference_tolerance = (double)NAN;
    m->worst_error = m->time_resolution = 0;
    m->time_unresolved = INFINITY;
    m->closest.distance = INFINITY;
}

void phys_motion_solution_free(struct phys_motion_solution *solution)
{
    if (!solution)
        return;
    forget_samples(solution);
    phys_ode_free(&solution->ode);
    free(solution->start);
    *solution = (struct phys_motion_solution){0};
}

/* ---- the motion ---- */

/* Samples between steps are interpolated: their energies are off by more than those of the steps.
 */
static void count_drift_of_samples(struct phys_motion_solution *m)
{
    const double start = m->info.energy_start, unit = start != 0 ? fabs(start) : 1;
    for (size_t i = 0; i < m->n; i++)
        m->info.energy_drift = fmax(m->info.energy_drift, fabs(m->energy[i] - start) / unit);
}

/* How many times as many samples the motion has while its error is measured, or that would depend
   on their number: of fixed steps no more than there are. Those that were asked for are among them.
 */
static size_t finer_samples(const struct phys_motion_solution *m,
                            const struct phys_motion_settings *settings, size_t samples)
{
    const double steps = m->integrator->adaptive ? INFINITY : settings->time / m->setting;
    if (!has_few(m) || settings->no_reference || settings->every == 1)
        return 1;
    if (settings->every) { /* all steps, or enough of them */
        size_t k = m->integrator->adaptive ? settings->every : 1;
        while (k < settings->every &&
               (settings->every % k || steps / (double)settings->every * (double)k < SAMPLES))
            k++;
        return k;
    }
    const double k = fmin(ceil((double)SAMPLES / (double)samples), floor(steps / (double)samples));
    return k > 1 ? (size_t)k : 1;
}

/* Leaves the samples that were asked for, and one where an event ended the motion. */
static void thin(struct phys_motion_solution *m, size_t times)
{
    const size_t columns = 2 * m->system->dof;
    size_t n = 0;
    for (size_t i = 0; times > 1 && i < m->n; i++) {
        if (i % times && !(i + 1 == m->n && m->info.stop == PHYS_SIMULATION_EVENT))
            continue;
        m->t[n] = m->t[i];
        m->energy[n] = m->energy[i];
        if (m->distance)
            m->distance[n] = m->distance[i];
        memmove(m->x + n++ * columns, m->x + i * columns, columns * sizeof *m->x);
    }
    m->n = times > 1 ? n : m->n;
}

static enum ad_status forward(struct solving *s, double *y, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    const struct phys_motion_settings *settings = s->settings;
    size_t n = settings->n_crossings;
    struct phys_simulation how = phys_simulation_of(m->integrator, m->setting, settings->time);
    struct phys_events *events = malloc((n + 1) * sizeof *events);
    struct crossing_watch *watches = malloc((n + 1) * sizeof *watches);
    m->crossed.constant = calloc(n + 1, sizeof *m->crossed.constant);
    if (!events || !watches || !m->crossed.constant)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (!has_few(m) || m->integrator->scheme->observe ||
             phys_closest_approach_begin(&m->ode, 0, y, &m->closest, error) == AD_OK) {
        phys_crossings_watch(s, watches, events);
        events[n] = m->closest.events;
        how.events = events;
        how.n_events = n + (m->closest.events.n > 0);
        how.n_samples = settings->n_samples ? settings->n_samples
                        : has_few(m)        ? SAMPLES
                                            : SAMPLES_OF_MANY;
        s->finer = finer_samples(m, settings, how.n_samples);
        how.every = settings->every / s->finer;
        how.n_samples *= settings->every ? 1 : s->finer;
        how.sample = sample;
        how.proceed = solving_proceed;
        how.context = s;
        how.watch_energy = true;
        if (phys_simulate(&how, &m->ode, y, &m->info, error) == AD_OK && n > 0)
            phys_crossings_settle(s, error);
        count_drift_of_samples(m);
    }
    phys_closest_approach_end(&m->closest);
    free(watches);
    free(events);
    if (s->lost.status != AD_OK)
        return ad_fail(error, s->lost.status, "%s", s->lost.message);
    if (s->failed)
        ad_fail(error, AD_E_MEMORY, "out of memory for samples and events");
    return error->status;
}

/* How far from the start the motion ends when it is run back. */
static enum ad_status reverse(struct solving *s, double *y, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    size_t dof = m->system->dof;
    struct phys_simulation how = phys_simulation_of(m->integrator, m->setting, 0);
    double sum = 0, *x = s->state;
    how.t0 = m->info.t;
    how.proceed = solving_proceed;
    how.context = s;
    if (phys_simulate(&how, &m->ode, y, NULL, error) != AD_OK ||
        phys_ode_leave(&m->ode, 0, y, x, x + dof, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < dof; k++)
        sum += pow(x[k] - m->start[k], 2);
    m->reversal = sqrt(sum);
    return AD_OK;
}

/* ---- all of it ---- */

static enum ad_status follow(struct solving *s, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    const struct phys_motion_settings *settings = s->settings;
    size_t dof = m->system->dof;
    double *y = malloc(4 * dof * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->state = y + 2 * dof;
    if (phys_ode_enter(&m->ode, 0, m->start, m->start + dof, y, error) == AD_OK &&
        forward(s, y, error) == AD_OK && settings->reverse)
        reverse(s, y, error);
    free(y);
    if (error->status == AD_OK && has_few(m) && !settings->no_reference)
        phys_motion_compare(s, error);
    if (error->status == AD_OK && has_few(m))
        phys_conserved(m->system, m->n, m->x, m->t, &m->conserved, error);
    thin(m, s->finer);
    return error->status;
}

enum ad_status phys_motion_refuse(const struct phys_motion_settings *settings,
                                  struct ad_error *error)
{
    if (!(settings->time > 0))
        return ad_fail(error, AD_E_ARGUMENT, "time: expected more than 0, got %g", settings->time);
    const double number[] = {settings->error, settings->dt, settings->tolerance};
    for (size_t k = 0; k < sizeof number / sizeof *number; k++)
        if (!(number[k] >= 0 && isfinite(number[k])))
            return ad_fail(error, AD_E_ARGUMENT, "%s: expected more than 0, or 0 for none, got %g",
                           (const char *[]){"error", "dt", "tolerance"}[k], number[k]);
    if (settings->n_crossings && !settings->crossings)
        return ad_fail(error, AD_E_ARGUMENT, "%zu crossings: got NULL", settings->n_crossings);
    return AD_OK;
}

static enum ad_status begin(struct solving *s, struct ad_error *error)
{
    const struct phys_motion_settings *settings = s->settings;
    struct phys_motion_solution *m = s->solution;
    const struct phys_scene *scene = m->system->scene;
    size_t dof = m->system->dof;
    if (phys_motion_refuse(settings, error) != AD_OK)
        return error->status;
    if (!(m->start = calloc(2 * dof, sizeof *m->start)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_motion_start(m->system, settings->seed, settings->q, settings->v, m->start, error) !=
        AD_OK)
        return error->status;
    m->integrator = settings->integrator;
    if (!m->integrator && !(settings->error > 0))
        m->integrator = phys_integrator_find("dop853", error);
    bool adaptive = m->integrator && m->integrator->adaptive;
    m->setting = adaptive ? settings->tolerance : settings->dt;
    if (!(m->setting > 0) && settings->error > 0)
        return phys_motion_choose(s, error);
    if (!(m->setting > 0))
        m->setting = adaptive ? default_tolerance : scene->dt;
    return error->status;
}

static void run(struct solving *s, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    const struct phys_scene *scene = m->system->scene;
    /* a scene's own equations define its friction */
    m->keeps_energy = m->ode.friction == 0 && (scene->ode || phys_keeps_energy(m->system, error));
    for (int k = 0; follow(s, error) == AD_OK && k + 1 < TRIES; k++) {
        struct ad_error missed = {0};
        if (phys_motion_met(s->settings, m, &missed) == AD_OK || isnan(m->error) ||
            m->reference_uncertainty > s->settings->error ||
            !phys_motion_tighten(s, m->error, error))
            break;
        forget_samples(m);
    }
}

enum ad_status phys_motion_solve(const struct phys_system *system,
                                 const struct phys_motion_settings *settings,
                                 struct phys_motion_solution *solution, struct ad_error *error)
{
    struct phys_motion_solution *m = solution;
    struct solving s = {.solution = m};
    if (AD_LACKS(error, solution))
        return error->status;
    *m = (struct phys_motion_solution){.system = system};
    forget_samples(m);
    if (AD_LACKS(error, system, system->scene, settings))
        return error->status;
    AD_OWN(phys_motion_settings, settings, context, error);
    s.settings = settings;
    if (begin(&s, error) == AD_OK && phys_ode_for(system, m->integrator, &m->ode, error) == AD_OK)
        run(&s, error);
    struct ad_error start = {0};
    if (error->status != AD_OK && m->info.steps == 0 && m->start && !s.interrupted &&
        phys_motion_check_start(system, 0, m->start, m->start + system->dof, &start) ==
            AD_E_ARGUMENT)
        *error = start;
    return error->status;
}

enum ad_status phys_motion_met(const struct phys_motion_settings *settings,
                               const struct phys_motion_solution *solution, struct ad_error *error)
{
    const struct phys_motion_solution *m = solution;
    if (AD_LACKS(error, settings, solution))
        return error->status;
    AD_OWN(phys_motion_settings, settings, context, error);
    if (m->n_trials > 0 && isfinite(m->time_unresolved))
        return ad_fail(
            error, AD_E_ACCURACY,
            "an error of %g: cannot be verified, from t = %.6g on the forces change with "
            "time too often to be followed; try a shorter time",
            settings->error, m->time_unresolved);
    if (m->n_trials == 0 || isnan(m->known_until) || m->error <= settings->error)
        return AD_OK;
    if (isfinite(m->known_until))
        return ad_fail(error, AD_E_ACCURACY,
                       "an error of %g: cannot be verified, the reference is lost at t = %.6g; "
                       "try a shorter time",
                       settings->error, m->known_until);
    if (m->reference_uncertainty > settings->error)
        return ad_fail(error, AD_E_ACCURACY,
                       "an error of %g: cannot be verified, rounding leaves the reference known to "
                       "%.3g; allow a larger error",
                       settings->error, m->reference_uncertainty);
    return ad_fail(error, AD_E_ACCURACY,
                   "an error of %g: missed, got %.3g: rounding, or a force that acts for less than "
                   "a step of %.3g; try gauss4 with fixed steps",
                   settings->error, m->error, m->info.max_step);
}
