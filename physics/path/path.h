/* Stationary paths between two ends: solvers, verification, search for all of them.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_PATH_PATH_H
#define PHYSICS_PATH_PATH_H

#include "autodiff/ranks.h"
#include "physics/action/action.h"

AD_HEADER_BEGIN

/* Adds noise to `path` [dof x slices] in place; a seed gives the same numbers on every machine. */
void phys_noise_add(const struct phys_noise *noise, const struct phys_system *system, size_t slices,
                    uint64_t seed, double *path);

/* A straight line between the first and the last slice of `between`; both are [dof x slices]. */
void phys_path_line(size_t dof, size_t slices, const double *between, double *path);
/* Adds a linear function of time to a path so that it meets the first and last slices of `between`,
   both [dof x slices]. */
void phys_path_bend(size_t dof, size_t slices, const double *between, double *path);

enum phys_motion_of {
    PHYS_PATH_TRUE,     /* the scene's motion, to rounding */
    PHYS_PATH_CLOSED,   /* its closed form */
    PHYS_PATH_GRID,     /* that of rule left */
    PHYS_PATH_LOST,     /* the true one, for that of rule left is far from it */
    PHYS_PATH_PUBLISHED /* by the equations of the paper */
};
struct phys_path_settings;
/* The motion that gives a path its ends and that it is compared with: path [dof x slices]. For the
   rules left and left+repeat it is that of left, by its discrete equations, as long as that is near
   the true one, or the published one of a preset (NULL: none) or scene of the paper; for others the
   true one. */
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

/* What is left free at the ends of a path. */
struct phys_ends {
    size_t size;         /* sizeof(struct phys_ends) */
    const bool *free[2]; /* [dof]: coordinates of the first and of the last slice that are found,
                            too (their momentum there is then 0); NULL: none */
    /* [n_relations][2 dof + 1] Linear relations that these coordinates keep: the coefficients of
       the first slice and of the last, and the value of their sum. The momenta (-p, p) of both ends
       are then 0 along the directions that are left. AD_E_ARGUMENT where one follows from others,
       or contradicts them. */
    size_t n_relations;
    const double *relation;
    bool free_time; /* phys_path_refine, phys_path_all: the duration is found, too, ... */
    double energy;  /* ... that of the path of this energy (phys_path_free_time) */
    bool families;  /* paths that keep the relations may form families: steps of newton do not lead
                       along them */
};

struct phys_path_settings {
    size_t size; /* sizeof(struct phys_path_settings) */
    const struct phys_rule *rule;
    size_t slices, steps;
    double dt;
    double learning_rate; /* adam, sgd, and adam_steps */
    double momentum;      /* sgd */
    double tolerance;     /* stop when |gradient| falls below tolerance * its start; 0: never */
    double energy_weight; /* descents only: penalty on the change of energy ... */
    bool energy_local;    /* ... between slices instead of from the start */
    size_t hold;          /* slices held at either end; 0 means 1 */
    const struct phys_ends *ends; /* newton, lbfgs; NULL: nothing is free */
    size_t adam_steps;       /* newton, lbfgs: Adam steps before; if newton then stalls it is tried
                                without them */
    const double *reference; /* [dof x slices]: descents end at the step nearest to it, once the
                                distance has not decreased for PHYS_PATIENCE steps; or NULL */
    const double *compare;   /* [s*dof x slices]: a path to be measured as well; or NULL */
    bool compare_true;       /* it is a motion of the system, not of the grid (phys_path_find) */
    struct phys_refined *refined; /* phys_path_find: of phys_path_refine, whose recording and
                                     verdicts serve where the same path is found; or NULL.
                                     phys_path_refine: of an earlier path of the system, whose
                                     recording serves while parameters are the same; it is to
                                     outlast the other; or NULL */
    const struct phys_ode *ode;   /* phys_path_find, phys_path_motion: of the system's motions, by
                                     phys_ode_for; NULL: made for each */
    double *start_momentum;       /* [dof]: receives -dS/dq at the first slice of the path found, a
                                     momentum of the order of the rule; or NULL */
    size_t threads;
    bool native; /* use machine code where it pays (ad_native) */
    /* Called after step 0 (the start) and every step; false stops the run. path is [s*dof x slices]
       for a rule of degree s; means are those of phys_action. May be NULL. */
    bool (*progress)(void *context, const struct phys_path_step *step);
    /* Called repeatedly within the steps of newton, spectra and searches; false stops the run, as
       progress does, at the last complete step. May be NULL. */
    bool (*proceed)(void *context);
    void *context; /* of both */
    /* newton: [slices] times of the slices in units of dt, ascending from 0 to slices - 1; NULL:
       0, 1, 2 ... */
    const double *mesh;
    /* Of phys_path_all, which all of them call: starts are dealt out among them, and all have the
       same solutions, those of one process. proceed ends the search from any of them. NULL: one. */
    struct ad_ranks *ranks;
};

