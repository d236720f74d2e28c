/* Gaussian packets, and moments of a wave function. */
#include "internal.h"

#include <complex.h>
#include <math.h>

void qm_packet(const struct qm_grid *grid, double hbar, const struct qm_gaussian *packet,
               size_t packets, size_t column, qm_complex *psi)
{
    if (!grid || !psi || column >= packets)
        return;
    if (!packet || !(packet->sigma > 0) || !(hbar > 0)) {
        qm_unknown(grid->n, packets, psi + column);
        return;
    }
    double height = pow(2 * M_PI * packet->sigma * packet->sigma, -0.25);
    for (size_t a = 0; a < grid->n; a++) {
        double d = qm_x(grid, a) - packet->x, u = d / (2 * packet->sigma);
        psi[a * packets + column] = height * exp(-u * u) * cexp(I * (packet->p * d / hbar));
    }
}

static double square(qm_complex z) { return creal(z) * creal(z) + cimag(z) * cimag(z); }

struct qm_moments qm_moments(const struct qm_grid *grid, size_t stride, const qm_complex *psi)
{
    double sum = 0, mean = 0, spread = 0;
    if (!grid || !stride || !psi)
        return (struct qm_moments){NAN, NAN, NAN};
    for (size_t a = 0; a < grid->n; a++) {
        double share = square(psi[a * stride]);
        sum += share;
        mean += share * qm_x(grid, a);
    }
    mean /= sum;
    for (size_t a = 0; a < grid->n; a++)
        spread += square(psi[a * stride]) * pow(qm_x(grid, a) - mean, 2);
    double width = sqrt(spread / sum);
    return (struct qm_moments){sum * qm_dx(grid), mean, width};
}

qm_complex qm_overlap(const struct qm_grid *grid, size_t stride, const qm_complex *a,
                      const qm_complex *b)
{
    qm_complex sum = 0;
    if (!grid || !stride || !a || !b)
        return (double)NAN;
    for (size_t k = 0; k < grid->n; k++)
        sum += conj(a[k * stride]) * b[k * stride];
    return sum * qm_dx(grid);
}
