/* The picture of a path run (path.h), as in the paper: left the reference path, the start, some
   paths on the way and the one found; right S, T and V over the steps. A GIF shows the path deform.
 */
#include "apps/output/axes.h"
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
    int x_power, y_power;  /* powers of ten of the axes */
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
    write_path(run, "reference", run->reference ? run->reference : run->path, out);
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
        return (struct curves){.n = bodies, .x = 2, .y = 3, .x_step = dims, .y_step = dims};
    return (struct curves){.n = dof, .x = 1, .y = 2, .y_step = 1};
}

/* Range of a column of the curves (1: time) over the reference, the start and the path found, so
   that all frames of an animation share one. */
static struct range column_range(const struct path_run *run, size_t column, size_t step, size_t n)
{
    struct range range = {INFINITY, -INFINITY};
    size_t slices = run->settings.slices;
    const double *const paths[] = {run->reference ? run->reference : run->path, run->start,
                                   run->path};
    if (column == 1)
        return (struct range){0, (double)(slices - 1) * run->settings.dt};
    for (size_t p = 0; p < 3; p++)
        for (size_t c = 0; c < n; c++)
            for (size_t i = 0; i < slices; i++)
                range_widen(&range, paths[p][(column - 2 + c * step) * slices + i]);
    return range_with_margins(range, 0.04, 0.04);
}

/* The first steps may tower above the rest by powers of ten: they may leave the picture. */
static struct range history_range(const struct path_record *record,
                                  const struct phys_path_figures *reference)
{
    struct range range = {INFINITY, -INFINITY};
    for (size_t i = record->n / 4; i < record->n + (isnan(reference->action_mean) ? 0 : 1); i++) {
        const struct phys_path_figures *f = i < record->n ? &record->figures[i] : reference;
        range_widen(&range, f->action_mean);
        range_widen(&range, f->kinetic_mean);
        range_widen(&range, f->potential_mean);
    }
    return range_with_margins(range, 0.3, 1);
}

/* Sets the axes of the left side, and the curves' scales. */
static void left_axes(const struct path_run *run, struct curves *curves, FILE *out)
{
    const struct phys_scene *scene = run->system.scene;
    struct range x = column_range(run, curves->x, curves->x_step, curves->n);
    struct range y = column_range(run, curves->y, curves->y_step, curves->n);
    bool plane = curves->x != 1;
    curves->x_power = range_exponent(x);
    curves->y_power = range_exponent(y);
    if (plane)
        curves->x_power = curves->y_power =
            curves->x_power > curves->y_power ? curves->x_power : curves->y_power;
    fprintf(out, "set size %s\n", plane ? "ratio -1" : "noratio");
    axis_set(out, "x", plane ? "x" : "t", plane ? scene->unit : scene->time_unit, x,
             curves->x_power);
    axis_set(out, "y",
             plane                                   ? "y"
             : scene->picture == PHYS_PICTURE_ANGLES ? "angle"
                                                     : "coordinate",
             scene->unit, y, curves->y_power);
}

/* Plot elements of one path block, one a curve, the first with a title. */
static void elements(const struct curves *curves, const char *block, const char *style,
                     const char *title, FILE *out)
{
    for (size_t c = 0; c < curves->n; c++)
        fprintf(out, "data index %s using ($%zu/1e%d):($%zu/1e%d) %s %s%s%s, \\\n    ", block,
                curves->x + c * curves->x_step, curves->x_power, curves->y + c * curves->y_step,
                curves->y_power, style, c == 0 && title ? "title '" : "notitle",
                c == 0 && title ? title : "", c == 0 && title ? "'" : "");
}

/* Left of a still picture: with the frames nearest to steps 1/64, 1/16, 1/4 of the run. */
static void left_still(const struct path_run *run, const struct curves *curves,
                       const struct blocks *blocks, const struct path_record *record, FILE *out)
{
    char block[32];
    fputs("plot ", out);
    if (run->reference)
        elements(curves, "0", "with lines lw 6 lc rgb '#c8c8c8'", "reference", out);
    elements(curves, "1", "with linespoints lw 0.5 pt 7 ps 0.25 lc rgb '#e8a33d'", "start", out);
    size_t last = 0;
    for (size_t part = 64; part >= 4; part /= 4) {
        size_t frame = record->n_frames / part;
        if (frame == last)
            continue;
        snprintf(block, sizeof block, "%zu", blocks->frames + frame);
        elements(curves, block, "with lines lw 1 lc rgb '#7db3d9'", last ? NULL : "on the way",
                 out);
        last = frame;
    }
    snprintf(block, sizeof block, "%zu", blocks->found);
    elements(curves, block, "with lines lw 1.8 lc rgb '#1f4e79'", "found", out);
    fputs("NaN notitle\n", out);
}

