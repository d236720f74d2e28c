/* Factors P L D L^T P^T of symmetric matrices by diagonal pivoting (Bunch, Kaufman, Math. Comp. 31,
   1977), in the format of LAPACK's dsytrf, which factors large ones: small ones are done before
   that library would be loaded. Matrices are by columns, of which the lower triangle counts. */
#include "linear.h"

#include <math.h>

static const double GROWTH = 0.6403882032022076; /* (1 + sqrt 17) / 8 */

static double *at(double *a, size_t n, size_t i, size_t j) { return a + j * n + i; }

static void swap(double *x, double *y)
{
    double kept = *x;
    *x = *y;
    *y = kept;
}

/* The largest off-diagonal entry of row and column i in columns k to last; its index in *where. */
static double largest_beside(double *a, size_t n, size_t last, size_t k, size_t i, size_t *where)
{
    double most = 0;
    *where = i;
    for (size_t j = k; j < last; j++) {
        double x = j < i ? fabs(*at(a, n, i, j)) : j > i ? fabs(*at(a, n, j, i)) : 0;
        if (!(x <= most)) { /* NaN, too */
            most = x;
            *where = j;
        }
    }
    return most;
}

/* Row and column before `last` to pivot with at k; whether the pivot is 2 x 2. n: there is none but
   zeros or NaN. */
static size_t choose_pivot(double *a, size_t n, size_t last, size_t k, bool *pair)
{
    size_t other, next;
    double here = fabs(*at(a, n, k, k)), column = largest_beside(a, n, last, k, k, &other);
    *pair = false;
    if (isnan(column + here) || here + column == 0)
        return n;
    if (here >= GROWTH * column)
        return k;
    double row = largest_beside(a, n, last, k, other, &next);
    if (here >= GROWTH * column * (column / row))
        return k;
    *pair = fabs(*at(a, n, other, other)) < GROWTH * row;
    return other;
}

static void interchange(double *a, size_t n, size_t k, size_t from, size_t to)
{
    for (size_t i = to + 1; i < n; i++)
        swap(at(a, n, i, from), at(a, n, i, to));
    for (size_t j = from + 1; j < to; j++)
        swap(at(a, n, j, from), at(a, n, to, j));
    swap(at(a, n, from, from), at(a, n, to, to));
    if (from > k)
        swap(at(a, n, from, k), at(a, n, to, k));
}

static void eliminate_one(double *a, size_t n, size_t k)
{
    double inverse = 1 / *at(a, n, k, k);
    for (size_t j = k + 1; j < n; j++) {
        double share = inverse * *at(a, n, j, k), *restrict to = a + j * n;
        const double *restrict from = a + k * n;
        if (share == 0) /* of a band */
            continue;
#pragma omp simd
        for (size_t i = j; i < n; i++)
            to[i] -= share * from[i];
    }
    for (size_t i = k + 1; i < n; i++)
        *at(a, n, i, k) *= inverse;
}

static void eliminate_pair(double *a, size_t n, size_t k)
{
    double off = *at(a, n, k + 1, k), d = *at(a, n, k + 1, k + 1) / off, e = *at(a, n, k, k) / off;
    double scale = 1 / (d * e - 1) / off;
    for (size_t j = k + 2; j < n; j++) {
        double x = *at(a, n, j, k), y = *at(a, n, j, k + 1);
        double first = scale * (d * x - y), second = scale * (e * y - x);
        for (size_t i = j; i < n; i++)
            *at(a, n, i, j) -= *at(a, n, i, k) * first + *at(a, n, i, k + 1) * second;
        *at(a, n, j, k) = first;
        *at(a, n, j, k + 1) = second;
    }
}

int phys_lapack_symmetric_reduce(size_t n, size_t inner, double *a, int *pivots)
{
    int zero = 0;
    bool pair;
    for (size_t k = 0; k < inner; k += 1 + pair) {
        size_t to = choose_pivot(a, n, inner, k, &pair);
        if (to == n) {
            zero = zero ? zero : (int)(k + 1);
            pivots[k] = (int)(k + 1);
            continue;
        }
        pivots[k] = (int)(to + 1) * (pair ? -1 : 1);
        if (to != k + pair)
            interchange(a, n, k, k + pair, to);
        if (pair) {
            pivots[k + 1] = pivots[k];
            eliminate_pair(a, n, k);
        } else {
            eliminate_one(a, n, k);
        }
    }
    return zero;
}

