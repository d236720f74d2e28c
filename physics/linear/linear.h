/* Linear algebra for physics/ and quantum/: LAPACK on small and banded systems, and a complex
   matrix product. Matrices are row-major unless stated otherwise. */
#ifndef PHYSICS_LINEAR_LINEAR_H
#define PHYSICS_LINEAR_LINEAR_H

#include <stdbool.h>
#include <stddef.h>

/* Product of complex matrices, pairs of real and imaginary part: c [m x n] = a [m x k] op(b),
   where b is [k x n], or [n x k] to be transposed (not conjugated). Rows are contiguous. */
void phys_lapack_gemm_complex(bool transpose_b, size_t m, size_t n, size_t k, const double *a,
                              const double *b, double *c);

/* Solves a x = b for one right side: a [n x n] is destroyed, b [n] becomes x. Returns 0, or 1 + the
   index of the zero pivot. */
int phys_lapack_lu_solve_once(size_t n, double *a, double *b);
/* The same in two steps, for many right sides: factors a in place, `pivots` [n] is room; solves
   from the factors, b in place. */
int phys_lapack_lu_factor(size_t n, double *a, int *pivots);
/* The sign of the determinant of a, which is factored. */
int phys_lapack_lu_sign(size_t n, double *a, int *pivots);
void phys_lapack_lu_solve(size_t n, const double *a, const int *pivots, double *b);

/* Band matrices of n rows with `width` diagonals on either side of the main one, stored by columns:
   element (i, j), |i - j| <= width, is band[PHYS_BAND(width, i, j)] of PHYS_BAND_ROWS(width) * n
   elements. The rest is room for the factor. */
#define PHYS_BAND_ROWS(width) (3 * (width) + 1)
#define PHYS_BAND(width, i, j) (2 * (width) + (i) - (j) + PHYS_BAND_ROWS(width) * (j))

/* Factors a band in place as P L U; `pivots` [n] is room. Returns 0, or 1 + the index of a zero
   pivot. */
int phys_lapack_band_factor(size_t n, size_t width, double *band, int *pivots);
/* Solves band x = b, in place, from the factors. */
void phys_lapack_band_solve(size_t n, size_t width, const double *band, const int *pivots,
                            double *b);
/* The same for complex numbers, pairs of real and imaginary part. */
int phys_lapack_band_factor_complex(size_t n, size_t width, double *band, int *pivots);
void phys_lapack_band_solve_complex(size_t n, size_t width, const double *band, const int *pivots,
                                    double *b);

/* Factors a matrix a [n x n] by columns, real, or `with_i` of pairs of real and imaginary
   part, in place as P L U; `pivots` [n] is room. Returns 0, or 1 + the index of a zero pivot.
 */
int phys_lapack_block_factor(bool with_i, size_t n, double *a, int *pivots);
/* Solves a x = b from the factors, in place. */
void phys_lapack_block_solve(bool with_i, size_t n, const double *a, const int *pivots, double *b);
/* y -= a x, or a^T x. */
void phys_lapack_block_subtract(bool with_i, bool transpose, size_t n, const double *a,
                                const double *x, double *y);
/* c [m x m] -= b^T a^-1 b from the factors P L U, as (b^T U^-1) (L^-1 P^-1 b): elimination proper,
   stable where a^-1 itself is not. b [n x m] is overwritten, `work` [n x m] is room. All by
   columns. */
void phys_lapack_block_eliminate(bool with_i, size_t n, const double *a, const int *pivots,
                                 size_t m, double *b, double *work, double *c);

/* Complex tridiagonal matrices of n rows: below [n-1], diagonal [n] and above [n-1] are factored in
   place; second [n-2] and `pivots` [n] are room. Returns 0, or 1 + the index of a zero pivot. */
int phys_lapack_tridiagonal_factor_complex(size_t n, double *below, double *diagonal, double *above,
                                           double *second, int *pivots);
/* Solves for m right sides from the factors, b [m x n], one a row, in place. */
void phys_lapack_tridiagonal_solve_complex(size_t n, const double *below, const double *diagonal,
                                           const double *above, const double *second,
                                           const int *pivots, size_t m, double *b);
