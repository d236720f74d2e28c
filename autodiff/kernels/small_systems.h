/* Factors and solutions of small linear systems, one per column, for kernels.c: blocks of columns
   fill the vectors, and each column has pivots of its own.

   The factor of a matrix of n*n rows (row i*n + j is element (i, j)) has, in the same rows, L below
   the diagonal, U above it and the reciprocals of U's diagonal on it (LU), or L with the
   reciprocals of its diagonal (Cholesky); n more rows hold the pivots of LU. */

enum { BLOCK = 64 / sizeof(R) }; /* columns */

#ifdef AD_KERNEL_F32
#define UNIT FLT_EPSILON
#define MOST FLT_MAX
#else
#define UNIT DBL_EPSILON
#define MOST DBL_MAX
#endif

#define EACH_COLUMN _Pragma("omp simd") for (size_t l = 0; l < BLOCK; l++)

typedef R block[BLOCK];

/* A pivot no larger than the rounding of the terms it is the difference of, n units of their sum,
   has no correct digit and counts as 0; so does one that is, or whose reciprocal is, infinite or
   NaN. */
static void check_pivot(size_t n, const block terms, const block pivot, block reciprocal, block bad)
{
    EACH_COLUMN
    {
        R r = 1 / pivot[l], size = F(fabs)(pivot[l]);
        bool good = size > (R)n * UNIT * terms[l] && size <= MOST && F(fabs)(r) <= MOST;
        bad[l] = good ? bad[l] : 1;
        reciprocal[l] = r;
    }
}

static void swap_rows(size_t n, block *m, const block with, size_t k)
{
    for (size_t l = 0; l < BLOCK; l++) {
        size_t i = (size_t)with[l];
        for (size_t j = 0; i != k && j < n; j++) {
            R swap = m[k * n + j][l];
            m[k * n + j][l] = m[i * n + j][l];
            m[i * n + j][l] = swap;
        }
    }
}

static void lu_block(size_t n, block *m, block *pivot, block bad)
{
    for (size_t k = 0; k < n; k++) {
        block largest, terms = {0};
        EACH_COLUMN
        {
            pivot[k][l] = (R)k;
            largest[l] = F(fabs)(m[k * n + k][l]);
        }
        for (size_t i = k + 1; i < n; i++)
            EACH_COLUMN
            {
                R size = F(fabs)(m[i * n + k][l]);
                pivot[k][l] = size > largest[l] ? (R)i : pivot[k][l];
                largest[l] = size > largest[l] ? size : largest[l];
            }
        swap_rows(n, m, pivot[k], k);
        for (size_t j = 0; j < k; j++)
            EACH_COLUMN terms[l] += F(fabs)(m[k * n + j][l] * m[j * n + k][l]);
        check_pivot(n, terms, m[k * n + k], m[k * n + k], bad);
        for (size_t i = k + 1; i < n; i++) {
            EACH_COLUMN m[i * n + k][l] *= m[k * n + k][l];
            for (size_t j = k + 1; j < n; j++)
                EACH_COLUMN m[i * n + j][l] -= m[i * n + k][l] * m[k * n + j][l];
        }
    }
}

/* Of the lower triangle. */
static void cholesky_block(size_t n, block *m, block bad)
{
    for (size_t k = 0; k < n; k++) {
        block terms = {0}, pivot, reciprocal;
        for (size_t j = 0; j < k; j++)
            EACH_COLUMN terms[l] += m[k * n + j][l] * m[k * n + j][l];
        EACH_COLUMN
        {
            R rest = m[k * n + k][l] - terms[l];
            pivot[l] = rest > 0 ? rest : 0;
        }
        check_pivot(n, terms, pivot, reciprocal, bad);
        EACH_COLUMN m[k * n + k][l] = 1 / F(sqrt)(pivot[l]);
        for (size_t i = k + 1; i < n; i++) {
            for (size_t j = 0; j < k; j++)
                EACH_COLUMN m[i * n + k][l] -= m[i * n + j][l] * m[k * n + j][l];
            EACH_COLUMN m[i * n + k][l] *= m[k * n + k][l];
        }
    }
}

