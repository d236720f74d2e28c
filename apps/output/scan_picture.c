/* The picture of a scan (scan_parts.h): curves or maps. Where seeds are scanned, they are no axis
   of it, but points and their mean. */
#include "apps/quote.h"
#include "figure.h"
#include "scan_parts.h"

#include <math.h>
#include <string.h>

/* Seeds alone are the axis of a curve. */
static bool is_map(const struct scan *scan) { return scan->axes == AXES && !scan_over_seeds(scan); }

/* A row a point with the means of its seeds, in a block of their own. */
static void write_means(const struct scan *scan, FILE *out)
{
    fputs("\n\n# scanned values, then the means over seeds\n", out);
    for (size_t p = 0; p < scan->axis[0].n; p++) {
        fprintf(out, "%.12g ", scan_between(&scan->axis[0], (double)p));
        for (size_t k = 0; k < scan->n; k++)
            if (scan->column[k].shown) {
                const struct spread s = scan_spread(scan, &scan->column[k], p);
                fprintf(out, isnan(s.mean) ? "NaN " : "%.12g ", s.mean);
            }
        fputc('\n', out);
    }
}

/* A row a run. Of a map: the edges of its cell, which a logarithmic axis needs. */
static void write_data(const struct scan *scan, FILE *out)
{
    const bool map = is_map(scan);
    fputs(map ? "# each scanned value with both edges of its cell, then the numbers shown\n"
              : "# scanned values, then the numbers shown\n",
          out);
    for (size_t r = 0; r < scan->runs; r++) {
        for (size_t a = 0; a < scan->axes; a++) {
            const double k = (double)scan_place(scan, a, r);
            fprintf(out, "%.12g ", scan_between(&scan->axis[a], k));
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
    if (scan->axes == AXES && !map)
        write_means(scan, out);
}

static struct range range_of(const double *value, size_t n)
{
    struct range range = {INFINITY, -INFINITY};
    for (size_t k = 0; k < n; k++)
        if (isfinite(value[k]))
            range_widen(&range, value[k]);
    return range;
}

/* Losses differ by powers of ten. */
static bool is_logarithmic(struct range range)
{
    return range.low > 0 && range.high > 50 * range.low;
}

/* An axis as long as what was scanned: to the edges of the cells of a map. */
static struct axis scanned_axis(const struct scan *scan, size_t axis)
{
    const struct axis_of_scan *a = &scan->axis[axis];
    const double edge = is_map(scan) ? 0.5 : a->list ? 0.25 : 0;
    struct range range = {INFINITY, -INFINITY};
    range_widen(&range, scan_between(a, -edge));
    range_widen(&range, scan_between(a, (double)(a->n - 1) + edge));
    return (struct axis){a->name, a->unit, range, 0};
}

/* The values of a list are the labels of its axis. */
static void label_axis(struct figure *figure, const struct scan *scan, size_t axis)
{
    const struct axis_of_scan *a = &scan->axis[axis];
    FILE *out = figure->plot->script;
    for (size_t k = 0; a->list && k < a->n; k++) {
        if (k)
            fputs(", ", out);
        else
            fprintf(out, "set %ctics (", axis ? 'y' : 'x');
        quote_gnuplot(out, a->text[k]);
        fprintf(out, " %zu%s", k, k + 1 < a->n ? "" : ")\n");
    }
}

static void draw_map(struct figure *figure, const struct scan *scan,
                     const struct result_column *column, const char *name, size_t number)
{
    char log[3] = "";
    for (size_t a = 0; a < AXES; a++)
        if (scan->axis[a].log)
            strcat(log, a == 0 ? "x" : "y");
    const struct range range = range_of(column->value, scan->runs);
    const bool powers = is_logarithmic(range);
    const int power = powers ? 0 : range_exponent(range);
    const double scale = pow(10, power);
    figure_panel(figure, &(struct panel){.across = scanned_axis(scan, 0),
                                         .up = scanned_axis(scan, 1),
                                         .colour = {name, column->unit, {0, 0}, power},
                                         .log = log});
    for (size_t a = 0; a < AXES; a++)
        label_axis(figure, scan, a);
    if (range.low < range.high) /* gnuplot's own leaves out cells that meet an edge */
        fprintf(figure->plot->script, "set cbrange [%.9g:%.9g]\n", range.low / scale,
                range.high / scale);
    else
        fputs("set cbrange [*:*]\n", figure->plot->script);
    fputs(powers ? "set logscale cb\nset format cb '10^{%T}'\n" : "unset logscale cb\n",
          figure->plot->script);
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

/* Of the numbers that share a panel, `together` of them. */
static struct range range_of_panel(const struct scan *scan, size_t panel, size_t *together)
{
    struct range range = {INFINITY, -INFINITY};
    *together = 0;
    for (size_t k = 0; k < scan->n; k++)
        if (scan->column[k].panel == panel) {
            const struct range own = range_of(scan->column[k].value, scan->runs);
            ++*together;
            range_widen(&range, own.low);
            range_widen(&range, own.high);
        }
    return range;
}

/* A curve; points where several numbers share the panel, or runs differ by their seeds. */
static void draw_curves(struct figure *figure, const struct scan *scan,
                        const struct result_column *first, const char *name)
{
    size_t together, number = 0;
    const struct range range = range_of_panel(scan, first->panel, &together);
    const bool powers = is_logarithmic(range), means = scan->axes == AXES;
    const int power = powers ? 0 : range_exponent(range);
    char log[3] = "";
    strcat(log, scan->axis[0].log ? "x" : "");
    strcat(log, powers ? "y" : "");
    figure_panel(figure, &(struct panel){.across = scanned_axis(scan, 0),
                                         .up = {name, first->unit, {0, 0}, power},
                                         .log = log,
                                         .key = means ? KEY_ABOVE : NULL});
    label_axis(figure, scan, 0);
    const bool line = together == 1 && !scan_over_seeds(scan);
    const struct style *style =
        STYLE(figure_colours[0], !line || scan->runs <= 60 ? 7 : 0, line ? 1.2 : 0,
              together > 1 ? 0.25
              : means      ? 0.5
              : line       ? 0.4
                           : 0.8);
    for (size_t k = 0; k < scan->n; k++) {
        number += scan->column[k].shown;
        if (scan->column[k].panel != first->panel)
            continue;
        figure_draw(figure, style, NULL, "data index 0 using 1:($%zu/1e%d)", scan->axes + number,
                    power);
        if (means)
            figure_draw(figure, STYLE(figure_colours[1], 0, 1.6, 0), "mean",
                        "data index 1 using 1:($%zu/1e%d)", 1 + number, power);
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
    if (is_map(scan))
        draw_map(figure, scan, &scan->column[k], name, number);
    else
        draw_curves(figure, scan, &scan->column[k], name);
}

enum ad_status scan_draw(const void *context, struct plot *plot, struct ad_error *error)
{
    const struct scan *scan = context;
    const bool map = is_map(scan);
    size_t shown = 0, missing = 0;
    struct figure figure;
    for (size_t k = 0; k < scan->n; k++) {
        shown = scan->column[k].panel > shown ? scan->column[k].panel : shown;
        for (size_t r = 0; r < scan->runs && scan->column[k].shown; r++)
            missing += isnan(scan->column[k].value[r]) ? 1 : 0;
    }
    if (shown == 0 || scan->unshown.status != AD_OK) {
        plot_abandon(plot);
        return error->status;
    }
    struct layout layout = figure_pair;
    layout.rows = shown > 2 ? 2 : 1;
    layout.columns = shown > 1 ? 2 : 1;
    layout.room.top = 0.9;
    layout.gap.y = 0.16;
    layout.gap.x = map ? 0.2 : 0.11;
    layout.room.right = map ? 0.88 : 0.98;
    layout.height = shown > 2 ? 760 : 440;
    write_data(scan, plot->data);
    fputs("what = ", plot->script);
    quote_gnuplot_label(plot->script, scan->command->line.name);
    fputs("\nscene = ", plot->script);
    quote_gnuplot_label(plot->script, scan_subject(scan));
    fputc('\n', plot->script);
    layout.found = map && missing > 0 ? "grey: runs without this number" : NULL;
    layout.expression = "sprintf('%s %s', what, scene)";
    figure_begin(&figure, plot, &layout);
    for (size_t panel = 1; panel <= shown; panel++)
        draw_panel(&figure, scan, panel);
    figure_end(&figure);
    return error->status;
}
