/* A member of an ensemble in a place (ensemble_place.h): its start, its samples, its result. */
#include "physics/linear/vectors.h"
#include "ensemble_place.h"
#include "autodiff/ascending.h"
#include "autodiff/free.h"

#include <float.h>
#include <math.h>

static const double finer = 1e-2, least_tolerance = 1e-16, caution = 2;

/* ---- the ends of steps ---- */

void phys_place_track(struct ensemble_place *place)
{
    struct ensemble_track *track = &place->track;
    const struct phys_stepper *m = &place->run.stepper;
    const size_t dof = place->task->ensemble->dof, columns = 1 + 2 * dof;
    if (!phys_ensemble_measures(place->task) || place->fine || place->error.status != AD_OK)
        return;
    if (track->n == track->room) {
        const size_t room = track->room ? 2 * track->room : 64;
        if (!solving_widen(&track->x, room * columns)) {
            ad_fail(&place->error, AD_E_MEMORY, "out of memory");
            return;
        }
        track->room = room;
    }
    double *x = track->x + columns * track->n++;
    x[0] = m->t;
    phys_ode_leave(&place->solution.ode, m->t, m->y, x + 1, x + 1 + dof, &place->solving.lost);
}

/* The times of the ensemble and of the track, in order; returns how many. */
static size_t merge_times(struct ensemble_place *place)
{
    const struct phys_ensemble *e = place->task->ensemble;
    const struct ensemble_track *track = &place->track;
    const size_t columns = 1 + 2 * e->dof;
    size_t n = 0;
    if (!solving_widen(&place->times, e->n_times + track->n)) {
        ad_fail(&place->error, AD_E_MEMORY, "out of memory");
        return 0;
    }
    for (size_t i = 1, k = 0; i < e->n_times || k < track->n;) {
        const double a = i < e->n_times ? e->t[i] : (double)INFINITY;
        const double b = k < track->n ? track->x[k * columns] : (double)INFINITY;
        i += a <= b;
        k += b <= a;
        place->times[n++] = fmin(a, b);
    }
    return n;
}

static bool compare_tracks(struct ensemble_place *place, double t, const double *y)
{
    const struct ensemble_track *track = &place->track;
    const size_t dof = place->task->ensemble->dof;
    const double *x = track->x + place->tracked * (1 + 2 * dof);
    if (place->tracked == track->n || t != x[0])
        return true;
    double *mine = place->x + 2 * dof * place->task->ensemble->n_times;
    if (phys_ode_leave(&place->solution.ode, t, y, mine, mine + dof, &place->solving.lost) != AD_OK)
        return false;
    const double apart = phys_distance(dof, x + 1, mine);
    place->apart = apart <= place->apart ? place->apart : apart;
    place->tracked++;
    return true;
}

/* ---- runs ---- */

static bool take_sample(void *context, double t, const double *y)
{
    struct ensemble_place *place = context;
    struct phys_motion_solution *m = &place->solution;
    const struct phys_ensemble *e = place->task->ensemble;
    const size_t dof = e->dof;
    if (m->n < e->n_times && t == e->t[m->n]) { /* else where an event ends the motion */
        double *x = m->x + 2 * dof * m->n;
        m->n += phys_ode_leave(&m->ode, t, y, x, x + dof, &place->solving.lost) == AD_OK;
    }
    return place->solving.lost.status == AD_OK && (!place->fine || compare_tracks(place, t, y));
}

void phys_place_leave(struct ensemble_place *place)
{
    phys_crossed_clear(&place->solution.crossed);
    phys_ode_free(&place->own);
    phys_system_close(&place->system);
    phys_time_scan_free(&place->scan);
    place->own = (struct phys_ode){0};
    place->system = (struct phys_system){0};
}

/* Times at which the forces change abruptly, and equal parts, within which the scan is blind to
   slow changes. */
static void scan_time(const struct phys_system *system, const double *start, double time,
                      struct phys_time_scan *scan, struct ad_error *error)
{
    enum { PARTS = 256 };
    if (phys_time_scan(system, start, start + system->dof, 0, time, scan, error) != AD_OK ||
        !(scan->resolution > 0))
        return;
    double *times = realloc(scan->times, (scan->n + PARTS) * sizeof *times);
    if (!times) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return;
    }
    scan->times = times;
    for (size_t k = 1; k < PARTS; k++)
        times[scan->n++] = time * (double)k / PARTS;
    qsort(times, scan->n, sizeof *times, ad_ascending);
}

