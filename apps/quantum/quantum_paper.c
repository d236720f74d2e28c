/* leastaction quantum --preset paper: a packet in a box of 8 as published, and done right. The
   published matrix is exp(i (m (x_a - x_b)^2 / (2 hbar dt) - (V_a - V_b) dt / hbar)), normalised
   after every slice. Its potential acts once, as a kick V' dt at the start; its grid aliases, and
   normalising hides what the ghosts add. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "quantum_paper.h"
#include "apps/bench/timing.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DENSITY = 500, FRAMES = 100, POINTS = 1024 };

static const double box = 8, span = 3, wave_number = 15, half_width = 0.2;
static const double pull = 10; /* of the potential whose effect is measured */

/* ---- as published ---- */

static enum ad_status reserve(struct published *p, struct ad_error *error)
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

static void published_free(struct published *p)
{
    free(p->K);
    free(p->density);
}

static void normalise(size_t n, size_t stride, qm_complex *psi)
{
    double sum = 0;
    for (size_t a = 0; a < n; a++)
        sum += creal(psi[a * stride] * conj(psi[a * stride]));
    for (size_t a = 0; a < n; a++)
        psi[a * stride] /= sqrt(sum);
}

static void keep_frame(struct published *p, double t)
{
    size_t n = p->grid.n;
    double *density = p->density + p->frames * n, dx = qm_dx(&p->grid), mean = 0;
    for (size_t a = 0; a < n; a++) {
        density[a] = creal(p->psi[2 * a] * conj(p->psi[2 * a])) / dx;
        mean += density[a] * dx * (double)a * dx;
    }
    p->mean[p->frames] = mean;
    p->time[p->frames++] = t;
}

/* Column 0 without a potential, column 1 with one: V_a - V_b is a phase of either end, so the
   matrix with it is exp(-i V_a dt/hbar) K exp(i V_b dt/hbar), and all it does to a packet, in any
   number of slices, is one kick V' dt before the first and one back after the last. */
static void gauge(struct published *p, int sign)
{
    double turn = sign * pull * qm_dx(&p->grid) * p->dt / p->hbar;
    for (size_t a = 0; a < p->grid.n; a++)
        p->psi[2 * a + 1] *= cexp(I * (turn * (double)a));
}

static void published_step(struct published *p)
{
    size_t n = p->grid.n;
    gauge(p, 1);
    qm_kernel_apply(n, p->K, 2, p->psi, p->work);
    memcpy(p->psi, p->work, 2 * n * sizeof *p->psi);
    gauge(p, -1);
}

/* What the norm becomes in one slice, had the matrix its prefactor. */
static double norm_of_slice(const struct published *p)
{
    double sum = 0, dx = qm_dx(&p->grid);
    for (size_t a = 0; a < p->grid.n; a++)
        sum += creal(p->psi[2 * a] * conj(p->psi[2 * a]));
    return sum * dx * dx / (2 * M_PI * p->hbar * p->dt);
}

static void published_run(struct published *p)
{
    size_t n = p->grid.n, every = p->steps / FRAMES + 1;
    keep_frame(p, 0);
    for (size_t k = 1; k <= p->steps && !interrupted(); k++) {
        published_step(p);
        if (k == 1)
            p->norm = norm_of_slice(p);
        normalise(n, 2, p->psi);
        normalise(n, 2, p->psi + 1);
        if (k % every == 0 || k == p->steps)
            keep_frame(p, (double)k * p->dt);
    }
    double most = 0;
    for (size_t a = 0; a < n; a++) {
        most = fmax(most, cabs(p->psi[2 * a]));
        p->gauge = fmax(p->gauge, fabs(cabs(p->psi[2 * a]) - cabs(p->psi[2 * a + 1])));
    }
    p->gauge /= most;
}

