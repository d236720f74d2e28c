/* The published matrix, and the same scene with a correct kernel (published.h). */
#include "autodiff/sized.h"
#include "published.h"
#include "autodiff/free.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DENSITY = 500, FRAMES = 100, POINTS = 1024 };

static const double box = 8, span = 3, speed = 15, half_width = 0.2;
static const double pull = 10; /* slope of the potential whose effect is measured */

static enum ad_status check_scale(double scale, struct ad_error *error)
{
    return scale >= 0.25 && scale <= 2
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "scale: expected 0.25 to 2, got %g", scale);
}

/* ---- as published ---- */

static enum ad_status reserve(struct qm_published *p, struct ad_error *error)
{
    size_t n = p->grid.n;
    p->K = malloc((n * n + 4 * n) * sizeof *p->K);
    p->density = malloc((FRAMES + 2) * (n + 2) * sizeof *p->density);
    if (!p->K || !p->density)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    p->psi = p->K + n * n;
    p->work = p->psi + 2 * n;
    p->time = p->density + (FRAMES + 2) * n;
    p->mean = p->time + FRAMES + 2;
    return AD_OK;
}

void qm_published_free(struct qm_published *p)
{
    if (!p)
        return;
    AD_FREE(p->K, p->density);
    *p = (struct qm_published){0};
}

static void normalise(size_t n, qm_complex *psi)
{
    double sum = 0;
    for (size_t a = 0; a < n; a++)
        sum += creal(psi[2 * a] * conj(psi[2 * a]));
    for (size_t a = 0; a < n; a++)
        psi[2 * a] /= sqrt(sum);
}

static void keep_frame(struct qm_published *p)
{
    size_t n = p->grid.n;
    double *density = p->density + p->frames * n, dx = qm_dx(&p->grid), mean = 0;
    for (size_t a = 0; a < n; a++) {
        density[a] = creal(p->psi[2 * a] * conj(p->psi[2 * a])) / dx;
        mean += density[a] * dx * (double)a * dx;
    }
    p->mean[p->frames] = mean;
    p->time[p->frames++] = (double)p->done * p->dt;
}

/* Column 0 without a potential, column 1 with one: V_a - V_b is a phase of either end, so the
   matrix with it is exp(-i V_a dt/hbar) K exp(i V_b dt/hbar), and all it does to a packet, in any
   number of slices, is one kick V' dt before the first and one back after the last. */
static void gauge(struct qm_published *p, int sign)
{
    double turn = sign * pull * qm_dx(&p->grid) * p->dt / p->hbar;
    for (size_t a = 0; a < p->grid.n; a++)
        p->psi[2 * a + 1] *= cexp(I * (turn * (double)a));
}

static void step(struct qm_published *p)
{
    size_t n = p->grid.n;
    gauge(p, 1);
    qm_kernel_apply(n, p->K, 2, p->psi, p->work);
    memcpy(p->psi, p->work, 2 * n * sizeof *p->psi);
    gauge(p, -1);
}

/* The norm after one slice, if the matrix had its prefactor. */
static double norm_of_slice(const struct qm_published *p)
{
    double sum = 0, dx = qm_dx(&p->grid);
    for (size_t a = 0; a < p->grid.n; a++)
        sum += creal(p->psi[2 * a] * conj(p->psi[2 * a]));
    return sum * dx * dx / (2 * M_PI * p->hbar * p->dt);
}

static void measure_kick(struct qm_published *p)
{
    double most = 0, change = 0;
    for (size_t a = 0; a < p->grid.n; a++) {
        most = fmax(most, cabs(p->psi[2 * a]));
        change = fmax(change, fabs(cabs(p->psi[2 * a]) - cabs(p->psi[2 * a + 1])));
    }
    p->kick = change / most;
}

bool qm_published_advance(struct qm_published *p)
{
    if (!p || !p->K || p->done == p->steps)
        return false;
    step(p);
    if (++p->done == 1)
        p->norm = norm_of_slice(p);
    normalise(p->grid.n, p->psi);
    normalise(p->grid.n, p->psi + 1);
    if (p->done % (p->steps / FRAMES + 1) == 0 || p->done == p->steps)
        keep_frame(p);
    measure_kick(p);
    return true;
}

static void fill_matrix(struct qm_published *p, double alpha)
{
    size_t n = p->grid.n;
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            double d = (double)a - (double)b;
            p->K[a * n + b] = cexp(I * (alpha * d * d));
        }
}

static void fill_packet(struct qm_published *p)
{
    size_t n = p->grid.n;
    for (size_t a = 0; a < n; a++) { /* numpy's linspace: the last point is on the wall */
        double x = box * (double)a / ((double)n - 1), u = (x - box / 2) / half_width;
        bool wall = a == 0 || a + 1 == n;
        p->psi[2 * a] = p->psi[2 * a + 1] = wall ? 0 : exp(-0.5 * u * u) * cexp(I * (speed * x));
    }
    normalise(n, p->psi);
    normalise(n, p->psi + 1);
}

enum ad_status qm_published_new(double scale, struct qm_published *p, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, p) || check_scale(scale, error) != AD_OK)
        return error->status;
    size_t n = (size_t)(DENSITY * pow(scale, 1.5));
    p->grid = (struct qm_grid){0, box, n};
    p->dt = span / (double)n;
    p->hbar = 1 / scale;
    p->steps = n / (size_t)span;
    if (reserve(p, error) != AD_OK)
        return error->status;
    double dx = qm_dx(&p->grid), alpha = dx * dx / (2 * p->hbar * p->dt);
    p->phases = alpha * (2 * (double)n - 3);
    p->ghost = M_PI * dx / alpha;
    fill_matrix(p, alpha);
    fill_packet(p);
    keep_frame(p);
    return AD_OK;
}

/* ---- done right ---- */

enum ad_status qm_published_right(double scale, struct phys_system *system, struct qm_slice *slice,
                                  struct qm_gaussian *packet, size_t *steps, struct ad_error *error)
{
    struct qm_slice right;
    if (AD_LACKS_RESULT(error, system) || AD_LACKS(error, packet, steps) ||
        !AD_TAKE(&right, slice, threads, error) || check_scale(scale, error) != AD_OK ||
        phys_system_open("freebody", system, error) != AD_OK ||
        phys_system_set(system, "g", 0, error) != AD_OK)
        return error->status;
    size_t points = (size_t)fmax(POINTS / 2, POINTS * scale); /* 50 slices or more */
    right = (struct qm_slice){.size = sizeof right,
                              .system = system,
                              .rule = phys_rule_find("trapezoid", error),
                              .grid = {0, box, points},
                              .walls = QM_REFLECT,
                              .dt = box * box * scale / (M_PI * (double)points),
                              .hbar = 1 / scale};
    AD_GIVE(slice, &right);
    *packet = (struct qm_gaussian){box / 2, sqrt(0.5 / scale), speed};
    *steps = (size_t)ceil(1 / slice->dt);
    return error->status;
}
