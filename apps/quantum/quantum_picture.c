/* The picture of a wave packet (quantum.h): left its density over place and time, with the mean and
   the particle of the same Lagrangian; right the density now, over the start and the potential. A
   GIF shows the right side moving. */
#include "apps/output/axes.h"
#include "quantum.h"
#include "apps/output/figure.h"
#include "apps/output/unit.h"

#include <math.h>
#include <stdlib.h>

enum { FRAMES = 100, ACROSS = 400 };

/* Block 0: t x density, a scan a sample. Block 1: samples. Block 2: x, start, potential. Then a
   block a frame: x, density. */
static void write_data(const struct quantum_run *run, const struct qm_run_result *result,
                       const double *V, size_t frames, FILE *out)
{
    const struct qm_grid *grid = &run->settings.slice.grid;
    size_t n = grid->n;
    quantum_density(result->n, n, result->t, result->density, grid->low + 0.5 * qm_dx(grid),
                    qm_dx(grid), out);
    for (size_t k = 0; k < result->n; k++)
        fprintf(out, "%.6g %.6g %.6g\n", result->t[k],
                result->moments[k * run->settings.packets].mean_x, result->classical[k]);
    fputs("\n\n", out);
    for (size_t a = 0; a < n; a++)
        fprintf(out, "%.6g %.6g %.6g\n", qm_x(grid, a), result->density[a], V[a]);
    for (size_t f = 0; f < frames; f++) {
        size_t k = frames > 1 ? f * (result->n - 1) / (frames - 1) : result->n - 1;
        fprintf(out, "\n\n# t = %g\n", result->t[k]);
        for (size_t a = 0; a < n; a++)
            fprintf(out, "%.6g %.6g\n", qm_x(grid, a), result->density[k * n + a]);
    }
}

void quantum_density(size_t frames, size_t n, const double *t, const double *density, double low,
                     double dx, FILE *out)
{
    size_t skip = n / ACROSS + 1;
    for (size_t k = 0; k < frames; k++, fputc('\n', out))
        for (size_t a = 0; a < n; a += skip)
            fprintf(out, "%.6g %.6g %.4g\n", t[k], low + (double)a * dx, density[k * n + a]);
    fputc('\n', out);
}

void quantum_carpet(int density, int motion, bool particle, FILE *out)
{
    fprintf(out, "plot data index %d using 1:2:3 with image, \\\n    data index %d using 1:2 ",
            density, motion);
    style_write(out, STYLE("#e8743b", 0, 2, 0), "mean");
    if (particle) {
        fprintf(out, ", \\\n    data index %d using 1:3 ", motion);
        style_write(out, &(const struct style){"#303030", 0, 1.5, 0, "(8,5)", NULL}, "particle");
    }
    fputc('\n', out);
}

static void carpet(const struct quantum_run *run, const struct qm_run_result *result, FILE *out)
{
    const struct phys_scene *scene = run->system.scene;
    const struct qm_grid *grid = &run->settings.slice.grid;
    char name[48];
    phys_coordinate_name(&run->system, 0, name, sizeof name);
    axis_set(out, "x", "t", scene->time_unit, (struct range){0, result->t[result->n - 1]}, 0);
    axis_set(out, "y", name, scene->unit, (struct range){grid->low, grid->high}, 0);
    fputs("set colorbox\nset cblabel 'density |psi|^2' noenhanced\nset key top right opaque "
          "noautotitle\n",
          out);
    quantum_carpet(0, 1, true, out);
}

