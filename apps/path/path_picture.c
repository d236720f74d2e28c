/* The picture of a path run (path.h), as in the paper: left the reference path, the start, some
   paths on the way and the one found, or those of --all with their energies; right S, T and V over
   the steps, if there are any. A GIF shows the path deform. */
#include "apps/output/coordinates.h"
#include "path.h"

#include <math.h>

/* Blocks of the data file: the reference, the frames (the start first), the path found, the
   solutions of --all, the history. */
enum { FIRST_FRAME = 1, HOLD = 15, LEGEND = 8 }; /* HOLD: frames that show an animation's end */

/* ---- data ---- */

static void write_path(const struct path_run *run, const char *name, const double *path, FILE *out)
{
    size_t n = run->settings.slices;
    const struct phys_grid grid = phys_grid_of(&run->settings);
    fprintf(out, "# %s: time, coordinates\n", name);
    for (size_t i = 0; i < n; i++) {
        fprintf(out, "%.9g", phys_grid_time(&grid, i));
        for (size_t k = 0; k < run->system.dof; k++)
            fprintf(out, " %.9g", path[k * n + i]);
        fputc('\n', out);
    }
    fputs("\n\n", out);
}

static void write_data(const struct path_run *run, FILE *out)
{
    size_t size = run->system.dof * run->settings.slices;
    char name[48];
    write_path(run, "reference", run->reference ? run->reference : run->path, out);
    for (size_t f = 0; f < run->record.n_frames; f++) {
        snprintf(name, sizeof name, "step %zu", run->record.frame_step[f]);
        write_path(run, name, run->record.frames + f * size, out);
    }
    write_path(run, "found", run->path, out);
    for (size_t k = 0; k < run->solutions.n; k++)
        write_path(run, "solution", run->solutions.solution[k].path, out);
    fputs("# history: step, S, T, V\n", out);
    for (size_t i = 0; i < run->record.n; i++)
        fprintf(out, "%zu %.9g %.9g %.9g\n", i, run->record.figures[i].action_mean,
                run->record.figures[i].kinetic_mean, run->record.figures[i].potential_mean);
}

/* The first steps may tower above the rest by powers of ten: they may leave the picture. */
static struct range history_range(const struct path_run *run)
{
    const struct phys_path_figures *reference = &run->found.info.compared;
    struct range range = {INFINITY, -INFINITY};
    for (size_t i = run->record.n / 4; i < run->record.n + (isnan(reference->action_mean) ? 0 : 1);
         i++) {
        const struct phys_path_figures *f = i < run->record.n ? &run->record.figures[i] : reference;
        range_widen(&range, f->action_mean);
        range_widen(&range, f->kinetic_mean);
        range_widen(&range, f->potential_mean);
    }
    return range_with_margins(range, 0.3, 1);
}

/* Plot elements of one path block, one a curve, the first with a title. */
static void elements(struct figure *figure, const struct coordinates *view, const char *block,
                     const struct style *style, const char *title)
{
    for (size_t c = 0; c < view->n; c++)
        coordinates_draw(view, figure, c, block, style, c == 0 ? title : NULL);
}

/* Of a still picture: with the frames nearest to steps 1/64, 1/16, 1/4 of the run. */
static void left_still(struct figure *figure, const struct coordinates *view,
                       const struct path_run *run)
{
    char block[32];
    elements(figure, view, "index 1", STYLE("#e8a33d", 7, 0.5, 0.25), "start");
    size_t last = 0;
    for (size_t part = 64; part >= 4; part /= 4) {
        size_t frame = run->record.n_frames / part;
        if (frame == last)
            continue;
        snprintf(block, sizeof block, "index %zu", FIRST_FRAME + frame);
        elements(figure, view, block, STYLE("#7db3d9", 0, 1, 0), last ? NULL : "on the way");
        last = frame;
    }
    snprintf(block, sizeof block, "index %zu", FIRST_FRAME + run->record.n_frames);
    elements(figure, view, block, STYLE("#1f4e79", 0, 1.8, 0), "found");
}

