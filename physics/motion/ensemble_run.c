/* Runs members of an ensemble: one after another, or several places in step where there is machine
   code for that (physics/integrators/taylor_points.h). A place whose run has ended takes the next
   one, of its member or of another. */
#include "ensemble_place.h"
#include "autodiff/free.h"
#include "physics/ode/internal.h"

#include <math.h>
#include <string.h>

/* The model's series exists and was evaluated. */
static bool evaluate(const struct phys_ode *ode, const double *y, double *two_rows)
{
    struct ad_error none = {0};
    memcpy(two_rows, y, ode->n * sizeof *y);
    return ode->series && ode->series(ode->context, 1, 0, two_rows, NULL, &none) == AD_OK;
}

bool phys_ensemble_worker_join(struct ensemble_worker *w, bool build)
{
    const struct phys_ensemble *e = w->task->ensemble;
    struct ensemble_place *place = &w->place[0];
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
    struct ensemble_place *place = &w->place[p];
    const struct phys_ode *ode = &place->solution.ode;
    if (!phys_ode_motion_series(ode) && !evaluate(ode, place->y, place->x))
        return false;
    return phys_taylor_points_put(w->points, p, &place->run.stepper, &place->run.tolerance);
}

static void end(struct ensemble_worker *w, size_t p)
{
    phys_taylor_points_take(w->points, p);
    phys_place_finish(&w->place[p]);
}

/* The next attempt at a step, or the end. */
static void prepare(struct ensemble_worker *w, size_t p)
{
    struct ensemble_place *place = &w->place[p];
    struct run *run = &place->run;
    if (w->points->order[p] == 0)
        return; /* first its series */
    if (!place->again) {
        if (!phys_run_goes_on(run, &place->error)) {
            end(w, p);
            return;
        }
        phys_run_propose(run, phys_taylor_points_longest(w->points, p));
    }
    if (phys_run_length(run, &place->error) != AD_OK)
        end(w, p);
}

/* Whether the step is taken, or the series about the start is there. */
static bool judge(struct ensemble_worker *w, size_t p, const struct ad_error *cause)
{
    struct ensemble_place *place = &w->place[p];
    struct run *run = &place->run;
    bool first = w->points->order[p] == 0, lost = cause->status == AD_E_NONFINITE;
    place->within = false;
    if (cause->status != AD_OK && (first || !lost)) {
        place->error = *cause;
        end(w, p);
        return false;
    }
    if (first)
        return true;
    if (lost)
        run->cause = *cause;
    place->again = !phys_run_judge(run, lost ? (double)INFINITY : w->points->at.norm[p]);
    if (place->again)
        return false;
    if (run->table)
        phys_taylor_points_fetch(w->points, p);
    place->within = true;
    if (phys_run_settle(run, &place->error) == AD_OK)
        return true;
    end(w, p);
    return false;
}

/* The samples within the steps that were taken, the next one of each place at once. */
static void sample_together(struct ensemble_worker *w)
{
    const size_t n = w->points->n;
    bool due[AD_SERIES_POINTS], any;
    do {
        double theta[AD_SERIES_POINTS] = {0};
        any = false;
        for (size_t p = 0; p < AD_SERIES_POINTS; p++) {
            const struct run *run = &w->place[p].run;
            due[p] = w->place[p].within && !run->table && phys_run_sample_within(run, &theta[p]);
            any |= due[p];
        }
        const double *y = any ? phys_taylor_points_at(w->points, theta) : NULL;
        for (size_t p = 0; p < AD_SERIES_POINTS; p++) {
            struct run *run = &w->place[p].run;
            if (!due[p])
                continue;
            for (size_t i = 0; i < n; i++)
                run->point[i] = y[i * AD_SERIES_POINTS + p];
            phys_run_give_within(run, run->point);
        }
    } while (any);
}

static void step_together(struct ensemble_worker *w)
{
    struct ad_error errors[AD_SERIES_POINTS];
    bool taken[AD_SERIES_POINTS];
    phys_taylor_points_step(w->points, errors);
    for (size_t p = 0; p < AD_SERIES_POINTS; p++)
        taken[p] = w->place[p].busy && judge(w, p, &errors[p]);
    sample_together(w);
    for (size_t p = 0; p < AD_SERIES_POINTS; p++) {
        struct ensemble_place *place = &w->place[p];
        if (!place->busy || !place->within)
            continue;
        if (phys_run_pass(&place->run, &place->error) == AD_OK)
            phys_place_track(place);
        else
            end(w, p);
        if (place->busy && place->run.growing)
            phys_taylor_points_allow(w->points, p);
    }
    phys_taylor_points_accept(w->points, taken);
}

/* ---- which run is next ---- */

