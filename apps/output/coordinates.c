/* Coordinates of a system in a picture (coordinates.h). */
#include "coordinates.h"
#include "report.h"

#include <math.h>
#include <string.h>

/* More coordinates than this, of one each, are the sites of a lattice. */
enum { LATTICE = 16, NAME = 48 };

void coordinates_begin(struct coordinates *view, const struct phys_system *system,
                       struct range time, bool even)
{
    const struct phys_scene *scene = system->scene;
    const struct range none = {INFINITY, -INFINITY};
    *view = (struct coordinates){.system = system,
                                 .n = system->dof,
                                 .step = 1,
                                 .x = {"t", scene->time_unit, time, 0},
                                 .y = {view->label, scene->unit, none, 0}};
    if (scene->picture == PHYS_PICTURE_PLANE && system->dims >= 2) {
        view->view = system->dims == 3 ? VIEW_SPACE : VIEW_PLANE;
        view->n = system->bodies;
        view->step = system->dims;
        view->x = (struct axis){"x", scene->unit, none, 0};
        view->y = (struct axis){"y", scene->unit, none, 0};
        view->z = (struct axis){"z", scene->unit, none, 0};
    } else if (system->dims == 1 && system->dof > LATTICE && even) {
        view->view = VIEW_MAP;
    } else if (system->dof == 1) {
        phys_coordinate_name(system, 0, view->label, sizeof view->label);
    } else {
        strcpy(view->label, scene->picture == PHYS_PICTURE_ANGLES ? "angle" : "coordinate");
    }
    view->named = view->n > 1 && view->n <= FIGURE_LEGEND;
}

void coordinates_widen(struct coordinates *view, size_t samples, const double *x, size_t stride,
                       size_t next)
{
    for (size_t i = 0; i < samples; i++)
        for (size_t c = 0; c < view->n; c++) {
            const double *at = x + i * next + c * view->step * stride;
            if (view->view == VIEW_TIME || view->view == VIEW_MAP) {
                range_widen(&view->y.range, *at);
                continue;
            }
            range_widen(&view->x.range, at[0]);
            range_widen(&view->y.range, at[stride]);
            if (view->view == VIEW_SPACE)
                range_widen(&view->z.range, at[2 * stride]);
        }
}

/* The centres that a scene has beside its bodies. */
static size_t centres(const struct phys_system *system, double x[2])
{
    const char *name = system->library ? "" : system->scene->name;
    bool one = strcmp(name, "kepler") == 0 || strcmp(name, "fall") == 0;
    bool two = strcmp(name, "arenstorf") == 0 || strcmp(name, "cr3bp") == 0;
    x[0] = two ? -phys_system_get(system, "mu") : 0;
    x[1] = 1 + x[0];
    return two ? 2 : one;
}

static void map_panel(struct coordinates *view, struct figure *figure)
{
    double most = fmax(fabs(view->y.range.low), fabs(view->y.range.high));
    const char *unit = unit_shown(view->y.unit);
    struct axis sites = {"site", NULL, {0.5, (double)view->n + 0.5}, 0};
    figure_panel(figure, &(struct panel){.across = view->x, .up = sites});
    FILE *out = figure->plot->script;
    fprintf(out,
            "set colorbox\nset cbrange [%.6g:%.6g]\nset palette defined (-1 '#b2182b', -.5 "
            "'#f4a582', 0 '#f7f7f7', .5 '#92c5de', 1 '#2166ac')\nset cblabel ",
            most > 0 ? -most : -1, most > 0 ? most : 1);
    quote_gnuplot_label(out, "coordinate");
    if (*unit) {
        fputs(".\" / \".", out);
        quote_gnuplot_label(out, unit);
    }
    fputc('\n', out);
}

/* Widens a range about its middle. */
static void no_flatter(struct range *range, double least)
{
    double lacks = fmax(0, least - (range->high - range->low));
    range->low -= 0.5 * lacks;
    range->high += 0.5 * lacks;
}

