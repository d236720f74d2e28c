/* The table and the picture of rollouts (chart_hnn_rollouts.h). */
#include "chart_hnn_rollouts.h"

void rollouts_print(const struct rollouts *r, FILE *out)
{
    static const double errors[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10};
    fprintf(out, "%-8s %-38s %s\n", "rollout", "field in f64", "in f32");
    for (size_t k = 0; k < sizeof errors / sizeof *errors; k++) {
        fprintf(out, "  %5.0e", errors[k]);
        for (size_t t = 0; t < ROLLOUT_TYPES; t++) {
            struct work_point at;
            size_t best = work_best(r->n, r->curve[t], errors[k], &at);
            if (best < r->n)
                fprintf(out, "  %-11s %6.0f fields %8.2g s ", r->curve[t][best].name,
                        at.evaluations, at.seconds);
            else
                fprintf(out, "  %-37s", "no method gets there");
        }
        fputc('\n', out);
    }
    fprintf(out,
            "errors at t = %g against the network's own exact motion, which is %.1e from the "
            "pendulum's;\nwith the field in f32 no method comes nearer than %.1e\n",
            r->time, r->model_error, r->least[1]);
}

static void draw_panel(const struct rollouts *r, size_t type, FILE *out)
{
    fputs("plot ", out);
    for (size_t c = 0; c < r->n; c++) {
        struct work_style s = work_style_of(r->curve[type][c].name);
        fprintf(out,
                "data index %zu using 3:1 with linespoints lw 2 dt %s pt %d ps 0.6 lc rgb '%s' "
                "title '%s', \\\n    ",
                type * r->n + c, s.dashed ? "(8,3)" : "1", s.mark, s.colour, s.name);
    }
    fprintf(out, "%.6g with lines lw 1.5 dt (3,3) lc rgb '#444444' notitle", r->model_error);
    fprintf(out, ", \\\n    %.6g with lines lw 1.5 dt (1,3) lc rgb '#c0392b' notitle\n",
            r->least[1]);
}

/* The methods that have no curve: the stages of implicit ones are not solved to the roundings of
   f64 by a field in f32. */
static void name_missing(const struct rollouts *r, size_t type, FILE *out)
{
    const char *between = "no solution of the stages:\\n";
    fputs("set label 2 \"", out);
    for (size_t c = 0; c < r->n; c++)
        if (r->curve[type][c].n == 0) {
            fprintf(out, "%s%s", between, r->curve[type][c].name);
            between = ", ";
        }
    fputs("\" at graph 0.02,0.1 left font ',10' textcolor rgb '#444444'\n", out);
}

void rollouts_draw(const struct rollouts *r, struct plot *plot)
{
    static const char *const titles[ROLLOUT_TYPES] = {"field in f64", "the same field in f32"};
    FILE *out = plot->script;
    plot->width = 1040;
    plot->height = 480;
    for (size_t t = 0; t < ROLLOUT_TYPES; t++)
        for (size_t c = 0; c < r->n; c++)
            work_write_curve(&r->curve[t][c], plot->data);
    fprintf(out,
            "set multiplot layout 1,2 margins 0.08,0.8,0.12,0.92 spacing 0.05,0\n"
            "set logscale xy\nset format xy '10^{%%T}'\nset ytics 100\nset border 3\n"
            "set tics nomirror\nset grid lc rgb '#e6e6e6' lt 1\nset xrange [30:2e4]\n"
            "set yrange [1e-12:3]\nset xlabel 'evaluations of the field'\nunset key\n"
            "set ylabel 'error at t = %g, relative' offset 1\n"
            "set label 1 'error of the network' at graph 0.02, first %.3g "
            "left font ',10' textcolor rgb '#444444' front\n"
            "set label 3 'f32 ends: %.1e' at graph 0.02, first %.3g "
            "left font ',10' textcolor rgb '#c0392b' front\n",
            r->time, r->model_error / 1.7, r->least[1], r->least[1] / 1.7);
    for (size_t t = 0; t < ROLLOUT_TYPES; t++) {
        if (t > 0)
            fputs("unset ylabel\nset key at screen 0.998,0.92 right top Left reverse samplen 2.5 "
                  "spacing 1.3\n",
                  out);
        fprintf(out, "set title '%s' offset 0,-0.5\n", titles[t]);
        name_missing(r, t, out);
        draw_panel(r, t, out);
    }
    fputs("unset multiplot\n", out);
}