/* Steps end where L changes with time, or both runs of a member would step over the same pulse. */
static void land(struct ensemble_worker *w, struct ensemble_place *place, const double *start)
{
    const struct ensemble_task *task = w->task;
    const struct phys_ensemble *e = task->ensemble;
    const bool own = task->has_parameters;
    struct phys_time_scan *scan = own ? &place->scan : &w->scan;
    place->blind = false;
    if (e->system->scene->ode)
        return;
    if (own || !w->scanned)
        scan_time(own ? &place->system : e->system, start, task->settings->motion->time, scan,
                  &place->error);
    w->scanned = !own;
    place->blind = scan->n > 0 && isfinite(scan->unresolved);
    place->run.landings = scan->times;
    place->run.n_landings = scan->n;
}

static const struct phys_ode *ode_of(struct ensemble_worker *w, struct ensemble_place *place)
{
    const struct ensemble_task *task = w->task;
    const struct phys_integrator *method = task->ensemble->integrator;
    struct ad_error *error = &place->error;
    if (!task->has_parameters) {
        const struct phys_ensemble *e = task->ensemble;
        if (!w->ode.context && phys_ode_for(e->system, method, &w->ode, error) == AD_OK &&
            !e->system->scene->ode)
            w->energy = phys_ensemble_energy_new(e->system, e->n_times, e->t);
        place->energy = w->energy;
        return &w->ode;
    }
    if (phys_ensemble_system(task, place->member, &place->system, error) == AD_OK)
        phys_ode_for(&place->system, method, &place->own, error);
    return &place->own;
}

static struct phys_simulation how_of(struct ensemble_place *place)
{
    const struct ensemble_task *task = place->task;
    const struct phys_ensemble *e = task->ensemble;
    const double tolerance = e->member[place->member].tolerance;
    struct phys_simulation how = phys_simulation_of(
        e->integrator, place->fine ? fmax(tolerance * finer, least_tolerance) : tolerance,
        task->settings->motion->time);
    how.n_samples = place->fine ? merge_times(place) : e->n_times - 1;
    how.times = place->fine ? place->times : NULL;
    how.sample = take_sample;
    how.proceed = task->settings->motion->proceed;
    how.context = place;
    how.events = place->events;
    how.n_events = task->settings->motion->n_crossings;
    return how;
}

/* proceed has the caller's context, samples have the place. */
static bool proceed(void *context)
{
    const struct ensemble_place *place = context;
    const struct phys_motion_settings *s = place->task->settings->motion;
    return s->proceed(s->context);
}

void phys_place_enter(struct ensemble_worker *w, struct ensemble_place *place)
{
    const struct ensemble_task *task = w->task;
    const struct phys_motion_settings *settings = task->settings->motion;
    struct phys_ensemble *e = task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    const double *start = e->start + 2 * e->dof * place->member;
    phys_place_leave(place);
    place->again = false;
    place->tracked = 0;
    place->apart = 0;
    if (!place->fine)
        place->track.n = 0;
    place->error = place->solving.lost = (struct ad_error){0};
    place->run = (struct run){.info = &place->info};
    place->info = (struct phys_simulation_info){0};
    const struct phys_ode *ode = ode_of(w, place);
    *m = (struct phys_motion_solution){
        .system = ode->system ? ode->system : e->system,
        .ode = *ode,
        .t = e->t,
        .x = place->fine ? place->x : e->x + 2 * e->dof * e->n_times * place->member};
    m->crossed.constant = calloc(settings->n_crossings + 1, sizeof *m->crossed.constant);
    if (!m->crossed.constant)
        ad_fail(&place->error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < 2 * e->dof * e->n_times; k++)
        m->x[k] = (double)NAN;
    if (place->error.status != AD_OK)
        return;
    if (settings->n_crossings > 0)
        m->keeps_energy = ode->friction == 0 &&
                          (m->system->scene->ode || phys_keeps_energy(m->system, &place->error));
    phys_crossings_watch(&place->solving, place->watches, place->events);
    struct phys_simulation how = how_of(place);
    how.proceed = settings->proceed ? proceed : NULL;
    if (phys_ode_enter(ode, 0, start, start + e->dof, place->y, &place->error) != AD_OK)
        return;
    for (size_t k = 0; place->fine && k < ode->n; k++)
        place->y[k] *= 1 + DBL_EPSILON; /* what rounding of the start makes of the motion */
    if (phys_run_open(&place->run, &how, &m->ode, place->y, &place->info, false, &place->error) ==
        AD_OK)
        land(w, place, start);
}

/* The times of crossings by two runs. */
static void compare_crossed(const struct phys_crossed *fine, struct phys_crossed *c)
{
    for (size_t i = 0; i < c->n; i++) {
        if (i >= fine->n || fine->which[i] != c->which[i])
            return;
        c->uncertainty[i] = caution * fabs(fine->t[i] - c->t[i]) + DBL_EPSILON * c->t[i];
    }
}