static double below(const double *column, size_t from, size_t n, const double *b)
{
    double sum = 0;
    for (size_t i = from; i < n; i++)
        sum += column[i] * b[i];
    return sum;
}

/* P^-T L^-T b, the last of the three solves, for the first `inner` of n unknowns; columns of a are
   `stride` apart. */
static void solve_transposed(size_t n, size_t inner, size_t stride, const double *a,
                             const int *pivots, double *b)
{
    for (size_t k = inner; k-- > 0;) {
        size_t last = k;
        bool pair = pivots[k] < 0;
        b[k] -= below(a + k * stride, last + 1, n, b);
        if (pair) {
            k--;
            b[k] -= below(a + k * stride, last + 1, n, b);
        }
        swap(b + last, b + (pair ? -pivots[k] : pivots[k]) - 1);
    }
}

void phys_lapack_symmetric_forward(size_t n, size_t inner, const double *a, const int *pivots,
                                   double *b)
{
    for (size_t k = 0; k < inner; k++) {
        bool pair = pivots[k] < 0;
        const double *restrict x = a + k * n, *restrict y = x + n;
        swap(b + k + pair, b + (pair ? -pivots[k] : pivots[k]) - 1);
        for (size_t i = k + 1 + pair; i < n; i++)
            b[i] -= x[i] * b[k] + (pair ? y[i] * b[k + 1] : 0);
        if (pair) {
            double off = x[k + 1], d = x[k] / off, e = y[k + 1] / off;
            double first = b[k] / off, second = b[k + 1] / off, det = d * e - 1;
            b[k] = (e * first - second) / det;
            b[k + 1] = (d * second - first) / det;
            k++;
        } else {
            b[k] /= x[k];
        }
    }
}

void phys_lapack_symmetric_backward(size_t n, size_t inner, const double *a, const int *pivots,
                                    double *b)
{
    solve_transposed(n, inner, n, a, pivots, b);
}

void phys_lapack_symmetric_eliminated(size_t n, size_t inner, const double *a, const int *pivots,
                                      double *solved)
{
    for (size_t r = 0; r < n - inner; r++, solved += inner) {
        for (size_t k = 0; k < inner; k++)
            solved[k] = a[k * n + inner + r];
        solve_transposed(inner, inner, n, a, pivots, solved);
    }
}

int phys_lapack_symmetric_factor(size_t n, double *a, int *pivots, double *work)
{
    if (n == 1) {
        pivots[0] = 1;
        return a[0] == 0;
    }
    return n <= PHYS_SMALL ? phys_lapack_symmetric_reduce(n, n, a, pivots)
                           : phys_lapack_symmetric_factor_large(n, a, pivots, work);
}

size_t phys_lapack_symmetric_inertia(size_t n, size_t stride, const double *a, const int *pivots,
                                     double *log_determinant)
{
    size_t negative = 0;
    double product = 1;
    for (size_t k = 0; k < n; k++) {
        double d = a[k * stride + k], det = d;
        if (pivots[k] < 0) { /* a 2 x 2 pivot: one eigenvalue of either sign */
            double off = a[k * stride + k + 1];
            det = (d / off * a[(k + 1) * stride + k + 1] - off) * off;
            k++;
        }
        negative += det < 0;
        product *= fabs(det);
        if (!(product > 1e-150 && product < 1e150)) {
            *log_determinant += log(product);
            product = 1;
        }
    }
    *log_determinant += log(product);
    return negative;
}

void phys_lapack_symmetric_solve(size_t n, const double *a, const int *pivots, size_t m, double *b)
{
    if (n > PHYS_SMALL)
        phys_lapack_symmetric_solve_large(n, a, pivots, m, b);
    for (size_t k = 0; n == 1 && k < m; k++)
        b[k] /= a[0];
    for (size_t k = 0; n > 1 && n <= PHYS_SMALL && k < m; k++) {
        phys_lapack_symmetric_forward(n, n, a, pivots, b + k * n);
        phys_lapack_symmetric_backward(n, n, a, pivots, b + k * n);
    }
}
