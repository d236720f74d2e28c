/* LU of narrow systems by partial pivoting, of NUMBER, double or double complex: linear.c includes
   this for each. That costs less than a call of LAPACK, and far less than loading it. Without
   guard. NAME(f) names a function, SIZE(x) orders pivots, TIMES(x, y) is a product. */

static int NAME(factor)(struct narrow s, void *matrix, int *pivots)
{
    NUMBER *a = matrix;
    int info = 0;
    for (size_t k = s.width + 1; k < s.n; k++)
        for (size_t i = k - least(k, 2 * s.width); i + s.width < k; i++)
            a[i * s.row + k * s.column] = 0;
    for (size_t j = 0; j < s.n; j++) {
        const size_t below = least(s.n - 1, j + s.width), right = least(s.n - 1, j + 2 * s.width);
        NUMBER *column = a + j * s.column;
        size_t p = j;
        for (size_t i = j + 1; i <= below; i++)
            if (SIZE(column[i * s.row]) > SIZE(column[p * s.row]))
                p = i;
        pivots[j] = (int)p + 1; /* as LAPACK counts */
        const NUMBER pivot = column[p * s.row];
        if (pivot == 0) {
            info = info ? info : (int)j + 1;
            continue;
        }
        column[p * s.row] = column[j * s.row];
        column[j * s.row] = pivot;
        for (size_t i = j + 1; i <= below; i++)
            column[i * s.row] /= pivot;
        for (size_t k = j + 1; k <= right; k++) {
            NUMBER *to = a + k * s.column, above = to[p * s.row];
            to[p * s.row] = to[j * s.row];
            to[j * s.row] = above;
            if (s.row == 1) {
#pragma omp simd
                for (size_t i = j + 1; i <= below; i++)
                    to[i] -= TIMES(column[i], above);
            } else {
                for (size_t i = j + 1; i <= below; i++)
                    to[i * s.row] -= TIMES(column[i * s.row], above);
            }
        }
    }
    return info;
}

/* x = L^-1 P^-1 x. */
static void NAME(forward)(struct narrow s, const NUMBER *a, const int *pivots, NUMBER *x)
{
    for (size_t j = 0; j < s.n; j++) {
        const size_t p = (size_t)pivots[j] - 1, below = least(s.n - 1, j + s.width);
        const NUMBER top = x[p];
        x[p] = x[j];
        x[j] = top;
        for (size_t i = j + 1; i <= below; i++)
            x[i] -= TIMES(a[i * s.row + j * s.column], top);
    }
}

static void NAME(forward_all)(struct narrow s, const void *matrix, const int *pivots, size_t m,
                              void *block)
{
    for (size_t k = 0; k < m; k++)
        NAME(forward)(s, matrix, pivots, (NUMBER *)block + k * s.n);
}

static void NAME(solve)(struct narrow s, const void *matrix, const int *pivots, void *right)
{
    const NUMBER *a = matrix;
    NUMBER *x = right;
    NAME(forward)(s, a, pivots, x);
    for (size_t j = s.n; j-- > 0;) {
        x[j] /= a[j * (s.row + s.column)];
        for (size_t i = j - least(j, 2 * s.width); i < j; i++)
            x[i] -= TIMES(a[i * s.row + j * s.column], x[j]);
    }
}

/* y -= a x for a dense a. */
static void NAME(subtract)(struct narrow s, const void *matrix, const void *of, void *from)
{
    const NUMBER *a = matrix, *x = of;
    NUMBER *y = from;
    for (size_t j = 0; j < s.n; j++)
        for (size_t i = 0; i < s.n; i++)
            y[i] -= TIMES(a[i * s.row + j * s.column], x[j]);
}

/* Columns become rows. */
static void NAME(transpose)(size_t n, size_t m, const NUMBER *block, NUMBER *to)
{
    for (size_t k = 0; k < m; k++)
        for (size_t i = 0; i < n; i++)
            to[i * m + k] = block[k * n + i];
}

/* y -= factor x, [m] each. */
static void NAME(subtract_row)(size_t m, NUMBER factor, const NUMBER *restrict x,
                               NUMBER *restrict y)
{
#pragma omp simd
    for (size_t k = 0; k < m; k++)
        y[k] -= TIMES(factor, x[k]);
}

/* phys_lapack_block_eliminate, where `other` holds b, too: by rows of all columns at a time. */
static void NAME(eliminate)(struct narrow s, const void *matrix, const int *pivots, size_t m,
                            void *block, void *other, void *result)
{
    const NUMBER *a = matrix;
    NUMBER *work = other, *c = result, b[NARROW * NARROW];
    NAME(transpose)(s.n, m, block, b);
    NAME(forward_all)(s, a, pivots, m, work);
    for (size_t j = 0; j < s.n; j++) { /* U^T y = b */
        for (size_t i = 0; i < j; i++)
            NAME(subtract_row)(m, a[i * s.row + j * s.column], b + i * m, b + j * m);
        for (size_t k = 0; k < m; k++)
            b[j * m + k] /= a[j * (s.row + s.column)];
    }
    for (size_t j = 0; j < m; j++)
        for (size_t k = 0; k < s.n; k++)
            NAME(subtract_row)(m, work[k + j * s.n], b + k * m, c + j * m);
}

#undef NUMBER
#undef NAME
#undef SIZE
#undef TIMES
