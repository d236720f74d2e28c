/* How many eigenvalues of a symmetric band matrix are negative: block elimination,
       D_1 = A_1,   D_i+1 = A_i+1 - B_i^T D_i^-1 B_i,
   over blocks of as many rows as the band is wide; their inertias add up (Haynsworth, Linear
   Algebra Appl. 1, 73, 1968). Pivots are chosen within blocks (Bunch, Kaufman). */
#include "autodiff/blas.h"
#include "linear.h"

#include <stdlib.h>
#include <string.h>

struct elimination {
    size_t width;
    const double *band;
    double *D; /* [width x width] by columns, as are the next four */
    int *pivots;
    double *before, *B, *Y, *X, *work; /* [64 width] */
};

static double element(const struct elimination *s, size_t i, size_t j)
{
    const size_t above = i < j ? i : j, apart = i < j ? j - i : i - j;
    return apart > s->width ? 0 : s->band[above * (s->width + 1) + apart];
}

/* D of the block of `count` rows from `first` on; that before is factored. */
static void next_block(struct elimination *s, size_t first, size_t count)
{
    const size_t m = s->width;
    for (size_t j = 0; j < count; j++)
        for (size_t i = 0; i < count; i++)
            s->D[j * count + i] = element(s, first + i, first + j);
    if (first == 0)
        return;
    for (size_t j = 0; j < count; j++)
        for (size_t i = 0; i < m; i++)
            s->B[j * m + i] = element(s, first - m + i, first + j);
    memcpy(s->Y, s->B, count * m * sizeof *s->Y);
    phys_lapack_symmetric_solve(m, s->before, s->pivots, count, s->Y);
    ad_blas_gemm(AD_F64, false, true, count, count, m, s->Y, m, s->B, m, false, s->X, count);
    for (size_t k = 0; k < count * count; k++)
        s->D[k] -= s->X[k];
}

bool phys_band_inertia(size_t n, size_t width, const double *band, size_t *negative, bool *memory)
{
    const size_t m = width, square = m * m;
    double *room = malloc((5 * square + 64 * m) * sizeof *room), unused = 0;
    int *pivots = malloc(m * sizeof *pivots);
    bool regular = *memory = room && pivots;
    struct elimination s = {.width = width, .band = band, .D = room, .pivots = pivots};
    *negative = 0;
    if (*memory) {
        s.before = room + square;
        s.B = s.before + square;
        s.Y = s.B + square;
        s.X = s.Y + square;
        s.work = s.X + square;
    }
    for (size_t first = 0; regular && first < n; first += m) {
        const size_t count = n - first < m ? n - first : m;
        next_block(&s, first, count);
        regular = phys_lapack_symmetric_factor(count, s.D, pivots, s.work) == 0;
        *negative += phys_lapack_symmetric_inertia(count, count, s.D, pivots, &unused);
        double *swap = s.before;
        s.before = s.D;
        s.D = swap;
    }
    free(room);
    free(pivots);
    return regular;
}
