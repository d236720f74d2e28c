/* leastaction chart gradients: first and second derivatives of the action, nanoseconds and ratio to
   hand-written C. */
#include "charts.h"
#include "apps/command.h"
#include "hand.h"
#include "apps/output/json.h"
#include "gradient_benchmark.h"

#include <stdio.h>

/* Above this the two are not the gradient of one function, and comparing their speed says nothing.
 */
static const double tolerance = 1e-11;

/* One table of columns for the print, the CSV and the JSON; a line of the print an order. */
static const struct column {
    const char *key, *title;
    int order, width, digits;
    int over, under; /* quotient of two measurements; under < 0: nanoseconds */
} columns[] = {
    {"tape_gradient_ns", "tape", 1, 10, 0, TAPE_GRADIENT, -1},
    {"native_gradient_ns", "compiled", 1, 9, 0, NATIVE_GRADIENT, -1},
    {"hand_gradient_ns", "hand", 1, 8, 0, HAND_GRADIENT, -1},
    {"gradient_ratio", "ratio", 1, 6, 2, TAPE_GRADIENT, HAND_GRADIENT},
    {"native_gradient_ratio", "compiled", 1, 9, 2, NATIVE_GRADIENT, HAND_GRADIENT},
    {"tape_primal_ns", "primal", 1, 10, 0, TAPE_PRIMAL, -1},
    {"hand_primal_ns", "hand", 1, 8, 0, HAND_PRIMAL, -1},
    {"tape_gradient_per_primal", "grad/primal", 1, 12, 2, TAPE_GRADIENT, TAPE_PRIMAL},
    {"hand_gradient_per_primal", "hand", 1, 6, 2, HAND_GRADIENT, HAND_PRIMAL},
    {"adam_step_per_gradient", "Adam step/grad", 1, 15, 2, ADAM_STEP, TAPE_GRADIENT},
    {"native_adam_step_ns", "compiled step", 1, 14, 0, NATIVE_ADAM_STEP, -1},
    {"tape_product_ns", "tape", 2, 10, 0, TAPE_PRODUCT, -1},
    {"native_product_ns", "compiled", 2, 9, 0, NATIVE_PRODUCT, -1},
    {"hand_product_ns", "hand", 2, 8, 0, HAND_PRODUCT, -1},
    {"product_ratio", "ratio", 2, 6, 2, TAPE_PRODUCT, HAND_PRODUCT},
    {"native_product_ratio", "compiled", 2, 9, 2, NATIVE_PRODUCT, HAND_PRODUCT},
    {"native_product_per_gradient", "per gradient", 2, 13, 2, NATIVE_PRODUCT, NATIVE_GRADIENT},
    {"hessian_blocks_ns", "all blocks", 2, 12, 0, HESSIAN_BLOCKS, -1},
};

enum { N_COLUMNS = sizeof columns / sizeof *columns };

static double cell(const struct column *c, const struct race *race)
{
    return c->under < 0 ? race->ns[c->over] : race->ratio[c->over][c->under];
}

static void print_order(FILE *out, int order, const char *what, const struct race races[HAND_N])
{
    fprintf(out, "%s\n%-10s", what, "");
    for (size_t c = 0; c < N_COLUMNS; c++)
        if (columns[c].order == order)
            fprintf(out, " %*s", columns[c].width, columns[c].title);
    for (int scene = 0; scene < HAND_N; scene++) {
        fprintf(out, "\n%-10s", hand_build(0)[scene].scene);
        for (size_t c = 0; c < N_COLUMNS; c++)
            if (columns[c].order == order)
                fprintf(out, " %*.*f", columns[c].width, columns[c].digits,
                        cell(&columns[c], &races[scene]));
    }
    fputc('\n', out);
}

static void print_table(FILE *out, const struct race races[HAND_N])
{
    print_order(out, 1, "gradient", races);
    print_order(out, 2, "\nHessian times a vector", races);
    fprintf(out, "\nnanoseconds a call, one thread, f64, %d slices, left+repeat\n", HAND_SLICES);
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
        json_number(&json, "second_disagreement", races[scene].second);
        json_end_object(&json);
    }
    json_close(&json);
}

static void print_csv(FILE *out, const struct race races[HAND_N])
{
    fputs("scene,dof,slices", out);
    for (size_t c = 0; c < N_COLUMNS; c++)
        fprintf(out, ",%s", columns[c].key);
    fputs(",disagreement,second_disagreement", out);
    for (int scene = 0; scene < HAND_N; scene++) {
        const struct hand_kernel *hand = &hand_build(0)[scene];
        fprintf(out, "\n%s,%d,%d", hand->scene, hand->dof, HAND_SLICES);
        for (size_t c = 0; c < N_COLUMNS; c++)
            fprintf(out, ",%.6g", cell(&columns[c], &races[scene]));
        fprintf(out, ",%.3g,%.3g", races[scene].disagreement, races[scene].second);
    }
    fputc('\n', out);
}

/* What others need to do the same, and to compare what they get. */
static void print_values(FILE *out, const struct race races[HAND_N])
{
    fprintf(out, "# adam: the path after %d steps, betas 0.9 and 0.999, eps 1e-8, learning rates",
            RACE_ADAM_STEPS);
    for (int scene = 0; scene < HAND_N; scene++)
        fprintf(out, " %s %g", hand_build(0)[scene].scene, races[scene].values.adam_rate);
    fputs("\nscene,coordinate,slice,x,u,gradient,product,adam\n", out);
    for (int scene = 0; scene < HAND_N; scene++) {
        const struct race_values *v = &races[scene].values;
        for (size_t k = 0; k < v->n; k++)
            fprintf(out, "%s,%zu,%zu,%.17g,%.17g,%.17g,%.17g,%.17g\n", hand_build(0)[scene].scene,
                    k / HAND_SLICES, k % HAND_SLICES, v->x[k], v->u[k], v->gradient[k],
                    v->product[k], v->adam[k]);
    }
}