/* All of them, the result with a thick line. */
static void solutions(struct figure *figure, const struct coordinates *view,
                      const struct path_run *run)
{
    char block[32], title[32];
    fputs("set key at graph 1.02,1 left top vertical Left reverse\n", figure->plot->script);
    for (size_t k = 0; k < run->solutions.n; k++) {
        snprintf(block, sizeof block, "index %zu", FIRST_FRAME + run->record.n_frames + 1 + k);
        snprintf(title, sizeof title, "E = %.5g", run->solutions.solution[k].energy);
        elements(figure, view, block,
                 STYLE(figure_colours[k % LEGEND], 0, k == run->chosen ? 3 : 1.2, 0),
                 k < LEGEND ? title : NULL);
    }
}

static void left(struct figure *figure, const struct path_run *run)
{
    struct coordinates view;
    size_t n = run->settings.slices;
    coordinates_begin(&view, &run->system, (struct range){0, (double)(n - 1) * run->settings.dt});
    const double *const paths[] = {run->reference ? run->reference : run->path, run->start,
                                   run->path};
    for (size_t p = 0; p < 3; p++) /* all frames of an animation share the axes */
        coordinates_widen(&view, n, paths[p], n, 1);
    for (size_t k = 0; k < run->solutions.n; k++)
        coordinates_widen(&view, n, run->solutions.solution[k].path, n, 1);
    coordinates_panel(&view, figure);
    if (run->reference && !run->solutions.n)
        elements(figure, &view, "index 0", STYLE("#c8c8c8", 0, 6, 0), "reference");
    if (run->solutions.n)
        solutions(figure, &view, run);
    else if (figure->layout.frames)
        elements(figure, &view, "index frame(f)", STYLE("#1f4e79", 0, 2, 0), "path");
    else
        left_still(figure, &view, run);
}

/* S, T, V over the steps; dashed: their values on the reference path. An animation shows the
   history up to its frame. */
static void right(struct figure *figure, const struct path_run *run)
{
    const struct phys_path_figures *r = &run->found.info.compared;
    const struct {
        const char *name, *colour;
        double reference;
    } rows[] = {{"S", "#1f4e79", r->action_mean},
                {"T", "#c0392b", r->kinetic_mean},
                {"V", "#27823b", r->potential_mean}};
    size_t steps = run->found.info.steps;
    struct range values = history_range(run);
    int power = range_exponent(values);
    figure_panel(
        figure,
        &(struct panel){.across = {"step", NULL, {0, steps ? (double)steps : 1}, 0},
                        .up = {"mean per slice", run->system.scene->energy_unit, values, power},
                        .key = KEY_ABOVE});
    for (size_t k = 0; k < 3 && run->reference; k++)
        // cppcheck-suppress varFuncNullUB ; the title is no variable argument
        figure_draw(figure, &(struct style){.colour = rows[k].colour, .width = 1, .dash = "2"},
                    NULL, "%.9g", rows[k].reference / pow(10, power));
    for (size_t k = 0; k < 3; k++)
        figure_draw(figure, STYLE(rows[k].colour, 0, 2, 0), rows[k].name,
                    "data index %zu%s using 1:($%zu/1e%d)",
                    FIRST_FRAME + run->record.n_frames + 1 + run->solutions.n,
                    figure->layout.frames ? " every ::0::step(f)" : "", k + 2, power);
}

enum ad_status path_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct path_run *run = context;
    FILE *out = plot->script;
    size_t frames = run->record.n_frames, found = FIRST_FRAME + frames;
    bool history = run->found.info.steps > 0 && run->solutions.n == 0;
    struct layout layout = figure_pair;
    struct figure figure;
    write_data(run, plot->data);
    fputs("set samples 2\nname = ", out);
    quote_gnuplot_label(out, run->system.scene->name);
    fputc('\n', out);
    layout.expression = "name";
    if (!history) {
        layout.columns = 1;
        layout.right = run->solutions.n ? 0.86 : layout.right; /* a legend beside */
    }
    if (plot->animated) {
        layout.frames = frames + 1 + HOLD;
        layout.expression = "sprintf('%s: step %d of %d', name, step(f), last)";
        fprintf(out,
                "last = %zu\nframe(f) = f < %zu ? f + %d : %zu\n"
                "step(f) = f < %zu ? f * %zu : last\n",
                run->found.info.steps, frames, FIRST_FRAME, found, frames, run->record.frame_every);
    }
    figure_begin(&figure, plot, &layout);
    left(&figure, run);
    if (history)
        right(&figure, run);
    figure_end(&figure);
    return error->status;
}
