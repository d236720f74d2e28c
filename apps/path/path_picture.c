/* The picture of a path run (path.h): left the start, paths on the way and the one found over the
   reference, or those of --all with their energies; right what the steps changed: of a descent S, T
   and V, of a few steps of Newton's method the gradient. A GIF shows the path deform. */
#include "apps/output/coordinates.h"
#include "apps/output/report.h"
#include "path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Blocks of the data file: the reference, the start, the frames, the path found, the solutions of
   --all, the history. */
enum { START = 1, FIRST_FRAME = 2, HOLD = 15, FEW_STEPS = 30, WAY = 3, POINTS = 400, CURVES = 16 };
/* HOLD: frames that show an animation's end */

/* ---- data ---- */

static void write_rows(const struct path_run *run, const struct phys_grid *grid, const char *name,
                       const double *path, FILE *out)
{
    const size_t n = grid->slices;
    fprintf(out, "# %s: time, coordinates\n", name);
    for (size_t i = 0; i < n; i++) {
        fprintf(out, "%.9g", phys_grid_time(grid, i));
        for (size_t k = 0; k < run->system.dof; k++)
            fprintf(out, " %.9g", path[k * n + i]);
        fputc('\n', out);
    }
    fputs("\n\n", out);
}

/* A path at its slices. */
static void write_path(const struct path_run *run, const char *name, const double *path, FILE *out)
{
    const struct phys_grid grid = phys_grid_of(&run->settings);
    write_rows(run, &grid, name, path, out);
}

/* Points drawn for an element: of rules of higher degree more than its ends; of fields, a map of
   the slices, these. */
static size_t parts_of(const struct path_run *run)
{
    return run->settings.rule->degree == 1 || run->system.dof > CURVES
               ? 1
               : POINTS / run->settings.slices + 1;
}

/* The same with what the rule has between slices. */
static enum ad_status write_curve(const struct path_run *run, const char *name, const double *path,
                                  FILE *out, struct ad_error *error)
{
    const struct phys_grid grid = phys_grid_of(&run->settings);
    const size_t n = grid.slices, parts = parts_of(run), fine = parts * (n - 1) + 1;
    if (parts == 1) {
        write_path(run, name, path, out);
        return AD_OK;
    }
    double *mesh = malloc(fine * sizeof *mesh), *curve = NULL;
    if (!mesh)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < fine; i++) {
        const double share = (double)(i % parts) / (double)parts,
                     at = phys_grid_time(&grid, i / parts);
        mesh[i] = share > 0 ? at + share * (phys_grid_time(&grid, i / parts + 1) - at) : at;
    }
    const struct phys_grid finer = {phys_rule_find("left", error), fine, 1, mesh};
    if ((curve = phys_path_resample(&grid, path, &finer, run->system.dof, error)))
        write_rows(run, &finer, name, curve, out);
    free(curve);
    free(mesh);
    return error->status;
}

static enum ad_status write_data(const struct path_run *run, FILE *out, struct ad_error *error)
{
    size_t size = run->system.dof * run->settings.slices;
    char name[48];
    write_path(run, "reference", run->reference ? run->reference : run->path, out);
    write_curve(run, "start", run->start, out, error);
    for (size_t f = 0; f < run->record.n_frames; f++) {
        snprintf(name, sizeof name, "step %zu", run->record.frame_step[f]);
        write_path(run, name, run->record.frames + f * size, out);
    }
    write_curve(run, "found", run->path, out, error);
    for (size_t k = 0; k < run->solutions.n && error->status == AD_OK; k++) {
        struct path_run timed = *run;
        timed.settings.dt = run->solutions.solution[k].time / (double)(run->settings.slices - 1);
        write_curve(&timed, "solution", run->solutions.solution[k].path, out, error);
    }
    fputs("# history: step, S, T, V, |gradient|\n", out);
    for (size_t i = 0; i < run->record.n; i++) {
        const struct phys_path_figures *f = &run->record.figures[i];
        fprintf(out, "%zu %.9g %.9g %.9g %.9g\n", i, f->action_mean, f->kinetic_mean,
                f->potential_mean, f->grad_norm);
    }
    return error->status;
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
    return range_with_margins(range, 0.05, 0.1);
}