/* The error that was asked for is missed, and a smaller tolerance is to be tried. */
static bool tighten(const struct ensemble_task *task, size_t i)
{
    const double floor = 1e-16, finer = 0.3, aim = 0.3, error = task->settings->motion->error;
    struct phys_member *member = &task->ensemble->member[i];
    if (!(error > 0) || member->error <= error || member->failure.status != AD_OK ||
        !(member->tolerance > floor))
        return false;
    double ratio = isnan(member->error) ? 1e-3 : aim * error / member->error;
    member->tolerance = fmax(member->tolerance * fmax(fmin(ratio, finer), 1e-6), floor);
    return true;
}

static void forget(struct phys_ensemble *e, size_t member)
{
    const size_t first = member * e->n_times, end = first + e->n_times;
    for (size_t k = first; k < end; k++)
        e->energy[k] = (double)NAN;
    for (size_t k = 2 * e->dof * first; k < 2 * e->dof * end; k++)
        e->x[k] = (double)NAN;
}

/* Another run of the place's member. */
static bool has_another(struct ensemble_place *place)
{
    const struct ensemble_task *task = place->task;
    enum { TRIES = 3 };
    if (!place->taken || !phys_ensemble_measures(task) ||
        __atomic_load_n(&task->ensemble->interrupted, __ATOMIC_RELAXED))
        return false;
    if (!place->fine)
        return place->fine = task->ensemble->member[place->member].failure.status == AD_OK;
    place->fine = false;
    return ++place->tries < TRIES && tighten(task, place->member);
}

/* Begins the next run in a place; false: there is none. */
static bool enter_next(struct ensemble_worker *w, struct ensemble_place *place,
                       struct ensemble_queue *queue)
{
    struct phys_ensemble *e = w->task->ensemble;
    if (!has_another(place)) {
        place->member = __atomic_fetch_add(&queue->next, 1, __ATOMIC_RELAXED);
        place->tries = 0;
        place->fine = false;
        while (place->member < queue->end && __atomic_load_n(&e->interrupted, __ATOMIC_RELAXED)) {
            forget(e, place->member);
            place->member = __atomic_fetch_add(&queue->next, 1, __ATOMIC_RELAXED);
        }
        place->taken = place->member < queue->end;
    }
    if (place->taken)
        phys_place_enter(w, place);
    return place->taken;
}

static void run_together(struct ensemble_worker *w, struct ensemble_queue *queue, bool last)
{
    size_t busy;
    do {
        busy = 0;
        phys_taylor_points_look(w->points);
        for (size_t p = 0; p < AD_SERIES_POINTS; p++) {
            struct ensemble_place *place = &w->place[p];
            if (place->busy)
                prepare(w, p);
            while (!place->busy && enter_next(w, place, queue)) {
                if (place->error.status == AD_OK && join(w, p))
                    place->busy = true;
                else
                    phys_place_run(place);
            }
            busy += place->busy;
        }
        if (busy > 0)
            step_together(w);
    } while (busy == AD_SERIES_POINTS || (last && busy > 0));
}

void phys_ensemble_run_first(struct ensemble_worker *w)
{
    phys_place_enter(w, &w->place[0]);
    phys_place_run(&w->place[0]);
}

void phys_ensemble_run(struct ensemble_worker *w, struct ensemble_queue *queue, bool last)
{
    if (w->points)
        run_together(w, queue, last);
    else
        while (enter_next(w, &w->place[0], queue))
            phys_place_run(&w->place[0]);
}

/* ---- workers ---- */

void phys_ensemble_worker_free(struct ensemble_worker *w)
{
    if (!w)
        return;
    for (size_t p = 0; p < AD_SERIES_POINTS; p++) {
        phys_place_leave(&w->place[p]);
        AD_FREE(w->place[p].events, w->place[p].watches, w->place[p].solving.state, w->place[p].y,
                w->place[p].x, w->place[p].times, w->place[p].track.x);
    }
    phys_taylor_points_free(w->points);
    phys_ensemble_energy_free(w->energy);
    phys_time_scan_free(&w->scan);
    phys_ode_free(&w->ode);
    phys_ode_free(&w->model);
    phys_system_close(&w->system);
    free(w);
}

struct ensemble_worker *phys_ensemble_worker_new(const struct ensemble_task *task,
                                                 struct ad_error *error)
{
    const size_t events = task->settings->motion->n_crossings + 1;
    const size_t dof = task->ensemble->dof, times = task->ensemble->n_times;
    struct ensemble_worker *w = calloc(1, sizeof *w);
    bool done = w;
    for (size_t p = 0; done && p < AD_SERIES_POINTS; p++) {
        struct ensemble_place *place = &w->place[p];
        place->task = task;
        place->events = calloc(events, sizeof *place->events);
        place->watches = calloc(events, sizeof *place->watches);
        place->y = calloc(2 * dof, sizeof *place->y);
        place->x = calloc(2 * dof * (times + 1), sizeof *place->x);
        place->solving = (struct solving){.settings = task->settings->motion,
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
