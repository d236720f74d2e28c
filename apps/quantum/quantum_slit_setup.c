/* The double slit set up (quantum_slit.h). The kernel is a product, psi -> Kx psi Ky^T; the barrier
   is an imaginary potential -i hbar kappa(x) u(y) whose integral along a crossing leaves exp(-u),
   two Gaussian slits. */
#include "quantum.h"
#include "quantum_slit.h"
#include "autodiff/clock.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FRAMES = 60, POINTS = 256, STEPS = 200 };

static const double thickness = 0.15;      /* of the barrier, a standard deviation */
static const double start = -4, width = 1; /* of the packet, along x */
static const double layer = 3;             /* that absorbs, at all four edges */

static const struct phys_param params[] = {
    {"apart", "1", "distance of the slits", 4, offsetof(struct slit_setup, apart)},
    {"sigma", "1", "width of a slit", 0.3, offsetof(struct slit_setup, sigma)},
    {"speed", "1", "of the packet", 6, offsetof(struct slit_setup, speed)},
    {"flight", "1", "time from the slits to the screen", 3, offsetof(struct slit_setup, flight)},
    {"m", "1", "mass", 1, offsetof(struct slit_setup, mass)},
};

static enum ad_status read_settings(const struct settings *set, struct slit_setup *setup,
                                    struct ad_error *error)
{
    enum { N = sizeof params / sizeof *params };
    const char *names[N];
    for (size_t k = 0; k < N; k++) {
        *(double *)((char *)setup + params[k].offset) = params[k].value;
        names[k] = params[k].name;
    }
    for (size_t s = 0; s < set->n; s++) {
        size_t k = phys_find("parameter of double-slit", set->setting[s].name, N, names, error);
        if (k == N)
            return AD_E_ARGUMENT;
        if (!(set->setting[s].value > 0))
            return ad_fail(error, AD_E_ARGUMENT, "double-slit: %s is %g, expected more than 0",
                           params[k].name, set->setting[s].value);
        *(double *)((char *)setup + params[k].offset) = set->setting[s].value;
    }
    return AD_OK;
}

