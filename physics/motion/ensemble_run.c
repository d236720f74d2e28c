/* Runs members of an ensemble: each in a place of its own, several places in step where there is
   machine code for that (physics/integrators/taylor_points.h). A place whose member has ended takes
   the next one. */
#include "ensemble_run.h"
#include "autodiff/free.h"
#include "physics/integrators/taylor_points.h"
#include "physics/ode/internal.h"
#include "run.h"
#include "solving.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { P = AD_SERIES_POINTS };
static const double finer = 1e-2, least_tolerance = 1e-16, caution = 2;

struct place {
    const struct ensemble_task *task;
    struct ensemble_item item;
    bool busy, again; /* the last attempt at a step was rejected */
    struct run run;
    struct phys_simulation_info info;
    struct ad_error error;
    struct phys_system system; /* of a member's parameters */
    struct phys_ode own;       /* of that */
    struct solving solving;    /* as events see the motion; its ode is not its own */
    struct phys_motion_solution solution;
    struct phys_events *events;
    struct crossing_watch *watches;
    double *y, *x;                  /* [2 dof]; [n_times][2 dof] of a fine run */
    struct ensemble_energy *energy; /* the worker's, where there is one */
};

struct ensemble_worker {
    const struct ensemble_task *task;
    struct phys_ode ode, model; /* of members without parameters; of the machine code */
    struct phys_system system;  /* of the model */
    struct phys_taylor_points *points;
    struct ensemble_energy *energy; /* of the motions of `ode`; NULL: one by one */
    struct place place[P];
};

/* ---- a member in a place ---- */

static bool take_sample(void *context, double t, const double *y)
{
    struct place *place = context;
    struct phys_motion_solution *m = &place->solution;
    const struct phys_ensemble *e = place->task->ensemble;
    const size_t dof = e->dof;
    if (m->n < e->n_times && t == e->t[m->n]) { /* else where an event ends the motion */
        double *x = m->x + 2 * dof * m->n;
        if (phys_ode_leave(&m->ode, t, y, x, x + dof, &place->solving.lost) != AD_OK)
            return false;
        m->n++;
    }
    return true;
}

static void forget_crossed(struct phys_crossed *c)
{
    AD_FREE(c->which, c->touch, c->t, c->x, c->uncertainty, c->constant);
    *c = (struct phys_crossed){0};
}

static void leave(struct place *place)
{
    forget_crossed(&place->solution.crossed);
    phys_ode_free(&place->own);
    phys_system_close(&place->system);
    place->own = (struct phys_ode){0};
    place->system = (struct phys_system){0};
}

static const struct phys_ode *ode_of(struct ensemble_worker *w, struct place *place)
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
    if (phys_ensemble_system(task, place->item.member, &place->system, error) == AD_OK)
        phys_ode_for(&place->system, method, &place->own, error);
    return &place->own;
}

static struct phys_simulation how_of(const struct place *place)
{
    const struct ensemble_task *task = place->task;
    const struct phys_ensemble *e = task->ensemble;
    const double tolerance = e->member[place->item.member].tolerance;
    struct phys_simulation how = phys_simulation_of(
        e->integrator, place->item.fine ? fmax(tolerance * finer, least_tolerance) : tolerance,
        task->settings->motion.time);
    how.n_samples = e->n_times - 1;
    how.sample = take_sample;
    how.proceed = task->settings->motion.proceed;
    how.context = (void *)place;
    how.events = place->events;
    how.n_events = task->settings->motion.n_crossings;
    return how;
}

/* proceed has the caller's context, samples have the place. */
static bool proceed(void *context)
{
    const struct place *place = context;
    const struct phys_motion_settings *s = &place->task->settings->motion;
    return s->proceed(s->context);
}

/* Begins the motion of an item; place->error where it cannot begin. */
static void enter(struct ensemble_worker *w, struct place *place, struct ensemble_item item)
{
    const struct ensemble_task *task = w->task;
    const struct phys_motion_settings *settings = &task->settings->motion;
    struct phys_ensemble *e = task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    const double *start = e->start + 2 * e->dof * item.member;
    leave(place);
    place->item = item;
    place->again = false;
    place->error = place->solving.lost = (struct ad_error){0};
    place->run = (struct run){.info = &place->info};
    place->info = (struct phys_simulation_info){0};
    const struct phys_ode *ode = ode_of(w, place);
    *m = (struct phys_motion_solution){
        .system = ode->system ? ode->system : e->system,
        .ode = *ode,
        .t = e->t,
        .x = item.fine ? place->x : e->x + 2 * e->dof * e->n_times * item.member};
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
    for (size_t k = 0; item.fine && k < ode->n; k++)
        place->y[k] *= 1 + DBL_EPSILON; /* what rounding of the start makes of the motion */
    phys_run_open(&place->run, &how, &m->ode, place->y, &place->info, false, &place->error);
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

static double length(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) {
        double d = a[k] - (b ? b[k] : 0);
        sum += d * d;
    }
    return sqrt(sum);
}