/* ---- left: paths ---- */

/* A picture shows a few paths on the way; colours fade from the path found back to the start. */
static void still(struct figure *figure, const struct coordinates *view, const struct path_run *run)
{
    size_t n = run->record.n_frames, last = SIZE_MAX;
    char block[32];
    bool noisy = run->noise.sigma > 0;
    coordinates_draw(
        view, figure, "index 1",
        noisy ? STYLE(NULL, 7, 0, 0.25) : &(struct style){.width = 1.3, .dash = "(3,4)"}, 0x40);
    for (size_t part = 0; part < WAY && n > 1; part++) {
        size_t frame = n > 16 ? n >> (6 - 2 * part) : part * n / WAY;
        if (frame == last || (frame == 0 && run->settings.adam_steps == 0))
            continue;
        snprintf(block, sizeof block, "index %zu", FIRST_FRAME + frame);
        coordinates_draw(view, figure, block, STYLE(NULL, 0, 1, 0), 0x90);
        last = frame;
    }
    snprintf(block, sizeof block, "index %zu", FIRST_FRAME + n);
    coordinates_draw(view, figure, block, STYLE(NULL, 0, 2, 0), 0);
    figure_draw(figure,
                noisy ? STYLE("#606060", 7, 0, 0.25)
                      : &(struct style){.colour = "#606060", .width = 1.3, .dash = "(3,4)"},
                "start", "NaN");
    if (last != SIZE_MAX)
        figure_draw(figure, STYLE("#a0a0a0", 0, 1, 0), "on the way", "NaN");
    figure_draw(figure, STYLE(view->n > 1 ? "#303030" : figure_colours[0], 0, 2, 0), "found",
                "NaN");
}

/* What a list of solutions is by. */
static double key_of(const struct path_run *run, size_t k)
{
    const struct phys_solution *s = &run->solutions.solution[k];
    return run->ends.free_time ? s->time : s->energy;
}

/* All of them, the result with a thick line; beyond the legend in grey. */
static void solutions(struct figure *figure, const struct coordinates *view,
                      const struct path_run *run)
{
    const struct phys_solutions *all = &run->solutions;
    size_t named = all->n <= FIGURE_LEGEND ? all->n : FIGURE_LEGEND - 2;
    char block[32], title[96];
    const bool timed = run->ends.free_time;
    const char *unit = timed ? run->system.scene->time_unit : run->system.scene->energy_unit;
    for (size_t k = all->n; k-- > 0;) {
        bool result = k == run->chosen;
        snprintf(block, sizeof block, "index %zu", FIRST_FRAME + run->record.n_frames + 1 + k);
        snprintf(title, sizeof title, "%s = %.*g%s%.16s%s", timed ? "T" : "E", timed ? 5 : 7,
                 key_of(run, k), unit_blank(unit), unit_shown(unit), result ? ", the result" : "");
        const char *colour = k < named ? figure_colours[k] : result ? "#000000" : "#b0b0b0";
        coordinates_draw(view, figure, block, STYLE(colour, 0, result ? 3 : 1.2, 0), 0);
        if (k < named || result)
            figure_draw(figure, STYLE(colour, 0, result ? 3 : 1.2, 0), title, "NaN");
    }
    snprintf(title, sizeof title, "%zu more, up to %.7g", all->n - named,
             all->n ? key_of(run, all->n - 1) : 0);
    if (named < all->n)
        figure_draw(figure, STYLE("#b0b0b0", 0, 1.2, 0), title, "NaN");
}

