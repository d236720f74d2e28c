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

/* Pivots are the largest with rows scaled to one length: no scale of an equation costs a digit. */
static void lu_block(size_t n, block *m, block *pivot, block *weight, block bad)
{
    for (size_t k = 0; k < n; k++) {
        block largest, terms = {0};
        EACH_COLUMN
        {
            pivot[k][l] = (R)k;
            largest[l] = F(fabs)(m[k * n + k][l]) * weight[k][l];
        }
        for (size_t i = k + 1; i < n; i++)
            EACH_COLUMN
            {
                R size = F(fabs)(m[i * n + k][l]) * weight[i][l];
                pivot[k][l] = size > largest[l] ? (R)i : pivot[k][l];
                largest[l] = size > largest[l] ? size : largest[l];
            }
        swap_rows(n, m, pivot[k], k);
        for (size_t i = k + 1; i < n; i++)
            EACH_COLUMN weight[i][l] = pivot[k][l] == (R)i ? weight[k][l] : weight[i][l];
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

/* ---- condition ---- */

/* The condition number that counts is that of the matrix with rows, then columns, scaled to a
   largest element of 1: scales cost no digit. Where a rounding of the elements can change the
   solution by half, the matrix counts as singular. */
#define NO_DIGIT (R)(0.5 / UNIT)
/* It is estimated where a bound cannot rule out that three quarters of the digits are lost. */
#define FEW_DIGITS F(pow)(UNIT, (R)-0.75)

/* For LU squared lengths of the rows, and what rows are compared by for pivots: 1 / (sum of
   |element|); for Cholesky the diagonal. */
static void row_sizes(size_t n, block *m, bool cholesky, block *size, block *weight)
{
    for (size_t i = 0; i < n; i++) {
        block squares = {0}, sum = {0};
        for (size_t j = 0; j < n && !cholesky; j++)
            EACH_COLUMN
            {
                R x = m[i * n + j][l];
                squares[l] += x * x;
                sum[l] += F(fabs)(x);
            }
        memcpy(size[i], cholesky ? m[i * n + i] : squares, sizeof squares);
        if (!cholesky)
            EACH_COLUMN weight[i][l] = 1 / sum[l];
    }
}

/* With rows of length 1 the condition number is below 2 / |det| (Guggenheimer, Edelman, Johnson,
   A simple estimate of the condition number of a linear system, 1995). With a diagonal of 1,
   positive definite, the smallest eigenvalue is above det / e, as the others' product is at most
   that of equal ones, and the largest at most n. Products under 1 are those of overflow. */
static bool may_be_large(size_t n, block *f, block *size, bool cholesky)
{
    const R few = FEW_DIGITS, most = cholesky ? few / (R)(2.72 * (double)n) : few * few / 4;
    block product;
    R large = 0;
    EACH_COLUMN product[l] = 1;
    for (size_t i = 0; i < n; i++)
        EACH_COLUMN product[l] *= size[i][l] * f[i * n + i][l] * f[i * n + i][l];
    _Pragma("omp simd reduction(+ : large)") for (size_t l = 0; l < BLOCK; l++) large +=
        product[l] > (R)0.5 && product[l] < most ? 0 : 1;
    return large > 0;
}

static inline void raise_to(block most, const block x)
{
    EACH_COLUMN most[l] = x[l] > most[l] ? x[l] : most[l];
}

/* Largest elements of rows, of columns once rows are divided by theirs, and the 1-norm with both
   divided. */
static void scales(size_t n, size_t w, const R *a, size_t lda, block *row, block *col, block norm)
{
    block sum[AD_MOST_SIDE] = {{0}}, x[AD_MOST_SIDE];
    for (size_t i = 0; i < n; i++) {
        block r;
        load(n, w, x, a + i * n * lda, lda);
        for (size_t j = 0; j < n; j++) {
            EACH_COLUMN x[j][l] = F(fabs)(x[j][l]);
            raise_to(row[i], x[j]);
        }
        EACH_COLUMN r[l] = 1 / row[i][l];
        for (size_t j = 0; j < n; j++) {
            scale(x[j], r);
            EACH_COLUMN sum[j][l] += x[j][l];
            raise_to(col[j], x[j]);
        }
    }
    for (size_t j = 0; j < n; j++) {
        EACH_COLUMN sum[j][l] /= col[j][l];
        raise_to(norm, sum[j]);
    }
}

/* x becomes the solution of the matrix divided so. */
static void solve_scaled(size_t n, block *f, block *x, block *scale_of, block *scale_to,
                         bool cholesky, bool transposed)
{
    for (size_t i = 0; i < n; i++)
        scale(x[i], scale_of[i]);
    solve_block(n, f, x, cholesky, transposed);
    for (size_t i = 0; i < n; i++)
        scale(x[i], scale_to[i]);
}

/* Of each column, with the 1-norm of the inverse from below by one step of Hager's ascent (Higham,
   Accuracy and stability of numerical algorithms, 15.3), from alternating signs. */
static void condition_block(size_t n, size_t w, const R *a, size_t lda, block *f, bool cholesky,
                            block condition)
{
    block row[AD_MOST_SIDE] = {{0}}, col[AD_MOST_SIDE] = {{0}}, x[AD_MOST_SIDE], norm = {0},
          most = {0}, size;
    scales(n, w, a, lda, row, col, norm);
    for (size_t i = 0; i < n; i++)
        EACH_COLUMN x[i][l] = (R)(i % 2 ? -1 : 1) * (1 + (R)i / (R)n);
    solve_scaled(n, f, x, row, col, cholesky, false);
    for (size_t i = 0; i < n; i++)
        EACH_COLUMN x[i][l] = x[i][l] < 0 ? -1 : 1;
    solve_scaled(n, f, x, col, row, cholesky, true);
    for (size_t i = 0; i < n; i++) {
        EACH_COLUMN size[l] = F(fabs)(x[i][l]);
        raise_to(most, size);
    }
    EACH_COLUMN condition[l] = norm[l] * most[l];
}

static struct ad_factored factor_columns(size_t n, size_t cols, void *o, size_t ldo, const void *a,
                                         size_t lda, bool cholesky)
{
    block m[(AD_MOST_SIDE + 1) * AD_MOST_SIDE], size[AD_MOST_SIDE], weight[AD_MOST_SIDE];
    const size_t rows = n * n + (cholesky ? 0 : n);
    struct ad_factored found = {.singular = SIZE_MAX};
    for (size_t c = 0; c < cols; c += BLOCK) {
        size_t w = cols - c < BLOCK ? cols - c : BLOCK;
        block bad = {0}, condition = {0};
        load(n * n, w, m, (const R *)a + c, lda);
        row_sizes(n, m, cholesky, size, weight);
        if (cholesky)
            cholesky_block(n, m, bad);
        else
            lu_block(n, m, m + n * n, weight, bad);
        if (may_be_large(n, m, size, cholesky))
            condition_block(n, w, (const R *)a + c, lda, m, cholesky, condition);
        for (size_t l = 0; l < w; l++) {
            bool known = condition[l] <= MOST,
                 singular = bad[l] != 0 || (known && condition[l] > NO_DIGIT);
            for (size_t i = 0; singular && i < n * n; i++)
                m[i][l] = (R)NAN;
            if (!singular)
                found.condition =
                    fmax(found.condition, known ? (double)condition[l] : (double)INFINITY);
            else if (found.singular == SIZE_MAX)
                found.singular = c + l;
        }
        store(rows, w, (R *)o + c, ldo, m);
    }
    return found;
}

static void solve_columns(size_t n, size_t m, size_t cols, void *o, size_t ldo, const void *f,
                          size_t ldf, const void *b, size_t ldb, bool cholesky, bool transposed)
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

static void logdet_columns(size_t n, size_t cols, void *o, const void *f, size_t ldf, bool cholesky)
{
    R *y = o;
    for (size_t c = 0; c < cols; c++) {
        double s = 0;
        for (size_t i = 0; i < n; i++)
            s -= log(fabs((double)((const R *)f)[(i * n + i) * ldf + c]));
        y[c] = (R)(cholesky ? 2 * s : s);
    }
}
