/* Ensembles of motions (ensemble.h): the division among threads, tolerances. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "ensemble_run.h"
#include "solving.h"
#include "physics/system/internal.h"
#include "autodiff/clock.h"
#include "autodiff/series.h"
#include "autodiff/exec/pool.h"

#include <math.h>
#include <string.h>

enum { SERIES_DOF = 32 /* beyond, dop853 costs less */ };
static const double default_tolerance = 1e-9;
static const double worth = 0.3; /* seconds of all members that pay for compiling */

/* ---- running ---- */

struct team {
    struct ensemble_task task;
    size_t threads;
    struct ensemble_queue queue;
    bool last;                       /* none comes after the queue */
    size_t share;                    /* members that a rank begins at a time */
    struct ensemble_worker **worker; /* [threads] */
};

static void run_worker(void *context, size_t thread, size_t k)
{
    struct team *team = context;
    (void)thread; /* that may run several of them */
    phys_ensemble_run(team->worker[k], &team->queue, team->last);
}

/* The method, and the tolerance of each member's steps. */
static enum ad_status choose(const struct ensemble_task *task, struct ad_error *error)
{
    const struct phys_motion_settings *s = task->settings->motion;
    struct phys_ensemble *e = task->ensemble;
    double *scale = malloc(4 * e->dof * sizeof *scale);
    struct phys_ode ode = {0};
    struct phys_system first;
    struct ad_error none = {0};
    if (!scale)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    e->integrator = s->integrator ? s->integrator : phys_integrator_find("taylor", error);
    if (phys_ensemble_system(task, 0, &first, error) == AD_OK &&
        phys_ode_for(&first, e->integrator, &ode, error) == AD_OK) {
        memcpy(scale, e->start, 2 * e->dof * sizeof *scale);
        bool has = ode.series && e->dof <= SERIES_DOF &&
                   ode.series(ode.context, 1, 0, scale, NULL, &none) != AD_E_ARGUMENT;
        if (!has && !s->integrator)
            e->integrator = phys_integrator_find("dop853", error);
    }
    for (size_t i = 0; i < e->n && error->status == AD_OK; i++) {
        double size = 1;
        memcpy(scale, e->start + 2 * e->dof * i, 2 * e->dof * sizeof *scale);
        none.status = AD_OK;
        if (s->error > 0 && phys_typical_sizes(&ode, 0, scale, scale + 2 * e->dof, &none) == AD_OK)
            size = scale[2 * e->dof];
        e->member[i].tolerance = s->error > 0 ? fmin(fmax(1e-3 * s->error / size, 1e-14), 1e-2)
                                 : s->tolerance > 0 ? s->tolerance
                                                    : default_tolerance;
    }
    phys_ode_free(&ode);
    phys_system_close(&first);
    free(scale);
    return error->status;
}

/* The first member alone, by which it is known whether machine code is worth compiling. */
static void run_first(const struct team *team)
{
    struct phys_ensemble *e = team->task.ensemble;
    const double before = ad_now();
    phys_ensemble_run_first(team->worker[0]);
    const size_t at_once = team->task.settings->at_once;
    bool pays = at_once > 1 || (double)e->n * (ad_now() - before) > worth;
    e->vectors = at_once != 1 && e->n > 1 && phys_ensemble_worker_join(team->worker[0], pays);
}

/* Begins the members of one share, and goes on with those before; the result is the rank. */
static enum ad_status run_share(void *context, size_t k, void *rank, struct ad_error *error)
{
    struct team *team = context;
    const size_t n = team->task.ensemble->n, end = (k + 1) * team->share;
    team->queue = (struct ensemble_queue){k * team->share, end < n ? end : n};
    ad_parallel(team->threads, team->threads, run_worker, team);
    *(size_t *)rank = team->task.settings->ranks->rank;
    return error->status;
}

/* Members are dealt out to ranks, and then known to all. */
static enum ad_status run_ranks(struct team *team, struct ad_error *error)
{
    struct phys_ensemble *e = team->task.ensemble;
    struct ad_ranks *ranks = team->task.settings->ranks;
    const size_t share = team->share = 2 * team->threads * AD_SERIES_POINTS,
                 shares = (e->n + share - 1) / share;
    size_t *rank = calloc(shares, sizeof *rank);
    if (!rank)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (ad_ranks_agree(ranks, error) == AD_OK)
        ad_ranks_deal(ranks, shares, sizeof *rank, run_share, team, rank, error);
    team->queue = (struct ensemble_queue){0};
    team->last = true;
    ad_parallel(team->threads, team->threads, run_worker, team);
    for (size_t k = 0, next; k < shares && error->status == AD_OK; k = next) {
        for (next = k + 1; next < shares && rank[next] == rank[k];)
            next++;
        phys_ensemble_share(&team->task, rank[k], k * share, next < shares ? next * share : e->n,
                            error);
    }
    double going = !e->interrupted;
    ad_ranks_least(ranks, 1, &going, error);
    e->interrupted = going == 0;
    free(rank);
    return error->status;
}