static void left(struct figure *figure, const struct path_run *run)
{
    struct coordinates view;
    size_t n = run->settings.slices;
    const struct phys_grid grid = phys_grid_of(&run->settings);
    bool beside = run->reference && !run->solutions.n;
    const double end = run->solutions.n && run->ends.free_time ? key_of(run, run->solutions.n - 1)
                                                               : phys_grid_time(&grid, n - 1);
    coordinates_begin(&view, &run->system, (struct range){0, end}, !run->settings.mesh);
    const double *const paths[] = {beside ? run->reference : run->path, run->start, run->path};
    for (size_t p = 0; p < 3; p++) /* all frames of an animation share the axes */
        coordinates_widen(&view, n, paths[p], n, 1);
    for (size_t k = 0; k < run->solutions.n; k++)
        coordinates_widen(&view, n, run->solutions.solution[k].path, n, 1);
    fprintf(figure->plot->script, "rows = %zu\n", n);
    coordinates_panel(&view, figure);
    bool map = view.view == VIEW_MAP;
    if (beside && !map) {
        const struct style *style = parts_of(run) > 1 ? STYLE(COLOUR_REFERENCE, 7, 0, 1.1)
                                                      : STYLE(COLOUR_REFERENCE, 0, 6, 0);
        coordinates_draw(&view, figure, "index 0", style, 0);
        figure_draw(figure, style, "reference", "NaN");
    }
    if (run->solutions.n && !map)
        solutions(figure, &view, run);
    else if (figure->layout.frames)
        coordinates_draw(&view, figure, "index frame(f)", STYLE(NULL, 0, 2, 0), 0);
    else if (map)
        coordinates_draw(&view, figure, "index found", STYLE(NULL, 0, 0, 0), 0);
    else
        still(figure, &view, run);
    coordinates_legend(&view, figure);
}

/* ---- right: what the steps changed ---- */

static void gradient(struct figure *figure, const struct path_run *run, size_t block)
{
    const double steps = (double)run->found.info.steps;
    figure_panel(figure, &(struct panel){.across = {"step", NULL, {-0.02 * steps, 1.02 * steps}, 0},
                                         .y = "|gradient of the action|",
                                         .x_tics = steps <= 10 ? "1" : "5",
                                         .log = "y"});
    figure_draw(figure, STYLE(figure_colours[0], 7, 1.5, 0.6), NULL,
                "data index %zu%s using 1:($5 > 0 ? $5 : NaN)", block,
                figure->layout.frames ? " every ::0::step(f)" : "");
}

/* S, T, V over the steps; dashed: their values on the reference path. An animation shows the
   history up to its frame. */
static void history(struct figure *figure, const struct path_run *run, size_t block)
{
    const struct phys_path_figures *r = &run->found.info.compared;
    const struct {
        const char *name;
        double reference;
    } rows[] = {{"S", r->action_mean}, {"T", r->kinetic_mean}, {"V", r->potential_mean}};
    struct range values = history_range(run);
    int power = range_exponent(values);
    figure_panel(
        figure,
        &(struct panel){.across = {"step", NULL, {0, (double)run->found.info.steps}, 0},
                        .up = {"mean per slice", run->system.scene->energy_unit, values, power},
                        .key = KEY_ABOVE});
    for (size_t k = 0; k < 3 && run->reference; k++) {
        const struct style dashed = {.colour = figure_colours[k], .width = 1, .dash = "(6,4)"};
        figure_draw(figure, &dashed, NULL, "%.9g", rows[k].reference / pow(10, power));
    }
    for (size_t k = 0; k < 3; k++)
        figure_draw(figure, STYLE(figure_colours[k], 0, 2, 0), rows[k].name,
                    "data index %zu%s using 1:($%zu/1e%d)", block,
                    figure->layout.frames ? " every ::0::step(f)" : "", k + 2, power);
    if (run->reference)
        figure_draw(figure, &(struct style){.colour = "#606060", .width = 1, .dash = "(6,4)"},
                    "reference", "NaN");
}

