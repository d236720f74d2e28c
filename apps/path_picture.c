/* The picture of a path run (path.h), as in the paper: left the reference path, the start, some
   paths on the way and the one found; right S, T and V over the steps. A GIF shows the path deform.
 */
#include "path.h"

#include <math.h>

/* Blocks of the data file, in gnuplot's numbering: the reference, the frames (the start first), the
   path found, the history. */
struct blocks {
    size_t frames, found, history;
};

/* Columns of a path block: time, then the coordinates; which of them make the curves. */
struct curves {
    size_t n;              /* curves: coordinates against time, or bodies in the plane */
    size_t x, y;           /* columns of the first curve */
    size_t x_step, y_step; /* from one curve to the next */
};

struct range {
    double low, high;
};

/* ---- data ---- */

static void write_path(const struct path_run *run, const char *name, const double *path, FILE *out)
{
    size_t n = run->settings.slices;
    fprintf(out, "# %s: time, coordinates\n", name);
    for (size_t i = 0; i < n; i++) {
        fprintf(out, "%.9g", (double)i * run->settings.dt);
        for (size_t k = 0; k < run->system.dof; k++)
            fprintf(out, " %.9g", path[k * n + i]);
        fputc('\n', out);
    }
    fputs("\n\n", out);
}

static struct blocks write_data(const struct path_run *run, const struct path_record *record,
                                FILE *out)
{
    size_t size = run->system.dof * run->settings.slices;
    char name[48];
    write_path(run, "reference", run->reference, out);
    for (size_t f = 0; f < record->n_frames; f++) {
        snprintf(name, sizeof name, "step %zu", record->frame_step[f]);
        write_path(run, name, record->frames + f * size, out);
    }
    write_path(run, "found", run->path, out);
    fputs("# history: step, S, T, V\n", out);
    for (size_t i = 0; i < record->n; i++)
        fprintf(out, "%zu %.9g %.9g %.9g\n", i, record->figures[i].action_mean,
                record->figures[i].kinetic_mean, record->figures[i].potential_mean);
    return (struct blocks){1, 1 + record->n_frames, 2 + record->n_frames};
}

/* ---- what is drawn ---- */

static struct curves choose_curves(const struct path_run *run)
{
    size_t dof = run->system.dof, bodies = run->system.bodies, dims = run->system.dims;
    if (run->system.scene->picture == PHYS_PICTURE_PLANE && dims >= 2)
        return (struct curves){bodies, 2, 3, dims, dims};
    return (struct curves){dof, 1, 2, 0, 1};
}

static void widen(struct range *range, double value)
{
    range->low = fmin(range->low, value);
    range->high = fmax(range->high, value);
}

/* Range of a column of the curves (1: time) over the reference, the start and the path found, so
   that all frames of an animation share one. */
static struct range column_range(const struct path_run *run, size_t column, size_t step, size_t n)
{
    struct range range = {INFINITY, -INFINITY};
    size_t slices = run->settings.slices;
    const double *const paths[] = {run->reference, run->start, run->path};
    if (column == 1)
        return (struct range){0, (double)(slices - 1) * run->settings.dt};
    for (size_t p = 0; p < 3; p++)
        for (size_t c = 0; c < n; c++)
            for (size_t i = 0; i < slices; i++)
                widen(&range, paths[p][(column - 2 + c * step) * slices + i]);
    double margin = 0.04 * (range.high - range.low);
    if (margin == 0)
        margin = 1;
    return (struct range){range.low - margin, range.high + margin};
}

