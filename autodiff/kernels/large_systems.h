/* One matrix of more than AD_MOST_SIDE rows, by LAPACK, for kernels.c. Rows and columns are scaled
   by powers of 2 to a largest element of about 1 (Cholesky: to a diagonal of about 1), so that
   scales cost no digit.

   The factor of an n x n matrix has n*n numbers of the factors of the scaled one (ad_blas_factor),
   then n scales of rows, n of columns, n pivots, and n to work with. */

static R scale_for(R size, int root)
{
    return size > 0 && size <= MOST ? F(scalbn)(1, -F(ilogb)(size) / root) : (R)NAN;
}

/* Scales of rows, then of columns, and m = the scaled matrix, whose 1-norm is returned. */
static R scale_matrix(size_t n, R *m, const R *a, size_t lda, bool cholesky)
{
    R *row = m + n * n, *col = row + n, *sum = col + 2 * n, norm = 0;
    for (size_t i = 0; i < n; i++) {
        R largest = cholesky ? a[(i * n + i) * lda] : 0;
        for (size_t j = 0; j < n && !cholesky; j++)
            largest = F(fmax)(largest, F(fabs)(a[(i * n + j) * lda]));
        row[i] = scale_for(largest, cholesky ? 2 : 1);
        col[i] = cholesky ? row[i] : 0;
        sum[i] = 0;
    }
    for (size_t i = 0; i < n && !cholesky; i++)
        for (size_t j = 0; j < n; j++)
            col[j] = F(fmax)(col[j], F(fabs)(a[(i * n + j) * lda] * row[i]));
    for (size_t j = 0; j < n && !cholesky; j++)
        col[j] = scale_for(col[j], 1);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            m[i * n + j] = a[(i * n + j) * lda] * row[i] * col[j];
            sum[j] += F(fabs)(m[i * n + j]);
        }
    for (size_t j = 0; j < n; j++)
        norm = F(fmax)(norm, sum[j]);
    return norm;
}

static void permute(size_t n, size_t w, R *x, size_t ldx, const int *pivot, bool ascending)
{
    for (size_t s = 0; s < n; s++) {
        const size_t k = ascending ? s : n - 1 - s, i = (size_t)pivot[k] - 1;
        for (size_t j = 0; i != k && j < w; j++) {
            R swap = x[k * ldx + j];
            x[k * ldx + j] = x[i * ldx + j];
            x[i * ldx + j] = swap;
        }
    }
}

/* x [n x w] becomes the solution of the scaled matrix. */
static void solve_large_scaled(size_t n, size_t w, const R *f, R *x, size_t ldx, bool cholesky,
                               bool transposed)
{
    const int *pivot = (const int *)(const void *)(f + n * n + 2 * n);
    const bool back = transposed && !cholesky, forth = !transposed && !cholesky;
    if (back)
        permute(n, w, x, ldx, pivot, true);
    ad_blas_triangle(TYPE, back, back, back, n, w, f, x, ldx);
    ad_blas_triangle(TYPE, forth, !forth, forth, n, w, f, x, ldx);
    if (forth)
        permute(n, w, x, ldx, pivot, false);
}

/* As condition_block, for a matrix of this 1-norm; NaN or infinite where a solution is. */
static R large_condition(size_t n, R *f, R norm, bool cholesky)
{
    R *x = f + n * n + 3 * n, most = 0;
    for (size_t i = 0; i < n; i++)
        x[i] = (R)(i % 2 ? -1 : 1) * (1 + (R)i / (R)n);
    solve_large_scaled(n, 1, f, x, 1, cholesky, false);
    for (size_t i = 0; i < n; i++)
        x[i] = x[i] < 0 ? -1 : x[i] >= 0 ? 1 : x[i];
    solve_large_scaled(n, 1, f, x, 1, cholesky, true);
    for (size_t i = 0; i < n; i++) {
        most = F(fmax)(most, F(fabs)(x[i]));
        norm += 0 * x[i];
    }
    return norm * most;
}

static struct ad_factored factor_large(size_t n, R *f, const R *a, size_t lda, bool cholesky)
{
    int *pivot = (int *)(void *)(f + n * n + 2 * n);
    const R norm = scale_matrix(n, f, a, lda, cholesky);
    const bool regular = ad_blas_factor(TYPE, cholesky, n, f, pivot);
    const R condition = regular ? large_condition(n, f, norm, cholesky) : (R)NAN;
    const bool singular = !(condition <= NO_DIGIT);
    for (size_t i = 0; singular && i < n * n + 2 * n; i++)
        f[i] = (R)NAN;
    return (struct ad_factored){.singular = singular ? 0 : SIZE_MAX,
                                .condition = condition > FEW_DIGITS ? (double)condition : 0};
}

/* All right sides at once, unless rows of o lie apart. */
static void solve_large(size_t n, size_t m, R *o, size_t ldo, const R *f, const R *b, size_t ldb,
                        bool cholesky, bool transposed)
{
    const R *row = f + n * n, *col = row + n, *before = transposed ? col : row,
            *after = transposed ? row : col;
    const size_t w = ldo == 1 ? m : 1, ldx = m * ldo;
    for (size_t k = 0; k < m; k += w) {
        R *x = o + k * ldo;
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < w; j++)
                x[i * ldx + j] = b[(i * m + k + j) * ldb] * before[i];
        solve_large_scaled(n, w, f, x, ldx, cholesky, transposed);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < w; j++)
                x[i * ldx + j] *= after[i];
    }
}

static R logdet_large(size_t n, const R *f, bool cholesky)
{
    const R *row = f + n * n, *col = row + n;
    double s = 0;
    for (size_t i = 0; i < n; i++)
        s += (cholesky ? 2 : 1) * log(fabs((double)f[i * n + i])) - log((double)row[i]) -
             log((double)col[i]);
    return (R)s;
}

/* ---- of either size ---- */

static struct ad_factored factor(size_t n, size_t cols, void *o, size_t ldo, const void *a,
                                 size_t lda, bool cholesky)
{
    return n > AD_MOST_SIDE ? factor_large(n, o, a, lda, cholesky)
                            : factor_columns(n, cols, o, ldo, a, lda, cholesky);
}

static void solve(size_t n, size_t m, size_t cols, void *o, size_t ldo, const void *f, size_t ldf,
                  const void *b, size_t ldb, bool cholesky, bool transposed)
{
    if (n > AD_MOST_SIDE)
        solve_large(n, m, o, ldo, f, b, ldb, cholesky, transposed);
    else
        solve_columns(n, m, cols, o, ldo, f, ldf, b, ldb, cholesky, transposed);
}

static void logdet(size_t n, size_t cols, void *o, const void *f, size_t ldf, bool cholesky)
{
    if (n > AD_MOST_SIDE)
        *(R *)o = logdet_large(n, f, cholesky);
    else
        logdet_columns(n, cols, o, f, ldf, cholesky);
}
