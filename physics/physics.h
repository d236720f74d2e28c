/* Physics on the tape: a Lagrangian written once gives the action of a discretised path, its
   gradient, the stationary path between two ends, and the motion from a start.

   Paths are [dof x slices], row-major: row k is coordinate k over time. */
#ifndef PHYSICS_H
#define PHYSICS_H

#include "autodiff/autodiff.h"
#include "autodiff/optim.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* L for all time slices at once. q, v: [dof x n] (row k is coordinate k), t: [1 x n]; returns
   [1 x n]. Slice i of the result may depend on slice i of the inputs only. */
typedef ad_var phys_lagrangian(ad_var q, ad_var v, ad_var t, const void *params);

/* Differences of all pairs of bodies as rows. q: [bodies*dims x n], body b holds rows b*dims ...;
   d[k], k < dims, becomes [pairs x n] with x_k(i) - x_k(j) for i < j in lexicographic order,
   pairs = bodies*(bodies-1)/2. Gathers, no node per pair. Needs two bodies: AD_E_ARGUMENT. */
void phys_pair_differences(ad_var q, size_t bodies, size_t dims, ad_var d[]);
/* Squares of the distances of all pairs plus `softening`: [pairs x n], in the same order. */
ad_var phys_pair_squares(ad_var q, size_t bodies, size_t dims, double softening);
/* The same for the pairs (first[k], second[k]) alone. */
void phys_listed_differences(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                             const uint32_t second[], ad_var d[]);
ad_var phys_listed_squares(ad_var q, size_t dims, size_t pairs, const uint32_t first[],
                           const uint32_t second[], double softening);

/* ---- scenes (scene.c, scenes/) ---- */

/* A named number of a scene: `offset` is where its double lies in the scene's params struct. */
struct phys_param {
    const char *name, *unit, *what;
    double value; /* default */
    size_t offset;
};

/* A parameter by name. */
struct phys_setting {
    const char *name;
    double value;
};

/* How the published code draws its noisy start around the ODE path: sigma times a standard normal
   number clipped at +-clip (0: not clipped) is added to all but the first and last three slices;
   then all but the first and last `margin` slices become scale*x + shift (margin 0: none do). */
struct phys_noise {
    double sigma, clip;
    bool around_zero; /* the path between its end slices is zero before the noise */
    size_t margin;
    double scale, shift;
    size_t quiet_bodies; /* the first so many bodies carry none */
};

/* The published setting of a scene, all of it (Nature's Cost Function, arXiv 2303.02115). */
struct phys_preset {
    size_t slices, steps;
    double dt, learning_rate;
    double energy_weight; /* penalty on the change of total energy; 0: none */
    double damping;       /* velocity factor of each step of the ODE path; 1: none */
    bool euler_start;     /* second slice is q + v dt; false: where the motion is after dt */
    struct phys_noise noise;
    const struct phys_setting *set; /* parameters that differ from the defaults */
    size_t n_set;
};

enum phys_picture {
    PHYS_PICTURE_TIME,  /* each coordinate against time */
    PHYS_PICTURE_PLANE, /* bodies in the plane of their first two coordinates */
    PHYS_PICTURE_ANGLES /* a chain of rods: angles from the vertical */
};

/* A scene records operations by their numbers: one built with another table of them is refused. */
#define PHYS_SCENE_VERSION (0x100 + AD_N_OPS)

/* One scene: one file, one const struct. A scene outside the tree is a shared object exporting
   `const struct phys_scene leastaction_scene`. */
struct phys_scene {
    uint32_t version; /* PHYS_SCENE_VERSION */
    uint32_t size;    /* sizeof(struct phys_scene) */
    const char *name, *what;

    size_t dof;                           /* 0: dof_of(params) */
    size_t (*dof_of)(const void *params); /* 0: the parameters make no system */
    size_t dims;                          /* coordinates of one body; 0: dims_of(params) */
    size_t (*dims_of)(const void *params);
    const char *const *coordinates; /* dof names; NULL: x1 y1 (z1) x2 ... */
    const char *(*body_name)(const void *params, size_t body); /* x_NAME for x1; NULL: numbers */
    const char *unit, *time_unit, *energy_unit;

    const struct phys_param *params; /* table of n_params */
    size_t n_params, params_bytes;   /* bytes of the params struct */

    phys_lagrangian *lagrangian;          /* NULL: kinetic - potential */
    phys_lagrangian *kinetic, *potential; /* [1 x n] each; NULL where L does not split */

