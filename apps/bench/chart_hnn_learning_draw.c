/* The picture of learning (chart_hnn_learning.h). */
#include "chart_hnn_learning.h"

#include <math.h>

/* Kinds by colour, widths by shade. */
static const struct shade {
    size_t width;
    const char *colour[2]; /* of baseline and HNN, in the order of enum hnn_kind */
} shades[] = {
    {50, {"#f0c9a0", "#a9cfe8"}},
    {100, {"#f2a65a", "#62acd8"}},
    {200, {"#dd6a2b", "#1f6fb0"}},
    {400, {"#8f2d0f", "#0b3a66"}},
};

static const char *colour_of(const struct network *network)
{
    size_t k = 0;
    while (shades[k].width != network->width)
        k++;
    return shades[k].colour[network->kind];
}

static void write_curve(const struct learning_curve *c, FILE *out)
{
    fprintf(out, "# %s, %s, %zu wide: seconds, test loss, energy error\n",
            hnn_kinds[c->network.kind], hnn_precisions[c->network.type], c->network.width);
    for (size_t k = 0; k < c->n; k++) {
        const struct learning_point *p = &c->point[k];
        fprintf(out, "%.6g %.6g ", p->seconds, p->test_loss);
        fprintf(out, isfinite(p->energy_mse) ? "%.6g\n" : "NaN\n", p->energy_mse);
    }
    fputs("\n\n", out);
}

static void draw_curve(size_t index, const struct network *network, int column, bool title,
                       FILE *out)
{
    bool baseline = network->kind == HNN_BASELINE;
    fprintf(out, "data index %zu using 1:%d with linespoints pt %d ps 0.5 lw 2 lc rgb '%s' ", index,
            column, baseline ? 5 : 7, colour_of(network));
    if (title)
        fprintf(out, "title '%s, %zu wide', \\\n    ", baseline ? "baseline" : "HNN",
                network->width);
    else
        fputs("notitle, \\\n    ", out);
}

static void draw_panel(size_t n, const struct learning_curve curves[], enum ad_type type,
                       int column, bool titles, FILE *out)
{
    fputs("plot ", out);
    for (int kind = HNN_HAMILTONIAN; kind >= HNN_BASELINE; kind--)
        for (size_t k = 0; k < n; k++)
            if (curves[k].network.type == type && (int)curves[k].network.kind == kind)
                draw_curve(k, &curves[k].network, column, titles, out);
    fputs("NaN notitle\n", out);
}

void learning_draw(size_t n, const struct learning_curve curves[], struct plot *plot)
{
    static const struct {
        const char *title, *y_label, *x_label, *range;
    } panels[] = {
        {"trained in f32", "test loss", "", "1e-6:20"},
        {"trained in f64", "", "", "1e-6:20"},
        {"", "energy error, mean square", "processor seconds of training", "1e-7:100"},
        {"", "", "processor seconds of training", "1e-7:100"},
    };
    FILE *out = plot->script;
    plot->width = 1080;
    plot->height = 640;
    for (size_t k = 0; k < n; k++)
        write_curve(&curves[k], plot->data);
    fputs("set multiplot layout 2,2 margins 0.075,0.82,0.11,0.94 spacing 0.05,0.075\n"
          "set logscale xy\nset format xy '10^{%T}'\nset ytics 100\nset border 3\n"
          "set tics nomirror\nset grid lc rgb '#e6e6e6' lt 1\nset xrange [1e-3:6]\nunset key\n",
          out);
    for (int p = 0; p < 4; p++) {
        if (p == 3) /* one legend for all */
            fputs("set key at screen 0.998,0.93 right top Left reverse samplen 2 spacing 1.3\n",
                  out);
        fprintf(out, "set title '%s' offset 0,-0.5\nset ylabel '%s'\nset xlabel '%s'\n",
                panels[p].title, panels[p].y_label, panels[p].x_label);
        fprintf(out, "set yrange [%s]\n", panels[p].range);
        draw_panel(n, curves, p % 2 ? AD_F64 : AD_F32, p < 2 ? 2 : 3, p == 3, out);
    }
    fputs("unset multiplot\n", out);
}
