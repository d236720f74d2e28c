/* Panels with curves (figure.h). */
#include "figure.h"
#include "report.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

const struct layout figure_pair = {
    .height = 480, .columns = 2, .room = {0.095, 0.985, 0.115, 0.82}, .gap = {0.2, 0}};
const char *const figure_colours[FIGURE_LEGEND] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#e69f00", "#56b4e9", "#6b6b6b", "#000000"};

void range_widen(struct range *range, double value)
{
    range->low = fmin(range->low, value);
    range->high = fmax(range->high, value);
}

struct range range_with_margins(struct range range, double below, double above)
{
    double span = range.high > range.low ? range.high - range.low : fabs(range.high) + 1;
    return (struct range){range.low - below * span, range.high + above * span};
}

int range_exponent(struct range range)
{
    double most = fmax(fabs(range.low), fabs(range.high));
    return isfinite(most) && (most >= 1e5 || (most > 0 && most < 1e-2)) ? (int)floor(log10(most))
                                                                        : 0;
}

void line_add(struct line *line, const char *format, ...)
{
    char text[sizeof line->text];
    va_list values;
    va_start(values, format);
    int length = vsnprintf(text, sizeof text, format, values);
    va_end(values);
    if (length > 0 && line->length + (size_t)length + 2 < sizeof line->text)
        line->length +=
            (size_t)snprintf(line->text + line->length, sizeof line->text - line->length, "%s%s",
                             line->length ? ", " : "", text);
}

void figure_begin(struct figure *figure, struct plot *plot, const struct layout *layout)
{
    FILE *out = plot->script;
    *figure = (struct figure){.plot = plot, .layout = *layout};
    plot->width = layout->width ? layout->width : plot->width;
    plot->height = layout->height ? layout->height : plot->height;
    if (layout->frames)
        fprintf(out, "do for [f = 0:%zu] {\n", layout->frames - 1);
    fputs("set multiplot\nset key font ',12'\nset grid lt 1 lc rgb '#e6e6e6'\nset label 1 ", out);
    if (layout->expression)
        fputs(layout->expression, out);
    else
        quote_gnuplot_label(out, layout->title ? layout->title : "");
    fprintf(out, " at screen 0.5,%.4f center font ',15'\nset label 2 ", 1 - 18.0 / plot->height);
    quote_gnuplot_label(out, layout->found ? layout->found : "");
    fprintf(out, " at screen 0.5,%.4f center font ',12' textcolor rgb '#404040'\n",
            1 - 40.0 / plot->height);
}

static void end_panel(struct figure *figure)
{
    if (figure->drawing)
        fputc('\n', figure->plot->script);
    figure->drawing = false;
}

static struct place next_place(const struct figure *figure)
{
    const struct layout *l = &figure->layout;
    const struct place *room = &l->room;
    int rows = l->rows ? l->rows : 1, columns = l->columns ? l->columns : 1;
    double width = (room->right - room->left - (columns - 1) * l->gap.x) / columns;
    double height = (room->top - room->bottom - (rows - 1) * l->gap.y) / rows;
    double left = room->left + figure->panel % columns * (width + l->gap.x);
    double top = room->top - figure->panel / columns * (height + l->gap.y);
    return (struct place){left, left + width, top - height, top};
}

/* The part of a place, about its middle, in which units of both axes are equally long. */
static struct place equal_units(const struct panel *panel, const struct plot *plot, struct place p)
{
    double x = panel->across.range.high - panel->across.range.low;
    double y = panel->up.range.high - panel->up.range.low;
    double wide = plot->width * (p.right - p.left), high = plot->height * (p.top - p.bottom);
    double unit = fmin(wide / x, high / y);
    double side = 0.5 * (wide - unit * x) / plot->width;
    double above = 0.5 * (high - unit * y) / plot->height;
    return (struct place){p.left + side, p.right - side, p.bottom + above, p.top - above};
}

