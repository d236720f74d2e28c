/* Stationary paths between two ends: solvers, verdicts, all of several. */
#ifndef PHYSICS_PATH_H
#define PHYSICS_PATH_H

#include "physics/action/action.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* Adds noise to `path` [dof x slices] in place; the same numbers for one seed on every machine. */
void phys_noise_add(const struct phys_noise *noise, const struct phys_system *system, size_t slices,
                    uint64_t seed, double *path);

/* A straight line between the first and the last slice of `between`; both are [dof x slices]. */
void phys_path_line(size_t dof, size_t slices, const double *between, double *path);
/* Adds to a path what it misses the last slice of `between` by, in proportion to the time; both
   begin at one place. */
void phys_path_bend(size_t dof, size_t slices, const double *between, double *path);

enum phys_motion_of {
    PHYS_PATH_TRUE,   /* the scene's motion, to rounding */
    PHYS_PATH_CLOSED, /* its closed form */
    PHYS_PATH_GRID,   /* that of the discretisation: the published equations */
    PHYS_PATH_LOST    /* the true one, for that of the discretisation is far from it */
};
struct phys_path_settings;
/* The motion that a path is compared with and that gives its ends: path [dof x slices]. Rules left
   and left+repeat take that of the discretisation as long as it is near the true one, or the
   published one of a preset (NULL: none); others the true one. */
enum ad_status phys_path_motion(const struct phys_system *system,
                                const struct phys_path_settings *settings,
                                const struct phys_preset *preset, uint64_t seed, double *path,
                                enum phys_motion_of *which, struct ad_error *error);

struct phys_path_figures {
    double action, action_mean, kinetic_mean, potential_mean, objective, grad_norm;
};

struct phys_path_step {
    size_t step;
    const double *path;
    double action, action_mean, kinetic_mean, potential_mean, objective, grad_norm;
};

enum { PHYS_PATIENCE = 50 };

struct phys_path_settings {
    const struct phys_rule *rule;
    size_t slices, steps;
    double dt;
    double learning_rate; /* adam, sgd, and adam_steps */
    double momentum;      /* sgd */
    double tolerance;     /* stop when |gradient| falls below tolerance * its start; 0: never */
    double energy_weight; /* descents alone: a penalty on the change of energy ... */
    bool energy_local;    /* ... from slice to slice, not against that of the start */
    size_t hold;          /* slices held at either end; 0 means 1 */
    size_t adam_steps;    /* newton, lbfgs: steps of adam before; newton that stalls then tries
                             without */
    const double
        *reference;         /* [dof x slices]: descents end at the step nearest to it, once the
                               distance has not fallen for PHYS_PATIENCE steps; NULL: they do not */
    const double *compare;  /* [s*dof x slices]: a path whose figures are wanted, too; or NULL */
    bool compare_true;      /* it is a motion of the system, not of a grid (phys_path_find) */
    double *start_momentum; /* [dof]: becomes -dS/dq at the first slice of the path found, a
                               momentum of the order of the rule; or NULL */
    size_t threads;
    bool native; /* what runs long enough to pay for it runs as machine code (ad_native) */
    /* Called after step 0 (the start), and after every step; false stops the run cleanly. path is
       [s*dof x slices] for a rule of degree s; means are those of phys_action. May be NULL. */
    bool (*progress)(void *context, const struct phys_path_step *step);
    /* Asked now and then within the steps of newton, spectra and searches; false stops the run as
       progress does, at the last whole step. May be NULL. */
    bool (*proceed)(void *context);
    void *context; /* of both */
};

/* Rule left, the scene's slices and time step, 500 steps at a learning rate of 1e-2, for a scene of
   the paper its steps and rate; all else 0. */
struct phys_path_settings phys_path_defaults(const struct phys_system *system);

enum phys_stop {
    PHYS_STOP_STEPS = 1,   /* all steps taken */
    PHYS_STOP_TOLERANCE,   /* the gradient is small enough */
    PHYS_STOP_INTERRUPTED, /* progress returned false */
    PHYS_STOP_ROUNDING,    /* the gradient is zero but for rounding */
    PHYS_STOP_STALLED,     /* no step makes the gradient (newton) or objective (lbfgs) smaller */
    PHYS_STOP_REFERENCE    /* the path nearest to settings->reference */
};