    size_t slices; /* default span */
    double dt;
    /* Start: coordinates and velocities [dof] at t = 0, drawn from `seed` where they are random. */
    enum ad_status (*start)(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error);
    bool per_body; /* reports divide means by the number of bodies */
    enum phys_picture picture;
    const struct phys_preset *paper; /* NULL: not in the paper */
    /* The stationary path in closed form [dof x slices], its ends the scene's; NULL: the motion
       from the start gives the ends. For scenes that are no initial-value problem. */
    enum ad_status (*between)(const void *params, size_t slices, double *path,
                              struct ad_error *error);
    bool free_time; /* the end time is free: paths are those of energy 0 */
};

/* Built-in scenes, a NULL-terminated table. */
extern const struct phys_scene *const phys_scenes[];

/* A scene with parameter values: what every computation starts from. */
struct phys_system {
    const struct phys_scene *scene;
    size_t dof, bodies, dims; /* dof = bodies * dims */
    void *params;             /* owned; scene->params_bytes */
    void *library;            /* shared object of a scene from outside, or NULL */
};

/* By name, or by the path of a shared object (anything with a slash or ending in .so), with default
   parameters. Unknown names: AD_E_ARGUMENT, naming the nearest; a shared object that is none of
   ours: AD_E_INPUT, saying why. Ends with phys_system_close, after a failure too. */
enum ad_status phys_system_open(const char *name, struct phys_system *system,
                                struct ad_error *error);
/* The same for a scene of the caller's own, linked to its program; it must outlive the system.
   AD_E_INPUT says what a scene lacks. */
enum ad_status phys_system_make(const struct phys_scene *scene, struct phys_system *system,
                                struct ad_error *error);
void phys_system_close(struct phys_system *system);
/* Sets a parameter by name and updates dof. Unknown names are refused, naming the nearest; so are
   values that are not finite or make no system: AD_E_ARGUMENT, and the parameter keeps its value.
 */
enum ad_status phys_system_set(struct phys_system *system, const char *name, double value,
                               struct ad_error *error);
/* Sets n parameters in their order, up to the first that is refused. */
enum ad_status phys_system_set_all(struct phys_system *system, size_t n,
                                   const struct phys_setting set[], struct ad_error *error);
double phys_system_get(const struct phys_system *system, const char *name); /* NaN: no such name */
/* Writes the name of coordinate k. */
void phys_coordinate_name(const struct phys_system *system, size_t k, char *name, size_t size);

/* L [1 x n] of a system, from its scene's callbacks. What they return is checked: AD_E_SHAPE. */
ad_var phys_system_lagrangian(const struct phys_system *system, ad_var q, ad_var v, ad_var t);
/* Kinetic and potential energy [1 x n]: the scene's own, or, where its L does not split, E = v L_v
   - L taken apart as (E + L)/2 and (E - L)/2. */
void phys_system_energies(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                          ad_var *kinetic, ad_var *potential);

/* The name in names[0..n-1] nearest to `name` by edit distance; NULL if none is near. */
const char *phys_nearest(const char *name, size_t n, const char *const names[]);
/* Index of `name` in names[0..n-1]; n, and an AD_E_ARGUMENT that names the nearest or all there
   are, if it is not there. `what` is what they are names of. */
size_t phys_find(const char *what, const char *name, size_t n, const char *const names[],
                 struct ad_error *error);

/* ---- action (action.c) ---- */

enum { PHYS_RULE_MOST = 24 }; /* largest degree, and number of points, of a rule */

/* The numbers of a rule of degree s on an element, the stretch from one slice to the next, of
   length dt. The path there is the polynomial through s + 1 nodes X_k, both slices among them, and
       S = dt sum_j weight_j L(q_j, v_j, t + time_j dt),
       q_j = sum_k q_jk X_k,   v_j = (1/dt) sum_k v_jk X_k. */
struct phys_rule_table {
    size_t degree, points;
    double node[PHYS_RULE_MOST + 1]; /* where the nodes lie: 0 ... 1 */
    double time[PHYS_RULE_MOST], weight[PHYS_RULE_MOST];
    double q[PHYS_RULE_MOST][PHYS_RULE_MOST + 1], v[PHYS_RULE_MOST][PHYS_RULE_MOST + 1];
};

/* An action rule; one file, one line in the table.

   A path of a rule of degree s is [s*dof x slices]: rows 0 ... dof-1 are the coordinates at the
   slices, always a path of its own right; rows k*dof ... are node k of the element that begins at
   that slice. So every node of an element but its last is in one column, and the last is the first
   of the next column. The inner nodes of the last column are not used. */
