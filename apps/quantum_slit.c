/* leastaction quantum --scene double-slit: a packet meets a barrier with two slits. The kernel is a
   product, psi -> Kx psi Ky^T; the barrier is an imaginary potential -i hbar kappa(x) u(y) whose
   integral along a crossing leaves exp(-u), two Gaussian slits. Behind them the closed form is
   known. */
#include "command.h"
#include "interrupt.h"
#include "progress.h"
#include "quantum.h"
#include "quantum_slit.h"
#include "../autodiff/clock.h"

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

/* ---- setup ---- */

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
        return ad_fail(error, AD_E_ARGUMENT, "--method: the double slit has kernel alone, got '%s'",
                       options->method);
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

static void slit_free(struct slit *s)
{
    free(s->Kx);
    free(s->density);
    free(s->time);
    free(s->screen);
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

/* ---- the run ---- */

static void keep_frame(struct slit *s, double t)
{
    size_t all = s->x.n * s->y.n;
    for (size_t k = 0; k < all; k++)
        s->density[s->frames * all + k] = creal(s->psi[k] * conj(s->psi[k]));
    s->time[s->frames++] = t;
}

static void follow(const struct quantum_options *options, struct slit *s)
{
    struct progress progress;
    double from = ad_now();
    progress_start(&progress, options->common.quiet);
    keep_frame(s, 0);
    for (size_t done = 0; done < s->steps && !s->interrupted;) {
        size_t more = s->every < s->steps - done ? s->every : s->steps - done;
        qm_propagate_plane(s->x.n, s->Kx, s->y.n, s->Ky, s->mask, more, s->psi, s->work);
        done += more;
        keep_frame(s, (double)done * s->dt);
        s->interrupted = interrupted();
        if (progress_due(&progress))
            progress_line(&progress, "slice %zu of %zu", done, s->steps);
    }
    progress_end(&progress);
    s->seconds = ad_now() - from;
}

/* |sum of two spread Gaussians|^2, where one has spread by z = 1 + i theta. */
static void fill_expected(struct slit *s, double most)
{
    const struct slit_setup *p = &s->setup;
    double theta = s->hbar * p->flight / (2 * p->mass * p->sigma * p->sigma), highest = 0;
    for (size_t b = 0; b < s->y.n; b++) {
        qm_complex sum = 0;
        for (int side = -1; side <= 1; side += 2) {
            double u = (qm_x(&s->y, b) - side * p->apart / 2) / (2 * p->sigma);
            sum += cexp(-u * u / (1 + I * theta));
        }
        s->expected[b] = creal(sum * conj(sum));
        highest = fmax(highest, s->expected[b]);
    }
    for (size_t b = 0; b < s->y.n; b++)
        s->expected[b] *= most / highest;
}

/* Where the parabola through a point and its neighbours is least. */
static double valley(const struct slit *s, size_t b)
{
    const double *at = s->screen + b;
    double bend = at[-1] - 2 * at[0] + at[1];
    return qm_x(&s->y, b) + 0.5 * (at[-1] - at[1]) / bend * qm_dx(&s->y);
}

/* From the dark line on one side of the middle to that on the other. */
static double measure_fringe(const struct slit *s)
{
    size_t up = s->y.n / 2, down = s->y.n / 2 - 1;
    while (up + 1 < s->y.n && s->screen[up + 1] < s->screen[up])
        up++;
    while (down > 0 && s->screen[down - 1] < s->screen[down])
        down--;
    return up + 1 < s->y.n && down > 0 ? valley(s, up) - valley(s, down) : (double)NAN;
}

static void look_at_screen(struct slit *s)
{
    double at = (s->setup.speed * s->setup.flight - s->x.low) / qm_dx(&s->x), most = 0;
    size_t row = (size_t)at;
    for (size_t b = 0; b < s->y.n; b++) {
        qm_complex z = s->psi[row * s->y.n + b];
        s->screen[b] = creal(z * conj(z));
        most = fmax(most, s->screen[b]);
    }
    for (size_t k = 0; k < s->x.n * s->y.n; k++)
        s->norm += s->density[(s->frames - 1) * s->x.n * s->y.n + k];
    s->norm *= qm_dx(&s->x) * qm_dx(&s->y);
    s->fringe = measure_fringe(s);
    fill_expected(s, most);
}

/* ---- results ---- */

static double exact_fringe(const struct slit *s)
{
    const struct slit_setup *p = &s->setup;
    return qm_exact_fringe(p->mass, s->hbar, p->apart, p->sigma, p->flight);
}

static void print(const struct slit *s)
{
    printf("double slit: %zu x %zu points, %zu slices of %.4g in %.3g s\n\n", s->x.n, s->y.n,
           s->steps, s->dt, s->seconds);
    printf("  %-24s %13.6g\n", "norm at the end", s->norm);
    printf("  %-24s %13.6g\n", "fringe", s->fringe);
    printf("  %-24s %13.6g  the closed form\n", "fringe expected", exact_fringe(s));
    printf("  %-24s %13.6g  s\n", "building what moves it", s->setup_seconds);
}

static void print_json(const struct slit *s)
{
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "scene", "double-slit");
    json_text(&json, "method", "kernel");
    json_count(&json, "points", s->x.n);
    json_count(&json, "steps", s->steps);
    json_number(&json, "dt", s->dt);
    json_number(&json, "norm", s->norm);
    json_number(&json, "fringe", s->fringe);
    json_number(&json, "fringe_expected", exact_fringe(s));
    json_number(&json, "error", fabs(s->fringe / exact_fringe(s) - 1));
    json_text(&json, "error_against", "the closed form");
    json_number(&json, "setup_seconds", s->setup_seconds);
    json_number(&json, "seconds", s->setup_seconds + s->seconds);
    json_close(&json);
}