static enum ad_status published(double scale, struct published *p, struct ad_error *error)
{
    size_t n = (size_t)(DENSITY * pow(scale, 1.5));
    *p = (struct published){
        .grid = {0, box, n}, .dt = span / (double)n, .hbar = 1 / scale, .steps = n / (size_t)span};
    if (reserve(p, error) != AD_OK)
        return error->status;
    double dx = qm_dx(&p->grid), alpha = dx * dx / (2 * p->hbar * p->dt);
    p->phases = alpha * (2 * (double)n - 3);
    p->ghost = M_PI * dx / alpha;
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) {
            double d = (double)a - (double)b;
            p->K[a * n + b] = cexp(I * (alpha * d * d));
        }
    for (size_t a = 0; a < n; a++) { /* numpy's linspace: the last point is on the wall */
        double x = box * (double)a / ((double)n - 1), u = (x - box / 2) / half_width;
        bool wall = a == 0 || a + 1 == n;
        p->psi[2 * a] = p->psi[2 * a + 1] =
            wall ? 0 : exp(-0.5 * u * u) * cexp(I * (wave_number * x));
    }
    normalise(n, 2, p->psi);
    normalise(n, 2, p->psi + 1);
    published_run(p);
    return AD_OK;
}

/* ---- done right ---- */

/* The same box between walls that reflect; the speed of the particle is 15 whatever hbar, and the
   packet as wide as spreads least in the time: sigma^2 = hbar t / 2 m. */
static void right_options(const struct quantum_options *given, struct quantum_options *options,
                          char packet[64], const char **text)
{
    double scale = given->scale;
    size_t points = (size_t)fmax(POINTS / 2, POINTS * scale); /* 50 slices or more */
    snprintf(packet, 64, "%.17g,%.17g,%.17g", box / 2, sqrt(0.5 / scale), wave_number);
    *text = packet;
    *options = (struct quantum_options){
        .common = given->common,
        .scene = "free",
        .box = "0,8",
        .method = "kernel",
        .rule = "trapezoid",
        .walls = "reflect",
        .packets = {1, text},
        .hbar = 1 / scale,
        .absorb = 0,
        .points = points,
        .every = 1,
        .power = OPTION_NO_COUNT,
        .no_reference = true,
    };
    /* dt that makes the kernel unitary: mirrored, the box is one ghost long */
    double dt = box * box * scale / (M_PI * (double)points);
    options->steps = (size_t)ceil(1 / dt);
    options->dt = dt;
}

static double classical_error(const struct quantum_result *result)
{
    double sum = 0;
    for (size_t k = 0; k < result->n; k++)
        sum += pow(result->moments[k].mean_x - result->classical[k], 2);
    return sqrt(sum / (double)result->n);
}

/* ---- results ---- */

static void print(const struct published *p, const struct quantum_run *run,
                  const struct quantum_result *result)
{
    const struct qm_moments *m = &result->moments[result->n - 1];
    double start = result->moments[0].norm; /* of what the box does not cut off */
    printf("scale %g: hbar = %g\n\n%-34s%-22s%s\n", 1 / p->hbar, p->hbar, "", "as published",
           "done right");
    const struct {
        const char *name;
        double published, right;
    } rows[] = {
        {"points", (double)p->grid.n, (double)run->slice.grid.n},
        {"dt", p->dt, run->slice.dt},
        {"phases of neighbours, rad", p->phases, M_PI * run->aliasing.ratio},
        {"ghosts at a distance of", p->ghost, run->aliasing.ghost},
        {"norm after a slice", p->norm, result->moments[1].norm / start},
        {"norm at the end", (double)NAN, m->norm / start},
        {"mean at the end", p->mean[p->frames - 1], m->mean_x},
        {"a particle would be at", (double)NAN, result->classical[result->n - 1]},
        {"mean from particle, rms", (double)NAN, classical_error(result)},
        {"what a potential does to |psi|", p->gauge, (double)NAN},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        printf("  %-32s", rows[k].name);
        if (isnan(rows[k].published))
            printf("%-22s", "");
        else
            printf("%-22.6g", rows[k].published);
        if (!isnan(rows[k].right))
            printf("%.6g", rows[k].right);
        putchar('\n');
    }
}