static enum ad_status refuse_others(const struct quantum_options *options, struct ad_error *error)
{
    const struct {
        const char *name;
        bool given;
    } others[] = {{"box", options->box},
                  {"walls", options->walls},
                  {"packet", options->packets.n > 0},
                  {"power", options->power != OPTION_NO_COUNT},
                  {"normalise", options->normalise}};
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if (others[k].given)
            return ad_fail(error, AD_E_ARGUMENT, "--%s: not for the double slit; see --set",
                           others[k].name);
    if (strcmp(options->method, "kernel") != 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--method: expected kernel for the double slit, got '%s'", options->method);
    return AD_OK;
}

static enum ad_status reserve(struct slit *s, struct ad_error *error)
{
    size_t n = s->x.n, all = n * n;
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
static double barrier(const struct slit_setup *setup, double y)
{
    double d = fmin(fabs(y - setup->apart / 2), fabs(y + setup->apart / 2)) / (2 * setup->sigma);
    return fmin(d * d, 40);
}

/* Rate at which the layers at the edges of a grid absorb, in units of 1/time. */
static double layers(const struct slit *s, const struct qm_grid *grid, double at)
{
    double depth = fmax(0, 1 - fmin(at - grid->low, grid->high - at) / layer);
    return 8 * s->setup.speed / layer * depth * depth;
}

static void fill_mask(struct slit *s)
{
    double height = s->setup.speed / (sqrt(2 * M_PI) * thickness);
    for (size_t a = 0; a < s->x.n; a++) {
        double x = qm_x(&s->x, a), u = x / thickness, kappa = height * exp(-0.5 * u * u);
        for (size_t b = 0; b < s->y.n; b++) {
            double y = qm_x(&s->y, b);
            double rate = kappa * barrier(&s->setup, y) + layers(s, &s->x, x) + layers(s, &s->y, y);
            s->mask[a * s->y.n + b] = exp(-s->dt * rate);
        }
    }
}

static void fill_packet(struct slit *s)
{
    const struct slit_setup *setup = &s->setup;
    double broad = (s->y.high - layer) / 2.5;
    for (size_t a = 0; a < s->x.n; a++) {
        double x = qm_x(&s->x, a) - start, u = x / (2 * width);
        qm_complex along = exp(-u * u) * cexp(I * (setup->mass * setup->speed * x / s->hbar));
        for (size_t b = 0; b < s->y.n; b++) {
            double v = qm_x(&s->y, b) / (2 * broad);
            s->psi[a * s->y.n + b] = along * exp(-v * v) / sqrt(2 * M_PI * broad * width);
        }
    }
}

static enum ad_status fill_kernels(const struct quantum_options *options, struct slit *s,
                                   struct ad_error *error)
{
    struct phys_system system;
    if (phys_system_open("freebody", &system, error) == AD_OK &&
        phys_system_set(&system, "g", 0, error) == AD_OK &&
        phys_system_set(&system, "m", s->setup.mass, error) == AD_OK) {
        struct qm_slice slice = {.system = &system,
                                 .grid = s->x,
                                 .dt = s->dt,
                                 .hbar = s->hbar,
                                 .threads = options->common.threads};
        if (qm_kernel_short(&slice, s->Kx, error) == AD_OK) {
            slice.grid = s->y;
            qm_kernel_short(&slice, s->Ky, error);
        }
    }
    phys_system_close(&system);
    return error->status;
}

/* The packet's own momentum, and what the slits add, must stay below half of the grid's. */
static enum ad_status check_grid(const struct slit *s, struct ad_error *error)
{
    double most = s->setup.mass * s->setup.speed + 4 * s->hbar / (2 * width);
    double across = 4 * s->hbar / (2 * s->setup.sigma);
    double dx = M_PI * s->hbar / (2 * most), dy = M_PI * s->hbar / (2 * across);
    double points = fmax((s->x.high - s->x.low) / dx, (s->y.high - s->y.low) / dy);
    if ((double)s->x.n < points)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%zu points do not hold waves this short; expected --points %.0f or more",
                       s->x.n, ceil(points));
    return AD_OK;
}

static enum ad_status setup(const struct quantum_options *options, struct slit *s,
                            struct ad_error *error)
{
    if (refuse_others(options, error) != AD_OK ||
        read_settings(&options->set, &s->setup, error) != AD_OK)
        return error->status;
    const struct slit_setup *p = &s->setup;
    size_t n = option_count_or(options->points, POINTS);
    double screen = p->speed * p->flight, spread = options->hbar * p->flight / (2 * p->mass);
    double half = 2 * layer + p->apart / 2 + 2 * hypot(p->sigma, spread / p->sigma);
    s->hbar = options->hbar;
    s->x = (struct qm_grid){start - 2 - layer, screen + 3 + layer, n};
    s->y = (struct qm_grid){-half, half, n};
    s->steps = option_count_or(options->steps, STEPS);
    if (s->steps == 0 || n < 4)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: expected at least %d",
                       n < 4 ? "points" : "steps", n < 4 ? 4 : 1);
    s->every = s->steps / FRAMES + 1;
    s->dt = (screen - start) / p->speed / (double)s->steps;
    if (p->speed * s->dt > 2 * thickness)
        return ad_fail(error, AD_E_ARGUMENT,
                       "slices of %g step over the barrier; expected --steps %.0f or more", s->dt,
                       ceil((screen - start) / (2 * thickness)));
    return check_grid(s, error) == AD_OK ? reserve(s, error) : error->status;
}

enum ad_status slit_prepare(const struct quantum_options *options, struct slit *s,
                            struct ad_error *error)
{
    double from = ad_now();
    if (setup(options, s, error) != AD_OK || fill_kernels(options, s, error) != AD_OK)
        return error->status;
    fill_mask(s);
    fill_packet(s);
    s->setup_seconds = ad_now() - from;
    return AD_OK;
}

void slit_free(struct slit *s)
{
    free(s->Kx);
    free(s->density);
    free(s->time);
    free(s->screen);
}
