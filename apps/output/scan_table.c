/* The table of a scan (scan_parts.h): text, JSON, CSV, HDF5, and curves or maps. */
#include "apps/quote.h"
#include "figure.h"
#include "scan_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void write_report(const void *context, struct report *report)
{
    const struct scan *scan = context;
    report_line(report, "%s of %s: %zu runs\n", scan->command->line.name, scan->scene, scan->runs);
    report_count(report, "runs", NULL, scan->runs);
    report_count(report, "missed", NULL, scan->missed);
    report->passing = true; /* the file has datasets */
    for (size_t r = 0; r < scan->runs; r++) {
        report_item(report, "scan");
        for (size_t a = 0; a < scan->axes; a++)
            report_number(report, scan->axis[a].name, scan->axis[a].name, scan->axis[a].unit,
                          scan_value(scan, a, r));
        report_count(report, "status", NULL, (size_t)scan->status[r]);
        for (size_t k = 0; k < scan->n; k++)
            report_number(report, scan->column[k].key,
                          scan->column[k].shown ? scan->column[k].key : NULL, scan->column[k].unit,
                          scan->column[k].value[r]);
    }
    report_item(report, NULL);
    report->passing = false;
}

static void write_csv(const void *context, FILE *out)
{
    const struct scan *scan = context;
    for (size_t a = 0; a < scan->axes; a++)
        fprintf(out, "%s,", scan->axis[a].name);
    fputs("status", out);
    for (size_t k = 0; k < scan->n; k++)
        fprintf(out, ",%s", scan->column[k].key);
    fputc('\n', out);
    for (size_t r = 0; r < scan->runs; r++) {
        for (size_t a = 0; a < scan->axes; a++)
            fprintf(out, "%.17g,", scan_value(scan, a, r));
        fprintf(out, "%d", scan->status[r]);
        for (size_t k = 0; k < scan->n; k++)
            csv_number(out, 17, scan->column[k].value[r]);
        fputc('\n', out);
    }
}

/* Numbers over the scanned values: [n], or [n of the first x n of the second]. */
static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct scan *scan = context;
    const size_t shape[AXES] = {scan->axis[0].n, scan->axis[1].n};
    char name[KEY + 16];
    for (size_t a = 0; a < scan->axes; a++) {
        double *value = malloc(scan->axis[a].n * sizeof *value);
        if (!value)
            return ad_fail(error, AD_E_MEMORY, "out of memory");
        for (size_t k = 0; k < scan->axis[a].n; k++)
            value[k] = scan_value(scan, a, a + 1 < scan->axes ? k * scan->axis[1].n : k);
        snprintf(name, sizeof name, "scanned/%s", scan->axis[a].name);
        phys_hdf5_write(file, name, AD_F64, 1, &shape[a], value);
        phys_hdf5_text(file, name, "unit", scan->axis[a].unit);
        phys_hdf5_integer(file, name, "axis", (int64_t)a, NULL);
        free(value);
    }
    for (size_t k = 0; k < scan->n; k++) {
        snprintf(name, sizeof name, "results/%s", scan->column[k].key);
        phys_hdf5_write(file, name, AD_F64, scan->axes, shape, scan->column[k].value);
        if (*scan->column[k].unit)
            phys_hdf5_text(file, name, "unit", scan->column[k].unit);
    }
    return error->status;
}

/* A row a run. Of a map: the edges of its cell, which a logarithmic axis needs. */
static void write_data(const struct scan *scan, FILE *out)
{
    const bool map = scan->axes == AXES;
    fputs(map ? "# each scanned value with both edges of its cell, then the numbers shown\n"
              : "# scanned values, then the numbers shown\n",
          out);
    for (size_t r = 0; r < scan->runs; r++) {
        for (size_t a = 0; a < scan->axes; a++) {
            const double k = (double)scan_place(scan, a, r);
            fprintf(out, "%.12g ", scan_value(scan, a, r));
            if (map)
                fprintf(out, "%.12g %.12g ", scan_between(&scan->axis[a], k - 0.5),
                        scan_between(&scan->axis[a], k + 0.5));
        }
        for (size_t k = 0; k < scan->n; k++)
            if (scan->column[k].shown)
                fprintf(out, isnan(scan->column[k].value[r]) ? "NaN " : "%.12g ",
                        scan->column[k].value[r]);
        fputc('\n', out);
    }
}

static struct range range_of(const double *value, size_t n)
{
    struct range range = {INFINITY, -INFINITY};
    for (size_t k = 0; k < n; k++)
        if (isfinite(value[k]))
            range_widen(&range, value[k]);
    return range;
}

/* An axis as long as what was scanned: to the edges of the cells of a map. */
static struct axis scanned_axis(const struct scan *scan, size_t axis)
{
    const struct axis_of_scan *a = &scan->axis[axis];
    const double edge = scan->axes == AXES ? 0.5 : 0;
    struct range range = {INFINITY, -INFINITY};
    range_widen(&range, scan_between(a, -edge));
    range_widen(&range, scan_between(a, (double)(a->n - 1) + edge));
    return (struct axis){a->name, a->unit, range, 0};
}