struct phys_rule {
    const char *name, *what;
    size_t order;  /* of convergence to the motion as dt falls */
    size_t degree; /* s */
    bool repeat;   /* the last slice counts too, with the velocity before it: left+repeat */
    void (*fill)(const struct phys_rule *rule, struct phys_rule_table *table);
};
extern const struct phys_rule *const phys_rules[]; /* NULL-terminated; higher gauss rules exist */
/* By name: one of phys_rules, or gaussN up to N = PHYS_RULE_MOST; NULL and AD_E_ARGUMENT, naming
   the nearest, if there is none. */
const struct phys_rule *phys_rule_find(const char *name, struct ad_error *error);

/* Where the rule looks at a path x [s*dof x n]: q, v [dof x m], t [1 x m], and the weight of each
   point in units of dt (1 x 1 where all are equal). Points come by their number in the element,
   then by element. The path begins at t = 0. */
struct phys_rule_points {
    ad_var q, v, t, weight;
    size_t elements; /* points j*elements ... (j+1)*elements - 1 follow each other in time */
};
void phys_rule_points(const struct phys_rule *rule, ad_var x, double dt,
                      struct phys_rule_points *points);
/* Puts the inner nodes of a path [s*dof x slices] on cubics through its slices. */
void phys_rule_interpolate(const struct phys_rule *rule, size_t dof, size_t slices, double *path);
/* All nodes of a path in the order of time: nodes [dof x s*(slices-1)+1], and when they are (NULL:
   not asked for). */
void phys_rule_nodes(const struct phys_rule *rule, size_t dof, size_t slices, double dt,
                     const double *path, double *nodes, double *times);

/* The action on a tape: path -> S, T, V and the objective that a descent minimises. */
struct phys_action {
    ad_var path;                                      /* input [s*dof x slices] */
    ad_var kinetic_mean, potential_mean, action_mean; /* sums over slices / slices (and / bodies) */
    ad_var action;                                    /* integral: dt * sum of L */
    ad_var start_energy; /* input [1 x 1]: E0, held fixed along a descent */
    ad_var first_energy; /* energy of the first slice, what E0 is to be set to */
    ad_var energy;       /* E_i = (v L_v - L) / slices (and / bodies), scaled as published, at the
                            points of the rule [1 x m] */
    ad_var energy_mean;  /* of v L_v - L over the elements, not scaled */
    ad_var objective;    /* action_mean + energy_weight * mean (E0 - E_i)^2 */
    struct phys_rule_points points;
};
/* Records it with an input for the path; what is wrong with scene or rule is kept in the tape, and
   its status returned. */
enum ad_status phys_action_record(ad_tape *tape, const struct phys_system *system,
                                  const struct phys_rule *rule, size_t slices, double dt,
                                  double energy_weight, struct phys_action *action);
/* Adds weight * mean (E_i - E_i-1)^2 to the objective: energy held from slice to slice. */
void phys_action_hold_energy(struct phys_action *action, double weight);

/* ---- checks of a Lagrangian (check.c) ---- */

/* Where a Lagrangian is looked at: n slices of coordinates, velocities and time. */
struct phys_points {
    size_t n;
    const double *q, *v; /* [dof x n] */
    const double *t;     /* [1 x n] */
};

/* L and its gradient are finite there; AD_E_NONFINITE names the first operation that is not. */
enum ad_status phys_check_finite(const struct phys_system *system, const struct phys_points *at,
                                 struct ad_error *error);
/* The gradient of the sum of L over the slices (order 1), or its second derivatives (order 2),
   against differences; report->input is 0 for q, 1 for v, 2 for t, row and col are coordinate and
   slice. `entries` and `tolerance` are those of ad_check_gradient. AD_E_ARGUMENT for other orders.
 */
enum ad_status phys_check_gradient(const struct phys_system *system, const struct phys_points *at,
                                   int order, double tolerance, size_t entries,
                                   struct ad_check *report, struct ad_error *error);

/* Whether slice i of L depends on slice i of q, v and t alone. */
struct phys_locality {
    bool passed;
    size_t slice, moved; /* L of `slice` reacts to slice `moved` ... */
    size_t row;          /* ... of q (row < dof), v (< 2 dof) or t (2 dof); SIZE_MAX: several */
};
/* Moves one slice after the other and compares the bits of L at the rest: at 2 slices or more. */
enum ad_status phys_check_locality(const struct phys_system *system, const struct phys_points *at,
                                   struct phys_locality *report, struct ad_error *error);

/* ---- motion (euler_lagrange.c) ---- */

/* Accelerations of any Lagrangian from the tape: M(q,v) a = L_q - L_vq v - L_vt, M = L_vv. */
typedef struct phys_motion phys_motion;
/* The system must outlive it. What its callbacks do wrong is returned: AD_E_SHAPE, AD_E_MEMORY. */
enum ad_status phys_motion_new(const struct phys_system *system, phys_motion **motion,
                               struct ad_error *error);