/* Defaults: rule left, the scene's slices and time step, 500 steps at a learning rate of 1e-2, or
   the steps and rate of a scene of the paper; all else 0. */
void phys_path_defaults_to(struct phys_path_settings *settings, const struct phys_system *system);
static inline struct phys_path_settings phys_path_defaults(const struct phys_system *system)
{
    struct phys_path_settings settings;
    settings.size = sizeof settings;
    phys_path_defaults_to(&settings, system);
    return settings;
}

enum phys_stop {
    PHYS_STOP_STEPS = 1,   /* all steps taken */
    PHYS_STOP_TOLERANCE,   /* the gradient is small enough */
    PHYS_STOP_INTERRUPTED, /* progress returned false */
    PHYS_STOP_ROUNDING,    /* the gradient is zero to rounding */
    PHYS_STOP_STALLED,     /* no step reduces the gradient (newton) or objective (lbfgs) */
    PHYS_STOP_REFERENCE    /* the path nearest to settings->reference */
};

struct phys_path_info {
    enum phys_stop stop;
    size_t steps;
    double seconds; /* seconds of the solver */
    double action, action_mean, kinetic_mean, potential_mean, grad_norm;
    struct phys_path_figures start;    /* of the given path, before any step ... */
    struct phys_path_figures compared; /* ... and of settings->compare; NaN: there is none */
    double energy_mean;                /* of v L_v - L over the elements of the path found */
    double energy_drift;   /* its largest change from the first point of the rule, relative to its
                              value there */
    bool native;           /* action and gradient ran as machine code at the end ... */
    char interpreted[312]; /* ... or the reason why they did not */
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
/* Not in the table: only the first two slices are given, and the discrete equations of the rule are
   solved slice by slice. Its steps are the slices found; all other settings are ignored. */
extern const struct phys_solver phys_solver_march;
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct phys_solver *phys_solver_find(const char *name, struct ad_error *error);

/* Finds the stationary path between the first and last slice of path [s*dof x slices] (s: degree of
   the rule), in place. Settings are checked first (AD_E_ARGUMENT). Of a scene with constraints, by
   newton alone: among paths whose nodes all keep them, from the given path moved to where they
   hold; AD_E_ARGUMENT where they do not hold at an end, with a place that would do, or cannot at
   one that is partly given. A value that is
   not finite ends it with AD_E_NONFINITE, naming step, operation and the first coordinate in order
   of slices; path is then unchanged. */
enum ad_status phys_path_solve(const struct phys_solver *solver, const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct phys_path_info *info, struct ad_error *error);

/* Finds the stationary path [dof x slices] of a given energy (0: free end time) and its duration,
   starting from settings->dt, which is replaced by that duration per slice. Uses Newton's method,
   and calls proceed, not progress. AD_E_ACCURACY if there is none, AD_E_ARGUMENT if L depends on
   time explicitly. */
enum ad_status phys_path_free_time(const struct phys_system *system,
                                   struct phys_path_settings *settings, double energy, double *path,
                                   struct phys_path_info *info, struct ad_error *error);

/* A rule and its number of slices, one more than elements. */
struct phys_grid {
    const struct phys_rule *rule;
    size_t slices;
    double dt;
    const double *mesh; /* as in phys_path_settings */
};
struct phys_grid phys_grid_of(const struct phys_path_settings *settings);
/* When a slice is. */
double phys_grid_time(const struct phys_grid *grid, size_t slice);
/* A path on the grid `to`, interpolated from the grid `from` over the same time: [degree*dof x
   slices], freed by the caller. NULL: out of memory, or no path. */
double *phys_path_resample(const struct phys_grid *from, const double *path,
                           const struct phys_grid *to, size_t dof, struct ad_error *error);

/* L_vv along a path (Legendre's condition); singular counts as indefinite. */
enum phys_definite { PHYS_INDEFINITE, PHYS_POSITIVE, PHYS_NEGATIVE };

/* A point conjugate to the start, and the error bound of its time. */
struct phys_conjugate {
    double time, error;
};

/* The kind of a stationary path. */
struct phys_spectrum {
    enum phys_definite legendre;
    double not_definite; /* time at which L_vv first is indefinite or changes sign */
    /* Of S where L_vv is positive definite, of -S where it is negative definite; else unset. */
    size_t index;    /* Morse index: negative eigenvalues of the Hessian; 0 is a minimum */
    double smallest; /* eigenvalue; NaN where the number of coordinates makes it expensive */
    double second_variation; /* its smallest eigenvalue relative to the integral of x^2, which
                                converges to that of the operator; NaN likewise */
    double around[2];  /* the eigenvalues of the latter next to zero, to 1 %, below it and not; NaN,
                          INFINITY: none, or not computed. In results of phys_path_refine and
                          phys_path_all to a quarter, and the above are NaN */
    bool undetermined; /* one of them is zero within rounding, or (phys_path_find) a rule of higher
                          order has one between half of the one and half of the other: the index
                          is not known, and the ends are conjugate, or nearly */
    size_t n_conjugate;
    struct phys_conjugate *conjugate; /* in order of time; the intervals of slices until refined */
    bool unknown_conjugate;           /* too many coordinates: they are not computed */
    bool of_motion;                   /* they are those of the motion: see phys_path_conjugate */
};
/* A rule and a number of elements that phys_path_refine tried. */
struct phys_level {
    const struct phys_rule *rule;
    size_t elements;
    bool found;      /* Newton's method found a stationary path */
    double estimate; /* estimated error; NaN: no level to compare with */
    double seconds;
};
enum { PHYS_LEVELS = 20 }; /* at most */
struct phys_refined {
    size_t n; /* levels, coarse to fine; the last is the result */
    struct phys_level level[PHYS_LEVELS];
    struct phys_path_settings
        *settings; /* the settings given, with rule, slices, dt and adam_steps of the result */
    double *start, *path; /* [degree*dof x slices] each: its start, and the path ... */
    double *mesh;         /* [slices] that of the settings; NULL: its elements are even */
    struct phys_spectrum spectrum;
    double finer; /* ... and its distance from that of a rule of higher order on more elements */
    const char *approach;        /* what led to a guess, where the one given did not: a path of a
                                    shorter time, or a motion; NULL: it did */
    struct phys_derivatives *of; /* of L, for all levels ... */
    bool borrowed;               /* ... of settings->refined */
    bool unsettled;              /* AD_E_ACCURACY because levels converge to different paths */
    bool singular;               /* ... because no elements resolve the path, as at a collision */
};
/* Finds a path with an error below `tolerance` by the coarsest setting that has one: elements of
   settings->rule (NULL: gauss2, until two levels agree on a path, then a rule of higher order) are
   doubled, over the time of settings->slices and dt, until the estimated error is small enough, or
   placed anew where the path is much steeper than elsewhere. With settings->mesh the first elements
   are its. guess [dof x slices] is the start, and its ends, known to ends_error, are the ends, but
   for what settings->ends leaves free. Errors are distances as in phys_path_found. With free end
   time slices of the same share of the time are compared, and the change of that time counts by the
   speed. Uses Newton's method after as many of settings->adam_steps as lead to where it converges,
   or all where that has no result; where levels do not agree on a path, from one that is followed
   to the time and the ends given. AD_E_ACCURACY if there is no such setting, or settings->proceed
   returned false. Free with phys_refined_free in any case. */
enum ad_status phys_path_refine(const struct phys_system *system,
                                const struct phys_path_settings *settings, const double *guess,
                                double ends_error, double tolerance, struct phys_refined *refined,
                                struct ad_error *error);
void phys_refined_free(struct phys_refined *refined);

/* A parameter of the scene that changes: by equal ratios where both values have one sign. */
struct phys_continuation {
    size_t size; /* sizeof(struct phys_continuation) */
    const char *name;
    double from, to;
};
/* A value on the way, and the Morse index of its path: where that changes, another branch begins or
   ends. */
struct phys_continued_step {
    double value;
    size_t elements, index;
};
struct phys_continued {
    size_t n;
    struct phys_continued_step *step; /* [n], the first value first */
};
/* phys_path_refine at of->to, which the system has afterwards, along the branch of paths that
   begins at of->from with that found from the guess, between the same ends. AD_E_ACCURACY, naming
   the value reached, where it cannot be followed. Free both results in any case. */
enum ad_status phys_path_continue(struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *guess,
                                  double ends_error, double tolerance,
                                  const struct phys_continuation *of, struct phys_refined *refined,
                                  struct phys_continued *continued, struct ad_error *error);
void phys_continued_free(struct phys_continued *continued);

/* Whether the forces jump along a path [s*dof x slices], as where L has a kink: estimates from
   coarser grids hold for smooth L. */
bool phys_path_jumps(const struct phys_system *system, const struct phys_path_settings *settings,
                     const double *path);

/* The spectrum of the action S between its ends, at a stationary path [s*dof x slices]; of the
   settings rule, slices, dt and ends are used. Without conjugate points where coordinates are free
   at the ends. Free with phys_spectrum_free in any case. */
enum ad_status phys_path_spectrum(const struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *path,
                                  struct phys_spectrum *spectrum, struct ad_error *error);
/* Replaces the conjugate points by those of the motion between the ends of the path [dof x slices],
   found from the Jacobi fields along it; each counts as often as the fields lose rank there. They
   are unchanged where no motion is found near the path, and with more than PHYS_SHOOTING_DOF
   coordinates. Where L_vv is indefinite they are the sign changes of the Jacobi fields'
   determinant. */
enum { PHYS_SHOOTING_DOF = 40 };
enum ad_status phys_path_conjugate(const struct phys_system *system,
                                   const struct phys_path_settings *settings, const double *path,
                                   struct phys_spectrum *spectrum, struct ad_error *error);
void phys_spectrum_free(struct phys_spectrum *spectrum);

/* A path, its kind, and its distances from independent results. A distance is the largest
   difference of a coordinate at a slice; NaN: unknown. Where coordinates differ in unit, one that
   is by its mass less than a tenth of the largest counts, here and in phys_path_refine, as if it
   were of its size; bodies share one unit. */
struct phys_path_found {
    struct phys_path_info info;
    bool keeps_energy; /* L does not depend on time explicitly */
    bool stationary;   /* found by newton, to rounding or a tolerance of 1e-6 or less: then ... */
    struct phys_spectrum spectrum; /* ... its kind, with the conjugate points of the motion */
    double discretisation;         /* from the path of a rule of higher order; NaN: none nearby */
    bool unknown;  /* undetermined, and far from the path of a rule of higher order: the path is
                        not known */
    bool singular; /* stationary, or the end of a descent, and between two slices the motion meets a
                      singularity, which the path passes in one step: the grid alone may have it */
    double true_distance; /* from the motion from the path's own start, by another method ... */
    double true_known;    /* ... and the uncertainty of that motion */
    double free_momentum; /* coordinates free at the end: the largest of the momenta of both ends
                             along the directions that are free, on that motion, 0 but for the error
                             of the path */
    char no_motion[160];  /* why there is no such motion */
    double reference_distance; /* from settings->compare; NaN: there is none */
    double *force; /* [dof x slices] stationary, with constraints: the force that they exert, by the
                      equations of motion at the slices and the momenta there; else NULL */
    bool another;  /* settings->compare is, or converges to, another stationary path between these
                      ends */
};
/* Runs phys_path_solve on path [dof x slices] and measures its result, with one recording of the
   action. settings->proceed is called within the motions, too. Free with phys_path_found_free in
   any case. */
enum ad_status phys_path_find(const struct phys_solver *solver, const struct phys_system *system,
                              const struct phys_path_settings *settings, double *path,
                              struct phys_path_found *found, struct ad_error *error);
void phys_path_found_free(struct phys_path_found *found);

/* One of several stationary paths between the same ends. */
struct phys_solution {
    double *path; /* [s*dof x slices] */
    double
        *copy; /* the last one found with the same energy and action, for example a mirror image */
    size_t copies; /* number of such paths, this one included */
    double energy; /* mean over the path */
    double action;
    double time;    /* from end to end */
    double largest; /* coordinate at a slice */
    size_t family;  /* 0, or the dimension of the family of paths that it is one of */
    struct phys_spectrum spectrum;
    size_t hits;   /* starts that led to it or to an equivalent one */
    bool resolved; /* the accurately integrated motion is near; other paths are rejected, ... */
    /* ... but with more than PHYS_SHOOTING_DOF coordinates only the summed defect of the motion
       over each slice is compared with the path, which proves less. */
};
/* The most steps of motions that a search of two or three coordinates takes. */
#define PHYS_ALL_STEPS 15000000

struct phys_solutions {
    size_t n;
    struct phys_solution *solution; /* ascending by energy; of free end time by their time */
    size_t unresolved;     /* paths rejected, of the grid alone, and motions that the grid does not
                              resolve: one of its paths stands for several, or none is near */
    double *motion_energy; /* [n_motions] two and three coordinates: of those motions; ascending */
    size_t n_motions;
    bool interrupted; /* settings->proceed ended the search; the solutions are those so far */
    /* One coordinate, L without explicit time: these are all motions between the ends that begin
       slower than `fastest` with at most the given number of turns; `limited`: there are more with
       more turns. False where a search twice as dense found others. */
    bool exhaustive, limited;
    size_t most_turns;
    double fastest; /* of velocities that were swept; two and three coordinates: see below; free end
                       time: unset */
    double farthest; /* two and three coordinates, free at the start: of their places from those of
                        the path given, which were searched with `fastest`; else 0 */
    /* Two and three coordinates: motions from starts with a kinetic energy up to fastest^2 / 2 were
       looked for twice, independently. found_once: motions that only one search found;
       unseen_paths: a lower estimate of how many both missed; its upper bound at 95 % confidence,
       if each motion is missed by one search as easily as by the other and no easier than the
       others, infinite where not `saturated`: some were found, and all twice, at most 1e-3 of the
       starts were left undecided, and none because the search became too long. Else NaN. */
    bool saturated, exhausted; /* exhausted: PHYS_ALL_STEPS were not enough */
    size_t found_once;
    double undecided; /* share of the starts, by the volume of their velocities */
    double unseen_paths, unseen_paths_limit;
    /* More coordinates, or ends that move: random starts, and how many led to a path; the
       probability that another start finds a new path, from the number of paths that none but one
       of them led to, and its upper bound at 95 % confidence; else NaN. Paths that no start leads
       to are not included. */
    size_t starts, led;
    double unseen, unseen_limit;
};
/* Finds stationary paths between the ends of path [s*dof x slices], which is a start, too. With
   one coordinate all of them if L does not depend on time, else those found by sweeping the
   velocity at the first end; with two and three those of motions from a dense covering of the
   velocities at the first end, or of its places where these are free; with more, and where
   relations hold between the ends, those found from random velocities and places, at most `starts`,
   fewer once a new path has become unlikely. Constraints that leave one direction: by velocities
   along it, up to `fastest`; more: by random ones. Where settings->ends leaves the end time free:
   those of its energy that take no longer than settings->slices and dt say, each with a time of its
   own; of three coordinates at most, and of two and three by a covering of directions and times.
   AD_E_ACCURACY where the potential at the first end is as high as the energy, AD_E_ARGUMENT with
   more coordinates, with constraints or free coordinates beside it, where L depends on time
   explicitly, and for free coordinates beside constraints. AD_E_IO as in ranks.h. Free with
   phys_solutions_free; empty on failure. */
enum ad_status phys_path_all(const struct phys_system *system,
                             const struct phys_path_settings *settings, const double *path,
                             size_t starts, uint64_t seed, struct phys_solutions *solutions,
                             struct ad_error *error);
void phys_solutions_free(struct phys_solutions *solutions);

AD_HEADER_END
#endif
