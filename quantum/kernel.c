/* The matrix of amplitudes exp(i S_ab / hbar) (quantum.h). Real and imaginary parts are nodes of
   the program that computes the actions; it runs over a few rows at a time, which stay in cache. */
#include "internal.h"
#include "autodiff/sized.h"
#include "physics/linear/linear.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 32768 };       /* paths of one run, about */
enum { MOST_SQUARES = 1000 }; /* 2^times is a number */

/* Half the width of the range in which images fade out, relative to its centre. Packets with
   momenta below 1 - FADE of the grid's largest are unaffected. */
static const double FADE = 0.5;

struct kernel {
    const struct qm_slice *slice;
    size_t n, rows; /* of K in one run */
    struct qm_paths paths;
    ad_var re, im;
    ad_program *program;
};

/* 1 for paths slower than the grid's fastest wave, 0 for faster ones, smooth between, with weights
   that add up to 1 at equal distances above and below: what an image loses its ghost, also an
   image, gains, so that K is unitary if the box is a whole number of ghosts long. */
static ad_var fade(const struct kernel *k)
{
    double scale = qm_dx(&k->slice->grid) / (M_PI * k->slice->hbar);
    ad_var speed = ad_mul(scale, ad_mul(ad_abs(k->paths.distance), k->paths.mixed));
    ad_var u = ad_min(ad_max(ad_mul(1 / FADE, ad_sub(speed, 1.0)), -0.9999), 0.9999);
    return ad_sigmoid(ad_div(ad_mul(-2.0, u), ad_sub(1.0, ad_square(u))));
}

static enum ad_status compile(struct kernel *k, struct ad_error *error)
{
    const struct qm_slice *slice = k->slice;
    if (qm_paths_record(slice, k->rows * k->n, &k->paths, error) != AD_OK)
        return error->status;
    ad_var amplitude =
        ad_mul(qm_dx(&slice->grid), ad_sqrt(ad_mul(1 / (2 * M_PI * slice->hbar), k->paths.mixed)));
    if (slice->walls != QM_OPEN)
        amplitude = ad_mul(ad_mul(k->paths.s, amplitude), fade(k));
    ad_var phase = ad_sub(ad_mul(1 / slice->hbar, k->paths.action), M_PI / 4); /* 1/sqrt(i) */
    k->re = ad_mul(amplitude, ad_cos(phase));
    k->im = ad_mul(amplitude, ad_sin(phase));
    ad_compile(k->paths.tape, 2, (ad_var[]){k->re, k->im}, &k->program);
    if (phys_tape_status(k->paths.tape, error) == AD_OK)
        ad_set_threads(k->program, slice->threads);
    return error->status;
}

static enum ad_status open(const struct qm_slice *slice, size_t most, struct kernel *k,
                           struct ad_error *error)
{
    size_t n = slice->grid.n, rows = n < LANES ? LANES / n : 1;
    *k = (struct kernel){.slice = slice, .n = n, .rows = rows < most ? rows : most};
    if (compile(k, error) != AD_OK)
        return error->status;
    double *xb = ad_data(k->program, k->paths.xb);
    for (size_t p = 0; p < k->rows * n; p++)
        xb[p] = qm_x(&slice->grid, p % n);
    return AD_OK;
}

static void close_kernel(struct kernel *k)
{
    ad_program_free(k->program);
    qm_paths_free(&k->paths);
}

/* Adds the paths from one image of the starts to rows of K. */
static void add_image(struct kernel *k, double s, double c, qm_complex *K)
{
    ad_set(k->program, k->paths.s, &s);
    ad_set(k->program, k->paths.c, &c);
    ad_run(k->program);
    const double *re = ad_data(k->program, k->re), *im = ad_data(k->program, k->im);
    for (size_t p = 0; p < k->rows * k->n; p++)
        K[p] += re[p] + I * im[p];
}