static void load(size_t rows, size_t w, block *to, const R *from, size_t ld)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t l = 0; l < BLOCK; l++) /* the last column is repeated to fill the block */
            to[i][l] = from[i * ld + (l < w ? l : w - 1)];
}

static void store(size_t rows, size_t w, R *to, size_t ld, block *from)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t l = 0; l < w; l++)
            to[i * ld + l] = from[i][l];
}

static size_t factor(size_t n, size_t cols, void *o, size_t ldo, const void *a, size_t lda,
                     bool cholesky)
{
    block m[(AD_MOST_SIDE + 1) * AD_MOST_SIDE];
    size_t rows = n * n + (cholesky ? 0 : n), first = SIZE_MAX;
    for (size_t c = 0; c < cols; c += BLOCK) {
        size_t w = cols - c < BLOCK ? cols - c : BLOCK;
        block bad = {0};
        load(n * n, w, m, (const R *)a + c, lda);
        if (cholesky)
            cholesky_block(n, m, bad);
        else
            lu_block(n, m, m + n * n, bad);
        for (size_t l = 0; l < w; l++) {
            for (size_t i = 0; bad[l] != 0 && i < n * n; i++)
                m[i][l] = (R)NAN;
            first = bad[l] != 0 && first == SIZE_MAX ? c + l : first;
        }
        store(rows, w, (R *)o + c, ldo, m);
    }
    return first;
}

static inline void eliminate(block x, const block f, const block with)
{
    EACH_COLUMN x[l] -= f[l] * with[l];
}

static inline void scale(block x, const block f) { EACH_COLUMN x[l] *= f[l]; }

/* LU: L below the diagonal, with unit diagonal, and U above; transposed, the other way round. */
static void solve_block(size_t n, block *f, block *x, bool cholesky, bool transposed)
{
    const block *pivot = (const block *)f + n * n;
    bool lower_unit = !cholesky && !transposed, upper_unit = !cholesky && transposed;
    for (size_t k = 0; !cholesky && !transposed && k < n; k++)
        swap_rows(1, x, pivot[k], k);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++)
            eliminate(x[i], f[cholesky || !transposed ? i * n + j : j * n + i], x[j]);
        if (!lower_unit)
            scale(x[i], f[i * n + i]);
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t j = i + 1; j < n; j++)
            eliminate(x[i], f[cholesky || transposed ? j * n + i : i * n + j], x[j]);
        if (!upper_unit)
            scale(x[i], f[i * n + i]);
    }
    for (size_t k = n; !cholesky && transposed && k-- > 0;)
        swap_rows(1, x, pivot[k], k);
}

static void solve(size_t n, size_t m, size_t cols, void *o, size_t ldo, const void *f, size_t ldf,
                  const void *b, size_t ldb, bool cholesky, bool transposed)
{
    block factors[(AD_MOST_SIDE + 1) * AD_MOST_SIDE], x[AD_MOST_SIDE];
    for (size_t c = 0; c < cols; c += BLOCK) {
        size_t w = cols - c < BLOCK ? cols - c : BLOCK;
        load(n * n + (cholesky ? 0 : n), w, factors, (const R *)f + c, ldf);
        for (size_t k = 0; k < m; k++) { /* right sides one at a time, so that any number will do */
            load(n, w, x, (const R *)b + k * ldb + c, m * ldb);
            solve_block(n, factors, x, cholesky, transposed);
            store(n, w, (R *)o + k * ldo + c, m * ldo, x);
        }
    }
}

static void logdet(size_t n, size_t cols, void *o, const void *f, size_t ldf, bool cholesky)
{
    R *y = o;
    for (size_t c = 0; c < cols; c++) {
        double s = 0;
        for (size_t i = 0; i < n; i++)
            s -= log(fabs((double)((const R *)f)[(i * n + i) * ldf + c]));
        y[c] = (R)(cholesky ? 2 * s : s);
    }
}
