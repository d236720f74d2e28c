/* Directional derivatives, Jacobians and Hessians.

       ad_jacobian *J;
       ad_jacobian_new(y, 1, &x, &J);                     which elements of y depend on which of x
       ad_set(ad_jacobian_program(J), x, values);
       ad_jacobian_run(J);
       const struct ad_sparse *m = ad_jacobian_matrix(J);  by rows: m->start, m->col, m->value

   Errors: the tape's, or those named. Lifetime: what *_new makes lives until its *_free. Threads:
   as in autodiff.h. Shapes: row-major. */
#ifndef AUTODIFF_DERIVATIVES_H
#define AUTODIFF_DERIVATIVES_H

#include "autodiff/autodiff.h"

AD_HEADER_BEGIN

/* ---- directional derivatives, recorded ---- */

/* Appends J^T seed, the gradient of the sum of seed * y with respect to x[0..n-1]. The seed has the
   shape of y or broadcasts to it, and counts as constant. g[k] has the shape of x[k]. Returns the
   tape's status. */
enum ad_status ad_vjp(ad_var y, ad_var seed, size_t n, const ad_var x[], ad_var g[]);

/* Appends J dx, the derivative of y as each x[k] changes by dx[k] (of the shape of x[k], or
   broadcast to it), in the shape of y: one forward sweep, without a gradient. An x[k] that depends
   on another one changes by dx[k] in addition to the change that follows from the other. Returns
   the tape's status. */
enum ad_status ad_jvp(ad_var y, size_t n, const ad_var x[], const ad_var dx[], ad_var *dy);

/* ---- Jacobians and Hessians, as programs ---- */

/* A sparse matrix by rows: entries start[i] to start[i + 1] - 1 are those of row i, in ascending
   columns. */
struct ad_sparse {
    size_t rows, cols;
    const size_t *start;
    const uint32_t *col;
    double *value;
};

typedef struct ad_jacobian ad_jacobian;

/* The Jacobian of the elements of y (row-major) by those of x[0], then x[1], and so on. Its
   sparsity pattern is found on the tape, whatever the values: both branches of a select count, and
   every element of a matrix product. Columns that share no row are computed together, forward; or
   rows that share no column, backward, where that takes fewer runs. Where y reads an x through
   gathers and other views alone, rows that share its columns still go together if they share no
   copy. Compiles a program of its own
   and appends nothing to the tape. On failure *jacobian is NULL; the status is returned and kept in
   the tape. */
enum ad_status ad_jacobian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **jacobian);
/* The Hessian of the sum of y's elements, in the same form. */
enum ad_status ad_hessian_new(ad_var y, size_t n, const ad_var x[], ad_jacobian **hessian);
void ad_jacobian_free(ad_jacobian *jacobian); /* takes NULL */
/* The program, owned by the Jacobian: for ad_set, ad_set_threads and ad_native. NULL for NULL. */
ad_program *ad_jacobian_program(ad_jacobian *jacobian);
/* Directions that an ad_jacobian_run computes: a short program all in one run, a long one each in a
   run of its own. */
size_t ad_jacobian_runs(const ad_jacobian *jacobian);
/* Computes the matrix at the current inputs. */
void ad_jacobian_run(ad_jacobian *jacobian);
/* The matrix of the last run; lives as long as the Jacobian. */
const struct ad_sparse *ad_jacobian_matrix(const ad_jacobian *jacobian);
/* Copies the matrix to rows x cols doubles, row-major, with its zeros. */
void ad_jacobian_dense(const ad_jacobian *jacobian, double *values);

AD_HEADER_END
#endif
