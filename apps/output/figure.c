/* Panels with curves (figure.h). */
#include "figure.h"
#include "unit.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

const struct layout figure_pair = {.rows = 1,
                                   .columns = 2,
                                   .left = 0.07,
                                   .right = 0.98,
                                   .bottom = 0.12,
                                   .top = 0.86,
                                   .gap_x = 0.09};
const char *const figure_colours[8] = {"#1f4e79", "#c0392b", "#27823b", "#e8a33d",
                                       "#722a72", "#3c8dc5", "#84bf63", "#6b6b6b"};

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
    return most >= 1e5 || (most > 0 && most < 1e-2) ? (int)floor(log10(most)) : 0;
}

void figure_begin(struct figure *figure, struct plot *plot, const struct layout *layout)
{
    FILE *out = plot->script;
    *figure = (struct figure){.plot = plot, .layout = *layout};
    plot->width = layout->width ? layout->width : plot->width;
    plot->height = layout->height ? layout->height : plot->height;
    if (layout->frames)
        fprintf(out, "do for [f = 0:%zu] {\n", layout->frames - 1);
    fputs("set multiplot\nset grid lt 1 lc rgb '#e6e6e6'\nset label 1 ", out);
    if (layout->expression)
        fputs(layout->expression, out);
    else
        quote_gnuplot(out, layout->title ? layout->title : "");
    fputs(" at screen 0.5,0.97 center font ',14'\n", out);
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
    double row = figure->panel / l->columns, column = figure->panel % l->columns;
    double width = (l->right - l->left - (l->columns - 1) * l->gap_x) / l->columns;
    double height = (l->top - l->bottom - (l->rows - 1) * l->gap_y) / l->rows;
    double left = l->left + column * (width + l->gap_x), top = l->top - row * (height + l->gap_y);
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
        fputs(axis->power ? ".\" \"." : ".\" / \".", out);
        quote_gnuplot_label(out, unit);
    }
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
    fputs(which == 'x' ? " offset 0,0.6\n" : "\n", out);
}

void figure_panel(struct figure *figure, const struct panel *panel)
{
    FILE *out = figure->plot->script;
    struct place p = panel->place.top > 0 ? panel->place : next_place(figure);
    if (panel->equal)
        p = equal_units(panel, figure->plot, p);
    end_panel(figure);
    if (figure->panel > 0)
        fputs("unset label\n", out);
    fprintf(out,
            "unset object\nunset arrow\nunset y2tics\nunset y2label\n"
            "set lmargin at screen %.4g\nset rmargin at screen %.4g\nset tmargin at screen %.4g\n"
            "set bmargin at screen %.4g\n",
            p.left, p.right, p.top, p.bottom);
    set_axis('x', panel, panel->x, panel->x_range, panel->x_tics, &panel->across, out);
    set_axis('y', panel, panel->y, panel->y_range, panel->y_tics, &panel->up, out);
    fputs("set title ", out);
    quote_gnuplot(out, panel->title ? panel->title : "");
    fprintf(out, " offset 0,-0.5\nset key %s\n%s", panel->key ? panel->key : "off",
            panel->more ? panel->more : "");
    figure->panel++;
}

static void begin_element(struct figure *figure, const char *format, va_list values)
{
    fputs(figure->drawing ? ", \\\n    " : "plot ", figure->plot->script);
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
    if (title)
        quote_gnuplot(out, title);
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
