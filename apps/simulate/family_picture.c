/* The picture of a family: period (or energy) and largest multiplier over the value, with marks; in
   a plane or in space, some of its motions, over the two coordinates that change most. */
#include "apps/output/figure.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ORBITS = 24, POINTS = 241 };

static const struct {
    const char *name;
    int mark;
} marks[] = {[PHYS_MARK_FOLD] = {"fold", 5},          [PHYS_MARK_BRANCH] = {"branch point", 9},
             [PHYS_MARK_DOUBLING] = {"doubling", 11}, [PHYS_MARK_TORUS] = {"torus", 13},
             [PHYS_MARK_HALVING] = {"halving", 15},   [PHYS_MARK_REST] = {"rest", 7},
             [PHYS_MARK_CHANGE] = {"change", 2}};

static void draw(struct figure *figure, const struct phys_family *f, int column)
{
    figure_draw(figure, STYLE(figure_colours[0], 7, 1.4, 0.3), NULL, "data index 0 using 1:%d",
                column);
    for (size_t k = PHYS_MARK_FOLD; k < sizeof marks / sizeof *marks; k++)
        for (size_t i = 0; i < f->n; i++)
            if (f->member[i].mark == k) {
                figure_draw(figure, STYLE(figure_colours[k % FIGURE_LEGEND], marks[k].mark, 0, 1.1),
                            marks[k].name, "data index 0 using ($4 == %zu ? $1 : NaN):%d", k,
                            column);
                break;
            }
}

/* A block of places and the share of the family, a line a body and motion; returns their ranges. */
static enum ad_status write_orbits(const struct simulate_run *run, FILE *out, struct range range[3],
                                   struct ad_error *error)
{
    const struct phys_family *f = &run->family;
    struct phys_system system = run->system;
    const size_t dof = system.dof, apart = (f->n + ORBITS - 1) / ORBITS;
    const bool of = strcmp(run->along, "energy") != 0 && strcmp(run->along, "period") != 0;
    double *path = malloc(dof * POINTS * sizeof *path);
    if (!path)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    fputs("\n\n# some of the motions: places, share of the family\n", out);
    for (size_t i = 0; i < f->n && error->status == AD_OK; i += apart) {
        const struct phys_periodic *m = &f->member[i].motion;
        if (of)
            phys_system_set(&system, run->along, f->member[i].value, error);
        if (error->status != AD_OK ||
            phys_motion_path(&system, NULL, m->x, m->x + dof, POINTS, m->period / (POINTS - 1),
                             path, error) != AD_OK)
            break;
        for (size_t k = 0; k < dof; k += system.dims) {
            for (size_t j = 0; j < POINTS; j++) {
                for (size_t c = 0; c < system.dims; c++) {
                    fprintf(out, "%.9g ", path[(k + c) * POINTS + j]);
                    range_widen(&range[c], path[(k + c) * POINTS + j]);
                }
                fprintf(out, "%.3g\n", (double)i / (double)f->n);
            }
            fputc('\n', out);
        }
    }
    if (of) /* the values are shared with the run's system */
        phys_system_set(&system, run->along, f->member[f->n - 1].value, error);
    free(path);
    return error->status;
}

static double span(struct range range) { return range.high - range.low; }

enum ad_status simulate_family_picture(const struct simulate_run *run, struct plot *plot,
                                       struct ad_error *error)
{
    const struct phys_family *f = &run->family;
    const struct phys_scene *scene = run->system.scene;
    const bool plane = scene->picture == PHYS_PICTURE_PLANE && run->system.dims >= 2;
    struct range range[3] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    struct range values = {INFINITY, -INFINITY};
    const bool periods = strcmp(run->along, "period") == 0;
    struct layout layout = figure_pair;
    struct figure figure;
    struct line line = {0};
    char title[160];
    size_t n = 0;
    fputs("# value, period or energy, largest modulus of a multiplier, mark\n", plot->data);
    for (size_t i = 0; i < f->n; i++) {
        const struct phys_family_member *m = &f->member[i];
        const struct phys_multiplier *largest = m->motion.multiplier;
        fprintf(plot->data, "%.12g %.12g ", m->value, periods ? m->energy : m->motion.period);
        fprintf(plot->data, "%.12g %d\n", largest ? hypot(largest->re, largest->im) : NAN,
                (int)m->mark);
        n += m->mark != PHYS_MARK_NONE;
        range_widen(&values, m->value);
    }
    if (plane && write_orbits(run, plot->data, range, error) != AD_OK)
        return error->status;
    line_add(&line, "%zu periodic motions", f->n);
    line_add(&line, "%zu mark%s", n, n == 1 ? "" : "s");
    snprintf(title, sizeof title, "%.60s: a family in %.60s", scene->name, run->along);
    layout.title = title;
    if (plane) {
        layout.width = 1440;
        layout.columns = 3;
        layout.room.left = 0.065;
        layout.gap.x = 0.07;
    }
    layout.found = line.text;
    figure_begin(&figure, plot, &layout);
    const struct axis across = {run->along, NULL, range_with_margins(values, .02, .02), 0};
    figure_panel(
        &figure,
        &(struct panel){.across = across, .y = periods ? "energy" : "period", .key = KEY_ABOVE});
    draw(&figure, f, 2);
    figure_panel(
        &figure,
        &(struct panel){.across = across, .y = "largest modulus of a multiplier", .log = "y"});
    draw(&figure, f, 3);
    if (plane) {
        char names[2][SIMULATE_NAME];
        struct axis axis[2];
        size_t least = 2, shown[2];
        for (size_t k = 0; k < 2 && run->system.dims > 2; k++)
            least = span(range[k]) < span(range[least]) ? k : least;
        for (size_t k = 0; k < 2; k++) {
            shown[k] = k + (k >= least);
            phys_coordinate_name(&run->system, shown[k], names[k], sizeof names[k]);
            axis[k] = (struct axis){names[k], scene->unit,
                                    range_with_margins(range[shown[k]], .05, .05), 0};
        }
        figure_panel(&figure, &(struct panel){.across = axis[0], .up = axis[1], .equal = true});
        fputs("unset colorbox\nset palette defined (0 '#9ecae1', 1 '#08306b')\n", plot->script);
        figure_element(&figure, "data index 1 using %zu:%zu:%zu with lines lc palette notitle",
                       shown[0] + 1, shown[1] + 1, run->system.dims + 1);
    }
    figure_end(&figure);
    return error->status;
}