/* Images are at s x + c: windings at x + j L; behind walls at x + 2 j L and 2 low - x + 2 j L. */
static void add_images(struct kernel *k, double reach, qm_complex *K)
{
    const struct qm_grid *grid = &k->slice->grid;
    double L = grid->high - grid->low, period = k->slice->walls == QM_RING ? L : 2 * L;
    if (k->slice->walls == QM_OPEN) {
        add_image(k, 1, 0, K);
        return;
    }
    int most = (int)ceil((reach + L) / period);
    for (int j = -most; j <= most; j++) {
        if (fabs(j * period) - L < reach)
            add_image(k, 1, j * period, K);
        if (k->slice->walls == QM_REFLECT && fabs(j * period - L) - L < reach)
            add_image(k, -1, 2 * grid->low + j * period, K);
    }
}

/* From 1 at the inner edge of a layer to 0 at the wall. Waves that are long beside the layer are
   thrown back by any such slope. */
void qm_absorber(const struct qm_slice *slice, double *mask)
{
    const struct qm_grid *grid = &slice->grid;
    for (size_t a = 0; a < grid->n; a++) {
        double x = qm_x(grid, a), room = fmin(x - grid->low, grid->high - x);
        mask[a] = room < slice->absorb ? sin(0.5 * M_PI * room / slice->absorb) : 1;
    }
}

static enum ad_status absorb(const struct qm_slice *slice, qm_complex *K, struct ad_error *error)
{
    size_t n = slice->grid.n;
    double *mask = malloc(n * sizeof *mask);
    if (!mask)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    qm_absorber(slice, mask);
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++)
            K[a * n + b] *= mask[a];
    free(mask);
    return AD_OK;
}

static void fill(struct kernel *k, double reach, size_t from, size_t rows, qm_complex *K)
{
    double *xa = ad_data(k->program, k->paths.xa);
    for (size_t done = 0; done < rows; done += k->rows) {
        size_t row = done + k->rows <= rows ? done : rows - k->rows; /* the last run overlaps */
        for (size_t r = 0; r < k->rows; r++) {
            double x = qm_x(&k->slice->grid, from + row + r);
            for (size_t b = 0; b < k->n; b++)
                xa[r * k->n + b] = x;
        }
        memset(K + row * k->n, 0, k->rows * k->n * sizeof *K);
        add_images(k, reach, K + row * k->n);
    }
}

enum ad_status qm_kernel_rows(const struct qm_slice *slice, size_t first, size_t rows,
                              qm_complex *K, struct ad_error *error)
{
    struct qm_aliasing aliasing;
    struct kernel k = {0};
    if (AD_LACKS(error, K) || qm_aliasing(slice, &aliasing, error) != AD_OK)
        return error->status;
    if (open(slice, rows, &k, error) == AD_OK)
        fill(&k, (1 + FADE) * aliasing.ghost / 2, first, rows, K);
    close_kernel(&k);
    return error->status;
}

enum ad_status qm_kernel(const struct qm_slice *slice, qm_complex *K, struct ad_error *error)
{
    if (qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    if (qm_kernel_rows(slice, 0, slice->grid.n, K, error) == AD_OK && slice->absorb > 0)
        absorb(slice, K, error);
    return error->status;
}

enum ad_status qm_kernel_square(size_t n, size_t times, qm_complex *K, struct ad_error *error)
{
    if (AD_LACKS(error, K))
        return error->status;
    if (times > MOST_SQUARES)
        return ad_fail(error, AD_E_ARGUMENT, "kernel: expected at most %d squarings, got %zu",
                       MOST_SQUARES, times);
    if (!K || !n || n > SIZE_MAX / n / sizeof *K)
        return ad_fail(error, AD_E_ARGUMENT, "kernel: expected n x n numbers, got %s, n = %zu",
                       K ? "some" : "NULL", n);
    qm_complex *square = malloc(n * n * sizeof *square);
    if (!square)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu x %zu", n, n);
    for (size_t k = 0; k < times; k++) {
        phys_lapack_gemm_complex(false, n, n, n, (const double *)K, (const double *)K,
                                 (double *)square);
        memcpy(K, square, n * n * sizeof *K);
    }
    free(square);
    return AD_OK;
}

void qm_kernel_apply(size_t n, const qm_complex *K, size_t packets, const qm_complex *psi,
                     qm_complex *out)
{
    if (!n || !packets || !K || !psi || !out) {
        qm_unknown(n * packets, 1, out);
        return;
    }
    phys_lapack_gemm_complex(false, n, packets, n, (const double *)K, (const double *)psi,
                             (double *)out);
}