/* The largest coordinates, or way in a step: what is thrown up in one step comes down at 0. */
static double size_of_track(size_t dof, const struct ensemble_track *track)
{
    double size = 0, before = 0;
    for (size_t i = 0; i < track->n; i++) {
        const double *x = track->x + i * (1 + 2 * dof);
        size = fmax(size, phys_norm(dof, x + 1));
        size = fmax(size, phys_norm(dof, x + 1 + dof) * (x[0] - before));
        before = x[0];
    }
    return size;
}

/* The error of the run before by this, the finer one. */
static void estimate_error(struct ensemble_place *place)
{
    const struct phys_ensemble *e = place->task->ensemble;
    struct phys_member *member = &e->member[place->member];
    const double *x = e->x + 2 * e->dof * e->n_times * place->member;
    double most = place->apart, size = size_of_track(e->dof, &place->track);
    size_t n = place->solution.n;
    bool cut =
        member->info.stop == PHYS_SIMULATION_EVENT && place->info.stop == PHYS_SIMULATION_EVENT;
    for (size_t j = 0; j < e->n_times && most <= DBL_MAX; j++) {
        const double *a = x + 2 * e->dof * j, *b = place->x + 2 * e->dof * j;
        if (isnan(a[0]) && (j >= n || cut))
            break;
        if (j >= n && cut)
            break;
        double apart = phys_distance(e->dof, a, b);
        most = apart <= most ? most : apart;
        size = fmax(size, phys_norm(e->dof, a));
    }
    const struct phys_crossed *c = &member->crossed, *fine = &place->solution.crossed;
    if (cut && c->n > 0 && c->n == fine->n)
        most = fmax(most, phys_distance(e->dof, c->x + (c->n - 1) * 2 * e->dof,
                                        fine->x + (c->n - 1) * 2 * e->dof));
    double error = caution * most + DBL_EPSILON * size;
    member->error =
        place->error.status == AD_OK && !place->blind && error <= PHYS_MOTION_LOST * size
            ? error
            : (double)NAN;
    compare_crossed(&place->solution.crossed, &member->crossed);
}

static double energy_at(struct ensemble_place *place, double t, const double *x)
{
    const struct phys_ode *ode = &place->solution.ode;
    const size_t dof = place->task->ensemble->dof;
    return ode->energy && phys_ode_enter(ode, t, x, x + dof, place->y, &place->error) == AD_OK
               ? ode->energy(ode->context, t, place->y)
               : (double)NAN;
}

static void find_energies(struct ensemble_place *place, double *energy)
{
    const struct phys_ensemble *e = place->task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    if (place->energy) {
        phys_ensemble_energies(place->energy, m->n, m->x, energy);
        return;
    }
    for (size_t j = 0; j < e->n_times; j++)
        energy[j] = j < m->n ? energy_at(place, m->t[j], m->x + 2 * e->dof * j) : (double)NAN;
}

void phys_place_finish(struct ensemble_place *place)
{
    struct phys_ensemble *e = place->task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    struct phys_member *member = &e->member[place->member];
    if (place->run.settings)
        phys_run_close(&place->run, place->y);
    place->busy = false;
    if (place->solving.lost.status != AD_OK)
        place->error = place->solving.lost;
    if (place->solving.failed)
        ad_fail(&place->error, AD_E_MEMORY, "out of memory for events");
    if (place->info.stop == PHYS_SIMULATION_INTERRUPTED)
        __atomic_store_n(&e->interrupted, true, __ATOMIC_RELAXED);
    if (place->error.status == AD_OK && place->task->settings->motion->n_crossings > 0)
        phys_crossings_settle(&place->solving, &place->error);
    if (place->fine) {
        estimate_error(place);
        return;
    }
    find_energies(place, e->energy + e->n_times * place->member);
    phys_crossed_clear(&member->crossed);
    member->info = place->info;
    member->failure = place->error;
    member->crossed = m->crossed;
    m->crossed = (struct phys_crossed){0};
    double t;
    const double *end = phys_ensemble_end(place->task, place->member, &t);
    if (end)
        e->energy[e->n * e->n_times + place->member] = energy_at(place, t, end);
}

void phys_place_run(struct ensemble_place *place)
{
    struct run *run = &place->run;
    while (place->error.status == AD_OK && phys_run_goes_on(run, &place->error))
        if (phys_run_step(run, &place->error) == AD_OK &&
            phys_run_accept(run, &place->error) == AD_OK)
            phys_place_track(place);
    phys_place_finish(place);
}
