/* leastaction chart gradients: first and second derivatives of the action, in nanoseconds and
   relative to hand-written C. */
#include "chart.h"
#include "apps/bench/hand/hand.h"
#include "apps/bench/measure/gradient_benchmark.h"

#include <stdio.h>

/* Above this the two are not gradients of one function, and their speeds are not comparable. */
static const double tolerance = 1e-11;

#define NS .shown = 0, .fixed = true
#define TIMES .shown = 2, .fixed = true
static const struct column columns[] = {
    {.key = "scene", .title = "ns per call", .width = -11},
    {.key = "dof"},
    {.key = "slices"},
    {.key = "tape_gradient_ns", .title = "gradient", .width = 10, NS},
    {.key = "native_gradient_ns", .title = "compiled", .width = 9, NS},
    {.key = "hand_gradient_ns", .title = "hand", .width = 8, NS},
    {.key = "gradient_ratio", .title = "ratio", .width = 6, TIMES},
    {.key = "native_gradient_ratio", .title = "compiled", .width = 9, TIMES},
    {.key = "limit_gradient_ns", .title = "limit", .width = 8, NS},
    {.key = "native_limit_ratio", .title = "compiled", .width = 9, TIMES},
    {.key = "tape_primal_ns", .title = "primal", .width = 10, NS},
    {.key = "hand_primal_ns", .title = "hand", .width = 8, NS},
    {.key = "tape_gradient_per_primal", .title = "grad/primal", .width = 12, TIMES},
    {.key = "hand_gradient_per_primal", .title = "hand", .width = 6, TIMES},
    {.key = "adam_step_per_gradient", .title = "Adam step/grad", .width = 15, TIMES},
    {.key = "native_adam_step_ns", .title = "compiled step", .width = 14, NS},
    {.key = "tape_product_ns", .title = "Hessian x v", .width = 11, NS},
    {.key = "native_product_ns", .title = "compiled", .width = 9, NS},
    {.key = "hand_product_ns", .title = "hand", .width = 8, NS},
    {.key = "product_ratio", .title = "ratio", .width = 6, TIMES},
    {.key = "native_product_ratio", .title = "compiled", .width = 9, TIMES},
    {.key = "native_product_per_gradient", .title = "per gradient", .width = 13, TIMES},
    {.key = "hessian_blocks_ns", .title = "all blocks", .width = 12, NS},
    {.key = "disagreement", .digits = 3},
    {.key = "second_disagreement", .digits = 3},
    {.key = NULL},
};

static enum ad_status add_row(struct sheet *sheet, int scene, const struct race *r,
                              struct ad_error *error)
{
#define RATIO(a, b) NUMBER(r->ratio[a][b])
#define TIME(a) NUMBER(r->ns[a])
    const struct hand_kernel *hand = &hand_build(0)[scene];
    return sheet_row(
        sheet,
        ROW(NAME(hand->scene), NUMBER(hand->dof), NUMBER(HAND_SLICES), TIME(TAPE_GRADIENT),
            TIME(NATIVE_GRADIENT), TIME(HAND_GRADIENT), RATIO(TAPE_GRADIENT, HAND_GRADIENT),
            RATIO(NATIVE_GRADIENT, HAND_GRADIENT), TIME(LIMIT_GRADIENT),
            RATIO(NATIVE_GRADIENT, LIMIT_GRADIENT), TIME(TAPE_PRIMAL), TIME(HAND_PRIMAL),
            RATIO(TAPE_GRADIENT, TAPE_PRIMAL), RATIO(HAND_GRADIENT, HAND_PRIMAL),
            RATIO(ADAM_STEP, TAPE_GRADIENT), TIME(NATIVE_ADAM_STEP), TIME(TAPE_PRODUCT),
            TIME(NATIVE_PRODUCT), TIME(HAND_PRODUCT), RATIO(TAPE_PRODUCT, HAND_PRODUCT),
            RATIO(NATIVE_PRODUCT, HAND_PRODUCT), RATIO(NATIVE_PRODUCT, NATIVE_GRADIENT),
            TIME(HESSIAN_BLOCKS), NUMBER(r->disagreement), NUMBER(r->second)),
        error);
}

