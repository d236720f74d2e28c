/* For physics/fit/ only. */
#ifndef PHYSICS_FIT_INTERNAL_H
#define PHYSICS_FIT_INTERNAL_H

#include "fit.h"
#include "physics/ode/ode.h"

/* ---- least squares (least_squares.c) ---- */

/* min |J x - r|, J [rows x n] and r [rows] destroyed: with the columns of J scaled to length 1, J =
   U diag(s) V^T, s descending. */
struct phys_squares {
    size_t n;
    double *scale;   /* [n] lengths of the columns; 1 for one of zeros */
    double *s, *u_r; /* [n] singular values; U^T r */
    double *V;       /* [n][n], row k is direction k */
    double left;     /* the minimum of |J x - r|^2 */
};
enum ad_status phys_squares_new(size_t rows, size_t n, double *J, double *r,
                                struct phys_squares *squares, struct ad_error *error);
void phys_squares_free(struct phys_squares *squares);
/* x [n] of min |J x - r|^2 + lambda |scaled x|^2. */
void phys_squares_solve(const struct phys_squares *squares, double lambda, double *x);

/* ---- data (prepare.c) ---- */

static inline size_t phys_fit_trial(const struct phys_fit_data *data, size_t row)
{
    return data->trial ? data->trial[row] : 0;
}
/* Of component i of d; where it is constant its size, else 1. */
double phys_fit_spread(const struct phys_fit_data *data, size_t d, size_t i);
/* Checks all; sizes and memory of the fit, held rows, and a first noise. */
enum ad_status phys_fit_prepare(const struct phys_system *system, const struct phys_fit_data *data,
                                const struct phys_fit_settings *how, struct phys_fit *fit,
                                struct ad_error *error);

/* ---- stretches of motions (stretches.c, measure.c) ---- */

struct phys_stretch {
    size_t trial, first, end; /* rows [first, end) */
    double t0, t1;            /* t1: of the stretch that follows; t0: none does */
};

/* What is followed: values of the parameters and states where the stretches begin. */
struct phys_fitting {
    const struct phys_fit_data *data;
    const struct phys_fit_settings *settings;
    struct phys_fit *fit;      /* sizes, held rows, noise, model */
    struct phys_system system; /* a copy, whose parameters change */
    struct phys_ode ode;
    size_t d, n_stretches;
    size_t span; /* rows to either side that rates not measured are guessed from */
    struct phys_stretch *stretch;
    double *begin; /* [n_stretches][d] */
    double *size;  /* [d] of the components; then those of all of y */
    double *y;     /* [ode.n] */
    /* Of the last measure: */
    double *J, *r;  /* [measured][n_unknown], and the residuals, as far as linear */
    double *chain;  /* [n_stretches][d][n_unknown + 1] how beginnings move with the unknowns; and
                       by themselves, to close the gaps */
    double merit;   /* sum of squares of residuals and of gaps, in units of the noise */
    double squares; /* that of residuals alone */
    double gap;     /* the largest, in units of the noise */
};

/* Stretches of all trials, and their beginnings from the data. */
enum ad_status phys_fitting_new(const struct phys_system *system, const struct phys_fit_data *data,
                                const struct phys_fit_settings *settings, struct phys_fit *fit,
                                struct phys_fitting *s, struct ad_error *error);
void phys_fitting_free(struct phys_fitting *s);
/* Other stretches, of so many rows, that begin at the data. */
enum ad_status phys_fitting_divide(struct phys_fitting *s, size_t rows, struct ad_error *error);
static inline size_t phys_fitting_rows(const struct phys_fit_settings *settings)
{
    return settings->stretch ? settings->stretch : 20;
}
static inline bool phys_fitting_begins_trial(const struct phys_fitting *s, size_t k)
{
    return k == 0 || s->stretch[k].trial != s->stretch[k - 1].trial;
}
/* Follows all stretches: model, J, r, chain. */
enum ad_status phys_fitting_measure(struct phys_fitting *s, struct ad_error *error);
/* The model at the held rows, from the last stretches on. */
enum ad_status phys_fitting_predict(struct phys_fitting *s, struct ad_error *error);

/* ---- one minimum (minimise.c) ---- */

/* What a step changes. */
struct phys_fitting_point {
    double *params, *begin;
};
void phys_fitting_keep(const struct phys_fitting *s, struct phys_fitting_point *to);
void phys_fitting_restore(struct phys_fitting *s, const struct phys_fitting_point *from);
/* From the present point to a minimum; *met: it is one. `here` is its memory. */
enum ad_status phys_fitting_minimise(struct phys_fitting *s, struct phys_fitting_point *here,
                                     bool *met, struct ad_error *error);
/* Whether the error ends the fit rather than a step or a try. */
bool phys_fitting_is_fatal(const struct ad_error *error);

/* ---- at a minimum (estimate.c, verdict.c) ---- */

/* Singular values below it, of the largest, are rounding of the motion. */
#define PHYS_FIT_INDISTINCT 1e-8

/* Noise and covariance; *still: the noise does not change any more. */
enum ad_status phys_fitting_estimate(struct phys_fitting *s, bool *still, struct ad_error *error);
void phys_fitting_rms(const struct phys_fitting *s);
/* AD_E_ACCURACY: unknowns that the data cannot tell apart, or a motion unlike the data. */
enum ad_status phys_fitting_refuse(const struct phys_fitting *s, struct ad_error *error);

#endif
