/* The common base of all path solvers: the action and its gradient as a program, the caller's
   progress function, and the reasons to stop. */
#ifndef PHYSICS_PATH_PATH_PROGRAM_H
#define PHYSICS_PATH_PATH_PROGRAM_H

#include "ends.h"
#include "physics/path/constrained/surface.h"

struct phys_path_program {
    const struct phys_system *system;
    const struct phys_path_settings *settings;
    struct phys_hessian *hessian; /* evaluates the path instead of a tape of it; or NULL */
    struct phys_end_space ends;   /* gradients of the ends lie in it */
    struct phys_surface *surface; /* gradients are tangential to the constraints; or NULL */
    ad_tape *tape;
    ad_program *program, *measures; /* measures: energies and the whole gradient, once needed */
    struct phys_action action;
    ad_var gradient, norm; /* gradient: 0 where the path is held */
    ad_var whole_gradient;
    size_t n;      /* elements of the path: s*dof*slices */
    double *x, *g; /* path and gradient of the objective, 0 where held: program storage */
    double *ran;   /* [n]: the path run last, without a tape of it ... */
    struct phys_path_step found;    /* ... and what was found; .path NULL: none was */
    struct phys_path_figures start; /* of the path given */
    double start_norm;              /* of the gradient, at the start */
    double *nearest;             /* path nearest to settings->reference so far; NULL: no matter */
    double nearest_at;           /* its mean square distance ... */
    size_t nearest_step;         /* ... and step */
    double started, in_progress; /* seconds: clock at the start; in the progress function */
};

/* Records and compiles, and starts from `path` unless it is NULL. Ends with phys_path_program_free,
   whatever it returned. */
enum ad_status phys_path_program_new(struct phys_path_program *p, const struct phys_system *system,
                                     const struct phys_path_settings *settings, const double *path,
                                     struct ad_error *error);
/* The same without a recording: from a Hessian of the settings' grid. Without penalties on the
   energy and reference. (path_points.c) */
enum ad_status phys_path_program_over(struct phys_path_program *p, const struct phys_system *system,
                                      const struct phys_path_settings *settings,
                                      struct phys_hessian *hessian, struct ad_error *error);
struct phys_path_step phys_path_points_run(struct phys_path_program *p, size_t step);
/* Of the path run last. */
void phys_path_points_measure(struct phys_path_program *p, struct phys_path_info *info);
void phys_path_program_free(struct phys_path_program *p);
/* The path is `path`, with ends that keep the relations between them. */
void phys_path_program_place(struct phys_path_program *p, const double *path);
/* The path is the start, and its energy the E0 of the penalty. */
void phys_path_program_start(struct phys_path_program *p, const double *path);

/* Objective, action, means and |gradient| at x. */
struct phys_path_step phys_path_program_run(struct phys_path_program *p, size_t step);
/* AD_E_NONFINITE where |gradient| is 1e100 times that of the start or more. */
enum ad_status phys_path_stays(size_t step, double norm, double start, struct ad_error *error);
/* After a run: AD_E_NONFINITE naming step, operation and coordinate if something is not finite; and
   as above. */
enum ad_status phys_path_program_finite(struct phys_path_program *p,
                                        const struct phys_path_step *at, struct ad_error *error);
/* Reports a step; the reason to stop there, 0 if there is none. */
enum phys_stop phys_path_program_report(struct phys_path_program *p,
                                        const struct phys_path_step *at);
/* Fills info and the caller's path. */
void phys_path_program_end(struct phys_path_program *p, enum phys_stop stop,
                           const struct phys_path_step *at, double *path,
                           struct phys_path_info *info);
/* settings->adam_steps of Adam, unreported, before another solver; fewer where they lead to a path
   on which the action is not finite, and the last one before it stays, or to one that is `enough`,
   which is asked after 0, 10, 20, 40 ... steps; NULL: none is. */
enum ad_status phys_path_program_adam(struct phys_path_program *p,
                                      bool (*enough)(void *context, size_t step), void *context,
                                      struct ad_error *error);

/* What phys_path_solve refuses. */
enum ad_status phys_path_check(const struct phys_solver *solver, const struct phys_system *system,
                               const struct phys_path_settings *settings, const double *path,
                               const struct phys_path_info *info, struct ad_error *error);

/* The columns of node k (0 ... degree-1) that move: first ... first + count - 1. */
void phys_path_free_columns(const struct phys_path_settings *settings, size_t k, size_t *first,
                            size_t *count);

#endif
