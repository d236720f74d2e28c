/* leastaction chart gradients: nanoseconds, ratio to hand-written C, gradient per value. */
#include "charts.h"
#include "command.h"
#include "hand.h"
#include "json.h"
#include "race.h"

#include <stdio.h>

/* Above this the two are not the gradient of one function, and comparing their speed says nothing.
 */
static const double tolerance = 1e-11;

/* One table of columns for the print, the CSV and the JSON. */
static const struct column {
    const char *key, *title;
    int width, digits;
    int over, under; /* quotient of two measurements; under < 0: nanoseconds */
} columns[] = {
    {"tape_gradient_ns", "tape", 10, 0, TAPE_GRADIENT, -1},
    {"native_gradient_ns", "compiled", 9, 0, NATIVE_GRADIENT, -1},
    {"hand_gradient_ns", "hand", 8, 0, HAND_GRADIENT, -1},
    {"gradient_ratio", "ratio", 6, 2, TAPE_GRADIENT, HAND_GRADIENT},
    {"native_gradient_ratio", "compiled", 9, 2, NATIVE_GRADIENT, HAND_GRADIENT},
    {"tape_primal_ns", "primal", 10, 0, TAPE_PRIMAL, -1},
    {"hand_primal_ns", "hand", 8, 0, HAND_PRIMAL, -1},
    {"tape_gradient_per_primal", "grad/primal", 12, 2, TAPE_GRADIENT, TAPE_PRIMAL},
    {"hand_gradient_per_primal", "hand", 6, 2, HAND_GRADIENT, HAND_PRIMAL},
    {"adam_step_per_gradient", "Adam step/grad", 15, 2, ADAM_STEP, TAPE_GRADIENT},
};

enum { N_COLUMNS = sizeof columns / sizeof *columns };

static double cell(const struct column *c, const struct race *race)
{
    return c->under < 0 ? race->ns[c->over] : race->ratio[c->over][c->under];
}

static void print_table(FILE *out, const struct race races[HAND_N])
{
    fprintf(out, "%-10s", "");
    for (size_t c = 0; c < N_COLUMNS; c++)
        fprintf(out, " %*s", columns[c].width, columns[c].title);
    for (int scene = 0; scene < HAND_N; scene++) {
        fprintf(out, "\n%-10s", hand_build(0)[scene].scene);
        for (size_t c = 0; c < N_COLUMNS; c++)
            fprintf(out, " %*.*f", columns[c].width, columns[c].digits,
                    cell(&columns[c], &races[scene]));
    }
    fputs("\nnanoseconds a call, one thread, f64, 100 slices, left+repeat\n", out);
}

static void print_json(FILE *out, const struct race races[HAND_N])
{
    struct json json;
    json_open(&json, out);
    for (int scene = 0; scene < HAND_N; scene++) {
        json_object(&json, hand_build(0)[scene].scene);
        for (size_t c = 0; c < N_COLUMNS; c++)
            json_number(&json, columns[c].key, cell(&columns[c], &races[scene]));
        json_number(&json, "disagreement", races[scene].disagreement);
        json_end_object(&json);
    }
    json_close(&json);
}

static void print_csv(FILE *out, const struct race races[HAND_N])
{
    fputs("scene,dof,slices", out);
    for (size_t c = 0; c < N_COLUMNS; c++)
        fprintf(out, ",%s", columns[c].key);
    fputs(",disagreement", out);
    for (int scene = 0; scene < HAND_N; scene++) {
        const struct hand_kernel *hand = &hand_build(0)[scene];
        fprintf(out, "\n%s,%d,%d", hand->scene, hand->dof, HAND_SLICES);
        for (size_t c = 0; c < N_COLUMNS; c++)
            fprintf(out, ",%.6g", cell(&columns[c], &races[scene]));
        fprintf(out, ",%.3g", races[scene].disagreement);
    }
    fputc('\n', out);
}

/* Bars in units of the hand-written gradient, so that scenes of any size stand side by side. */
static void draw(const struct race races[HAND_N], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 640;
    plot->height = 360;
    for (int scene = 0; scene < HAND_N; scene++) {
        static const int bars[] = {TAPE_GRADIENT, NATIVE_GRADIENT, HAND_GRADIENT};
        const struct race *race = &races[scene];
        fputs(hand_build(0)[scene].scene, plot->data);
        for (size_t b = 0; b < sizeof bars / sizeof *bars; b++)
            fprintf(plot->data, " %.4g %.3g", race->ratio[bars[b]][HAND_GRADIENT],
                    1e-3 * race->ns[bars[b]]);
        fputc('\n', plot->data);
    }
    fprintf(out,
            "set title 'Gradient of the action, %d slices, one thread (labels: microseconds)'\nset "
            "style data histogram\n"
            "set style histogram clustered gap 1\nset style fill solid noborder\n"
            "set boxwidth 0.9\nset border 3\nset tics nomirror\nset yrange [0:*]\n"
            "set xrange [-0.6:%d.6]\nset offsets 0,0,0.4,0\nset ylabel 'times the hand-written "
            "C'\nset key top left\n"
            "plot data using 2:xtic(1) lc rgb '#1f4e79' title 'interpreted', \\\n"
            "    data using 4 lc rgb '#3f9b6e' title 'compiled', \\\n"
            "    data using 6 lc rgb '#e8a33d' title 'by hand', \\\n"
            "    data using ($0-0.25):2:3 with labels offset 0,0.6 font ',10' notitle, \\\n"
            "    data using ($0):4:5 with labels offset 0,0.6 font ',10' notitle, \\\n"
            "    data using ($0+0.25):6:7 with labels offset 0,0.6 font ',10' notitle\n",
            HAND_SLICES, HAND_N - 1);
}

int chart_gradients(const struct chart_settings *settings, struct ad_error *error)
{
    struct race races[HAND_N];
    struct result csv;
    struct plot plot = {0};
    bool agree = true;
    if (chart_csv(settings, "gradients", &csv, error) == AD_OK)
        chart_picture(settings, "gradients", &plot, error);
    for (int scene = 0; scene < HAND_N && error->status == AD_OK; scene++)
        if (race_run(scene, settings->quick, &races[scene], error) == AD_OK)
            agree = agree && races[scene].disagreement < tolerance;
    if (error->status == AD_OK) {
        print_csv(csv.out, races);
        draw(races, &plot);
        if (plot_commit(&plot, error) == AD_OK)
            result_commit(&csv, error);
    }
    plot_abandon(&plot);
    result_abandon(&csv);
    if (error->status != AD_OK)
        return command_status(error);
    if (!settings->quiet)
        print_table(stdout, races);
    if (!agree)
        fputs("leastaction: the gradients by the tape and by hand differ\n", stderr);
    if (settings->json)
        print_json(stdout, races);
    return agree ? DONE : NOT_REACHED;
}