/* Values for peers, who repeat the computation and compare. */
static const struct column value_columns[] = {{.key = "scene"},
                                              {.key = "coordinate"},
                                              {.key = "slice"},
                                              {.key = "x", .digits = 17},
                                              {.key = "u", .digits = 17},
                                              {.key = "gradient", .digits = 17},
                                              {.key = "product", .digits = 17},
                                              {.key = "adam", .digits = 17},
                                              {.key = NULL}};

static void add_values(struct sheet *sheet, int scene, const struct race_values *v,
                       struct ad_error *error)
{
    const char *name = hand_build(0)[scene].scene;
    fprintf(
        sheet->csv,
        "# %s: adam is the path after %d steps, betas 0.9 and 0.999, eps 1e-8, learning rate %g\n",
        name, RACE_ADAM_STEPS, v->adam_rate);
    for (size_t k = 0; k < v->n; k++)
        sheet_row(sheet,
                  ROW(NAME(name), NUMBER(k / HAND_SLICES), NUMBER(k % HAND_SLICES), NUMBER(v->x[k]),
                      NUMBER(v->u[k]), NUMBER(v->gradient[k]), NUMBER(v->product[k]),
                      NUMBER(v->adam[k])),
                  error);
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
    static const struct layout layout = {
        .width = 1040,
        .height = 400,
        .title = "Derivatives of the action beside hand-written C: "
                 "100 slices, one thread, f64; above the bars microseconds",
        .columns = N_PANELS,
        .room = {0.06, 0.99, 0.11, 0.8},
        .gap = {0.06, 0}};
    static const char *const names[] = {"interpreted", "compiled", "by hand"};
    static const char *const colours[] = {"#0072b2", "#009e73", "#e69f00"};
    struct figure figure;
    char range[32];
    snprintf(range, sizeof range, "[-0.6:%d.6]", HAND_N - 1);
    figure_begin(&figure, plot, &layout);
    for (int p = 0; p < N_PANELS; p++) {
        write_bars(&panels[p], races, plot->data);
        figure_panel(
            &figure,
            &(struct panel){.title = panels[p].title,
                            .y = panels[p].unit,
                            .x_range = range,
                            .y_range = "[0:*]",
                            .key = p ? NULL : "at screen 0.5,0.9 center horizontal samplen 1.5",
                            .more = "set style data histogram\nset style histogram clustered "
                                    "gap 1\nset style fill solid noborder\nset boxwidth "
                                    "0.9\nset offsets 0,0,0.5,0\n"});
        for (int b = 0; b < 3; b++)
            figure_element(&figure, "data index %d using %d%s lc rgb '%s' title '%s'", p, 2 * b + 2,
                           b ? "" : ":xtic(1)", colours[b], names[b]);
        for (int b = 0; b < 3; b++)
            figure_element(&figure,
                           "data index %d using ($0%+.2f):%d:%d with labels offset 0,0.6 font "
                           "',10' notitle",
                           p, 0.25 * (b - 1), 2 * b + 2, 2 * b + 3);
    }
    figure_end(&figure);
}

static void json_scene(struct json *json, const struct sheet *sheet, size_t row)
{
    json_object(json, hand_build(0)[row].scene);
    for (const struct column *c = columns + 3; c->key; c++)
        json_number(json, c->key, sheet_number(sheet, row, c->key));
    json_end_object(json);
}

enum ad_status chart_gradients(struct chart *chart, struct ad_error *error)
{
    struct race races[HAND_N] = {0};
    struct sheet *sheet = chart_sheet(chart, "gradients", columns, error);
    struct sheet *values = chart_sheet(chart, "gradients-values", value_columns, error);
    struct plot *plot = chart_picture(chart, "gradients", error);
    for (int scene = 0; scene < HAND_N && error->status == AD_OK; scene++) {
        struct race *race = &races[scene];
        if (race_run(scene, chart->quick, race, error) != AD_OK ||
            add_row(sheet, scene, race, error) != AD_OK)
            break;
        add_values(values, scene, &race->values, error);
        json_scene(&chart->json, sheet, (size_t)scene);
        if (!(race->disagreement < tolerance && race->second < tolerance))
            chart->missed = "derivatives by the tape and by hand differ";
    }
    if (error->status == AD_OK)
        draw(races, plot);
    for (int scene = 0; scene < HAND_N; scene++)
        race_free(&races[scene]);
    return error->status != AD_OK || chart_sizes(chart, error) != AD_OK
               ? error->status
               : chart_forces(chart, error);
}