static void write_results(const struct quantum_options *options, const struct slit *s,
                          struct outputs *outputs)
{
    size_t n = s->y.n;
    if (outputs->csv.out) {
        fputs("y,intensity,closed_form\n", outputs->csv.out);
        for (size_t b = 0; b < n; b++)
            fprintf(outputs->csv.out, "%.17g,%.17g,%.17g\n", qm_x(&s->y, b), s->screen[b],
                    s->expected[b]);
    }
    if (outputs->file) {
        phys_runfile_text(outputs->file, "/", "program", "leastaction " LEASTACTION_VERSION);
        phys_runfile_text(outputs->file, "/", "command", options->common.command);
        phys_runfile_text(outputs->file, "/", "scene", "double-slit");
        phys_runfile_number(outputs->file, "/", "fringe", s->fringe, NULL);
        phys_runfile_write(outputs->file, "time", AD_F64, 1, &s->frames, s->time);
        phys_runfile_write(outputs->file, "density", AD_F64, 3, (size_t[]){s->frames, s->x.n, n},
                           s->density);
        phys_runfile_text(outputs->file, "density", "axes", "frame, x, y: |psi|^2");
    }
    if (outputs->plot.script)
        slit_picture(s, &outputs->plot);
}

static enum ad_status prepare(const struct quantum_options *options, struct slit *s,
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

int quantum_slit(const struct quantum_options *options, struct ad_error *error)
{
    struct slit slit = {0};
    struct outputs outputs = {0};
    interrupt_catch();
    if (prepare(options, &slit, error) == AD_OK &&
        outputs_begin(&options->common, &outputs, error) == AD_OK) {
        follow(options, &slit);
        look_at_screen(&slit);
        write_results(options, &slit, &outputs);
        if (outputs_commit(&outputs, error) == AD_OK) {
            if (options->common.json)
                print_json(&slit);
            else if (!options->common.quiet)
                print(&slit);
        }
        if (error->status == AD_OK && slit.interrupted)
            ad_fail(error, AD_E_ACCURACY, "interrupted; results are those so far");
    }
    slit_free(&slit);
    return command_status(error);
}
