/* Panels with curves (figure.h). */
#include "figure.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

void figure_begin(struct figure *figure, struct plot *plot, const struct layout *layout)
{
    *figure = (struct figure){.plot = plot, .layout = *layout};
    plot->width = layout->width;
    plot->height = layout->height;
    fputs("set multiplot\n"
          "set grid lt 1 lc rgb '#e6e6e6'\nset label 1 ",
          plot->script);
    quote_gnuplot(plot->script, layout->title ? layout->title : "");
    fputs(" at screen 0.5,0.97 center font ',14'\n", plot->script);
}

static void end_panel(struct figure *figure)
{
    if (figure->drawing)
        fputc('\n', figure->plot->script);
    figure->drawing = false;
}

static void place(const struct figure *figure, FILE *out)
{
    const struct layout *l = &figure->layout;
    double row = figure->panel / l->columns, column = figure->panel % l->columns;
    double width = (l->right - l->left - (l->columns - 1) * l->gap_x) / l->columns;
    double height = (l->top - l->bottom - (l->rows - 1) * l->gap_y) / l->rows;
    double left = l->left + column * (width + l->gap_x), top = l->top - row * (height + l->gap_y);
    fprintf(out,
            "set lmargin at screen %.4g\nset rmargin at screen %.4g\nset tmargin at screen %.4g\n"
            "set bmargin at screen %.4g\n",
            left, left + width, top, top - height);
}

static void axis(char which, const struct panel *panel, const char *title, const char *range,
                 const char *tics, FILE *out)
{
    bool log = panel->log && strchr(panel->log, which);
    fprintf(out, "%s logscale %c\nset format %c '%s'\nset %crange %s\nset %ctics %s\nset %clabel ",
            log ? "set" : "unset", which, which, log ? "10^{%T}" : "%g", which,
            range ? range : "[*:*]", which, tics ? tics : "auto", which);
    quote_gnuplot(out, title ? title : "");
    fputs(which == 'x' ? " offset 0,0.6\n" : "\n", out);
}

void figure_panel(struct figure *figure, const struct panel *panel)
{
    FILE *out = figure->plot->script;
    end_panel(figure);
    if (figure->panel > 0)
        fputs("unset label\nunset object\n", out);
    place(figure, out);
    axis('x', panel, panel->x, panel->x_range, panel->x_tics, out);
    axis('y', panel, panel->y, panel->y_range, panel->y_tics, out);
    fputs("set title ", out);
    quote_gnuplot(out, panel->title ? panel->title : "");
    fprintf(out, " offset 0,-0.5\nset key %s\n%s", panel->key ? panel->key : "off",
            panel->more ? panel->more : "");
    figure->panel++;
}

void figure_element(struct figure *figure, const char *format, ...)
{
    FILE *out = figure->plot->script;
    va_list values;
    fputs(figure->drawing ? ", \\\n    " : "plot ", out);
    figure->drawing = true;
    va_start(values, format);
    vfprintf(out, format, values);
    va_end(values);
}

void style_write(FILE *out, const struct style *s, const char *title)
{
    if (s->axes)
        fprintf(out, "axes %s ", s->axes);
    fprintf(out, "with %s", s->width > 0 && s->mark ? "linespoints" : s->mark ? "points" : "lines");
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
    FILE *out = figure->plot->script, *data = figure->plot->data;
    bool any = false;
    va_list where;
    figure_element(figure, "data index %zu using 1:2 ", figure->blocks++);
    style_write(out, s, title);
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
    fputs("unset multiplot\n", figure->plot->script);
}
