/* leastaction quantum --scene double-slit: a packet meets a barrier with two slits. What comes to
   the screen behind them is held against the closed form. */
#include "apps/command.h"
#include "apps/interrupt.h"
#include "apps/output/progress.h"
#include "quantum.h"
#include "quantum_slit.h"
#include "autodiff/clock.h"

#include <complex.h>
#include <math.h>

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

int quantum_slit(const struct quantum_options *options, struct ad_error *error)
{
    struct slit slit = {0};
    struct outputs outputs = {0};
    interrupt_catch();
    if (slit_prepare(options, &slit, error) == AD_OK &&
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
