/* The picture of rules by their order (chart_rules.h). */
#include "chart_rules.h"

#include <math.h>

double rule_order(const struct rule_curve *curve)
{
    double order = NAN;
    for (size_t k = 1; k < curve->n; k++) {
        const struct rule_point *a = &curve->point[k - 1], *b = &curve->point[k];
        if (b->error > 1e-11 && a->error < 0.3)
            order =
                log(a->error / b->error) / log((double)(b->slices - 1) / (double)(a->slices - 1));
    }
    return order;
}

static const char *const colours[] = {"#9a9a9a", "#6b6b6b", "#e8a33d", "#d1622b",
                                      "#8fc7e8", "#3c8dc5", "#0b4f8a", "#4d1654"};
enum { N_COLOURS = sizeof colours / sizeof *colours };

/* Blocks: a curve each, then Adam's point. */
static void write_data(const struct panel *panel, FILE *data)
{
    for (size_t c = 0; c < panel->n; c++) {
        fprintf(data, "# %s, %s: slices, seconds, error\n", panel->boundary->scene,
                panel->curve[c].rule->name);
        for (size_t k = 0; k < panel->curve[c].n; k++)
            fprintf(data, "%zu %.6g %.6g\n", panel->curve[c].point[k].slices,
                    panel->curve[c].point[k].seconds, panel->curve[c].point[k].error);
        fputs("\n\n", data);
    }
    if (panel->adam.slices)
        fprintf(data, "%zu %.6g %.6g\n\n\n", panel->adam.slices, panel->adam.seconds,
                panel->adam.error);
    else
        fputs("NaN NaN NaN\n\n\n", data);
}

static void draw_panel(const struct panel *panels, size_t p, int row, FILE *out)
{
    const struct panel *panel = &panels[p];
    size_t first = p * (panel->n + 1);
    double left = 0.06 + 0.255 * (double)p;
    fprintf(out,
            "set lmargin at screen %g\nset rmargin at screen %g\nset tmargin at screen %g\n"
            "set bmargin at screen %g\nset title '%s' font ',11' offset 0,-0.5\nset xlabel '%s' "
            "offset 0,0.6\nset ylabel '%s' offset 1\nset format x '%s'\n%s\n",
            left, left + 0.21, row ? 0.46 : 0.94, row ? 0.08 : 0.56,
            row ? "" : panel->boundary->title, row ? "seconds of the processor" : "slices",
            p ? "" : "error of the path", row ? "10^{%T}" : "%g",
            row ? "set xtics auto\nset xrange [*:*]"
                : "set xtics (11, 41, 161, 641, 2561)\nset xrange [10:3000]");
    bool titles = row == 0 && p == 0;
    fputs(titles ? "set key at screen 0.995, screen 0.93 right top Left reverse samplen 2 spacing "
                   "1.4 font ',11'\nplot "
                 : "set key off\nplot ",
          out);
    for (size_t c = 0; c < panel->n; c++)
        fprintf(out,
                "data index %zu using %d:3 with linespoints lw 1.8 pt 7 ps 0.5 lc rgb '%s' title "
                "'%s: order %.2f', \\\n    ",
                first + c, row ? 2 : 1, colours[c % N_COLOURS], panel->curve[c].rule->name,
                rule_order(&panels[N_BOUNDARIES - 1].curve[c]));
    fprintf(
        out,
        "data index %zu using %d:3 with points pt 3 ps 1.4 lw 2 lc rgb '#b8261b' title 'Adam as "
        "published'\n",
        first + panel->n, row ? 2 : 1);
}

void rules_draw(const struct panel panels[N_BOUNDARIES], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 1120;
    plot->height = 640;
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        write_data(&panels[p], plot->data);
    fputs("set multiplot\nset logscale xy\nset yrange [1e-14:3]\nset format y '10^{%T}'\n"
          "set ytics 100\nset grid lc rgb '#e6e6e6' lt 1\nset border 3\nset tics nomirror\n",
          out);
    for (size_t p = 0; p < N_BOUNDARIES; p++)
        for (int row = 0; row < 2; row++)
            draw_panel(panels, p, row, out);
    fputs("unset multiplot\n", out);
}