static void draw_map(struct figure *figure, const struct scan *scan,
                     const struct result_column *column, const char *name, size_t number)
{
    char log[3] = "";
    for (size_t a = 0; a < AXES; a++)
        if (scan->axis[a].log)
            strcat(log, a == 0 ? "x" : "y");
    const struct range range = range_of(column->value, scan->runs);
    const int power = range_exponent(range);
    const double scale = pow(10, power);
    figure_panel(figure, &(struct panel){.across = scanned_axis(scan, 0),
                                         .up = scanned_axis(scan, 1),
                                         .colour = {name, column->unit, {0, 0}, power},
                                         .log = log});
    if (range.low < range.high) /* gnuplot's own leaves out cells that meet an edge */
        fprintf(figure->plot->script, "set cbrange [%.9g:%.9g]\n", range.low / scale,
                range.high / scale);
    else
        fputs("set cbrange [*:*]\n", figure->plot->script);
    fputs(DENSITY_PALETTE, figure->plot->script);
    figure_element(figure,
                   "data using 1:4:2:3:5:6 with boxxyerror fs solid noborder fc rgb '%s' notitle",
                   COLOUR_REFERENCE);
    const size_t at = 3 * AXES + number; /* drawn where it is a number */
    figure_element(figure,
                   "data using ($%zu == $%zu ? $1 : NaN):4:2:3:5:6:($%zu/1e%d) with boxxyerror fs "
                   "solid noborder fc palette notitle",
                   at, at, at, power);
}

/* A curve; points where several numbers share the panel. */
static void draw_curves(struct figure *figure, const struct scan *scan,
                        const struct result_column *first, const char *name)
{
    struct range range = {INFINITY, -INFINITY};
    size_t together = 0, number = 0;
    for (size_t k = 0; k < scan->n; k++)
        if (scan->column[k].panel == first->panel) {
            const struct range own = range_of(scan->column[k].value, scan->runs);
            together++;
            range_widen(&range, own.low);
            range_widen(&range, own.high);
        }
    const int power = range_exponent(range);
    figure_panel(figure, &(struct panel){.across = scanned_axis(scan, 0),
                                         .up = {name, first->unit, {0, 0}, power},
                                         .log = scan->axis[0].log ? "x" : NULL});
    const struct style *style = together > 1
                                    ? STYLE(figure_colours[0], 7, 0, 0.25)
                                    : STYLE(figure_colours[0], scan->runs <= 60 ? 7 : 0, 1.2, 0.4);
    for (size_t k = 0; k < scan->n; k++) {
        number += scan->column[k].shown;
        if (scan->column[k].panel == first->panel)
            figure_draw(figure, style, NULL, "data using 1:($%zu/1e%d)", 1 + number, power);
    }
}

static void draw_panel(struct figure *figure, const struct scan *scan, size_t panel)
{
    size_t k = 0, number = 1;
    char name[KEY + 8];
    for (; scan->column[k].panel != panel; k++)
        number += scan->column[k].shown;
    size_t next = k + 1;
    while (next < scan->n && scan->column[next].panel != panel)
        next++;
    snprintf(name, sizeof name, "%s%s", scan->column[k].key, next < scan->n ? " ..." : "");
    for (char *blank = name; (blank = strchr(blank, '_'));)
        *blank = ' ';
    if (scan->axes == AXES)
        draw_map(figure, scan, &scan->column[k], name, number);
    else
        draw_curves(figure, scan, &scan->column[k], name);
}

static enum ad_status draw(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct scan *scan = context;
    const bool map = scan->axes == AXES;
    size_t shown = 0, missing = 0;
    struct figure figure;
    for (size_t k = 0; k < scan->n; k++) {
        shown = scan->column[k].panel > shown ? scan->column[k].panel : shown;
        for (size_t r = 0; r < scan->runs && scan->column[k].shown; r++)
            missing += isnan(scan->column[k].value[r]) ? 1 : 0;
    }
    if (shown == 0)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--plot: no number changes with the scan; choose with --curves");
    struct layout layout = figure_pair;
    layout.rows = shown > 2 ? 2 : 1;
    layout.columns = shown > 1 ? 2 : 1;
    layout.top = 0.9;
    layout.gap_y = 0.16;
    layout.gap_x = map ? 0.2 : 0.11;
    layout.right = map ? 0.88 : 0.98;
    layout.height = shown > 2 ? 760 : 440;
    write_data(scan, plot->data);
    fputs("what = ", plot->script);
    quote_gnuplot_label(plot->script, scan->command->line.name);
    fputs("\nscene = ", plot->script);
    quote_gnuplot_label(plot->script, scan->scene);
    fputc('\n', plot->script);
    layout.found = map && missing > 0 ? "grey: runs without this number" : NULL;
    layout.expression = "sprintf('%s %s', what, scene)";
    figure_begin(&figure, plot, &layout);
    for (size_t panel = 1; panel <= shown; panel++)
        draw_panel(&figure, scan, panel);
    figure_end(&figure);
    return error->status;
}

const struct output_kind scan_outputs = {write_report, write_file, write_csv, draw, NULL};
