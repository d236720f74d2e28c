/* The picture of a section (simulate.h) and its axes: its points in a plane, members by colour,
   grey where they are not known to be of their start. */
#include "apps/output/figure.h"
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MANY = 400 }; /* points that are drawn small */

/* ---- axes ---- */

/* The column of a row (simulate.h), by the name of its quantity; 0: there is none. */
static size_t find_column(const struct phys_system *system, const char *text, size_t length)
{
    char name[SIMULATE_NAME];
    for (size_t k = 0; k <= 2 * system->dof; k++) {
        simulate_quantity(system, k < 2 * system->dof ? k : k + 1, name);
        if (strlen(name) == length && strncmp(name, text, length) == 0)
            return k < 2 * system->dof ? 2 + k : 1;
    }
    return 0;
}

enum ad_status simulate_section_axes(struct simulate_run *run, struct ad_error *error)
{
    const char *text = run->options->section_axes;
    size_t first = text ? strcspn(text, ",") : 0;
    char name[64];
    if (!text)
        return AD_OK;
    size_t *axis = run->section.axis;
    axis[0] = find_column(&run->system, text, first);
    axis[1] =
        text[first] ? find_column(&run->system, text + first + 1, strlen(text + first + 1)) : 0;
    phys_coordinate_name(&run->system, 0, name, sizeof name);
    return axis[0] && axis[1] && axis[0] != axis[1]
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT,
                         "--section-axes: expected two quantities of %s such as %s,v_%s, "
                         "each a coordinate, v_ and a coordinate, or t, got '%s'",
                         run->system.scene->name, name, name, text);
}

static struct range range_of(const struct simulate_run *run, size_t column)
{
    struct range range = {INFINITY, -INFINITY};
    for (size_t i = 0; i < run->section.n; i++)
        range_widen(&range, run->section.row[i * (3 + 2 * run->system.dof) + column]);
    return run->section.n ? range : (struct range){0, 0};
}

/* The coordinate whose values and velocities spread most: those of the surface do not. Of one
   coordinate: the time, and what spreads more. */
static void choose_axes(const struct simulate_run *run, size_t axis[2])
{
    double most = -1, spread[2];
    const size_t dof = run->system.dof;
    for (size_t k = 0; k < dof; k++) {
        for (size_t half = 0; half < 2; half++) {
            struct range range = range_of(run, 2 + k + half * dof);
            spread[half] = range.high - range.low;
        }
        if (spread[0] * spread[1] > most) {
            most = spread[0] * spread[1];
            axis[0] = dof > 1 ? 2 + k : 1;
            axis[1] = dof > 1 || spread[1] >= spread[0] ? 2 + k + dof : 2;
        }
    }
}

/* The largest error of a value in a column, as far as that is known: of a velocity in proportion to
   the largest. What is constant but for that is drawn as such. */
static double error_of(const struct simulate_run *run, size_t column)
{
    const struct simulate_section *s = &run->section;
    const size_t dof = run->system.dof, columns = 3 + 2 * dof;
    double error = 0, size[2] = {0};
    for (size_t i = 0; i < s->n; i++) {
        const double *row = s->row + i * columns;
        error = fmax(error, row[columns - 1]);
        for (size_t k = 0; k < 2 * dof; k++)
            size[k / dof] = fmax(size[k / dof], fabs(row[2 + k]));
    }
    if (column == 1)
        return 0;
    return column < 2 + dof ? error : size[0] > 0 ? error / size[0] * size[1] : 0;
}

static struct axis axis_of(const struct simulate_run *run, size_t column, char *name)
{
    const struct phys_scene *scene = run->system.scene;
    const size_t dof = run->system.dof;
    const double least = 10 * error_of(run, column);
    struct range range = range_of(run, column);
    if (range.high - range.low < least) {
        const double middle = (range.low + range.high) / 2;
        range = (struct range){middle - least / 2, middle + least / 2};
    }
    range = range_with_margins(range, .05, .05);
    simulate_quantity(&run->system, column == 1 ? 2 * dof + 1 : column - 2, name);
    return (struct axis){name,
                         column == 1        ? scene->time_unit
                         : column < 2 + dof ? scene->unit
                                            : NULL,
                         range, range_exponent(range)};
}

enum ad_status simulate_section_picture(const struct simulate_run *run, struct plot *plot,
                                        struct ad_error *error)
{
    const struct simulate_section *s = &run->section;
    const size_t columns = 3 + 2 * run->system.dof;
    struct layout layout = {.width = 640, .height = 620, .room = {0.14, 0.96, 0.1, 0.86}};
    char names[2][SIMULATE_NAME], title[160], lost[64];
    size_t axis[2] = {s->axis[0], s->axis[1]};
    if (!axis[0])
        choose_axes(run, axis);
    const struct axis x = axis_of(run, axis[0], names[0]), y = axis_of(run, axis[1], names[1]);
    struct figure figure;
    struct line line = {0};
    line_add(&line, "%zu point%s", s->n, s->n == 1 ? "" : "s");
    if (s->known < s->n)
        line_add(&line, "%zu known to %.2g", s->known, s->accuracy);
    for (size_t i = 0; i < s->n; i++) {
        const double *row = s->row + i * columns;
        bool known = row[columns - 1] <= s->accuracy;
        const char *colour =
            known ? figure_colours[((size_t)row[0] - 1) % FIGURE_LEGEND] : COLOUR_REFERENCE;
        fprintf(plot->data, "%.9g %.9g %lu\n", row[axis[0]] / pow(10, x.power),
                row[axis[1]] / pow(10, y.power), strtoul(colour + 1, NULL, 16));
    }
    if (s->n == 0)
        fputs("NaN NaN 0\n", plot->data);
    snprintf(title, sizeof title, "%.60s: section %.60s", run->system.scene->name,
             run->options->section);
    layout.title = title;
    layout.found = line.text;
    figure_begin(&figure, plot, &layout);
    figure_panel(&figure, &(struct panel){.across = x, .up = y, .key = KEY_ABOVE});
    figure_element(&figure, "data using 1:2:3 with points pt 7 ps %g lc rgb variable notitle",
                   s->n > MANY ? 0.25 : 0.5);
    if (s->known < s->n) {
        snprintf(lost, sizeof lost, "not known to %.2g", s->accuracy);
        figure_draw(&figure, STYLE(COLOUR_REFERENCE, 7, 0, 0.5), lost, "NaN");
    }
    figure_end(&figure);
    return error->status;
}
