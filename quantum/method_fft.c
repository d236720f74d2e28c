/* Propagation by FFT. If S_ab = D (x_a - x_b)^2/2 + f(a) + g(b), as for every L = m v^2/2 - V(q)
   under a rule that evaluates L at the ends of paths, K is a Toeplitz matrix between two diagonal
   ones, and its product a convolution: n log n instead of n^2, with the same numbers as the matrix.
 */
#include "autodiff/free.h"
#include "internal.h"
#include "fft.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

struct convolution {
    size_t n;
    struct qm_fft fft;
    qm_complex *before, *after; /* [n] exp(i g / hbar); exp(i f / hbar) and the absorbing layers */
    double *tre, *tim;          /* [fft.n] transform of the Toeplitz matrix's first column */
    double *re, *im;            /* [fft.n] */
};

/* A ring of a power of two needs no room around it. */
static bool is_round(const struct qm_slice *slice)
{
    return slice->walls == QM_RING && (slice->grid.n & (slice->grid.n - 1)) == 0;
}

static bool aliases(const struct qm_slice *slice) { return !is_round(slice); }

static size_t length(const struct qm_slice *slice)
{
    size_t power = 2;
    while (power < 2 * slice->grid.n)
        power *= 2;
    return is_round(slice) ? slice->grid.n : power;
}

static void cost(const struct qm_slice *slice, struct qm_cost *cost)
{
    double n = (double)slice->grid.n, m = (double)length(slice);
    *cost = (struct qm_cost){
        .bytes = 32 * n + 56 * m, .setup = 400 * n, .step = 10 * m * log2(m) + 6 * m};
}

static void close_fft(void *state)
{
    struct convolution *c = state;
    if (!c)
        return;
    qm_fft_free(&c->fft);
    AD_FREE(c->before, c->tre, c);
}

static enum ad_status reserve(const struct qm_slice *slice, struct convolution *c,
                              struct ad_error *error)
{
    size_t n = c->n = slice->grid.n, m = length(slice);
    c->before = malloc(2 * n * sizeof *c->before);
    c->tre = calloc(4 * m, sizeof *c->tre);
    if (!c->before || !c->tre)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    c->after = c->before + n;
    c->tim = c->tre + m;
    c->re = c->tim + m;
    c->im = c->re + m;
    return qm_fft_new(m, &c->fft, error);
}

/* ---- the action taken apart ---- */

/* Actions of paths that stay where they are, S_aa = f(a) + g(a), without a kinetic part to round
   them; and along the antidiagonal, to find out whether the rest is kinetic: [2 n]. */
