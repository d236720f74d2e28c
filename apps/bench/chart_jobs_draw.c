/* The picture of chart jobs: a line a job, published and ours joined; seconds left, errors right.
 */
#include "chart_jobs.h"

#include <math.h>

static const double least = 1e-17; /* errors below are drawn there */

/* Name, group, then seconds and error of either side, and seconds until ours is level. */
static void write_data(size_t n, const struct job jobs[], FILE *data)
{
    for (const struct job *j = jobs; j < jobs + n; j++)
        fprintf(data, "\"%s: %s\" %.4g %.4g %.4g %.4g %.4g\n", j->group, j->name,
                j->published.seconds, fmax(j->published.error, least), j->ours.seconds,
                fmax(j->ours.error, least), j->level);
}

/* Columns of the published and of our values; the names of jobs stand at the first panel. */
static void draw_panel(int published, int ours, const char *names, const char *title, FILE *out)
{
    fprintf(out,
            "set title '%s' offset 0,-0.6\n"
            "plot data using %d:0:($%d-$%d):(0) with vectors nohead lw 1.5 lc rgb '#c0c0c0' "
            "notitle, \\\n"
            "    '' using %d:0%s with points pt 7 ps 1.1 lc rgb '#b8261b' title 'published "
            "settings', \\\n"
            "    '' using %d:0 with points pt 7 ps 1.1 lc rgb '#0b4f8a' title 'ours'",
            title, published, ours, published, published, names, ours);
}

void jobs_draw(size_t n, const struct job jobs[], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 1000;
    plot->height = 170 + 27 * (int)n;
    write_data(n, jobs, plot->data);
    fprintf(out,
            "set multiplot layout 1,2 margins 0.19,0.985,0.14,0.8 spacing 0.04,0\n"
            "set logscale x\nset format x '10^{%%T}'\nunset mxtics\nset yrange [%zu.6:-0.6]\n"
            "set border 3\nset tics nomirror\nset grid lt 1 lc rgb '#e6e6e6'\n"
            "set key at screen 0.985,0.96 right top maxrows 1 samplen 0.5 width 1\n",
            n - 1);
    draw_panel(2, 4, ":ytic(1)", "seconds of the processor for all of the job", out);
    fputs(
        ", \\\n    '' using 6:0 with points pt 6 ps 1.5 lw 1.5 lc rgb '#0b4f8a' title 'ours, until "
        "as exact as published'\nset key off\nset ytics 1\nset format y ''\n",
        out);
    draw_panel(3, 5, "", "error at the end", out);
    fputs("\nunset multiplot\n", out);
}
