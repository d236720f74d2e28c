/* Parameters and starts of a scene from measured motions.

       struct phys_fit fit;
       const char *const names[] = {"l", "damping"};
       struct phys_fit_settings how = {.size = sizeof how, .n_free = 2, .free = names};
       phys_fit_solve(&system, &data, &how, &fit, error);      fit.value[0] +- fit.deviation[0]
       phys_fit_free(&fit);

   The sum of squares of (motion - measured) / noise is minimised by the method of Levenberg and
   Marquardt, with the derivatives of the motion by parameters and starts. Motions are followed in
   stretches that begin at the data, and join as the iteration goes on (multiple shooting; Bock,
   1983), so that chaotic motions and rough first values do no harm.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_FIT_FIT_H
#define PHYSICS_FIT_FIT_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

struct phys_fit_data {
    size_t size;         /* sizeof(struct phys_fit_data) */
    size_t n;            /* rows */
    const double *t;     /* [n], increasing within a trial */
    const size_t *trial; /* [n] numbers of the trials from 0, not decreasing; NULL: one trial */
    const double *x;     /* [n][2 dof] coordinates and velocities; NaN: not measured */
};

/* Zero means the default. */
struct phys_fit_settings {
    size_t size; /* sizeof(struct phys_fit_settings) */
    size_t n_free;
    const char *const *free; /* parameters, which L has by PHYS_PARAM (phys_param_use) */
    /* Trials start at t = 0 with the scene's start, drawn from `seed`; else at their first row, and
       these starts are found, too. */
    bool fixed_start;
    uint64_t seed;
    const double *noise; /* [2 dof] standard deviations; 0 or NULL: unknown, from the residuals */
    size_t stretch;      /* rows from one beginning to the next; 0: 20 */
    size_t tries;        /* beginnings from other values of the parameters; 0: 3 */
    double held_out;     /* share of the rows at the end of each trial, predicted and not fitted */
    bool (*proceed)(void *context); /* AD_E_ACCURACY where it is false */
    void *context;
};

struct phys_fit {
    size_t n_free, n_trials, n_unknown; /* parameters, then 2 dof numbers of each trial's start */
    double *value, *deviation;          /* [n_unknown] and their standard deviations */
    double *covariance;                 /* [n_unknown][n_unknown] */
    /* Of the derivatives of all residuals, each column scaled to length 1: singular values,
       descending; and the direction of the smallest [n_unknown], in the same scale: what the data
       tell least. */
    double *singular, *weakest;
    double *model;          /* [n][2 dof] the motion at all rows */
    bool *held;             /* [n] not fitted */
    double *noise;          /* [2 dof] standard deviations, given or found; NaN: not measured */
    double *rms, *held_rms; /* [2 dof] of the residuals of fitted and of held rows */
    double chi_square;      /* sum of squares over noise; where that is found, `freedom` */
    size_t measured;        /* numbers that are fitted */
    double freedom;         /* measured - n_unknown */
    size_t iterations, tries, agreeing; /* tries that came to this minimum */
};

/* AD_E_ACCURACY where it does not converge, or where the data cannot tell unknowns apart: the
   message names them, and the results are there, with infinite deviations; the model, too.
   AD_E_ARGUMENT for parameters that are no variables, and for fewer numbers than unknowns. */
enum ad_status phys_fit_solve(const struct phys_system *system, const struct phys_fit_data *data,
                              const struct phys_fit_settings *settings, struct phys_fit *fit,
                              struct ad_error *error);
void phys_fit_free(struct phys_fit *fit); /* takes zero-initialised ones */
/* The name of unknown k: "l", "theta at the start of trial 2". */
void phys_fit_name(const struct phys_system *system, const struct phys_fit_settings *settings,
                   const struct phys_fit *fit, size_t k, char *name, size_t size);

AD_HEADER_END
#endif