void coordinates_panel(struct coordinates *view, struct figure *figure)
{
    struct axis *x = &view->x, *y = &view->y, *z = &view->z;
    double centre[2];
    for (size_t k = 0; k < centres(view->system, centre); k++) {
        range_widen(&x->range, centre[k]);
        range_widen(&y->range, 0);
    }
    if (view->view == VIEW_MAP) {
        map_panel(view, figure);
        return;
    }
    y->range = range_with_margins(y->range, 0.04, 0.04);
    if (view->view != VIEW_TIME)
        x->range = range_with_margins(x->range, 0.04, 0.04);
    double across = fmax(x->range.high - x->range.low, y->range.high - y->range.low);
    if (view->view != VIEW_TIME) { /* units of all axes are equally long */
        no_flatter(&x->range, 0.4 * across);
        no_flatter(&y->range, 0.4 * across);
        no_flatter(&z->range, 0.4 * across);
    }
    x->power = range_exponent(x->range);
    y->power = range_exponent(y->range);
    z->power = view->view == VIEW_SPACE ? range_exponent(z->range) : x->power;
    if (view->view != VIEW_TIME)
        x->power = y->power = z->power = (int)fmax(x->power, y->power);
    figure_panel(figure,
                 &(struct panel){.across = *x,
                                 .up = *y,
                                 .depth = view->view == VIEW_SPACE ? *z : (struct axis){0},
                                 .equal = view->view == VIEW_PLANE,
                                 .key = view->view == VIEW_SPACE ? KEY_COLUMN : KEY_BESIDE});
}

/* The colour of a curve, of one of many, or that of the style. */
static const char *colour_of(const struct coordinates *view, size_t c, const struct style *style)
{
    return style->colour ? style->colour : figure_colours[view->named ? c % FIGURE_LEGEND : 0];
}

static void draw_map(const struct coordinates *view, struct figure *figure, const char *which)
{
    const struct range *t = &view->x.range;
    figure_element(figure,
                   "data %s matrix every 1::1 using (%.9g+$2*%.9g/(rows-1)):1:3 with image notitle",
                   which, t->low, t->high - t->low);
}

void coordinates_draw(const struct coordinates *view, struct figure *figure, const char *which,
                      const struct style *style, int fade)
{
    const int power[] = {view->x.power, view->y.power, view->z.power};
    const char *when = view->when ? view->when : "1";
    if (view->view == VIEW_MAP) {
        draw_map(view, figure, which);
        return;
    }
    for (size_t c = 0; c < view->n; c++) {
        struct style s = *style;
        char colour[16], columns[3][80];
        size_t first = 2 + c * view->step, n = view->view == VIEW_SPACE ? 3 : 2;
        snprintf(colour, sizeof colour, "#%02x%.6s", fade, colour_of(view, c, style) + 1);
        s.colour = fade ? colour : colour_of(view, c, style);
        for (size_t k = 0; k < n; k++) {
            size_t column = view->view != VIEW_TIME ? first + k : k ? first : 1;
            snprintf(columns[k], sizeof columns[k], "(%s ? $%zu/1e%d : NaN)", when, column,
                     power[k]);
        }
        figure_draw(figure, &s, NULL, "data %s using %s:%s%s%s", which, columns[0], columns[1],
                    n == 3 ? ":" : "", n == 3 ? columns[2] : "");
    }
}

static void curve_name(const struct coordinates *view, size_t c, char name[NAME])
{
    const struct phys_scene *scene = view->system->scene;
    if (view->view == VIEW_TIME)
        phys_coordinate_name(view->system, c, name, 17);
    else if (scene->body_name)
        snprintf(name, NAME, "%.16s", scene->body_name(view->system->params, c));
    else
        snprintf(name, NAME, "body %zu", c + 1);
}

void coordinates_legend(const struct coordinates *view, struct figure *figure)
{
    double centre[2];
    char name[NAME];
    if (view->view == VIEW_MAP)
        return;
    for (size_t c = 0; view->named && c < view->n; c++) {
        curve_name(view, c, name);
        figure_draw(figure, STYLE(figure_colours[c], 0, 2, 0), name, "NaN");
    }
    if (!view->named && view->n > 1) {
        snprintf(name, sizeof name, "%zu %s", view->n,
                 view->view == VIEW_TIME ? "coordinates" : "bodies");
        figure_draw(figure, STYLE(figure_colours[0], 0, 2, 0), name, "NaN");
    }
    size_t n = centres(view->system, centre);
    for (size_t k = 0; k < n; k++)
        figure_draw(figure, STYLE("#000000", 2, 0, 1),
                    k       ? NULL
                    : n > 1 ? "centres"
                            : "centre",
                    "'+' using (%.9g):(0) every ::0::0", centre[k]);
}
