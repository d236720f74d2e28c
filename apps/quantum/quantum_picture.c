/* The picture of a wave packet (quantum.h): left its density over place and time, with the mean and
   the particle of the same Lagrangian; right the density now, over the start and the potential. A
   GIF shows the right side moving. */
#include "physics/linear/vectors.h"
#include "quantum.h"
#include "apps/output/figure.h"
#include "apps/output/report.h"

#include <math.h>
#include <stdlib.h>

/* With fewer samples than FEW the density is drawn as one curve a sample: a map would be stripes.
 */
enum { FRAMES = 100, ACROSS = 400, FEW = 24 };

/* Block 0: t x density, a scan a sample. Block 1: samples. Block 2: x, start, potential. Then a
   block a frame: x, density. */
static void write_data(const struct quantum_run *run, const struct qm_run_result *result,
                       const double *V, size_t frames, FILE *out)
{
    const struct qm_grid *grid = &run->slice.grid;
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

static void quantum_motion(struct figure *figure, int motion, bool particle)
{
    figure_draw(figure, STYLE("#d55e00", 0, 2, 0), "mean", "data index %d using 1:2", motion);
    if (particle)
        figure_draw(figure,
                    &(const struct style){.colour = "#303030", .width = 1.5, .dash = "(8,5)"},
                    "particle", "data index %d using 1:3", motion);
}

void quantum_carpet(struct figure *figure, int density, int motion, bool particle)
{
    figure_element(figure, "data index %d using 1:2:3 with image notitle", density);
    quantum_motion(figure, motion, particle);
}

/* "density |psi|^2", with its unit. */
static void density_name(const struct quantum_run *run, char name[64])
{
    const char *unit = unit_shown(run->system.scene->unit);
    snprintf(name, 64, "density |\xcf\x88|^2%s%.24s%s", *unit ? " / (1/" : "", unit,
             *unit ? ")" : "");
}

static void carpet(struct figure *figure, const struct quantum_run *run, const struct axis *x)
{
    const struct qm_run_result *result = &run->result;
    size_t n = run->slice.grid.n, samples = result->n;
    double end = result->t[samples - 1], apart = samples > 1 ? end / (double)(samples - 1) : 1;
    bool few = samples < FEW;
    char name[64];
    density_name(run, name);
    figure_panel(
        figure,
        &(struct panel){
            .across = {"t", run->system.scene->time_unit, {0, few ? end + 0.9 * apart : end}, 0},
            .up = *x,
            .colour = {few ? NULL : name, NULL, {0, 0}, 0},
            .key = KEY_ABOVE,
            .more = "set cbrange [0:*]\n"});
    if (few) {
        figure_draw(figure, STYLE("#56b4e9", 0, 1.2, 0), "density",
                    "data index 0 using ($1+%.6g*$3):2",
                    0.85 * apart / phys_largest(samples * n, result->density));
        quantum_motion(figure, 1, true);
    } else {
        quantum_carpet(figure, 0, 1, true);
    }
}

/* Of the start, a Gaussian packet; NaN where the potential is not known. */
static double mean_energy(const struct quantum_run *run, const double *V, double mass)
{
    const struct qm_grid *grid = &run->slice.grid;
    const struct qm_run_result *result = &run->result;
    double p = run->settings.packet[0].p;
    double width = 0.5 * run->slice.hbar / result->moments[0].std_x, sum = 0;
    for (size_t a = 0; a < grid->n; a++)
        sum += V[a] * result->density[a] * qm_dx(grid);
    return (p * p + width * width) / (2 * mass) + sum / result->moments[0].norm;
}

/* Potential and mean energy have an axis of their own, at the right. */
static void density_now(struct figure *figure, const struct quantum_run *run, const struct axis *x,
                        const struct range *V, double energy, double most)
{
    FILE *out = figure->plot->script;
    const char *unit = unit_shown(run->system.scene->energy_unit);
    char name[64];
    density_name(run, name);
    figure_panel(figure, &(struct panel){.across = *x,
                                         .up = {name, NULL, {0, 1.1 * most}, 0},
                                         .key = KEY_ABOVE " width -2"});
    if (V->high > V->low) {
        const struct style style = {.colour = "#6b6b6b", .width = 1.5, .axes = "x1y2"};
        const struct style dashed = {
            .colour = "#d55e00", .width = 1.2, .dash = "(6,4)", .axes = "x1y2"};
        fprintf(out,
                "set border 11\nset y2range [%.6g:%.6g]\nset y2tics\nset format y2 '%%g'\n"
                "set y2label ",
                V->low, V->high);
        snprintf(name, sizeof name, "energy%s%.40s", *unit ? " / " : "", unit);
        quote_gnuplot_label(out, name);
        fputc('\n', out);
        figure_draw(figure, &style, "potential", "data index 2 using 1:3");
        figure_draw(figure, &dashed, "mean energy", "%.9g", energy);
    }
    figure_draw(figure, &(struct style){.colour = "#56b4e9", .width = 1.2, .dash = "(4,4)"},
                "start", "data index 2 using 1:2");
    figure_element(figure, "data index 3+f using 1:2 with filledcurves y1=0 fs transparent solid "
                           ".35 lc rgb '#0072b2' notitle");
    figure_element(figure, "data index 3+f using 1:2 with lines lw 1.8 lc rgb '#0072b2' title "
                           "sprintf('t = %%.4g', times[f+1])");
}

/* Of the potential where the wave has been, and the energy, with some room above. */
static struct range potential_range(const struct qm_run_result *result, size_t n, const double *V,
                                    double energy)
{
    struct range range = {energy, energy};
    double most = phys_largest(result->n * n, result->density);
    for (size_t k = 0; k < result->n * n; k++)
        if (result->density[k] > 1e-2 * most)
            range_widen(&range, V[k % n]);
    return range_with_margins(range, 0.03, 0.2);
}

static void name_found(const struct quantum_run *run, struct line *line)
{
    const struct qm_run_result *result = &run->result;
    const struct qm_moments *end = &result->moments[(result->n - 1) * run->settings.packets];
    const char *x = unit_shown(run->system.scene->unit);
    line_add(line, "at the end: mean %.4g, width %.3g%s%.16s", end->mean_x, end->std_x,
             unit_blank(x), x);
    line_add(line, "norm - 1 = %.1g", end->norm / result->moments[0].norm - 1);
    if (isfinite(result->error))
        line_add(line, "error %.2g against %.60s", result->error, result->truth);
    if (run->aliasing.ratio > 1 + 1e-9 && run->settings.method->aliases(&run->slice))
        line_add(line, "ALIASED, run by force");
}

static void times(const struct qm_run_result *result, size_t frames, FILE *out)
{
    fprintf(out, "array times[%zu]\n", frames);
    for (size_t f = 0; f < frames; f++) {
        size_t k = frames > 1 ? f * (result->n - 1) / (frames - 1) : result->n - 1;
        fprintf(out, "times[%zu] = %.6g\n", f + 1, result->t[k]);
    }
}

static void draw(const struct quantum_run *run, const struct range *V, double energy, double most,
                 size_t frames, struct plot *plot)
{
    const struct qm_grid *grid = &run->slice.grid;
    bool file = run->name[0] == '.' || run->name[0] == '/';
    char name[48];
    struct axis x = {name, run->system.scene->unit, {grid->low, grid->high}, 0};
    struct layout layout = figure_pair;
    struct figure figure;
    char title[160];
    struct line line = {0};
    FILE *out = plot->script;
    phys_coordinate_name(&run->system, 0, name, sizeof name);
    fputs(DENSITY_PALETTE, out);
    snprintf(title, sizeof title, "%.48s: wave packet by %s, hbar = %g, %zu points",
             file ? run->system.scene->name : run->name, run->settings.method->name,
             run->slice.hbar, grid->n);
    name_found(run, &line);
    times(&run->result, frames, out);
    layout.room.right = 0.92;
    layout.title = title;
    layout.found = line.text;
    layout.frames = frames;
    figure_begin(&figure, plot, &layout);
    carpet(&figure, run, &x);
    density_now(&figure, run, &x, V, energy, most);
    figure_end(&figure);
}

enum ad_status quantum_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct quantum_run *run = context;
    const struct qm_run_result *result = &run->result;
    size_t n = run->slice.grid.n;
    size_t frames = plot->animated ? (result->n < FRAMES ? result->n : FRAMES) : 1;
    struct ad_error unknown = {0};
    double mass, most, *V = malloc(n * sizeof *V);
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool known = qm_potential(&run->system, &run->slice.grid, V, &mass, &unknown) == AD_OK;
    for (size_t a = 0; a < n && !known; a++)
        V[a] = 0;
    double energy = known ? mean_energy(run, V, mass) : 0;
    struct range range = {0};
    if (known)
        range = potential_range(result, n, V, energy);
    most = plot->animated ? phys_largest(result->n * n, result->density)
                          : fmax(phys_largest(n, result->density),
                                 phys_largest(n, result->density + (result->n - 1) * n));
    write_data(run, result, V, frames, plot->data);
    draw(run, &range, energy, most, frames, plot);
    free(V);
    return AD_OK;
}
