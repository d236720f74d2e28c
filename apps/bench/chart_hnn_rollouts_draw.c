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

static void draw_panel(struct figure *figure, const struct rollouts *r, size_t type)
{
    static const char *const titles[ROLLOUT_TYPES] = {"field in f64", "the same field in f32"};
    char y[64], labels[400];
    snprintf(y, sizeof y, "error at t = %g, relative", r->time);
    snprintf(labels, sizeof labels,
             "set label 4 'error of the network' at graph 0.02, first %.3g left font ',10' "
             "textcolor rgb '#444444' front\n"
             "set label 3 'f32 ends: %.1e' at graph 0.02, first %.3g left font ',10' textcolor rgb "
             "'#c0392b' front\n",
             r->model_error / 1.7, r->least[1], r->least[1] / 1.7);
    figure_panel(figure,
                 &(struct panel){.title = titles[type],
                                 .x = "evaluations of the field",
                                 .y = type ? NULL : y,
                                 .log = "xy",
                                 .x_range = "[30:2e4]",
                                 .y_range = "[1e-12:3]",
                                 .y_tics = "100",
                                 .key = type ? "at screen 0.998,0.92 right top Left reverse "
                                               "samplen 2.5 spacing 1.3"
                                             : NULL,
                                 .more = labels});
    name_missing(r, type, figure->plot->script);
    for (size_t c = 0; c < r->n; c++)
        work_curve_element(figure, &r->curve[type][c], "3:1", 2, 0.6, r->curve[type][c].name);
    figure_element(figure, "%.6g with lines lw 1.5 dt (3,3) lc rgb '#444444' notitle",
                   r->model_error);
    figure_element(figure, "%.6g with lines lw 1.5 dt (1,3) lc rgb '#c0392b' notitle", r->least[1]);
}

void rollouts_draw(const struct rollouts *r, struct plot *plot)
{
    static const struct layout layout = {1040, 480, NULL, 1, 2, 0.08, 0.8, 0.12, 0.92, 0.05, 0};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t t = 0; t < ROLLOUT_TYPES; t++)
        draw_panel(&figure, r, t);
    figure_end(&figure);
}
