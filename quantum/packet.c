/* Gaussian packets, and moments of a wave function. */
#include "internal.h"

#include <complex.h>
#include <math.h>

/* Standard deviations by which two packets of norm 1 overlap by less than 1e-16; turns of a ring
   that the tails of a wide packet are followed for. */
enum { NEGLIGIBLE = 18, MOST_TURNS = 100 };

static void add(const struct qm_grid *grid, double hbar, const struct qm_gaussian *packet,
                size_t packets, qm_complex *psi)
{
    double height = pow(2 * M_PI * packet->sigma * packet->sigma, -0.25);
    for (size_t a = 0; a < grid->n; a++) {
        double d = qm_x(grid, a) - packet->x, u = d / (2 * packet->sigma);
        psi[a * packets] += height * exp(-u * u) * cexp(I * (packet->p * d / hbar));
    }
}

void qm_packet(const struct qm_grid *grid, double hbar, const struct qm_gaussian *packet,
               size_t packets, size_t column, qm_complex *psi)
{
    if (!grid || !psi || column >= packets)
        return;
    bool known = packet && packet->sigma > 0 && hbar > 0;
    for (size_t a = 0; a < grid->n; a++)
        psi[a * packets + column] = known ? 0 : (double)NAN;
    if (known)
        add(grid, hbar, packet, packets, psi + column);
}

enum ad_status qm_packet_wound(const struct qm_slice *slice, const struct qm_grid *grid,
                               const struct qm_gaussian *packet, size_t packets, size_t column,
                               qm_complex *psi, struct ad_error *error)
{
    const double least = 1e-6, low = slice->grid.low, turn = slice->grid.high - low;
    struct qm_gaussian one = *packet;
    bool ring = slice->walls == QM_RING && slice->absorb == 0;
    if (ring)
        one.x -= turn * floor((one.x - low) / turn);
    qm_packet(grid, slice->hbar, &one, packets, column, psi);
    if (!ring)
        return AD_OK;
    double turns = ceil(NEGLIGIBLE * one.sigma / turn);
    double norm = 1; /* with <g(x)|g(x + a)> = exp(-a^2 / 8 sigma^2 + i p a / hbar) */
    for (int j = 1; j <= turns && j <= MOST_TURNS; j++) {
        double away = j * turn, u = away / one.sigma;
        norm += 2 * exp(-u * u / 8) * cos(one.p * away / slice->hbar);
        for (int side = -1; side <= 1; side += 2) {
            struct qm_gaussian other = {one.x + side * away, one.sigma, one.p};
            add(grid, slice->hbar, &other, packets, psi + column);
        }
    }
    if (turns > MOST_TURNS || norm < least)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "packet %g,%g,%g: too wide for a ring of %g, or its turns cancel; expected a "
            "smaller width",
            packet->x, packet->sigma, packet->p, turn);
    for (size_t a = 0; a < grid->n; a++)
        psi[a * packets + column] /= sqrt(norm);
    return AD_OK;
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
