/* Linear least squares by Householder's QR and one-sided Jacobi rotations of R, which keep small
   singular values exact (Demmel and Veselic, SIAM J. Matrix Anal. Appl. 13, 1992). */
#include "physics/linear/vectors.h"
#include "internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* J becomes R in its first n rows, r becomes Q^T r. */
static void triangulate(size_t rows, size_t n, double *J, double *r)
{
    for (size_t k = 0; k < n && k < rows; k++) {
        double *column = J + k * n + k, length = phys_scaled_norm(rows - k, column, n);
        if (length == 0)
            continue;
        const double head = column[0] > 0 ? -length : length, pivot = column[0] - head;
        column[0] = head;
        for (size_t i = 1; i < rows - k; i++)
            column[i * n] /= pivot; /* the reflector, whose head is 1 */
        const double tau = -pivot / head;
        for (size_t j = k + 1; j <= n; j++) {
            double *x = j < n ? J + k * n + j : r + k, sum = x[0];
            const size_t stride = j < n ? n : 1;
            for (size_t i = 1; i < rows - k; i++)
                sum += column[i * n] * x[i * stride];
            x[0] -= tau * sum;
            for (size_t i = 1; i < rows - k; i++)
                x[i * stride] -= tau * sum * column[i * n];
        }
    }
}

/* Columns of W [n][n], given as rows, become orthogonal; V takes the same rotations. */
static void rotate(size_t n, double *W, double *V)
{
    bool changed = true;
    for (int sweep = 0; sweep < 60 && changed; sweep++) {
        changed = false;
        for (size_t p = 0; p + 1 < n; p++)
            for (size_t q = p + 1; q < n; q++) {
                double a = 0, b = 0, c = 0;
                for (size_t i = 0; i < n; i++) {
                    a += W[p * n + i] * W[p * n + i];
                    b += W[q * n + i] * W[q * n + i];
                    c += W[p * n + i] * W[q * n + i];
                }
                if (fabs(c) <= 4 * DBL_EPSILON * sqrt(a * b))
                    continue;
                changed = true;
                const double zeta = (b - a) / (2 * c),
                             t = copysign(1, zeta) / (fabs(zeta) + hypot(1, zeta)),
                             cosine = 1 / hypot(1, t), sine = cosine * t;
                for (size_t i = 0; i < 2 * n; i++) {
                    double *x = i < n ? W + p * n + i : V + p * n + i - n,
                           *y = i < n ? W + q * n + i : V + q * n + i - n;
                    const double u = *x, v = *y;
                    *x = cosine * u - sine * v;
                    *y = sine * u + cosine * v;
                }
            }
    }
}

static void swap_rows(size_t n, double *x, double *y)
{
    for (size_t i = 0; i < n; i++) {
        const double z = x[i];
        x[i] = y[i];
        y[i] = z;
    }
}

enum ad_status phys_squares_new(size_t rows, size_t n, double *J, double *r, struct phys_squares *q,
                                struct ad_error *error)
{
    *q = (struct phys_squares){.n = n};
    q->scale = calloc(3 * n + 2 * n * n, sizeof *q->scale);
    if (!q->scale)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    q->s = q->scale + n;
    q->u_r = q->s + n;
    q->V = q->u_r + n;
    double *W = q->V + n * n;
    for (size_t k = 0; k < n; k++) {
        const double length = phys_scaled_norm(rows, J + k, n);
        q->scale[k] = length > 0 ? length : 1;
        for (size_t i = 0; i < rows; i++)
            J[i * n + k] /= q->scale[k];
    }
    triangulate(rows, n, J, r);
    for (size_t i = n; i < rows; i++)
        q->left += r[i] * r[i];
    for (size_t k = 0; k < n; k++) { /* row k of W: column k of R */
        q->V[k * n + k] = 1;
        for (size_t i = 0; i <= k && i < rows; i++)
            W[k * n + i] = J[i * n + k];
    }
    rotate(n, W, q->V);
    for (size_t k = 0; k < n; k++)
        q->s[k] = phys_scaled_norm(n, W + k * n, 1);
    for (size_t k = 0; k < n; k++) {
        size_t most = k;
        for (size_t j = k + 1; j < n; j++)
            most = q->s[j] > q->s[most] ? j : most;
        swap_rows(1, q->s + k, q->s + most);
        swap_rows(n, W + k * n, W + most * n);
        swap_rows(n, q->V + k * n, q->V + most * n);
        for (size_t i = 0; i < n && i < rows && q->s[k] > 0; i++)
            q->u_r[k] += W[k * n + i] / q->s[k] * r[i];
    }
    return AD_OK;
}

void phys_squares_free(struct phys_squares *squares)
{
    free(squares->scale);
    *squares = (struct phys_squares){0};
}

void phys_squares_solve(const struct phys_squares *q, double lambda, double *x)
{
    const size_t n = q->n;
    for (size_t i = 0; i < n; i++)
        x[i] = 0;
    for (size_t k = 0; k < n; k++) {
        const double s = q->s[k], down = s * s + lambda;
        for (size_t i = 0; i < n && s > 1e-13 * q->s[0]; i++)
            x[i] += s / down * q->u_r[k] * q->V[k * n + i] / q->scale[i];
    }
}