struct phys_path_info {
    enum phys_stop stop;
    size_t steps;
    double seconds; /* of the solver alone */
    double action, action_mean, kinetic_mean, potential_mean, grad_norm;
    struct phys_path_figures start;    /* of the path given, before any step ... */
    struct phys_path_figures compared; /* ... and of settings->compare; NaN: there is none */
    double energy_mean;                /* of v L_v - L over the elements of the path found */
    double energy_drift;   /* its largest change from the first point of the rule, relative to it */
    bool native;           /* the action and its gradient ran as machine code at the end ... */
    char interpreted[312]; /* ... or why they did not */
};

/* A solver: one file, one const struct, one line in the table. */
struct phys_solver {
    const char *name, *what;
    enum ad_status (*solve)(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error);
    bool rated; /* always needs settings->learning_rate */
};
extern const struct phys_solver *const phys_solvers[]; /* NULL-terminated */
/* Not one of them: only the first two slices are given, and the discrete equations of the rule are
   marched from slice to slice. Its steps are the slices found; all other settings are ignored. */
extern const struct phys_solver phys_solver_march;
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct phys_solver *phys_solver_find(const char *name, struct ad_error *error);

/* The stationary path between the first and the last slice of path [s*dof x slices] (s: degree of
   the rule), in place, by solver->solve after a look at the settings (AD_E_ARGUMENT). A value that
   is not finite stops it with AD_E_NONFINITE, naming step, operation and the first coordinate in
   order of slices; path is then as it was. */
enum ad_status phys_path_solve(const struct phys_solver *solver, const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct phys_path_info *info, struct ad_error *error);

/* The stationary path that has an energy (0: the one whose end time is free) and the time it takes:
   from settings->dt on, which becomes that time a slice. Newton's method inside. AD_E_ACCURACY
   where there is none. */
enum ad_status phys_path_free_time(const struct phys_system *system,
                                   struct phys_path_settings *settings, double energy, double *path,
                                   struct phys_path_info *info, struct ad_error *error);

/* A rule and the slices it works on, one more than elements. */
struct phys_grid {
    const struct phys_rule *rule;
    size_t slices;
    double dt;
};
/* A path on the grid `to`, from the polynomials of its elements on the grid `from`, of the same
   time: [degree*dof x slices], for the caller to free. NULL: out of memory, or no path. */
double *phys_path_resample(const struct phys_grid *from, const double *path,
                           const struct phys_grid *to, size_t dof, struct ad_error *error);

/* A rule and a number of elements that phys_path_refine tried. */
struct phys_level {
    const struct phys_rule *rule;
    size_t elements;
    bool found;      /* a stationary path */
    double estimate; /* of its error; NaN: nothing to compare it with */
    double seconds;
};
enum { PHYS_LEVELS = 20 }; /* at most */
struct phys_refined {
    size_t n; /* levels, coarse to fine; the last is the one taken */
    struct phys_level level[PHYS_LEVELS];
    struct phys_path_settings settings; /* those given, with its rule, slices, dt and adam_steps */
    double *start, *path; /* [degree*dof x slices] of these: what it began with, and its path */
    bool unsettled;       /* AD_E_ACCURACY, because levels do not agree on a path */
};
/* A path whose coordinates err by less than `tolerance`, by the coarsest setting that does:
   elements of settings->rule (NULL: of gauss2, then of gauss4) are doubled, over the time of
   settings->slices and dt, until the estimated error is less. guess [dof x slices] is the start,
   and its ends, known to ends_error, are the ends. Newton's method inside, after
   settings->adam_steps. AD_E_ACCURACY where there is no such setting, or settings->proceed said no.
   Ends with phys_refined_free, whatever it returned. */
enum ad_status phys_path_refine(const struct phys_system *system,
                                const struct phys_path_settings *settings, const double *guess,
                                double ends_error, double tolerance, struct phys_refined *refined,
                                struct ad_error *error);
void phys_refined_free(struct phys_refined *refined);

/* L_vv over a path (Legendre's condition): indefinite where it is singular, too. */
enum phys_definite { PHYS_INDEFINITE, PHYS_POSITIVE, PHYS_NEGATIVE };

/* A point conjugate to the start, and what its time may be off by. */
struct phys_conjugate {
    double time, error;
};

/* What kind of stationary point a path is. */
struct phys_spectrum {
    enum phys_definite legendre;
    double not_definite; /* when L_vv first is neither positive nor negative definite, or changes */
    /* Where L_vv is positive definite, of S; where it is negative definite, of -S; else none. */
    size_t index;            /* Morse index: negative eigenvalues of the Hessian; 0 is a minimum */
    double smallest;         /* eigenvalue; NaN where many coordinates make it expensive */
    double second_variation; /* its smallest eigenvalue against the integral of x^2, which tends to
                                that of the operator; NaN likewise */
    size_t n_conjugate;
    struct phys_conjugate *conjugate; /* in the order of time; between which slices at first */
    bool of_motion;                   /* they are those of the motion: phys_path_conjugate */
};
/* Of the action S itself between fixed first and last slices, at a stationary path [s*dof x
   slices]; of the settings rule, slices and dt matter. Ends with phys_spectrum_free, whatever it
   returned. */