static enum ad_status run_all(struct team *team, struct ad_error *error)
{
    struct phys_ensemble *e = team->task.ensemble;
    struct ad_ranks *ranks = team->task.settings->ranks;
    const size_t threads = team->threads;
    team->worker = calloc(threads, sizeof *team->worker);
    for (size_t k = 0; team->worker && k < threads; k++)
        if (!(team->worker[k] = phys_ensemble_worker_new(&team->task, error)))
            break;
    if (!team->worker || error->status != AD_OK) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    if (ad_ranks_agree(ranks, error) == AD_OK) {
        run_first(team);
        for (size_t k = 1; k < threads && e->vectors; k++)
            phys_ensemble_worker_join(team->worker[k], false);
        team->queue.end = team->task.ensemble->n;
        team->last = !ranks;
        if (ranks)
            run_ranks(team, error);
        else
            ad_parallel(threads, threads, run_worker, team);
    }
    for (size_t k = 0; team->worker && k < threads; k++)
        phys_ensemble_worker_free(team->worker[k]);
    free(team->worker);
    return error->status;
}

/* ---- all of it ---- */

static enum ad_status refuse(const struct phys_ensemble_settings *s, struct ad_error *error)
{
    const struct phys_integrator *given = s->motion->integrator;
    if (s->ranks && ad_ranks_check(s->ranks, error) != AD_OK)
        return error->status;
    if (s->n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "an ensemble of 0 members; expected some");
    if (s->n_columns && AD_LACKS(error, s->names, s->values))
        return error->status;
    if (phys_motion_refuse(s->motion, error) != AD_OK)
        return error->status;
    if (!isfinite(s->motion->time))
        return ad_fail(error, AD_E_ARGUMENT, "time: expected a finite one, got %g",
                       s->motion->time);
    if (given && !given->adaptive)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has fixed steps; expected one that chooses them: taylor, dop853 or "
                       "dopri5",
                       given->name);
    if (given && s->motion->error > 0)
        return ad_fail(error, AD_E_ARGUMENT, "an error and an integrator; expected one of them");
    return AD_OK;
}

static enum ad_status allocate(struct phys_ensemble *e, double time, struct ad_error *error)
{
    const size_t states = 2 * e->dof, rows = e->n * e->n_times;
    if (e->n > SIZE_MAX / 64 / sizeof(double) / states / e->n_times)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu members", e->n);
    e->start = calloc(e->n * states, sizeof *e->start);
    e->t = calloc(e->n_times, sizeof *e->t);
    e->x = malloc(rows * states * sizeof *e->x);
    e->energy = malloc((rows + e->n) * sizeof *e->energy);
    e->member = calloc(e->n, sizeof *e->member);
    e->spread = calloc((e->n_times + 1) * (states + 1) + 1, sizeof *e->spread);
    if (!e->start || !e->t || !e->x || !e->energy || !e->member || !e->spread)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu members", e->n);
    for (size_t j = 0; j < e->n_times; j++)
        e->t[j] = j + 1 == e->n_times ? time : time * (double)j / (double)(e->n_times - 1);
    for (size_t i = 0; i < e->n; i++)
        e->member[i].error = e->energy[rows + i] = (double)NAN;
    return AD_OK;
}

enum ad_status phys_ensemble_solve(const struct phys_system *system,
                                   const struct phys_ensemble_settings *settings,
                                   struct phys_ensemble *ensemble, struct ad_error *error)
{
    struct phys_ensemble *e = ensemble;
    if (AD_LACKS(error, ensemble))
        return error->status;
    *e = (struct phys_ensemble){.system = system};
    if (AD_LACKS(error, system, system->scene, settings, settings->motion))
        return error->status;
    if (phys_refuse_constraints(system, "ensembles", error) != AD_OK)
        return error->status;
    AD_OWN(phys_ensemble_settings, settings, at_once, error);
    struct phys_motion_settings motion;
    if (!AD_TAKE(&motion, settings->motion, context, error))
        return error->status;
    settings_own.motion = &motion;
    if (refuse(settings, error) != AD_OK)
        return error->status;
    struct team team = {.task = {settings, e,
                                 calloc(settings->n_columns + 1, sizeof(struct ensemble_column)),
                                 false},
                        .threads = settings->threads ? settings->threads : 1};
    e->n = settings->n;
    e->dof = system->dof;
    e->n_times =
        (settings->motion->n_samples ? settings->motion->n_samples : PHYS_ENSEMBLE_TIMES) + 1;
    if (!team.task.columns)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (allocate(e, settings->motion->time, error) == AD_OK &&
             phys_ensemble_columns(&team.task, error) == AD_OK &&
             phys_ensemble_starts(&team.task, error) == AD_OK &&
             choose(&team.task, error) == AD_OK) {
        const double before = ad_now();
        run_all(&team, error);
        e->seconds = ad_now() - before;
        if (error->status == AD_OK && !settings->motion->no_reference)
            phys_ensemble_check(&team.task, error);
        phys_ensemble_count(&team.task);
        if (error->status == AD_OK)
            phys_ensemble_spread(&team.task, team.threads, error);
    }
    free(team.task.columns);
    return error->status;
}

void phys_ensemble_free(struct phys_ensemble *ensemble)
{
    if (!ensemble)
        return;
    for (size_t i = 0; ensemble->member && i < ensemble->n; i++)
        phys_crossed_clear(&ensemble->member[i].crossed);
    AD_FREE(ensemble->start, ensemble->t, ensemble->x, ensemble->energy, ensemble->member,
            ensemble->spread);
    *ensemble = (struct phys_ensemble){0};
}