/* ---- the picture: first derivatives at left, second at right ---- */

static const struct bars {
    const char *title, *unit;
    int bar[3]; /* interpreted, compiled, by hand */
} panels[] = {
    {"gradient", "times the hand-written C", {TAPE_GRADIENT, NATIVE_GRADIENT, HAND_GRADIENT}},
    {"Hessian times a vector", "", {TAPE_PRODUCT, NATIVE_PRODUCT, HAND_PRODUCT}},
};

enum { N_PANELS = sizeof panels / sizeof *panels };

/* Scene, then height and label of each bar: in units of the hand-written code, so that scenes of
   any size stand side by side, and in microseconds. */
static void write_bars(const struct bars *bars, const struct race races[HAND_N], FILE *data)
{
    for (int scene = 0; scene < HAND_N; scene++) {
        const struct race *race = &races[scene];
        fputs(hand_build(0)[scene].scene, data);
        for (size_t b = 0; b < 3; b++) {
            double us = 1e-3 * race->ns[bars->bar[b]];
            fprintf(data, " %.4g %.*f", race->ratio[bars->bar[b]][bars->bar[2]],
                    us < 10    ? 2
                    : us < 100 ? 1
                               : 0,
                    us);
        }
        fputc('\n', data);
    }
    fputs("\n\n", data);
}

static void draw(const struct race races[HAND_N], struct plot *plot)
{
    FILE *out = plot->script;
    plot->width = 1040;
    plot->height = 400;
    fprintf(out,
            "set multiplot layout 1,%d margins 0.06,0.99,0.11,0.8 spacing 0.06,0\n"
            "set label 1 'Derivatives of the action beside hand-written C: %d slices, one thread, "
            "f64; above the bars microseconds' at screen 0.5,0.955 center font ',14'\n"
            "set style data histogram\nset style histogram clustered gap 1\n"
            "set style fill solid noborder\nset boxwidth 0.9\nset border 3\nset tics nomirror\n"
            "set grid ytics lt 1 lc rgb '#e6e6e6'\nset yrange [0:*]\nset xrange [-0.6:%d.6]\n"
            "set offsets 0,0,0.5,0\nset key at screen 0.5,0.9 center horizontal samplen 1.5\n",
            N_PANELS, HAND_SLICES, HAND_N - 1);
    for (size_t p = 0; p < N_PANELS; p++) {
        write_bars(&panels[p], races, plot->data);
        fprintf(out,
                "set title '%s' offset 0,-0.6\nset ylabel '%s'\n"
                "plot data index %zu using 2:xtic(1) lc rgb '#1f4e79' title 'interpreted', \\\n"
                "    '' index %zu using 4 lc rgb '#3f9b6e' title 'compiled', \\\n"
                "    '' index %zu using 6 lc rgb '#e8a33d' title 'by hand'",
                panels[p].title, panels[p].unit, p, p, p);
        for (int b = 0; b < 3; b++)
            fprintf(out,
                    ", \\\n    '' index %zu using ($0%+.2f):%d:%d with labels offset 0,0.6 font "
                    "',10' notitle",
                    p, 0.25 * (b - 1), 2 * b + 2, 2 * b + 3);
        fputs("\nset key off\nunset label 1\n", out);
    }
    fputs("unset multiplot\n", out);
}

static enum ad_status measure(const struct chart_settings *settings, struct race races[HAND_N],
                              struct ad_error *error)
{
    struct result csv = {0}, values = {0};
    struct plot plot = {0};
    if (chart_csv(settings, "gradients", &csv, error) == AD_OK &&
        chart_csv(settings, "gradients-values", &values, error) == AD_OK)
        chart_picture(settings, "gradients", &plot, error);
    for (int scene = 0; scene < HAND_N && error->status == AD_OK; scene++)
        race_run(scene, settings->quick, &races[scene], error);
    if (error->status == AD_OK) {
        print_csv(csv.out, races);
        print_values(values.out, races);
        draw(races, &plot);
        if (plot_commit(&plot, error) == AD_OK && result_commit(&values, error) == AD_OK)
            result_commit(&csv, error);
    }
    plot_abandon(&plot);
    result_abandon(&values);
    result_abandon(&csv);
    return error->status;
}

int chart_gradients(const struct chart_settings *settings, struct ad_error *error)
{
    struct race races[HAND_N] = {0};
    bool agree = true;
    if (measure(settings, races, error) == AD_OK) {
        for (int scene = 0; scene < HAND_N; scene++)
            agree =
                agree && races[scene].disagreement < tolerance && races[scene].second < tolerance;
        if (!settings->quiet)
            print_table(stdout, races);
        if (!agree)
            fputs("leastaction: derivatives by the tape and by hand differ\n", stderr);
        if (settings->json)
            print_json(stdout, races);
    }
    for (int scene = 0; scene < HAND_N; scene++)
        race_free(&races[scene]);
    if (error->status != AD_OK)
        return command_status(error);
    return agree ? DONE : NOT_REACHED;
}
