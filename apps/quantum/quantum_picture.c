/* The picture of a wave packet (quantum.h): left its density over place and time, with the mean and
   the particle of the same Lagrangian; right the density now, over the start and the potential. A
   GIF shows the right side moving. */
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

void quantum_carpet(struct figure *figure, int density, int motion, bool particle)
{
    figure_element(figure, "data index %d using 1:2:3 with image notitle", density);
    figure_draw(figure, STYLE("#e8743b", 0, 2, 0), "mean", "data index %d using 1:2", motion);
    if (particle)
        figure_draw(figure,
                    &(const struct style){.colour = "#303030", .width = 1.5, .dash = "(8,5)"},
                    "particle", "data index %d using 1:3", motion);
}

static void carpet(struct figure *figure, const struct quantum_run *run, const struct axis *x)
{
    const struct qm_run_result *result = &run->result;
    figure_panel(
        figure, &(struct panel){
                    .across = {"t", run->system.scene->time_unit, {0, result->t[result->n - 1]}, 0},
                    .up = *x,
                    .key = "top right opaque",
                    .more = "set cblabel 'density |psi|^2' noenhanced\n"});
    quantum_carpet(figure, 0, 1, true);
}

/* The potential has an axis of its own, at the right. */
static void density_now(struct figure *figure, const struct quantum_run *run, const struct axis *x,
                        const struct range *V, double most)
{
    FILE *out = figure->plot->script;
    const char *unit = unit_shown(run->system.scene->energy_unit);
    char energy[64];
    figure_panel(figure, &(struct panel){.across = *x,
                                         .up = {"density", NULL, {0, 1.15 * most}, 0},
                                         .key = "top right noopaque"});
    if (V->high > V->low) {
        snprintf(energy, sizeof energy, "potential%s%.40s%s", *unit ? " (" : "", unit,
                 *unit ? ")" : "");
        fprintf(out, "set y2range [%.6g:%.6g]\nset y2tics\nset format y2 '%%g'\nset y2label ",
                V->low, V->high);
        quote_gnuplot(out, energy);
        fputs(" noenhanced\n", out);
        figure_draw(figure, &(struct style){.colour = "#8a8a8a", .width = 1.5, .axes = "x1y2"},
                    "potential", "data index 2 using 1:3");
    }
    figure_draw(figure, &(struct style){.colour = "#62acd8", .width = 1.2, .dash = "(4,4)"},
                "start", "data index 2 using 1:2");
    figure_element(figure, "data index 3+f using 1:2 with filledcurves y1=0 fs transparent solid "
                           ".35 lc rgb '#0b4f8a' notitle");
    figure_element(figure, "data index 3+f using 1:2 with lines lw 1.8 lc rgb '#0b4f8a' title "
                           "sprintf('t = %%.4g', times[f+1])");
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

static void draw(const struct quantum_run *run, const struct range *V, double most, size_t frames,
                 struct plot *plot)
{
    const struct qm_grid *grid = &run->settings.slice.grid;
    bool file = run->name[0] == '.' || run->name[0] == '/';
    char name[48];
    struct axis x = {name, run->system.scene->unit, {grid->low, grid->high}, 0};
    struct layout layout = figure_pair;
    struct figure figure;
    FILE *out = plot->script;
    phys_coordinate_name(&run->system, 0, name, sizeof name);
    fputs(DENSITY_PALETTE "name = ", out);
    quote_gnuplot_label(out, file ? run->system.scene->name : run->name);
    fprintf(out, ".\", hbar = %g%s\"\n", run->settings.slice.hbar,
            run->aliasing.ratio > 1 + 1e-9 && run->settings.method->aliases(&run->settings.slice)
                ? ": ALIASED, run by force"
                : "");
    times(&run->result, frames, out);
    layout.right = 0.9;
    layout.gap_x = 0.16;
    layout.expression = "name";
    layout.frames = frames;
    figure_begin(&figure, plot, &layout);
    carpet(&figure, run, &x);
    density_now(&figure, run, &x, V, most);
    figure_end(&figure);
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
    draw(run, &range, most, frames, plot);
    free(V);
    return AD_OK;
}
