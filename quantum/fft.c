/* Stockham's FFT: radix 2, sorted without bit reversal, each pass from one pair of arrays to the
   other (Van Loan, Computational Frameworks for the Fast Fourier Transform, 1992, section 1.7).
   Real and imaginary parts are separate, so the inner loops vectorise. */
#include "fft.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum ad_status qm_fft_new(size_t n, struct qm_fft *fft, struct ad_error *error)
{
    *fft = (struct qm_fft){.n = n, .cosine = malloc(3 * n * sizeof(double))};
    if (!fft->cosine)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a transform of %zu", n);
    fft->sine = fft->cosine + n / 2;
    fft->re = fft->sine + n / 2;
    fft->im = fft->re + n;
    for (size_t k = 0; k < n / 2; k++) {
        fft->cosine[k] = cos(2 * M_PI * (double)k / (double)n);
        fft->sine[k] = sin(2 * M_PI * (double)k / (double)n);
    }
    return AD_OK;
}

void qm_fft_free(struct qm_fft *fft)
{
    free(fft->cosine);
    *fft = (struct qm_fft){0};
}

/* One butterfly for `run` neighbours: even = a + b, odd = (a - b) exp(-i angle). */
static inline void butterflies(size_t run, double c, double s, const double *restrict are,
                               const double *restrict aim, const double *restrict bre,
                               const double *restrict bim, double *restrict ere,
                               double *restrict eim, double *restrict ore, double *restrict oim)
{
#pragma omp simd
    for (size_t q = 0; q < run; q++) {
        double re = are[q] - bre[q], im = aim[q] - bim[q];
        ere[q] = are[q] + bre[q];
        eim[q] = aim[q] + bim[q];
        ore[q] = re * c + im * s;
        oim[q] = im * c - re * s;
    }
}

/* From x to y: `run` interleaved transforms of n/run numbers become 2 run of half as many. */
static void pass(const struct qm_fft *fft, size_t run, const double *xre, const double *xim,
                 double *yre, double *yim)
{
    size_t half = fft->n / 2 / run;
    for (size_t p = 0; p < half; p++) {
        size_t a = run * p, b = run * (p + half), even = 2 * run * p, odd = even + run;
        butterflies(run, fft->cosine[p * run], fft->sine[p * run], xre + a, xim + a, xre + b,
                    xim + b, yre + even, yim + even, yre + odd, yim + odd);
    }
}

void qm_fft_run(struct qm_fft *fft, double *re, double *im)
{
    double *x[2] = {re, im}, *y[2] = {fft->re, fft->im};
    for (size_t run = 1; run < fft->n; run *= 2) {
        pass(fft, run, x[0], x[1], y[0], y[1]);
        for (int part = 0; part < 2; part++) {
            double *swap = x[part];
            x[part] = y[part];
            y[part] = swap;
        }
    }
    if (x[0] != re) {
        memcpy(re, x[0], fft->n * sizeof *re);
        memcpy(im, x[1], fft->n * sizeof *im);
    }
}