enum ad_status phys_path_spectrum(const struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *path,
                                  struct phys_spectrum *spectrum, struct ad_error *error);
/* Replaces the conjugate points by those of the motion between the ends of the path, from the
   Jacobi fields along it, each as often as the fields lose rank there. They stay as they are where
   no motion is found near the path, and with more than PHYS_SHOOTING_DOF coordinates. Where L_vv is
   indefinite they are the changes of sign of the Jacobi fields' determinant. */
enum { PHYS_SHOOTING_DOF = 40 };
enum ad_status phys_path_conjugate(const struct phys_system *system,
                                   const struct phys_path_settings *settings, const double *path,
                                   struct phys_spectrum *spectrum, struct ad_error *error);
void phys_spectrum_free(struct phys_spectrum *spectrum);

/* A path, what kind it is, and how far it is to be believed. Distances are the largest of a
   coordinate at a slice; NaN: not known. */
struct phys_path_found {
    struct phys_path_info info;
    bool keeps_energy; /* L does not depend on time itself */
    bool stationary;   /* found by newton, to rounding or a tolerance of 1e-6 or less: then ... */
    struct phys_spectrum spectrum; /* ... its kind, with the conjugate points of the motion */
    double discretisation; /* distance from the path of a rule of higher order; NaN: none near */
    double true_distance;  /* from the motion from the path's own start, by another method ... */
    double true_known;     /* ... and what that motion is known to */
    char no_motion[160];   /* why it cannot be had */
    double reference_distance; /* from settings->compare; NaN: there is none */
    bool
        another; /* settings->compare is, or leads to, another stationary path between these ends */
};
/* phys_path_solve, and all that is said of its path, by one recording of the action.
   settings->proceed is asked within the motions, too. Ends with phys_path_found_free, whatever it
   returned. */
enum ad_status phys_path_find(const struct phys_solver *solver, const struct phys_system *system,
                              const struct phys_path_settings *settings, double *path,
                              struct phys_path_found *found, struct ad_error *error);
void phys_path_found_free(struct phys_path_found *found);

/* One of several stationary paths between the same ends. */
struct phys_solution {
    double *path;  /* [s*dof x slices] */
    double *copy;  /* the last one found of the same energy and action: a mirror image, say */
    size_t copies; /* how many such there are, this one included */
    double energy; /* mean over the path */
    double action;
    double largest; /* coordinate at a slice */
    struct phys_spectrum spectrum;
    size_t hits;   /* starts that led to it or to one like it */
    bool resolved; /* the motion, tightly integrated, is near; others are left out, ... */
    /* ... but not with more than PHYS_SHOOTING_DOF coordinates, where the motion's defect over each
       slice, summed, is compared with the path and proves less. */
};
struct phys_solutions {
    size_t n;
    struct phys_solution *solution; /* by energy, smallest first */
    size_t unresolved; /* how many were left out: of the grid alone, or not on the grid */
    bool interrupted;  /* settings->proceed ended the search: these are those so far */
    /* One coordinate, L without explicit time: every motion between the ends is among these that
       begins slower than `fastest` and turns at most so often; `limited`: there are more that turn
       more often. False where a search twice as dense found others, too. */
    bool exhaustive, limited;
    size_t most_turns;
    double fastest;
    size_t starts, led; /* several coordinates: random starts, and how many of them led to a path */
    /* Several coordinates: chance that another start finds another one, from the paths that were
       seen once, and what it is under with a chance of 95 %; else NaN. What no start leads to is
       not counted. */
    double unseen, unseen_limit;
};
/* Stationary paths between the ends of path [s*dof x slices], itself the first start. With one
   coordinate all of them, where L does not depend on the time, else those that a sweep of
   velocities at the first end finds; with more, those that random velocities lead to: `starts` of
   them at most, and fewer once another would hardly find a new one. End with
   phys_solutions_free, and are empty on failure. */
enum ad_status phys_path_all(const struct phys_system *system,
                             const struct phys_path_settings *settings, const double *path,
                             size_t starts, uint64_t seed, struct phys_solutions *solutions,
                             struct ad_error *error);
void phys_solutions_free(struct phys_solutions *solutions);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
