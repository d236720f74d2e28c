/* Derivatives in directions, Jacobians and Hessians.

       ad_jacobian *J;
       ad_jacobian_new(y, 1, &x, &J);                     which elements of y depend on which of x
       ad_set(ad_jacobian_program(J), x, values);
       ad_jacobian_run(J);
       const struct ad_sparse *m = ad_jacobian_matrix(J);  by rows: m->start, m->col, m->value */
#ifndef AUTODIFF_DERIVATIVES_H
#define AUTODIFF_DERIVATIVES_H

#include "autodiff/autodiff.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- in a direction, recorded ---- */

/* Appends J^T seed, the gradient of the sum of seed * y with respect to x[0..n-1], for a seed of
   the shape of y, or that broadcasts to it; what the seed depends on is constant here. g[k] has the
   shape of x[k]. Returns the tape's status. */
enum ad_status ad_vjp(ad_var y, ad_var seed, size_t n, const ad_var x[], ad_var g[]);

/* Appends J dx, the derivative of y as each x[k] moves along dx[k] (of the shape of x[k], or that
   broadcasts to it), in the shape of y: one sweep forward, without a gradient. An x[k] that depends
   on another one moves along dx[k] besides what that makes of it, as gradients add up. Returns the
   tape's status. */
enum ad_status ad_jvp(ad_var y, size_t n, const ad_var x[], const ad_var dx[], ad_var *dy);

/* ---- Jacobians and Hessians, as programs ---- */

/* A matrix by rows: those of row i are entries start[i] to before start[i + 1], in ascending
   columns. */
struct ad_sparse {
    size_t rows, cols;
    const size_t *start;
    const uint32_t *col;
    double *value;
};

typedef struct ad_jacobian ad_jacobian;

/* The Jacobian of the elements of y (row-major) by those of x[0], then x[1], and so on. Which
   entries can be other than 0 is found on the tape, whatever the values are: both branches of a
   select count, and every element of a matrix product. Columns that share no row are computed
   together, forward; or rows that share no column, backward, where these are fewer runs. Compiles
   a program of its own; nothing is appended to the tape. On failure *jacobian is NULL, and the
   status is returned and kept in the tape. */
enum ad_status ad_jacobian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **jacobian);
/* The same of the gradient of the sum of y's elements. */
enum ad_status ad_hessian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **hessian);
void ad_jacobian_free(ad_jacobian *jacobian); /* takes NULL */
/* The program, for ad_set, ad_set_threads and ad_native. NULL of NULL. */
ad_program *ad_jacobian_program(ad_jacobian *jacobian);
/* Runs of it that ad_jacobian_run makes. */
size_t ad_jacobian_runs(const ad_jacobian *jacobian);
/* Computes the values at the inputs as they are set. */
void ad_jacobian_run(ad_jacobian *jacobian);
/* The matrix, of the last run; lives as long as the Jacobian. */
const struct ad_sparse *ad_jacobian_matrix(const ad_jacobian *jacobian);
/* All of it, rows x cols, row-major, zeros too. */
void ad_jacobian_dense(const ad_jacobian *jacobian, double *values);

#ifdef __cplusplus
}
#endif
#endif
