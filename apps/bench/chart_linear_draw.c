/* The picture of chart linear: what is level is linear. */
#include "chart_linear.h"

static const char *const colours[LINEAR_WAYS] = {"#1f4e79", "#3f9b6e"};

static void write_block(const struct linear_curve *curve, FILE *data)
{
    for (const struct linear_point *p = curve->point; p < curve->point + curve->n; p++) {
        double units = (double)p->units;
        fprintf(data, "%.6g %.6g %.6g %.6g %.6g\n", units, 1e9 * p->seconds[0] / units,
                1e9 * p->seconds[1] / units, p->program_bytes / units, p->tape_bytes / units);
    }
    fputs("\n\n", data);
}

static void draw_times(const struct linear_curve *curve, int index, FILE *out)
{
    fprintf(out,
            "set title '%s' offset 0,-0.6\nunset logscale y\nset format y '%%g'\nset yrange "
            "[0:*]\nset ylabel 'ns a %s'\nset xlabel ''\nplot ",
            curve->title, curve->unit);
    for (int w = 0; w < LINEAR_WAYS; w++)
        fprintf(out,
                "data index %d using 1:%d with linespoints pt 7 ps 0.6 lw 2 lc rgb '%s' title '%s: "
                "%s^{%.2f}, at the end %s^{%.2f}'%s",
                index, 2 + w, colours[w], linear_ways[w], curve->axis, linear_exponent(curve, w, 0),
                curve->axis, linear_exponent(curve, w, linear_end(curve)),
                w + 1 < LINEAR_WAYS ? ", \\\n    " : "\n");
}

static void draw_memory(const struct linear_curve *curve, int index, FILE *out)
{
    fprintf(out,
            "set title ''\nset logscale y\nset format y '10^{%%T}'\nset yrange [10:1e4]\nset "
            "ylabel 'bytes a %s'\nset xlabel '%s'\n"
            "plot data index %d using 1:4 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#b8261b' title "
            "'program', \\\n    '' index %d using 1:5 with linespoints pt 7 ps 0.6 lw 2 lc rgb "
            "'#f2b134' title 'tape'\n",
            curve->unit, curve->axis, index, index);
}

void linear_draw(const struct linear_curve curves[LINEAR_CURVES], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 960;
    plot->height = 600;
    fputs("set multiplot layout 2,2 columnsfirst margins 0.08,0.985,0.115,0.94 spacing 0.1,0.09\n"
          "set logscale x\nset format x '10^{%T}'\nset yrange [0:*]\nset border 3\n"
          "set tics nomirror\nset grid lt 1 lc rgb '#e6e6e6'\nset offsets 0,0,graph 0.35,0\n"
          "set key top right samplen 2\n",
          out);
    for (int c = 0; c < LINEAR_CURVES; c++) {
        write_block(&curves[c], plot->data);
        draw_times(&curves[c], c, out);
        draw_memory(&curves[c], c, out);
    }
    fputs("unset multiplot\n", out);
}