/* The potential has an axis of its own, at the right. */
static void density_now(const struct quantum_run *run, const struct range *V, double most,
                        FILE *out)
{
    const struct phys_scene *scene = run->system.scene;
    const struct qm_grid *grid = &run->settings.slice.grid;
    char name[48], energy[64];
    phys_coordinate_name(&run->system, 0, name, sizeof name);
    snprintf(energy, sizeof energy, "potential%s%.40s%s",
             *unit_shown(scene->energy_unit) ? " (" : "", unit_shown(scene->energy_unit),
             *unit_shown(scene->energy_unit) ? ")" : "");
    axis_set(out, "x", name, scene->unit, (struct range){grid->low, grid->high}, 0);
    fprintf(out,
            "set yrange [0:%.6g]\nset ylabel 'density'\nset y2range [%.6g:%.6g]\nset key top right "
            "noopaque\n",
            1.15 * most, V->low, V->high);
    if (V->high > V->low) {
        fputs("set y2tics\nset y2label ", out);
        quote_gnuplot(out, energy);
        fputs(" noenhanced\n", out);
    }
    fprintf(out, "plot ");
    if (V->high > V->low)
        fputs("data index 2 using 1:3 axes x1y2 with lines lw 1.5 lc rgb '#8a8a8a' title "
              "'potential', \\\n    ",
              out);
    fputs("data index 2 using 1:2 with lines lw 1.2 dt (4,4) lc rgb '#62acd8' title 'start', \\\n"
          "    data index 3+f using 1:2 with filledcurves y1=0 fs transparent solid .35 lc rgb "
          "'#0b4f8a' notitle, \\\n"
          "    data index 3+f using 1:2 with lines lw 1.8 lc rgb '#0b4f8a' title sprintf('t = "
          "%.4g', times[f+1])\n",
          out);
}

/* Of the potential where the wave has been, with some room above. */
static struct range potential_range(const struct qm_run_result *result, size_t n, const double *V)
{
    struct range range = {INFINITY, -INFINITY};
    double most = 0;
    for (size_t k = 0; k < result->n * n; k++)
        most = fmax(most, result->density[k]);
    for (size_t k = 0; k < result->n * n; k++)
        if (result->density[k] > 1e-3 * most)
            range_widen(&range, V[k % n]);
    return range_with_margins(range, 0, 0.3);
}

static void times(const struct qm_run_result *result, size_t frames, FILE *out)
{
    fprintf(out, "array times[%zu]\n", frames);
    for (size_t f = 0; f < frames; f++) {
        size_t k = frames > 1 ? f * (result->n - 1) / (frames - 1) : result->n - 1;
        fprintf(out, "times[%zu] = %.6g\n", f + 1, result->t[k]);
    }
}

static void commands(const struct quantum_run *run, const struct qm_run_result *result,
                     const struct range *V, double most, size_t frames, FILE *out)
{
    fputs(DENSITY_PALETTE, out);
    times(result, frames, out);
    fprintf(out, "do for [f = 0:%zu] {\n", frames - 1);
    fputs("set multiplot layout 1,2 title ", out);
    quote_gnuplot(out,
                  run->name[0] == '.' || run->name[0] == '/' ? run->system.scene->name : run->name);
    fprintf(out, ".\", hbar = %g%s\" noenhanced\n", run->settings.slice.hbar,
            run->aliasing.ratio > 1 + 1e-9 && run->settings.method->aliases(&run->settings.slice)
                ? ": ALIASED, run by force"
                : "");
    carpet(run, result, out);
    density_now(run, V, most, out);
    fputs("unset multiplot\nunset y2tics\nunset y2label\n}\n", out);
}

enum ad_status quantum_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct quantum_run *run = context;
    const struct qm_run_result *result = &run->result;
    size_t n = run->settings.slice.grid.n;
    size_t frames = plot->animated ? (result->n < FRAMES ? result->n : FRAMES) : 1;
    struct ad_error unknown = {0};
    double mass, most = 0, *V = malloc(n * sizeof *V);
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool known = qm_potential(&run->system, &run->settings.slice.grid, V, &mass, &unknown) == AD_OK;
    for (size_t a = 0; a < n && !known; a++)
        V[a] = 0;
    struct range range = potential_range(result, n, V);
    for (size_t k = 0; k < result->n * n; k++)
        if (k < n || plot->animated || k >= (result->n - 1) * n)
            most = fmax(most, result->density[k]);
    write_data(run, result, V, frames, plot->data);
    commands(run, result, &range, most, frames, plot->script);
    free(V);
    return AD_OK;
}
