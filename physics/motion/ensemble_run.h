/* Inside of ensembles: columns (ensemble_columns.c), running members (ensemble_place.c,
   ensemble_run.c), energies (ensemble_energy.c), errors (ensemble_errors.c), statistics
   (ensemble_spread.c). */
#ifndef PHYSICS_MOTION_ENSEMBLE_RUN_H
#define PHYSICS_MOTION_ENSEMBLE_RUN_H

#include "autodiff/free.h"
#include "ensemble.h"

/* What a column sets. */
struct ensemble_column {
    enum { ENSEMBLE_STATE, ENSEMBLE_PARAMETER } kind;
    size_t which; /* of q and v; or of the scene's parameters */
};

struct ensemble_task {
    const struct phys_ensemble_settings *settings;
    struct phys_ensemble *ensemble;
    struct ensemble_column *columns; /* [settings->n_columns] */
    bool has_parameters;             /* so that each member has a system of its own */
};

static inline void phys_crossed_clear(struct phys_crossed *c)
{
    AD_FREE(c->which, c->touch, c->t, c->x, c->uncertainty, c->constant);
    *c = (struct phys_crossed){0};
}

/* The ends of a member's steps. */
struct ensemble_track {
    size_t n, room;
    double *x; /* [n][1 + 2 dof]: t, q, v */
};

/* Members that workers take one by one, each as soon as a place is free. */
struct ensemble_queue {
    size_t next, end; /* next: by atomic operations */
};

/* A thread's: steppers, and machine code. NULL when out of memory. */
struct ensemble_worker;
struct ensemble_worker *phys_ensemble_worker_new(const struct ensemble_task *task,
                                                 struct ad_error *error);
void phys_ensemble_worker_free(struct ensemble_worker *worker); /* takes NULL */
/* Prepares for many members at once, as they are in member 0; build: compiles for it. False: there
   is no machine code, and members are run one by one. */
bool phys_ensemble_worker_join(struct ensemble_worker *worker, bool build);
/* Member 0 alone. */
void phys_ensemble_run_first(struct ensemble_worker *worker);
/* Members of the queue until there are none; unless it is the last one, the motions in other places
   go on in the next call when the first has ended. Where errors are measured, each again at a
   hundredth of its tolerance, and from the beginning with a smaller one while it errs by too much.
   Results are those of each alone. After an interruption the rest have none. */
void phys_ensemble_run(struct ensemble_worker *worker, struct ensemble_queue *queue, bool last);

/* Whether errors are. */
static inline bool phys_ensemble_measures(const struct ensemble_task *task)
{
    return !task->settings->motion->no_reference;
}

/* Members first to before end of rank `from` to all the others (ensemble_ranks.c). */
enum ad_status phys_ensemble_share(const struct ensemble_task *task, size_t from, size_t first,
                                   size_t end, struct ad_error *error);

/* What the columns are; each once. */
enum ad_status phys_ensemble_columns(struct ensemble_task *task, struct ad_error *error);
/* The starts of all members: those of the scene, with the member's parameters, and its columns. */
enum ad_status phys_ensemble_starts(const struct ensemble_task *task, struct ad_error *error);
/* The system of a member, closed by the caller. AD_E_ARGUMENT names its row. */
enum ad_status phys_ensemble_system(const struct ensemble_task *task, size_t member,
                                    struct phys_system *system, struct ad_error *error);
/* Energies [n] of states x [n][2 dof] at the times, the first `known` of them, the others NaN.
   NULL: it cannot be recorded. */
struct ensemble_energy;
struct ensemble_energy *phys_ensemble_energy_new(const struct phys_system *system, size_t n,
                                                 const double *times);
void phys_ensemble_energies(struct ensemble_energy *energy, size_t known, const double *x,
                            double *energies);
void phys_ensemble_energy_free(struct ensemble_energy *energy); /* takes NULL */
/* It neither failed nor was interrupted, nor is still to come. */
static inline bool phys_member_complete(const struct phys_member *m)
{
    return m->failure.status == AD_OK &&
           (m->info.stop == PHYS_SIMULATION_END || m->info.stop == PHYS_SIMULATION_EVENT);
}

/* The state of a member at its end, and when that is: at its last crossing, where one ended it.
   NULL: it is not complete, or has not come to a crossing that was to end it. */
const double *phys_ensemble_end(const struct ensemble_task *task, size_t member, double *t);
/* Counts members by what became of them; measures the first one and that of the largest error. */
void phys_ensemble_count(const struct ensemble_task *task);
void phys_ensemble_check(const struct ensemble_task *task, struct ad_error *error);
enum ad_status phys_ensemble_spread(const struct ensemble_task *task, size_t threads,
                                    struct ad_error *error);

#endif
