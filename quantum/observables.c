/* Momentum and energy of a wave function, the probability of a region, and the correlation with the
   first wave. Derivatives are those of the trigonometric interpolant (Trefethen, Spectral Methods
   in MATLAB, 2000, chapter 3): on a ring of psi, between walls of psi and its mirror images, whose
   sign changes. */
#include "autodiff/sized.h"
#include "internal.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

/* weight[k], |k| < n stored at k + n: d/dx at a point from psi k points before it, of N equidistant
   points that recur after `length`. */
static void fill_weights(size_t n, size_t N, double length, double *weight)
{
    for (size_t j = 1; j < 2 * n; j++) {
        double k = (double)j - (double)n, angle = M_PI * k / (double)N;
        double sign = fmod(fabs(k), 2) == 1 ? -1 : 1;
        weight[j] = k == 0 ? 0 : M_PI / length * sign / (N % 2 ? sin(angle) : tan(angle));
    }
}

/* The same from the mirror image of point b, which is 2n - 1 - b, seen from a: the distance is
   a + b + 1 - 2n, or as well a + b + 1. */
static double mirrored(size_t n, size_t sum, double length)
{
    double angle = M_PI * (double)(sum + 1) / (double)(2 * n);
    return -M_PI / length * (sum % 2 ? 1 : -1) / tan(angle);
}

/* slope [n] of psi */
static enum ad_status differentiate(const struct qm_grid *grid, bool ring, size_t stride,
                                    const qm_complex *psi, qm_complex *slope,
                                    struct ad_error *error)
{
    size_t n = grid->n;
    double length = (ring ? 1 : 2) * (grid->high - grid->low);
    double *weight = malloc(4 * n * sizeof *weight);
    if (!weight)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    double *image = weight + 2 * n;
    fill_weights(n, ring ? n : 2 * n, length, weight);
    for (size_t k = 0; k + 1 < 2 * n; k++)
        image[k] = ring ? 0 : mirrored(n, k, length);
    for (size_t a = 0; a < n; a++) {
        slope[a] = 0;
        for (size_t b = 0; b < n; b++)
            slope[a] += (weight[n + a - b] + image[a + b]) * psi[b * stride];
    }
    free(weight);
    return AD_OK;
}

static double square(qm_complex z) { return creal(z) * creal(z) + cimag(z) * cimag(z); }

/* Finite, not 0, and not cut at an open wall, where momenta would be those of the cut. */
static enum ad_status check_wave(const struct qm_slice *slice, size_t stride, const qm_complex *psi,
                                 double *norm, struct ad_error *error)
{
    const double least = 1e-3;
    size_t n = slice->grid.n;
    double most = 0, edge;
    *norm = 0;
    for (size_t a = 0; a < n; a++) {
        *norm += square(psi[a * stride]);
        most = fmax(most, cabs(psi[a * stride]));
    }
    edge = fmax(cabs(psi[0]), cabs(psi[(n - 1) * stride]));
    if (!isfinite(*norm) || !(*norm > 0))
        return ad_fail(error, AD_E_NONFINITE, "sum |psi|^2 is %g, expected a wave", *norm);
    if (slice->walls == QM_OPEN && edge > least * most)
        return ad_fail(error, AD_E_ACCURACY,
                       "psi at an open wall is %.2g of its maximum: expected at most %g, or the "
                       "momenta are those of the cut; try a longer box",
                       edge / most, least);
    return AD_OK;
}

enum ad_status qm_observe(const struct qm_slice *slice, size_t stride, const qm_complex *psi,
                          struct qm_observables *o, struct ad_error *error)
{
    double mass, norm, p = 0, p2 = 0, V = 0;
    if (AD_LACKS_RESULT(error, o) || AD_LACKS(error, psi, stride) ||
        qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    if (check_wave(slice, stride, psi, &norm, error) != AD_OK)
        return error->status;
    size_t n = slice->grid.n;
    qm_complex *slope = malloc(n * sizeof *slope);
    double *potential = malloc(n * sizeof *potential);
    if (!slope || !potential)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    else if (qm_potential(slice->system, &slice->grid, potential, &mass, error) == AD_OK &&
             differentiate(&slice->grid, slice->walls == QM_RING, stride, psi, slope, error) ==
                 AD_OK) {
        for (size_t a = 0; a < n; a++) {
            p += slice->hbar * cimag(conj(psi[a * stride]) * slope[a]) / norm;
            p2 += slice->hbar * slice->hbar * square(slope[a]) / norm;
            V += potential[a] * square(psi[a * stride]) / norm;
        }
        *o = (struct qm_observables){.mean_p = p,
                                     .std_p = sqrt(fmax(0, p2 - p * p)),
                                     .kinetic = p2 / (2 * mass),
                                     .potential = V,
                                     .energy = p2 / (2 * mass) + V};
    }
    free(slope);
    free(potential);
    return error->status;
}

double qm_probability(const struct qm_grid *grid, double from, double to, size_t stride,
                      const qm_complex *psi)
{
    if (!grid || !stride || !psi || !(from <= to))
        return NAN;
    double sum = 0, dx = qm_dx(grid);
    for (size_t a = 0; a < grid->n; a++) {
        double low = grid->low + (double)a * dx;
        sum += square(psi[a * stride]) * fmax(0, fmin(to, low + dx) - fmax(from, low));
    }
    return sum;
}

enum ad_status qm_correlation(qm_propagator *propagator, size_t steps, size_t packets,
                              qm_complex *psi, qm_complex *c, struct ad_error *error)
{
    if (AD_LACKS(error, propagator, packets, psi, c))
        return error->status;
    const struct qm_grid *grid = qm_propagator_grid(propagator);
    size_t size = grid->n * packets;
    qm_complex *first = malloc(size * sizeof *first);
    if (!first)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", size);
    for (size_t k = 0; k < size; k++)
        first[k] = psi[k];
    for (size_t step = 0; step <= steps && error->status == AD_OK; step++)
        if (step == 0 || qm_propagate(propagator, packets, psi, error) == AD_OK)
            for (size_t p = 0; p < packets; p++)
                c[step * packets + p] = qm_overlap(grid, packets, first + p, psi + p);
    free(first);
    return error->status;
}
