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
};
enum ad_status phys_squares_new(size_t rows, size_t n, double *J, double *r,
                                struct phys_squares *squares, struct ad_error *error);
void phys_squares_free(struct phys_squares *squares);
/* x [n] of min |J x - r|^2 + lambda |scaled x|^2. */
void phys_squares_solve(const struct phys_squares *squares, double lambda, double *x);

/* ---- stretches of motions (stretches.c) ---- */

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
/* Follows all stretches: model, J, r, chain. */
enum ad_status phys_fitting_measure(struct phys_fitting *s, struct ad_error *error);
/* The model at the held rows, from the last stretches on. */
enum ad_status phys_fitting_predict(struct phys_fitting *s, struct ad_error *error);

#endif