void phys_motion_free(phys_motion *motion); /* takes NULL */
/* a [dof] at (q [dof], v [dof], t). AD_E_NONFINITE where it is not finite or M is singular, naming
   the coordinate. */
enum ad_status phys_motion_acceleration(phys_motion *motion, const double *q, const double *v,
                                        double t, double *a, struct ad_error *error);

/* Columns 0 and 1 of path [dof x slices] from q and v at t = 0: the second is q + v dt as published
   (`euler`), or where the motion is after dt. */
enum ad_status phys_first_slices(phys_motion *motion, const double *q, const double *v,
                                 size_t slices, double dt, bool euler, double *path,
                                 struct ad_error *error);
/* The published ODE path: semi-implicit Euler, v += a dt; v *= damping; x += v dt, from the first
   two slices: path [dof x slices], columns 0 and 1 given, the rest written. */
enum ad_status phys_ode_path(phys_motion *motion, size_t slices, double dt, double damping,
                             double *path, struct ad_error *error);
/* Classical Runge-Kutta from q, v with `substeps` steps a slice: path [dof x slices]. */
enum ad_status phys_fine_path(phys_motion *motion, const double *q, const double *v, size_t slices,
                              double dt, size_t substeps, double *path, struct ad_error *error);

/* Adds noise to `path` [dof x slices] in place; the same numbers for one seed on every machine. */
void phys_noise_add(const struct phys_noise *noise, const struct phys_system *system, size_t slices,
                    uint64_t seed, double *path);

/* ---- stationary paths (path.c, solvers in path_*.c) ---- */

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
    double *start_momentum; /* [dof]: becomes -dS/dq at the first slice of the path found, a
                               momentum of the order of the rule; or NULL */
    size_t threads;
    bool native; /* what runs long enough to pay for it runs as machine code (ad_native) */
    /* Called after step 0 (the start), and after every step; false stops the run cleanly. path is
       [s*dof x slices] for a rule of degree s; means are those of phys_action. May be NULL. */
    bool (*progress)(void *context, const struct phys_path_step *step);
    void *context;
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

/* One of several stationary paths between the same ends. */
struct phys_answer {
    double *path;  /* [s*dof x slices] */
    double *copy;  /* the last one found of the same energy and action: a mirror image, say */
    size_t copies; /* how many such there are, this one included */
    double energy; /* mean over the path */
    double action;
    double largest; /* coordinate at a slice */
    struct phys_spectrum spectrum;
    size_t hits;   /* starts that led to it or to one like it */
    bool resolved; /* finer grids have it, too; others are left out */
};
struct phys_answers {
    size_t n;
    struct phys_answer *answer; /* by energy, smallest first */
    size_t unresolved;          /* how many were left out */
    double unseen; /* with several coordinates: chance that another start finds another one */
};
/* Stationary paths between the ends of path [s*dof x slices], itself the first start. With one
   coordinate all those whose velocity at the first end is within a factor of 1000 of that of the
   path, and rest; with more, those that random velocities lead to: `starts` of them at most, and
   fewer once another would hardly find a new one. Answers end with phys_answers_free, and are empty
   on failure. */
enum ad_status phys_path_all(const struct phys_system *system,
                             const struct phys_path_settings *settings, const double *path,
                             size_t starts, uint64_t seed, struct phys_answers *answers,
                             struct ad_error *error);
void phys_answers_free(struct phys_answers *answers);

/* ---- the ephemeris (ephemeris.c) ---- */

struct phys_horizons;

/* Chooses the bodies (comma-separated names or ids) and the dimensions, 2 or 3, of an ephemeris
   system that runs without tables; a mass set by name stays. jupiter, saturn and moon are known
   roughly, from mean elements and series. AD_E_ARGUMENT names what is unknown. */
enum ad_status phys_ephemeris_choose(struct phys_system *system, const char *bodies, size_t dims,
                                     struct ad_error *error);
/* Bodies, start and reference path from n tables of the same epochs: slice i is epoch first + i.
   Masses are the tables' GM over G, save those set by name. The tables are not kept. reference:
   [n*dims x slices], or NULL. Tables of type 1 have no velocities: those at the start are then from
   differences of positions, of second order. */
enum ad_status phys_ephemeris_use(struct phys_system *system, size_t n,
                                  const struct phys_horizons *tables, size_t first, size_t slices,
                                  size_t dims, double *reference, struct ad_error *error);
/* Adds such roughly known bodies to a system whose bodies are chosen: the Sun is there for jupiter
   and saturn, the Earth for the moon. jd: Julian date TDB of its start. */
enum ad_status phys_ephemeris_add(struct phys_system *system, const char *bodies, double jd,
                                  struct ad_error *error);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