static void write_label(const struct axis *axis, FILE *out)
{
    const char *unit = unit_shown(axis->unit);
    quote_gnuplot_label(out, axis->name);
    if (axis->power)
        fprintf(out, ".\" / 10^{%d}\"", axis->power);
    if (*unit) {
        fputs(axis->power ? ".\"\\302\\240\"." : ".\" / \".", out); /* viewers drop a plain blank */
        quote_gnuplot_label(out, unit);
    }
}

/* About three steps, for axes in space, whose labels meet at the corners. */
static double wide_step(const struct axis *axis)
{
    double step = (axis->range.high - axis->range.low) / pow(10, axis->power) / 2.5;
    double unit = pow(10, floor(log10(step)));
    return unit * (step >= 5 * unit ? 5 : step >= 2 * unit ? 2 : 1);
}

/* The least round step between labels that leaves 45 pixels to each. */
static double narrow_step(const struct axis *axis, double pixels)
{
    double step = 45 * (axis->range.high - axis->range.low) / pow(10, axis->power) / pixels;
    double unit = pow(10, floor(log10(step)));
    return unit * (step > 5 * unit ? 10 : step > 2 * unit ? 5 : step > unit ? 2 : 1);
}

static void set_axis(char which, const struct panel *panel, const char *title, const char *range,
                     const char *tics, const struct axis *axis, FILE *out)
{
    bool log = panel->log && strchr(panel->log, which);
    double scale = pow(10, axis->power);
    fprintf(out, "%s logscale %c\nset format %c '%s'\nset %ctics %s\nset %crange ",
            log ? "set" : "unset", which, which, log ? "10^{%T}" : "%g", which,
            tics ? tics : "auto", which);
    if (axis->range.low < axis->range.high)
        fprintf(out, "[%.9g:%.9g]", axis->range.low / scale, axis->range.high / scale);
    else
        fputs(range ? range : "[*:*]", out);
    fprintf(out, "\nset %clabel ", which);
    if (axis->name)
        write_label(axis, out);
    else
        quote_gnuplot(out, title ? title : "");
    fputs(panel->depth.name ? which == 'z' ? " rotate parallel\n" : " offset 0,-0.4\n"
          : which == 'x'    ? " offset 0,0.4\n"
                            : " offset 0,0\n",
          out);
}

/* Margins of the panel; a view in space takes a rectangle, with its axes inside. */
static void set_place(const struct panel *panel, struct place p, FILE *out)
{
    if (panel->depth.name) {
        fprintf(out,
                "set lmargin\nset rmargin\nset tmargin\nset bmargin\nset origin %.4g,%.4g\n"
                "set size %.4g,%.4g\nset border 4095 lc rgb '#b0b0b0'\nset xyplane 0\n"
                "set view 62,32,1.5\nset view equal xyz\n",
                p.left - 0.02, p.bottom - 0.06, p.right - p.left + 0.04, p.top - p.bottom + 0.1);
        return;
    }
    fprintf(out,
            "set origin 0,0\nset size 1,1\nset border 3 lc rgb '#606060'\n"
            "set lmargin at screen %.4g\nset rmargin at screen %.4g\n"
            "set tmargin at screen %.4g\nset bmargin at screen %.4g\n",
            p.left, p.right, p.top, p.bottom);
}

