/* The double slit (slit.h). The kernel is a product, psi -> Kx psi Ky^T; the barrier is an
   imaginary potential -i hbar kappa(x) u(y) whose integral along a crossing gives the factor
   exp(-u): two Gaussian slits. */
#include "slit.h"
#include "autodiff/sized.h"
#include "autodiff/free.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

enum { FRAMES = 60 };

static const double thickness = 0.15;      /* of the barrier, a standard deviation */
static const double start = -4, width = 1; /* of the packet, along x */
static const double layer = 3;             /* that absorbs, at all four edges */

void qm_slit_defaults_to(struct qm_slit_setup *settings)
{
    const struct qm_slit_setup defaults = {.size = sizeof defaults,
                                           .apart = 4,
                                           .sigma = 0.3,
                                           .speed = 6,
                                           .flight = 3,
                                           .mass = 1,
                                           .hbar = 1,
                                           .points = 256,
                                           .steps = 200};
    AD_GIVE(settings, &defaults);
}

static enum ad_status reserve(struct qm_slit *s, struct ad_error *error)
{
    const size_t n = s->x.n, most = 1 << 15, all = n * n;
    if (n > most)
        return ad_fail(error, AD_E_ARGUMENT, "points: expected at most %zu, got %zu", most, n);
    s->Kx = calloc(5 * all, sizeof *s->Kx);
    s->density = malloc((FRAMES + 2) * all * sizeof *s->density);
    s->time = malloc((FRAMES + 2) * sizeof *s->time);
    s->screen = calloc(2 * n, sizeof *s->screen);
    if (!s->Kx || !s->density || !s->time || !s->screen)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu x %zu points", n, n);
    s->Ky = s->Kx + all;
    s->mask = s->Ky + all;
    s->psi = s->mask + all;
    s->work = s->psi + all;
    s->expected = s->screen + n;
    return AD_OK;
}

/* u(y) of the barrier; far from the slits nothing comes through anyway. */
static double barrier(const struct qm_slit_setup *setup, double y)
{
    double d = fmin(fabs(y - setup->apart / 2), fabs(y + setup->apart / 2)) / (2 * setup->sigma);
    return fmin(d * d, 40);
}

/* Rate at which the layers at the edges of a grid absorb, in units of 1/time. */
static double layers(const struct qm_slit *s, const struct qm_grid *grid, double at)
{
    double depth = fmax(0, 1 - fmin(at - grid->low, grid->high - at) / layer);
    return 8 * s->setup->speed / layer * depth * depth;
}

static void fill_mask(struct qm_slit *s)
{
    double height = s->setup->speed / (sqrt(2 * M_PI) * thickness);
    for (size_t a = 0; a < s->x.n; a++) {
        double x = qm_x(&s->x, a), u = x / thickness, kappa = height * exp(-0.5 * u * u);
        for (size_t b = 0; b < s->y.n; b++) {
            double y = qm_x(&s->y, b);
            double rate = kappa * barrier(s->setup, y) + layers(s, &s->x, x) + layers(s, &s->y, y);
            s->mask[a * s->y.n + b] = exp(-s->dt * rate);
        }
    }
}

static void fill_packet(struct qm_slit *s)
{
    const struct qm_slit_setup *setup = s->setup;
    double broad = (s->y.high - layer) / 2.5;
    for (size_t a = 0; a < s->x.n; a++) {
        double x = qm_x(&s->x, a) - start, u = x / (2 * width);
        qm_complex along =
            exp(-u * u) * cexp(I * (setup->mass * setup->speed * x / s->setup->hbar));
        for (size_t b = 0; b < s->y.n; b++) {
            double v = qm_x(&s->y, b) / (2 * broad);
            s->psi[a * s->y.n + b] = along * exp(-v * v) / sqrt(2 * M_PI * broad * width);
        }
    }
}

static enum ad_status fill_kernels(struct qm_slit *s, struct ad_error *error)
{
    struct phys_system system;
    if (phys_system_open("freebody", &system, error) == AD_OK &&
        phys_system_set(&system, "g", 0, error) == AD_OK &&
        phys_system_set(&system, "m", s->setup->mass, error) == AD_OK) {
        struct qm_slice slice = {.size = sizeof slice,
                                 .system = &system,
                                 .grid = s->x,
                                 .dt = s->dt,
                                 .hbar = s->setup->hbar,
                                 .threads = s->setup->threads};
        if (qm_kernel_short(&slice, s->Kx, error) == AD_OK) {
            slice.grid = s->y;
            qm_kernel_short(&slice, s->Ky, error);
        }
    }
    phys_system_close(&system);
    return error->status;
}