/* ---- the lines above ---- */

static void conjugate(const struct phys_spectrum *s, const char *unit, struct line *line)
{
    if (s->unknown_conjugate)
        return;
    if (s->n_conjugate == 0)
        line_add(line, "no conjugate points");
    else
        line_add(line, "conjugate at t = %.4g%s%.16s%s", s->conjugate[0].time, unit_blank(unit),
                 unit_shown(unit), s->n_conjugate > 1 ? " and later" : "");
}

static void name_found(const struct path_run *run, struct line *line)
{
    const struct phys_path_found *found = &run->found;
    const struct phys_scene *scene = run->system.scene;
    const char *E = unit_shown(scene->energy_unit), *t = unit_shown(scene->time_unit);
    double error = run->refined.n ? path_estimate(run) : found->discretisation;
    if (run->solutions.n > 1)
        line_add(line, "%zu stationary paths", run->solutions.n);
    if (found->keeps_energy && isfinite(found->info.energy_mean))
        line_add(line, "E = %.6g%s%.16s", found->info.energy_mean, unit_blank(E), E);
    line_add(line, "S = %.6g%s%.16s%s%.16s", found->info.action, unit_blank(E), E,
             *E ? unit_blank(t) : "", *E ? t : "");
    if (!found->stationary)
        line_add(line, "not stationary: gradient %.2g of the start's",
                 found->info.grad_norm / found->info.start.grad_norm);
    else if (found->spectrum.legendre == PHYS_POSITIVE && !found->spectrum.undetermined)
        line_add(line, "Morse index %zu", found->spectrum.index);
    if (found->stationary)
        conjugate(&found->spectrum, t, line);
    if (found->another && run->solutions.n == 0)
        line_add(line, "the reference is another path");
    if (isfinite(error))
        line_add(line, "%s %.2g%s%.16s", run->refined.n ? "error at most" : "discretisation error",
                 error, unit_blank(scene->unit), unit_shown(scene->unit));
}

static void name_run(const struct path_run *run, FILE *out)
{
    char text[160];
    snprintf(text, sizeof text, "%.60s: %s by %s, rule %s, %zu slices", run->system.scene->name,
             path_is_periodic(run->options) ? "periodic path" : "path between two ends",
             run->solver->name, run->settings.rule->name, run->settings.slices);
    fputs("name = ", out);
    quote_gnuplot_label(out, text);
    fputc('\n', out);
}

enum ad_status path_picture(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct path_run *run = context;
    FILE *out = plot->script;
    size_t frames = run->record.n_frames, found = FIRST_FRAME + frames;
    size_t steps = run->found.info.steps, block = found + 1 + run->solutions.n;
    bool changes = steps > 0 && run->solutions.n == 0;
    struct layout layout = figure_pair;
    struct figure figure;
    struct line line = {0};
    if (write_data(run, plot->data, error) != AD_OK)
        return error->status;
    name_found(run, &line);
    fprintf(out, "set samples 2\nfound = %zu\n", found);
    name_run(run, out);
    layout.expression = "name";
    layout.found = line.text;
    if (!changes) {
        layout.columns = 1;
        layout.room.right = 0.78; /* a legend beside */
    }
    if (plot->animated) {
        layout.frames = frames + 1 + HOLD;
        layout.expression = "sprintf('%s, step %d of %d', name, step(f), last)";
        fprintf(out,
                "last = %zu\nframe(f) = f < %zu ? f + %d : %zu\n"
                "step(f) = f < %zu ? f * %zu : last\n",
                steps, frames, FIRST_FRAME, found, frames, run->record.frame_every);
    }
    figure_begin(&figure, plot, &layout);
    left(&figure, run);
    if (changes)
        (steps < FEW_STEPS ? gradient : history)(&figure, run, block);
    figure_end(&figure);
    return error->status;
}