static enum ad_status look(const struct qm_slice *slice, double *S, double *D,
                           struct ad_error *error)
{
    size_t n = slice->grid.n;
    double *x = malloc(4 * n * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    for (size_t k = 0; k < n; k++) {
        x[k] = x[n + k] = x[2 * n + k] = qm_x(&slice->grid, k);
        x[3 * n + k] = qm_x(&slice->grid, n - 1 - k);
    }
    qm_actions(slice, 2 * n, x, x + 2 * n, S, D, error);
    free(x);
    return error->status;
}

/* The part of S_aa that belongs to the end of the path: the mean time of the rule's points. */
static double share_of_end(const struct qm_slice *slice, struct ad_error *error)
{
    struct phys_rule_table table;
    const struct phys_rule *rule = qm_rule(slice, error);
    double share = 0;
    rule->fill(rule, &table);
    for (size_t j = 0; j < table.points; j++)
        share += table.weight[j] * table.time[j];
    return share;
}

static bool is_toeplitz(const struct qm_slice *slice, double share, const double *S,
                        const double *D)
{
    size_t n = slice->grid.n;
    for (size_t k = 0; k < 2 * n; k++)
        if (fabs(D[k] - D[0]) > 1e-12 * fabs(D[0]))
            return false;
    for (size_t a = 0; a < n; a++) {
        size_t b = n - 1 - a;
        double d = qm_x(&slice->grid, a) - qm_x(&slice->grid, b), kinetic = 0.5 * D[0] * d * d;
        double ends = share * S[a] + (1 - share) * S[b], size = fabs(S[a]) + fabs(S[b]) + kinetic;
        if (fabs(S[n + a] - ends - kinetic) > 1e-9 * slice->hbar + 1e-13 * size)
            return false;
    }
    return true;
}

static enum ad_status take_apart(const struct qm_slice *slice, struct convolution *c,
                                 double *kinetic, struct ad_error *error)
{
    size_t n = c->n;
    double *S = malloc(4 * n * sizeof *S);
    if (!S)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    double *D = S + 2 * n;
    if (look(slice, S, D, error) == AD_OK) {
        double share = share_of_end(slice, error);
        *kinetic = D[0];
        if (!is_toeplitz(slice, share, S, D))
            ad_fail(error, AD_E_ARGUMENT,
                    "fft: K of %s is not a function of the difference of positions and of each "
                    "end; expected rule left or trapezoid, else method kernel",
                    slice->system->scene->name);
        for (size_t k = 0; k < n; k++) {
            c->after[k] = cexp(I * (share * S[k] / slice->hbar));
            c->before[k] = cexp(I * ((1 - share) * S[k] / slice->hbar));
        }
    }
    free(S);
    return error->status;
}

/* The first row of K, freed of the phases of its ends, is the first column of the Toeplitz matrix
   too: it is even. */
static enum ad_status transform(const struct qm_slice *slice, struct convolution *c,
                                struct ad_error *error)
{
    size_t n = c->n, m = c->fft.n;
    qm_complex *row = malloc(n * sizeof *row);
    if (!row)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    if (qm_kernel_rows(slice, 0, 1, row, error) == AD_OK) {
        for (size_t k = 0; k < n; k++) {
            qm_complex t = row[k] * conj(c->before[k] * c->after[0]) / (double)m;
            c->tre[k] = c->tre[(m - k) % m] = creal(t);
            c->tim[k] = c->tim[(m - k) % m] = cimag(t);
        }
        qm_fft_run(&c->fft, c->tre, c->tim);
    }
    free(row);
    return error->status;
}

/* The Fourier transform of sqrt(D / 2 pi i hbar) exp(i D x^2 / 2 hbar) is exp(-i hbar k^2 / 2 D):
   on a ring, that of the sum over all windings (Feit, Fleck, Steiger, J. Comput. Phys. 47, 1982).
 */
static void close_ring(const struct qm_slice *slice, double D, struct convolution *c)
{
    size_t m = c->fft.n;
    double unit = 2 * M_PI / (slice->grid.high - slice->grid.low);
    for (size_t j = 0; j < m; j++) {
        double k = unit * (j < m / 2 ? (double)j : (double)j - (double)m);
        double phase = -slice->hbar * k * k / (2 * D);
        c->tre[j] = cos(phase) / (double)m;
        c->tim[j] = sin(phase) / (double)m;
    }
}

static enum ad_status absorb(const struct qm_slice *slice, struct convolution *c,
                             struct ad_error *error)
{
    double *mask = malloc(c->n * sizeof *mask);
    if (!mask)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", c->n);
    qm_absorber(slice, mask);
    for (size_t k = 0; k < c->n; k++)
        c->after[k] *= mask[k];
    free(mask);
    return AD_OK;
}

static enum ad_status open_fft(const struct qm_slice *slice, void **state, struct ad_error *error)
{
    struct convolution *c = *state = calloc(1, sizeof *c);
    if (!c)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (slice->walls == QM_REFLECT)
        return ad_fail(error, AD_E_ARGUMENT,
                       "fft: between reflecting walls K is no convolution; expected method kernel "
                       "or other walls");
    double D = 0;
    if (reserve(slice, c, error) != AD_OK || take_apart(slice, c, &D, error) != AD_OK)
        return error->status;
    if (is_round(slice))
        close_ring(slice, D, c);
    else if (transform(slice, c, error) != AD_OK)
        return error->status;
    return absorb(slice, c, error);
}

/* ---- a slice ---- */

static void multiply(const struct convolution *c)
{
#pragma omp simd
    for (size_t k = 0; k < c->fft.n; k++) {
        double re = c->re[k] * c->tre[k] - c->im[k] * c->tim[k];
        c->im[k] = c->re[k] * c->tim[k] + c->im[k] * c->tre[k];
        c->re[k] = re;
    }
}

static enum ad_status step_fft(void *state, size_t packets, qm_complex *psi, struct ad_error *error)
{
    struct convolution *c = state;
    (void)error;
    for (size_t column = 0; column < packets; column++) {
        for (size_t k = 0; k < c->fft.n; k++) {
            qm_complex z = k < c->n ? psi[k * packets + column] * c->before[k] : 0;
            c->re[k] = creal(z);
            c->im[k] = cimag(z);
        }
        qm_fft_run(&c->fft, c->re, c->im);
        multiply(c);
        qm_fft_run(&c->fft, c->im, c->re); /* exchanged: the inverse */
        for (size_t k = 0; k < c->n; k++)
            psi[k * packets + column] = c->after[k] * (c->re[k] + I * c->im[k]);
    }
    return AD_OK;
}

const struct qm_method qm_method_fft = {
    "fft",    "the same sum as a convolution, by fast Fourier transforms",
    aliases,  cost,
    open_fft, step_fft,
    close_fft};