/* The packet's momentum plus that added by the slits must stay below half of the grid's largest. */
static enum ad_status check_waves(const struct qm_slit *s, struct ad_error *error)
{
    double most = s->setup->mass * s->setup->speed + 4 * s->setup->hbar / (2 * width);
    double across = 4 * s->setup->hbar / (2 * s->setup->sigma);
    double dx = M_PI * s->setup->hbar / (2 * most), dy = M_PI * s->setup->hbar / (2 * across);
    double points = fmax((s->x.high - s->x.low) / dx, (s->y.high - s->y.low) / dy);
    if ((double)s->x.n < points)
        return ad_fail(error, AD_E_ARGUMENT,
                       "points: %zu are too few for the shortest waves; expected %.0f or more",
                       s->x.n, ceil(points));
    return AD_OK;
}

static enum ad_status check_setup(const struct qm_slit_setup *p, struct ad_error *error)
{
    const struct {
        const char *name;
        double value;
    } positive[] = {{"apart", p->apart},   {"sigma", p->sigma}, {"speed", p->speed},
                    {"flight", p->flight}, {"m", p->mass},      {"hbar", p->hbar}};
    for (size_t k = 0; k < sizeof positive / sizeof *positive; k++)
        if (!(positive[k].value > 0) || !isfinite(positive[k].value))
            return ad_fail(error, AD_E_ARGUMENT, "double-slit: %s is %g, expected more than 0",
                           positive[k].name, positive[k].value);
    if (p->points < 4 || p->steps < 1)
        return ad_fail(error, AD_E_ARGUMENT, "double-slit: %s: expected at least %d",
                       p->points < 4 ? "points" : "steps", p->points < 4 ? 4 : 1);
    return AD_OK;
}

/* Grids and slices: the packet starts before the barrier and runs until its middle is at the
   screen. */
static enum ad_status lay_out(struct qm_slit *s, struct ad_error *error)
{
    const struct qm_slit_setup *p = s->setup;
    double screen = p->speed * p->flight, spread = p->hbar * p->flight / (2 * p->mass);
    double half = 2 * layer + p->apart / 2 + 2 * hypot(p->sigma, spread / p->sigma);
    s->x = (struct qm_grid){start - 2 - layer, screen + 3 + layer, p->points};
    s->y = (struct qm_grid){-half, half, p->points};
    s->every = p->steps / FRAMES + 1;
    s->dt = (screen - start) / p->speed / (double)p->steps;
    if (p->speed * s->dt > 2 * thickness)
        return ad_fail(error, AD_E_ARGUMENT,
                       "steps: slices of %g step over the barrier; expected %.0f or more", s->dt,
                       ceil((screen - start) / (2 * thickness)));
    return check_waves(s, error);
}

static void keep_frame(struct qm_slit *s)
{
    size_t all = s->x.n * s->y.n;
    for (size_t k = 0; k < all; k++)
        s->density[s->frames * all + k] = creal(s->psi[k] * conj(s->psi[k]));
    s->time[s->frames++] = (double)s->done * s->dt;
}

enum ad_status qm_slit_new(const struct qm_slit_setup *setup, struct qm_slit *s,
                           struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, s) || AD_LACKS(error, setup))
        return error->status;
    AD_OWN(qm_slit_setup, setup, threads, error);
    s->setup = malloc(sizeof *s->setup);
    if (!s->setup)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *s->setup = *setup;
    if (check_setup(setup, error) != AD_OK || lay_out(s, error) != AD_OK ||
        reserve(s, error) != AD_OK || fill_kernels(s, error) != AD_OK)
        return error->status;
    fill_mask(s);
    fill_packet(s);
    keep_frame(s);
    return AD_OK;
}

bool qm_slit_advance(struct qm_slit *s)
{
    if (!s || !s->psi)
        return false;
    size_t left = s->setup->steps - s->done, more = s->every < left ? s->every : left;
    if (more == 0)
        return false;
    qm_propagate_plane(s->x.n, s->Kx, s->y.n, s->Ky, s->mask, more, s->psi, s->work);
    s->done += more;
    keep_frame(s);
    return true;
}

void qm_slit_free(struct qm_slit *s)
{
    if (!s)
        return;
    AD_FREE(s->setup, s->Kx, s->density, s->time, s->screen);
    *s = (struct qm_slit){0};
}