static void left_frame(const struct path_run *run, const struct curves *curves, FILE *out)
{
    fputs("plot ", out);
    if (run->reference)
        elements(curves, "0", "with lines lw 5 lc rgb '#c8c8c8'", "reference", out);
    elements(curves, "frame", "with lines lw 2 lc rgb '#1f4e79'", "path", out);
    fputs("NaN notitle\n", out);
}

/* Right: S, T, V over the steps; dashed what they are on the reference path. `every` limits the
   history to what an animation has reached. */
static void right(const struct path_run *run, const struct path_record *record,
                  const struct path_result *result, const struct blocks *blocks, const char *every,
                  FILE *out)
{
    const struct phys_path_figures *r = &result->found.info.compared;
    const struct {
        const char *name, *colour;
        double reference;
    } rows[] = {{"S", "#1f4e79", r->action_mean},
                {"T", "#c0392b", r->kinetic_mean},
                {"V", "#27823b", r->potential_mean}};
    struct range steps = {0, result->found.info.steps ? (double)result->found.info.steps : 1};
    struct range values = history_range(record, r);
    int power = range_exponent(values);
    fputs("set size noratio\n", out);
    axis_set(out, "x", "step", "1", steps, 0);
    axis_set(out, "y", "mean per slice", run->system.scene->energy_unit, values, power);
    fputs("plot ", out);
    for (size_t k = 0; k < 3 && run->reference; k++)
        fprintf(out, "%.9g with lines dt 2 lw 1 lc rgb '%s' notitle, \\\n    ",
                rows[k].reference / pow(10, power), rows[k].colour);
    for (size_t k = 0; k < 3; k++)
        fprintf(out,
                "data index %zu%s using 1:($%zu/1e%d) with lines lw 2 lc rgb '%s' title '%s'%s",
                blocks->history, every, k + 2, power, rows[k].colour, rows[k].name,
                k < 2 ? ", \\\n    " : "\n");
}

/* One multiplot a frame, the last one held. */
static void animate(const struct path_run *run, const struct path_record *record,
                    const struct path_result *result, struct curves *curves,
                    const struct blocks *blocks, FILE *out)
{
    enum { HOLD = 15 };
    fprintf(out, "every = %zu\nlast = %zu\nname = ", record->frame_every, result->found.info.steps);
    quote_gnuplot(out, run->system.scene->name);
    fprintf(out, "\ndo for [f = %zu:%zu] {\n", blocks->frames, blocks->found + HOLD);
    fprintf(out, "frame = f < %zu ? f : %zu\n", blocks->found, blocks->found);
    fprintf(out, "step = f < %zu ? (f - 1) * every : last\n", blocks->found);
    fputs("set multiplot layout 1,2 title sprintf('%s: step %d of %d', name, step, last) "
          "noenhanced\n",
          out);
    left_axes(run, curves, out);
    left_frame(run, curves, out);
    right(run, record, result, blocks, " every ::0::step", out);
    fputs("unset multiplot\n}\n", out);
}

void path_picture(const struct path_run *run, const struct path_record *record,
                  const struct path_result *result, struct plot *plot)
{
    FILE *out = plot->script;
    struct curves curves = choose_curves(run);
    struct blocks blocks = write_data(run, record, plot->data);
    fputs(""
          "set key outside top center horizontal samplen 1.5\nset samples 2\n",
          out);
    if (plot->animated) {
        animate(run, record, result, &curves, &blocks, out);
        return;
    }
    fputs("set multiplot layout 1,2 title ", out);
    quote_gnuplot(out, run->system.scene->name);
    fputs(" noenhanced\n", out);
    left_axes(run, &curves, out);
    left_still(run, &curves, &blocks, record, out);
    right(run, record, result, &blocks, "", out);
    fputs("unset multiplot\n", out);
}