/* The `count` smallest eigenvalues of a symmetric tridiagonal matrix, ascending, and eigenvectors
   [count x n] of length 1, one a row; diagonal [n] and off [n] (the last one is room) are
   destroyed. Returns 0, positive where they do not converge, negative where memory is exhausted.
 */
int phys_lapack_tridiagonal_eigenvectors(size_t n, double *diagonal, double *off, size_t count,
                                         double *values, double *vectors);

/* Factors a symmetric matrix a [n x n] in place as L D L^T with diagonal pivoting (Bunch, Kaufman);
   `pivots` [n], `work` [64 n] are room. Returns 0, or 1 + the index of a zero pivot. */
int phys_lapack_symmetric_factor(size_t n, double *a, int *pivots, double *work);
/* Factors the first `inner` rows and columns of a small one, with pivots among them, and leaves of
   the others their Schur complement, in the lower triangle by columns. NaN is a zero pivot. */
int phys_lapack_symmetric_reduce(size_t n, size_t inner, double *a, int *pivots);
/* Solves with a matrix so reduced: `forward` eliminates the first `inner` unknowns from b [n],
   which is then solved for the others by what is left, and `backward` finds those from these. */
void phys_lapack_symmetric_forward(size_t n, size_t inner, const double *a, const int *pivots,
                                   double *b);
void phys_lapack_symmetric_backward(size_t n, size_t inner, const double *a, const int *pivots,
                                    double *b);
/* From a matrix so reduced, the inner block's inverse times its columns beside each other row:
   solved [n - inner][inner]. */
void phys_lapack_symmetric_eliminated(size_t n, size_t inner, const double *a, const int *pivots,
                                      double *solved);
enum { PHYS_SMALL = 40 }; /* rows that are factored without LAPACK */
/* Of the first n rows of a matrix so factored, columns of which are `stride` apart: how many
   eigenvalues are negative; adds log |det|. */
size_t phys_lapack_symmetric_inertia(size_t n, size_t stride, const double *a, const int *pivots,
                                     double *log_determinant);
/* How many eigenvalues of a symmetric band matrix are negative: element (i + k, i), k <= width, is
   band[i * (width + 1) + k]; width > 0. False: some block of it has a zero pivot, or `memory` is
   exhausted, which becomes false. (band_inertia.c) */
bool phys_band_inertia(size_t n, size_t width, const double *band, size_t *negative, bool *memory);
/* Solves a x = b for m right sides, b [m x n], one a row, in place. */
void phys_lapack_symmetric_solve(size_t n, const double *a, const int *pivots, size_t m, double *b);
/* The same two by LAPACK, for matrices large enough to repay the call. */
int phys_lapack_symmetric_factor_large(size_t n, double *a, int *pivots, double *work);
void phys_lapack_symmetric_solve_large(size_t n, const double *a, const int *pivots, size_t m,
                                       double *b);
/* Eigenvalues of a x = value b x for symmetric a and positive definite b, [n x n] each: values [n],
   ascending; row k of a becomes eigenvector k; b is destroyed. Returns 0, up to n where they do not
   converge, more where b is not positive definite, negative where memory is exhausted. */
int phys_lapack_eigenvectors(size_t n, double *a, double *b, double *values);
/* Eigenvalues re + i im [n] of a general matrix a [n x n] by columns, which is destroyed, and left
   and right eigenvectors of length 1, columns of [n x n]: for a pair, whose first has im > 0, real
   and imaginary part in two columns. Returns 0, positive where they do not converge, negative where
   memory is exhausted or a number is NaN. */
int phys_lapack_eigenvalues(size_t n, double *a, double *re, double *im, double *left,
                            double *right);

/* a = U diag(s) V^T of a general matrix a [m x n] by columns, which is destroyed; with k the
   smaller of m and n: s [k], descending, U [m x k] by columns, V^T [k x n] by columns. Returns as
   above. */
int phys_lapack_singular_values(size_t m, size_t n, double *a, double *s, double *u, double *vt);

/* Makes the rows of a [n x length] orthonormal, n <= length, as Gram's and Schmidt's method would:
   the first j of them span what they did, and none is turned around. `work` [2 n] is room. False:
   memory is exhausted. */
bool phys_lapack_orthonormal_rows(size_t n, size_t length, double *a, double *work);

#endif