/* The error of the run before by this, the finer one. */
static void measure(struct place *place)
{
    const struct phys_ensemble *e = place->task->ensemble;
    struct phys_member *member = &e->member[place->item.member];
    const double *x = e->x + 2 * e->dof * e->n_times * place->item.member;
    double most = 0, size = 0;
    size_t n = place->solution.n;
    bool cut =
        member->info.stop == PHYS_SIMULATION_EVENT && place->info.stop == PHYS_SIMULATION_EVENT;
    for (size_t j = 0; j < e->n_times && most <= DBL_MAX; j++) {
        const double *a = x + 2 * e->dof * j, *b = place->x + 2 * e->dof * j;
        if (isnan(a[0]) && (j >= n || cut))
            break;
        if (j >= n && cut)
            break;
        double apart = length(e->dof, a, b);
        most = apart <= most ? most : apart;
        size = fmax(size, length(e->dof, a, NULL));
    }
    double error = caution * most + DBL_EPSILON * size;
    member->error =
        place->error.status == AD_OK && error <= PHYS_MOTION_LOST * size ? error : (double)NAN;
    compare_crossed(&place->solution.crossed, &member->crossed);
}

static void find_energies(struct place *place, double *energy)
{
    const struct phys_ensemble *e = place->task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    if (place->energy) {
        phys_ensemble_energies(place->energy, m->n, m->x, energy);
        return;
    }
    for (size_t j = 0; j < e->n_times; j++) {
        const double *x = m->x + 2 * e->dof * j;
        energy[j] = (double)NAN;
        if (j < m->n && m->ode.energy &&
            phys_ode_enter(&m->ode, m->t[j], x, x + e->dof, place->y, &place->error) == AD_OK)
            energy[j] = m->ode.energy(m->ode.context, m->t[j], place->y);
    }
}

/* The result of a run that has ended. */
static void finish(struct place *place)
{
    struct phys_ensemble *e = place->task->ensemble;
    struct phys_motion_solution *m = &place->solution;
    struct phys_member *member = &e->member[place->item.member];
    if (place->run.settings)
        phys_run_close(&place->run, place->y);
    place->busy = false;
    if (place->solving.lost.status != AD_OK)
        place->error = place->solving.lost;
    if (place->solving.failed)
        ad_fail(&place->error, AD_E_MEMORY, "out of memory for events");
    if (place->info.stop == PHYS_SIMULATION_INTERRUPTED)
        __atomic_store_n(&e->interrupted, true, __ATOMIC_RELAXED);
    if (place->error.status == AD_OK && place->task->settings->motion.n_crossings > 0)
        phys_crossings_settle(&place->solving, &place->error);
    if (place->item.fine) {
        measure(place);
        return;
    }
    find_energies(place, e->energy + e->n_times * place->item.member);
    forget_crossed(&member->crossed);
    member->info = place->info;
    member->failure = place->error;
    member->crossed = m->crossed;
    m->crossed = (struct phys_crossed){0};
}

static void run_alone(struct place *place)
{
    struct run *run = &place->run;
    while (place->error.status == AD_OK && phys_run_goes_on(run, &place->error))
        if (phys_run_step(run, &place->error) == AD_OK)
            phys_run_accept(run, &place->error);
    finish(place);
}

/* ---- places in step ---- */

/* The model's series exists and was evaluated. */
static bool evaluate(const struct phys_ode *ode, const double *y, double *two_rows)
{
    struct ad_error none = {0};
    memcpy(two_rows, y, ode->n * sizeof *y);
    return ode->series && ode->series(ode->context, 1, 0, two_rows, &none) == AD_OK;
}

bool phys_ensemble_worker_join(struct ensemble_worker *w, bool build)
{
    const struct phys_ensemble *e = w->task->ensemble;
    struct place *place = &w->place[0];
    struct ad_error none = {0};
    if (e->integrator->scheme == &phys_power_series && !w->points &&
        phys_ensemble_system(w->task, 0, &w->system, &none) == AD_OK &&
        phys_ode_for(&w->system, e->integrator, &w->model, &none) == AD_OK &&
        phys_ode_enter(&w->model, 0, e->start, e->start + e->dof, place->y, &none) == AD_OK &&
        evaluate(&w->model, place->y, place->x))
        w->points = phys_taylor_points_new(&w->model, build);
    return w->points;
}

