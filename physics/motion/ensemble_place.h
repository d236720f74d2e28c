/* Places of an ensemble's worker, each for one member at a time. For ensemble_place.c and
   ensemble_run.c only. */
#ifndef PHYSICS_MOTION_ENSEMBLE_PLACE_H
#define PHYSICS_MOTION_ENSEMBLE_PLACE_H

#include "ensemble_run.h"
#include "physics/integrators/taylor_points.h"
#include "run.h"
#include "solving.h"
#include "time_scan.h"

struct ensemble_place {
    const struct ensemble_task *task;
    size_t member, tries; /* how often its tolerance was not enough */
    bool taken;           /* a member is there, whose run has ended unless `busy` */
    bool fine;            /* at a hundredth of the tolerance, for the error of the run before */
    struct ensemble_track track; /* of that, where errors are measured */
    bool busy, again;            /* the last attempt at a step was rejected */
    bool within;                 /* a step was taken, which may have samples */
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
    double *times;                  /* of samples of a fine run: the ensemble's and its track's */
    size_t tracked;                 /* rows of the track that were compared */
    double apart;                   /* the largest distance there */
    struct phys_time_scan scan;     /* of a member's parameters; steps end at its times */
    bool blind;                     /* the forces change with time too often to be followed */
    struct ensemble_energy *energy; /* the worker's, where there is one */
};

struct ensemble_worker {
    const struct ensemble_task *task;
    struct phys_ode ode, model; /* of members without parameters; of the machine code */
    struct phys_system system;  /* of the model */
    struct phys_taylor_points *points;
    struct ensemble_energy *energy; /* of the motions of `ode`; NULL: one by one */
    bool scanned;
    struct phys_time_scan scan; /* of members without parameters */
    struct ensemble_place place[AD_SERIES_POINTS];
};

/* Begins the motion of the place's member; place->error where it cannot begin. */
void phys_place_enter(struct ensemble_worker *w, struct ensemble_place *place);
/* After a step: notes its end. */
void phys_place_track(struct ensemble_place *place);
/* Runs to the end, alone, and finishes. */
void phys_place_run(struct ensemble_place *place);
/* Stores the result of a run that has ended. */
void phys_place_finish(struct ensemble_place *place);
/* Frees what belongs to the last member. */
void phys_place_leave(struct ensemble_place *place);

#endif
