/* Internals of a simulation: its state, steps (simulate_step.c), and events (simulate_events.c). */
#ifndef PHYSICS_MOTION_RUN_H
#define PHYSICS_MOTION_RUN_H

#include "motion.h"
#include "physics/integrators/stepper.h"
#include "roots.h"

/* A root within the step. */
struct found_event {
    double theta;
    const struct phys_events *events;
    size_t which;
    int kind;  /* +1, -1: sign after it; 0: a touch */
    double *y; /* [n], owned; NULL: from the step's polynomial */
};

struct run {
    const struct phys_simulation *settings;
    struct phys_simulation_info *info;
    struct phys_tolerance tolerance;
    double *growing; /* its scale where that is the largest |y_k| so far, else NULL */
    bool halves;     /* sizes are of halves */
    struct phys_stepper stepper;
    double direction; /* +1, -1 */
    size_t n_steps;   /* fixed steps in all */
    double h;         /* adaptive: to try next */
    double last_norm; /* error of the last step accepted, for the controller */
    bool rejected;    /* the last attempt was */
    struct {
        size_t steps, rejected;
        double t;
    } looked;           /* when a stall was last looked for */
    bool dense;         /* the polynomial of this step is prepared */
    double whole;       /* length of the step before an event cut it */
    size_t next_sample; /* number of the next one */
    double due;         /* its time in an adaptive run; where there is none, never */
    double *point;      /* [n] for dense output */
    double *values;     /* [largest n of the events] */
    int *signs; /* [sum of the events' n] last ones that were not 0; as much again for new ones */
    struct phys_roots_table *table; /* where there are events */
    size_t n_found;
    struct found_event *found;
    bool last;    /* this step reaches its target */
    double tried; /* length of the attempt; what made it impossible */
    struct ad_error cause;
    double target;          /* t1, or the time of the next sample or landing to land on */
    const double *landings; /* [n_landings] ascending; set after phys_run_open, for t1 > t0 only */
    size_t n_landings, next_landing;
    double end;  /* time at its end */
    double late; /* the time is stepper.t + late, and there stepper.end + next_late */
    double next_late;
    bool given;  /* as a sample */
    bool unseen; /* the method did not give the end of the step: nobody looks at it */
    bool stop;
    double away; /* seconds in callbacks */
    struct phys_simulation own;
    double *sizes, begun; /* at; 0: it is not timed */
};

/* fmax without its call, of numbers. */
static inline double phys_larger(double a, double b) { return a > b ? a : b; }

/* ---- a simulation step by step (simulate.c) ---- */

/* Ready for the first step, with its sample at the start. info must outlive the run; timed: it has
   the seconds. */
enum ad_status phys_run_open(struct run *run, const struct phys_simulation *settings,
                             const struct phys_ode *ode, const double *y,
                             struct phys_simulation_info *info, bool timed, struct ad_error *error);
/* Whether another step is to be taken; *error where none may be. */
bool phys_run_goes_on(struct run *run, struct ad_error *error);
/* What belongs to the step that was taken: events, energy, samples. */
enum ad_status phys_run_accept(struct run *run, struct ad_error *error);
/* The same in parts, of adaptive steps: events, then samples and what is left. Between them, those
   within the step may be given: whether there is another, where; its y. */
enum ad_status phys_run_settle(struct run *run, struct ad_error *error);
bool phys_run_sample_within(const struct run *run, double *theta);
void phys_run_give_within(struct run *run, const double *y);
enum ad_status phys_run_pass(struct run *run, struct ad_error *error);
/* y and info as phys_simulate leaves them; in any case. */
void phys_run_close(struct run *run, double *y);

/* ---- settings (simulate_settings.c) ---- */

enum ad_status phys_run_check(const struct phys_simulation *s, size_t n, struct ad_error *error);
/* One of rtol and atol may be 0: a component that is zero, at rest say, would allow no error. Sizes
   that the caller does not know come from the motion, so that units are no matter. */
enum ad_status phys_run_sizes(struct run *run, struct phys_simulation *s,
                              const struct phys_ode *ode, const double *y, double **sizes,
                              struct ad_error *error);

/* ---- steps ---- */

/* stepper.next at stepper.t + stepper.h, the step under control. */
enum ad_status phys_run_step(struct run *run, struct ad_error *error);
/* The same of adaptive steps in parts: the step proposed, where the method knows its longest; the
   length of the next attempt, in stepper.h; and, by its error, whether that is the step. */
void phys_run_propose(struct run *run, double longest);
enum ad_status phys_run_length(struct run *run, struct ad_error *error);
bool phys_run_judge(struct run *run, double norm);
/* The first step that suits tolerance and field. */
enum ad_status phys_run_first_step(struct run *run, struct ad_error *error);

/* Whether the end of the next fixed step is looked at. */
bool phys_run_looks(const struct run *run);

/* The time of sample number i. */
double phys_run_sample_time(const struct run *run, size_t i);

/* y at t + theta h of the step taken, into run->point. */
enum ad_status phys_run_dense(struct run *run, double theta, struct ad_error *error);
/* Values at the start; the roots within a step, in their order. A root that ends the simulation
   becomes the end of the step: h and next. */
enum ad_status phys_run_events_begin(struct run *run, struct ad_error *error);
enum ad_status phys_run_events(struct run *run, struct ad_error *error);
void phys_run_events_end(struct run *run);
/* Of the events that are not coarse, on a finer run of the step; one root more. */
enum ad_status phys_run_within(struct run *run, struct ad_error *error);
enum ad_status phys_run_found(struct run *run, const struct found_event *event,
                              struct ad_error *error);

#endif
