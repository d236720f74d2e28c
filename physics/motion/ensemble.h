/* Ensembles: many motions of one system, which differ by starts or parameters.

       const char *names[] = {"theta1", "g"};                  values [n][2], a row a member
       struct phys_ensemble_settings settings = {.size = sizeof settings, .n = n, .n_columns = 2,
   .names = names, .values = values, .motion.time = 10}; struct phys_ensemble ensemble;
       phys_ensemble_solve(&system, &settings, &ensemble, &error);
       ... ensemble.x[(i * ensemble.n_times + j) * 2 * dof + k]: member i at ensemble.t[j] ...
       phys_ensemble_free(&ensemble);

   Members go through the Taylor series eight at a time, a vector of machine code each number, with
   steps, orders and events of their own, and on several threads; the results of each are those of
   phys_motion_solve by the same method and tolerance, to the last bit.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_MOTION_ENSEMBLE_H
#define PHYSICS_MOTION_ENSEMBLE_H

#include "solve.h"
#include "autodiff/ranks.h"

AD_HEADER_BEGIN

enum { PHYS_ENSEMBLE_TIMES = 100, PHYS_ENSEMBLE_QUANTILES = 5, PHYS_ENSEMBLE_CHECKS = 2 };
extern const double phys_ensemble_quantile[PHYS_ENSEMBLE_QUANTILES]; /* 0.05 ... 0.95 */

/* Zero means the default, except for n and the time. */
struct phys_ensemble_settings {
    size_t size;      /* sizeof(struct phys_ensemble_settings) */
    size_t n;         /* members */
    size_t n_columns; /* coordinates, v_ and a coordinate, or parameters, each once; what has no
                         column is the system's, and its scene's start of motion.seed */
    const char *const *names;
    const double *values; /* [n][n_columns] */
    /* time, seed, n_samples [PHYS_ENSEMBLE_TIMES], crossings, no_reference, and proceed, which is
       called from all threads. integrator: one that chooses its steps [taylor, dop853 where there
       is no series]. tolerance: of a step [1e-9]; or error: of each motion, without an integrator.
     */
    const struct phys_motion_settings *motion;
    size_t threads; /* [1] */
    size_t at_once; /* 1: one by one; more: several by machine code; 0: where that pays */
    /* Ranks that share the members, dealt out as they become free; all call this, and all get all
       results. NULL: alone. */
    struct ad_ranks *ranks;
};

/* A member of an ensemble. */
struct phys_member {
    struct ad_error failure; /* where its motion ended early: status and reason */
    double tolerance;        /* of its steps */
    /* The largest distance of the coordinates, at the times and the ends of steps, from those of a
       run at a hundredth of the tolerance from a start off by rounding, doubled; NaN: unknown, as
       where they part. */
    double error;
    bool missed; /* of the error that was asked for */
    struct phys_simulation_info info;
    struct phys_crossed crossed; /* uncertainties by the same run */
};

/* Of one quantity at one time, of the members that got there: n of them. */
struct phys_spread {
    size_t n;
    double mean, deviation; /* with n - 1; NaN of one member */
    double quantile[PHYS_ENSEMBLE_QUANTILES];
};

struct phys_ensemble {
    const struct phys_system *system;
    const struct phys_integrator *integrator;
    size_t n, dof, n_times;
    double *start;  /* [n][2 dof] */
    double *t;      /* [n_times], from 0 on */
    double *x;      /* [n][n_times][2 dof]: q, then v; NaN beyond the end of a motion */
    double *energy; /* [n][n_times]; then [n]: at the end of each motion */
    struct phys_member *member;
    /* [n_times][2 dof + 1]: q, v, energy; then [2 dof + 2]: at the end of each motion, and when
       that is. Of crossings that end motions: only of those that they ended. */
    struct phys_spread *spread;
    /* Members that failed, that miss the error asked for, whose error is not known. */
    size_t failed, missed, unknown;
    size_t complete; /* that neither failed nor were interrupted */
    bool vectors;    /* several at once */
    double seconds;
    /* Members with a reference (phys_reference), the first and the one with the largest error, and
       their distances from it; NaN: unknown; and its uncertainty. */
    size_t n_checked, checked[PHYS_ENSEMBLE_CHECKS];
    double measured[PHYS_ENSEMBLE_CHECKS], uncertainty[PHYS_ENSEMBLE_CHECKS];
    bool interrupted;
};

/* AD_E_ARGUMENT: a column or a value that the scene does not take, naming the row, from 1. A member
   that fails is no error. Free with phys_ensemble_free in any case. */
enum ad_status phys_ensemble_solve(const struct phys_system *system,
                                   const struct phys_ensemble_settings *settings,
                                   struct phys_ensemble *ensemble, struct ad_error *error);
/* AD_E_ACCURACY where members failed or miss what was asked, or a checked one errs by more than
   said, naming the first. */
enum ad_status phys_ensemble_met(const struct phys_ensemble_settings *settings,
                                 const struct phys_ensemble *ensemble, struct ad_error *error);
void phys_ensemble_free(struct phys_ensemble *ensemble);

AD_HEADER_END
#endif