void figure_panel(struct figure *figure, const struct panel *panel)
{
    FILE *out = figure->plot->script;
    struct place p = panel->place.top > 0 ? panel->place : next_place(figure);
    if (panel->equal)
        p = equal_units(panel, figure->plot, p);
    end_panel(figure);
    figure->space = panel->depth.name != NULL;
    if (figure->panel > 0)
        fputs("unset label\n", out);
    fputs("unset object\nunset arrow\nunset y2tics\nunset y2label\n", out);
    set_place(panel, p, out);
    set_axis('x', panel, panel->x, panel->x_range, panel->x_tics, &panel->across, out);
    set_axis('y', panel, panel->y, panel->y_range, panel->y_tics, &panel->up, out);
    if (figure->layout.columns > 2 && panel->across.range.low < panel->across.range.high)
        fprintf(out, "set xtics %.6g\n",
                narrow_step(&panel->across, figure->plot->width * (p.right - p.left)));
    if (figure->space) {
        set_axis('z', panel, NULL, NULL, NULL, &panel->depth, out);
        fprintf(out, "set xtics %.6g\nset ytics %.6g\nset ztics %.6g\n", wide_step(&panel->across),
                wide_step(&panel->up), wide_step(&panel->depth));
    }
    if (panel->colour.name) {
        fputs("set format cb '%g'\nset cblabel ", out);
        write_label(&panel->colour, out);
        fputs(" offset 1.2,0\n", out);
    }
    fputs("set title ", out);
    quote_gnuplot(out, panel->title ? panel->title : "");
    fputs(" offset 0,-0.5\n", out);
    if (figure->space && panel->key) /* there "graph" is not the rectangle */
        fprintf(out, "set key at screen %.4g,%.4g %s\n", p.right + 0.01, p.top, panel->key);
    else
        fprintf(out, "set key %s\n", panel->key ? panel->key : "off");
    fputs(panel->more ? panel->more : "", out);
    figure->panel++;
}

static void begin_element(struct figure *figure, const char *format, va_list values)
{
    fputs(figure->drawing ? ", \\\n    "
          : figure->space ? "splot "
                          : "plot ",
          figure->plot->script);
    figure->drawing = true;
    vfprintf(figure->plot->script, format, values);
}

void figure_element(struct figure *figure, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    begin_element(figure, format, values);
    va_end(values);
}

void figure_draw(struct figure *figure, const struct style *s, const char *title,
                 const char *format, ...)
{
    FILE *out = figure->plot->script;
    va_list values;
    va_start(values, format);
    begin_element(figure, format, values);
    va_end(values);
    if (s->axes)
        fprintf(out, " axes %s", s->axes);
    fprintf(out, " with %s",
            s->width > 0 && s->mark ? "linespoints"
            : s->mark               ? "points"
                                    : "lines");
    if (s->width > 0)
        fprintf(out, " lw %g dt %s", s->width, s->dash ? s->dash : "1");
    if (s->mark)
        fprintf(out, " pt %d ps %g", s->mark, s->size > 0 ? s->size : 0.6);
    fprintf(out, " lc rgb '%s' %s", s->colour, title ? "title " : "notitle");
    if (title) {
        quote_gnuplot(out, title);
        fputs(" noenhanced", out);
    }
}

static bool selected(const struct sheet *sheet, size_t row, va_list where)
{
    va_list pairs;
    bool all = true;
    va_copy(pairs, where);
    for (const char *key; all && (key = va_arg(pairs, const char *));)
        all = sheet_is(sheet, row, key, va_arg(pairs, const char *));
    va_end(pairs);
    return all;
}

void figure_curve_where(struct figure *figure, const struct sheet *sheet, const char *x,
                        const char *y, const char *title, const struct style *s, ...)
{
    FILE *data = figure->plot->data;
    bool any = false;
    va_list where;
    figure_draw(figure, s, title, "data index %zu using 1:2", figure->blocks++);
    va_start(where, s);
    for (size_t r = 0; r < sheet->rows; r++) {
        double at = sheet_number(sheet, r, x), value = sheet_number(sheet, r, y);
        if (!isfinite(at) || !isfinite(value) || !selected(sheet, r, where))
            continue;
        fprintf(data, "%.6g %.6g\n", at, value);
        any = true;
    }
    va_end(where);
    fputs(any ? "\n\n" : "NaN NaN\n\n\n", data); /* gnuplot counts blocks that are there */
}

void figure_end(struct figure *figure)
{
    end_panel(figure);
    fputs(figure->layout.frames ? "unset multiplot\n}\n" : "unset multiplot\n",
          figure->plot->script);
}