static void axes(const struct path_run *run, const struct curves *curves, FILE *out)
{
    const struct phys_scene *scene = run->system.scene;
    struct range x = column_range(run, curves->x, curves->x_step, curves->n);
    struct range y = column_range(run, curves->y, curves->y_step, curves->n);
    bool plane = curves->x != 1;
    fprintf(out, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", x.low, x.high, y.low, y.high);
    fprintf(out, "set size %s\n", plane ? "ratio -1" : "noratio");
    if (plane)
        fprintf(out, "set xlabel 'x / %s'\nset ylabel 'y / %s'\n", scene->unit, scene->unit);
    else
        fprintf(out, "set xlabel 't / %s'\nset ylabel '%s / %s'\n", scene->time_unit,
                scene->picture == PHYS_PICTURE_ANGLES ? "angle" : "coordinate", scene->unit);
}

/* Plot elements of one path block, one a curve, the first with a title. */
static void elements(const struct curves *curves, const char *block, const char *style,
                     const char *title, FILE *out)
{
    for (size_t c = 0; c < curves->n; c++)
        fprintf(out, "data index %s using %zu:%zu %s %s%s%s, \\\n    ", block,
                curves->x + c * curves->x_step, curves->y + c * curves->y_step, style,
                c == 0 && title ? "title '" : "notitle", c == 0 && title ? title : "",
                c == 0 && title ? "'" : "");
}

static void block_name(char *name, size_t size, size_t block)
{
    snprintf(name, size, "%zu", block);
}

/* Left of a still picture: with the frames nearest to steps 1/64, 1/16, 1/4 of the run. */
static void left_still(const struct curves *curves, const struct blocks *blocks,
                       const struct path_record *record, FILE *out)
{
    char block[32];
    fputs("plot ", out);
    elements(curves, "0", "with lines lw 6 lc rgb '#c8c8c8'", "reference", out);
    elements(curves, "1", "with linespoints lw 0.5 pt 7 ps 0.25 lc rgb '#e8a33d'", "start", out);
    size_t last = 0;
    for (size_t part = 64; part >= 4; part /= 4) {
        size_t frame = record->n_frames / part;
        if (frame == last)
            continue;
        block_name(block, sizeof block, blocks->frames + frame);
        elements(curves, block, "with lines lw 1 lc rgb '#7db3d9'", last ? NULL : "on the way",
                 out);
        last = frame;
    }
    block_name(block, sizeof block, blocks->found);
    elements(curves, block, "with lines lw 1.8 lc rgb '#1f4e79'", "found", out);
    fputs("NaN notitle\n", out);
}

static void left_frame(const struct curves *curves, FILE *out)
{
    fputs("plot ", out);
    elements(curves, "0", "with lines lw 5 lc rgb '#c8c8c8'", "reference", out);
    elements(curves, "frame", "with lines lw 2 lc rgb '#1f4e79'", "path", out);
    fputs("NaN notitle\n", out);
}

/* Right: S, T, V over the steps; dashed what they are on the reference path. */
static void right(const struct path_run *run, const struct path_result *result,
                  const struct blocks *blocks, const char *every, FILE *out)
{
    const struct path_figures *r = &result->reference;
    const struct {
        const char *name, *colour;
        double reference;
    } rows[] = {{"S", "#1f4e79", r->action_mean},
                {"T", "#c0392b", r->kinetic_mean},
                {"V", "#27823b", r->potential_mean}};
    fprintf(out, "set size noratio\nset xrange [0:%zu]\nset autoscale y\n",
            result->info.steps ? result->info.steps : 1);
    fprintf(out, "set xlabel 'step'\nset ylabel 'mean a slice / %s'\nplot ",
            run->system.scene->energy_unit);
    for (size_t k = 0; k < 3; k++)
        fprintf(out,
                "data index %zu%s using 1:%zu with lines lw 2 lc rgb '%s' title '%s', \\\n    ",
                blocks->history, every, k + 2, rows[k].colour, rows[k].name);
    for (size_t k = 0; k < 3; k++)
        fprintf(out, "%.9g with lines dt 2 lw 1 lc rgb '%s' notitle%s", rows[k].reference,
                rows[k].colour, k < 2 ? ", \\\n    " : "\n");
}

/* One multiplot a frame, the last one held. */
static void animate(const struct path_run *run, const struct path_record *record,
                    const struct path_result *result, const struct curves *curves,
                    const struct blocks *blocks, FILE *out)
{
    enum { HOLD = 15 };
    fprintf(out, "every = %zu\nlast = %zu\n", record->frame_every, result->info.steps);
    fprintf(out, "do for [f = %zu:%zu] {\n", blocks->frames, blocks->found + HOLD);
    fprintf(out, "frame = f < %zu ? f : %zu\n", blocks->found, blocks->found);
    fprintf(out, "step = f < %zu ? (f - 1) * every : last\n", blocks->found);
    fprintf(out, "set multiplot layout 1,2 title sprintf('%s: step %%d of %zu', step)\n",
            run->system.scene->name, result->info.steps);
    axes(run, curves, out);
    left_frame(curves, out);
    right(run, result, blocks, " every ::0::step", out);
    fputs("unset multiplot\n}\n", out);
}

void path_picture(const struct path_run *run, const struct path_record *record,
                  const struct path_result *result, struct plot *plot)
{
    FILE *out = plot->script;
    struct curves curves = choose_curves(run);
    struct blocks blocks = write_data(run, record, plot->data);
    fputs(
        "set border 3 lc rgb '#606060'\nset tics nomirror\nset key outside top center horizontal\n"
        "set samples 2\n",
        out);
    if (plot->animated) {
        animate(run, record, result, &curves, &blocks, out);
        return;
    }
    fprintf(out, "set multiplot layout 1,2 title '%s'\n", run->system.scene->name);
    axes(run, &curves, out);
    left_still(&curves, &blocks, record, out);
    right(run, result, &blocks, "", out);
    fputs("unset multiplot\n", out);
}