static void print_json(const struct published *p, const struct quantum_run *run,
                       const struct quantum_result *result)
{
    const struct qm_moments *m = &result->moments[result->n - 1];
    struct json json;
    json_open(&json, stdout);
    json_text(&json, "preset", "paper");
    json_number(&json, "hbar", p->hbar);
    json_object(&json, "published");
    json_count(&json, "points", p->grid.n);
    json_number(&json, "dt", p->dt);
    json_number(&json, "phases", p->phases);
    json_number(&json, "ghost", p->ghost);
    json_number(&json, "norm_after_a_slice", p->norm);
    json_number(&json, "mean_x", p->mean[p->frames - 1]);
    json_number(&json, "effect_of_a_potential", p->gauge);
    json_end_object(&json);
    json_number(&json, "norm", m->norm / result->moments[0].norm);
    json_number(&json, "mean_x", m->mean_x);
    json_number(&json, "std_x", m->std_x);
    json_number(&json, "classical_x", result->classical[result->n - 1]);
    json_number(&json, "error", classical_error(result));
    json_text(&json, "error_against", "the particle's path, rms");
    json_number(&json, "aliasing", run->aliasing.ratio);
    json_number(&json, "seconds", result->setup_seconds + result->seconds);
    json_close(&json);
}

static enum ad_status write_results(const struct published *p, const struct quantum_run *run,
                                    const struct quantum_result *result, struct outputs *outputs,
                                    struct ad_error *error)
{
    size_t n = run->slice.grid.n;
    if (outputs->csv.out)
        quantum_write_csv(run, result, outputs->csv.out);
    if (outputs->file) {
        quantum_file(run, result, outputs->file);
        phys_runfile_write(outputs->file, "published/density", AD_F64, 2,
                           (size_t[]){p->frames, p->grid.n}, p->density);
        phys_runfile_write(outputs->file, "published/time", AD_F64, 1, &p->frames, p->time);
    }
    qm_complex *K = outputs->plot.script ? malloc(n * n * sizeof *K) : NULL;
    if (outputs->plot.script && !K)
        ad_fail(error, AD_E_MEMORY, "out of memory for a kernel of %zu x %zu", n, n);
    else if (K && qm_kernel(&run->slice, K, error) == AD_OK)
        paper_picture(p, run, result, K, &outputs->plot);
    free(K);
    if (error->status == AD_OK)
        outputs_commit(outputs, error);
    return error->status;
}

static enum ad_status both(const struct quantum_options *options, const struct quantum_run *run,
                           struct outputs *outputs, struct ad_error *error)
{
    struct published old;
    struct quantum_result result = {0};
    if (published(options->scale, &old, error) == AD_OK &&
        quantum_run(run, &result, error) == AD_OK &&
        write_results(&old, run, &result, outputs, error) == AD_OK) {
        if (options->common.json)
            print_json(&old, run, &result);
        else if (!options->common.quiet)
            print(&old, run, &result);
    }
    published_free(&old);
    quantum_result_free(&result);
    return error->status;
}

int quantum_paper(const struct quantum_options *options, struct ad_error *error)
{
    struct quantum_options right;
    struct quantum_run run = {0};
    struct outputs outputs = {0};
    char packet[64];
    const char *text;
    if (!(options->scale >= 0.25 && options->scale <= 2)) {
        ad_fail(error, AD_E_ARGUMENT, "--scale: expected 0.25 to 2, got %g", options->scale);
        return command_status(error);
    }
    right_options(options, &right, packet, &text);
    interrupt_catch();
    if (outputs_begin(&options->common, &outputs, error) == AD_OK &&
        quantum_setup(&right, &run, error) == AD_OK)
        both(options, &run, &outputs, error);
    outputs_abandon(&outputs);
    quantum_free(&run);
    return command_status(error);
}

enum ad_status paper_measure(double scale, struct paper_cost *cost, struct ad_error *error)
{
    const struct quantum_options options = {.scale = scale};
    struct quantum_options right;
    struct quantum_run run = {0};
    struct quantum_result result = {0};
    struct published old = {0};
    char packet[64];
    const char *text;
    right_options(&options, &right, packet, &text);
    double start = processor_seconds();
    if (published(scale, &old, error) == AD_OK) {
        double middle = processor_seconds();
        if (quantum_setup(&right, &run, error) == AD_OK &&
            quantum_run(&run, &result, error) == AD_OK) {
            double end = result.classical[result.n - 1];
            *cost = (struct paper_cost){
                .published_seconds = middle - start,
                .published_error = fabs(old.mean[old.frames - 1] - end),
                .seconds = processor_seconds() - middle,
                .error = fabs(result.moments[result.n - 1].mean_x - end),
            };
        }
    }
    published_free(&old);
    quantum_result_free(&result);
    quantum_free(&run);
    return error->status;
}