/* Puts the place's motion among the others; false: it has to run alone. */
static bool join(struct ensemble_worker *w, size_t p)
{
    struct place *place = &w->place[p];
    const struct phys_ode *ode = &place->solution.ode;
    if (!phys_ode_motion_series(ode) && !evaluate(ode, place->y, place->x))
        return false;
    return phys_taylor_points_put(w->points, p, &place->run.stepper, &place->run.tolerance);
}

static void end(struct ensemble_worker *w, size_t p)
{
    w->points->stepper[p] = NULL;
    w->points->order[p] = 0;
    finish(&w->place[p]);
}

/* The next attempt at a step, or the end. */
static void prepare(struct ensemble_worker *w, size_t p)
{
    struct place *place = &w->place[p];
    struct run *run = &place->run;
    if (w->points->order[p] == 0)
        return; /* first its series */
    if (!place->again) {
        if (!phys_run_goes_on(run, &place->error)) {
            end(w, p);
            return;
        }
        phys_run_propose(run, phys_taylor_points_longest(w->points, p, &run->tolerance));
    }
    if (phys_run_length(run, &place->error) != AD_OK)
        end(w, p);
}

/* Whether the step is taken, or the series about the start is there. */
static bool conclude(struct ensemble_worker *w, size_t p, const struct ad_error *cause)
{
    struct place *place = &w->place[p];
    struct run *run = &place->run;
    bool first = w->points->order[p] == 0, lost = cause->status == AD_E_NONFINITE;
    if (cause->status != AD_OK && (first || !lost)) {
        place->error = *cause;
        end(w, p);
        return false;
    }
    if (first)
        return true;
    if (lost)
        run->cause = *cause;
    place->again = !phys_run_judge(
        run, lost ? (double)INFINITY : phys_taylor_points_norm(w->points, p, &run->tolerance));
    if (place->again)
        return false;
    if (phys_run_looks_inside(run))
        phys_taylor_points_fetch(w->points, p);
    if (phys_run_accept(run, &place->error) != AD_OK)
        end(w, p);
    return true;
}

static void run_together(struct ensemble_worker *w, size_t n, const struct ensemble_item *items)
{
    size_t next = 0, busy;
    struct ad_error errors[P] = {{0}};
    bool accepted[P];
    do {
        busy = 0;
        for (size_t p = 0; p < P; p++) {
            struct place *place = &w->place[p];
            if (place->busy)
                prepare(w, p);
            while (!place->busy && next < n) {
                enter(w, place, items[next++]);
                if (place->error.status == AD_OK && join(w, p))
                    place->busy = true;
                else
                    run_alone(place);
            }
            busy += place->busy;
        }
        if (busy == 0)
            break;
        phys_taylor_points_step(w->points, errors);
        for (size_t p = 0; p < P; p++)
            accepted[p] = w->place[p].busy && conclude(w, p, &errors[p]);
        phys_taylor_points_accept(w->points, accepted);
    } while (busy);
}

void phys_ensemble_run(struct ensemble_worker *w, size_t n, const struct ensemble_item *items)
{
    if (w->points) {
        run_together(w, n, items);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        enter(w, &w->place[0], items[i]);
        run_alone(&w->place[0]);
    }
}

/* ---- workers ---- */

void phys_ensemble_worker_free(struct ensemble_worker *w)
{
    if (!w)
        return;
    for (size_t p = 0; p < P; p++) {
        leave(&w->place[p]);
        AD_FREE(w->place[p].events, w->place[p].watches, w->place[p].solving.state, w->place[p].y,
                w->place[p].x);
    }
    phys_taylor_points_free(w->points);
    phys_ensemble_energy_free(w->energy);
    phys_ode_free(&w->ode);
    phys_ode_free(&w->model);
    phys_system_close(&w->system);
    free(w);
}

struct ensemble_worker *phys_ensemble_worker_new(const struct ensemble_task *task,
                                                 struct ad_error *error)
{
    const size_t events = task->settings->motion.n_crossings + 1;
    const size_t dof = task->ensemble->dof, times = task->ensemble->n_times;
    struct ensemble_worker *w = calloc(1, sizeof *w);
    bool done = w;
    for (size_t p = 0; done && p < P; p++) {
        struct place *place = &w->place[p];
        place->task = task;
        place->events = calloc(events, sizeof *place->events);
        place->watches = calloc(events, sizeof *place->watches);
        place->y = calloc(2 * dof, sizeof *place->y);
        place->x = calloc(2 * dof * (times + 1), sizeof *place->x);
        place->solving = (struct solving){.settings = &task->settings->motion,
                                          .solution = &place->solution,
                                          .state = calloc(2 * dof, sizeof(double))};
        done = place->events && place->watches && place->y && place->x && place->solving.state;
    }
    if (done) {
        w->task = task;
        return w;
    }
    phys_ensemble_worker_free(w);
    ad_fail(error, AD_E_MEMORY, "out of memory");
    return NULL;
}
