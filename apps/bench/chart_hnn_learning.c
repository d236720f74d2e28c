/* Test loss and energy error against seconds of training (chart_hnn.h). The data are a pendulum's
   without noise: with noise all losses end at its level, whatever the network. */
#include "chart_hnn.h"
#include "apps/bench/measure/timing.h"
#include "hnn/rollout/rollout.h"

#include <math.h>

enum { TRIALS = 25, POINTS = PUBLISHED_BATCH / TRIALS, FIRST_STAGE = 4, STARTS = 5 };
enum { MOST_STEPS = 1 << 14, MOST_STEPS_QUICK = 8 };

static const double budget = 4;      /* seconds of training a network */
static const double accuracy = 1e-6; /* of rollouts: under any error of a model */

struct lesson {
    const struct hnn_task *task;
    struct hnn_observations train, test;
    size_t most_steps;
    double most_seconds;
    size_t stage; /* the step to measure at */
    struct sheet *sheet, *last;
    const struct network *network;
    double began, spent; /* processor seconds, of this stage and in those before */
};

static struct hnn_samples samples(const struct hnn_observations *o)
{
    return (struct hnn_samples){
        .n = o->rows, .x = o->values, .target = o->values + 2 * o->dof * o->rows};
}

static const struct column columns[] = {{.key = "model"},
                                        {.key = "precision"},
                                        {.key = "width"},
                                        {.key = "step"},
                                        {.key = "seconds", .digits = 4},
                                        {.key = "test_loss"},
                                        {.key = "energy_mse"},
                                        {.key = "network", .no_csv = true},
                                        {.key = NULL}};

/* The last stage of each network. */
static const struct column last_columns[] = {
    {.key = "model", .title = "", .width = -9},
    {.key = "precision", .title = "", .width = 4},
    {.key = "width", .title = "width", .width = 5, .shown = 5},
    {.key = "steps", .title = "steps", .width = 8, .shown = 8},
    {.key = "seconds", .title = "CPU time (s)", .width = 12, .shown = 3},
    {.key = "test_loss", .title = "test loss", .width = 11, .shown = 3},
    {.key = "energy_mse", .title = "energy MSE", .width = 11, .shown = 3},
    {.key = "network"},
    {.key = NULL},
};

/* Stops at the next stage, or where the time is up. */
static bool go_on(void *context, hnn_trainer *trainer)
{
    const struct lesson *lesson = context;
    return hnn_trainer_step(trainer) < lesson->stage &&
           lesson->spent + processor_seconds() - lesson->began < lesson->most_seconds;
}

enum ad_status network_energy_error(hnn_model *model, const struct hnn_task *task, size_t starts,
                                    double *mse, struct ad_error *error)
{
    const struct hnn_trials trials = {.size = sizeof trials, .starts = starts, .rtol = accuracy};
    struct phys_ode ode = {0};
    struct hnn_score score;
    struct ad_error lost = {0};
    *mse = INFINITY;
    if (hnn_model_ode(model, &ode, error) == AD_OK &&
        hnn_task_trials(&ode, task, &trials, &score, &lost) == AD_OK)
        *mse = score.energy_mse;
    phys_ode_free(&ode);
    if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

/* Label of a curve; name [NETWORK_NAME]. */
enum { NETWORK_NAME = 48 };
static const char *network_name(const struct network *w, char *room)
{
    snprintf(room, NETWORK_NAME, "%s %s %zu", hnn_kinds[w->kind], hnn_precisions[w->type],
             w->width);
    return room;
}

static enum ad_status add_stage(const struct lesson *lesson, struct sheet *sheet,
                                const hnn_trainer *trainer, double loss, double mse,
                                struct ad_error *error)
{
    const struct network *w = lesson->network;
    char name[NETWORK_NAME];
    return sheet_row(sheet,
                     ROW(NAME(hnn_kinds[w->kind]), NAME(hnn_precisions[w->type]), NUMBER(w->width),
                         NUMBER(hnn_trainer_step(trainer)), NUMBER(lesson->spent), NUMBER(loss),
                         NUMBER(mse), NAME(network_name(w, name))),
                     error);
}

/* Stages of 4, 8, 16 ... steps, until the time is up. */
static enum ad_status learn(struct lesson *lesson, hnn_model *model, hnn_trainer *trainer,
                            struct ad_error *error)
{
    double loss = NAN, mse = NAN;
    lesson->spent = 0;
    for (lesson->stage = FIRST_STAGE;
         lesson->stage <= lesson->most_steps && lesson->spent < lesson->most_seconds;
         lesson->stage *= 2) {
        enum hnn_stop stop;
        lesson->began = processor_seconds();
        if (hnn_trainer_run(trainer, &stop, error) != AD_OK)
            return error->status;
        lesson->spent += processor_seconds() - lesson->began;
        loss = hnn_trainer_test_loss(trainer);
        if (network_energy_error(model, lesson->task, STARTS, &mse, error) != AD_OK ||
            add_stage(lesson, lesson->sheet, trainer, loss, mse, error) != AD_OK)
            return error->status;
    }
    return add_stage(lesson, lesson->last, trainer, loss, mse, error);
}

/* The model belongs to the caller, also on failure. */
static enum ad_status one_network(struct lesson *lesson, hnn_model **model, struct ad_error *error)
{
    struct hnn_training training = hnn_training_defaults();
    const struct hnn_settings settings = network_settings(lesson->network);
    const struct hnn_samples train = samples(&lesson->train), test = samples(&lesson->test);
    hnn_trainer *trainer = NULL;
    training.steps = training.every = SIZE_MAX;
    training.weight_decay = 0; /* nothing to forget: there is no noise */
    training.threads = 1;
    training.progress = go_on;
    training.context = lesson;
    if (hnn_model_new(&settings, model, error) == AD_OK &&
        hnn_trainer_new(*model, &training, &train, &test, &trainer, error) == AD_OK)
        learn(lesson, *model, trainer, error);
    hnn_trainer_free(trainer);
    return error->status;
}

static enum ad_status open_lesson(struct lesson *lesson, struct ad_error *error)
{
    lesson->task = hnn_task_find("pendulum", error);
    struct hnn_sampling sampling = lesson->task->published;
    sampling.trials = TRIALS;
    sampling.points = POINTS;
    sampling.noise = 0;
    if (hnn_task_observe(lesson->task, &sampling, 1, &lesson->train, error) == AD_OK)
        hnn_task_observe(lesson->task, &sampling, 2, &lesson->test, error);
    return error->status;
}

/* ---- the picture: above the test loss, below the energy error; left f32, right f64 ---- */

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

static void draw_panel(struct figure *figure, const struct sheet *sheet, size_t n,
                       const struct network networks[])
{
    const int p = figure->panel;
    const enum ad_type type = p % 2 ? AD_F64 : AD_F32;
    char title[32], name[NETWORK_NAME];
    figure_panel(
        figure,
        &(struct panel){
            .title = p > 1 ? NULL
                     : p   ? "trained in f64"
                           : "trained in f32",
            .x = p > 1 ? "CPU time of training (s)" : NULL,
            .y = p == 0   ? "test loss"
                 : p == 2 ? "energy error, mean square"
                          : NULL,
            .log = "xy",
            .x_range = "[1e-3:6]",
            .y_range = p > 1 ? "[1e-7:100]" : "[1e-6:20]",
            .y_tics = "100",
            .key = p == 3 ? "at screen 0.998,0.93 right top Left reverse samplen 2 spacing 1.3"
                          : NULL});
    for (int kind = HNN_HAMILTONIAN; kind >= HNN_BASELINE; kind--)
        for (size_t k = 0; k < n; k++) {
            const struct network *w = &networks[k];
            if (w->type != type || (int)w->kind != kind)
                continue;
            snprintf(title, sizeof title, "%s, %zu wide", kind == HNN_BASELINE ? "baseline" : "HNN",
                     w->width);
            figure_curve(figure, sheet, "seconds", p > 1 ? "energy_mse" : "test_loss", title,
                         STYLE(colour_of(w), kind == HNN_BASELINE ? 5 : 7, 2, 0.5), "network",
                         network_name(w, name));
        }
}

static void draw(const struct sheet *sheet, size_t n, const struct network networks[],
                 struct plot *plot)
{
    static const struct layout layout = {.width = 1080,
                                         .height = 660,
                                         .title = "Learning a pendulum: errors over CPU time",
                                         .rows = 2,
                                         .columns = 2,
                                         .room = {0.075, 0.82, 0.11, 0.89},
                                         .gap = {0.05, 0.075}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (int p = 0; p < 4; p++)
        draw_panel(&figure, sheet, n, networks);
    figure_end(&figure);
}

enum ad_status chart_learning(struct chart *chart, hnn_model **kept, struct ad_error *error)
{
    struct network networks[NETWORKS_MOST];
    struct sheet last;
    struct sheet *sheet = chart_sheet(chart, "hnn-learning", columns, error);
    struct plot *plot = chart_picture(chart, "hnn-learning", error);
    struct lesson lesson = {.most_steps = chart->quick ? MOST_STEPS_QUICK : MOST_STEPS,
                            .most_seconds = chart->quick ? INFINITY : budget,
                            .sheet = sheet,
                            .last = &last};
    size_t n = networks_of_chart(chart->quick ? QUICK_WIDTH : 0, networks);
    if (error->status != AD_OK)
        return error->status;
    sheet_open(&last, last_columns, NULL, chart_terminal(chart));
    if (open_lesson(&lesson, error) == AD_OK)
        for (size_t k = 0; k < n && error->status == AD_OK; k++) {
            hnn_model *model = NULL;
            lesson.network = &networks[k];
            one_network(&lesson, &model, error);
            if (networks[k].kind == HNN_HAMILTONIAN && networks[k].type == AD_F32 &&
                networks[k].width == (chart->quick ? QUICK_WIDTH : PUBLISHED_WIDTH))
                *kept = model;
            else
                hnn_model_free(model);
        }
    if (error->status == AD_OK) {
        if (!chart->quiet)
            printf("a pendulum, %d samples without noise; energy: %d motions to t = 20\n\n",
                   PUBLISHED_BATCH, STARTS);
        sheet_json(&last, "learning", &chart->json);
        draw(sheet, n, networks, plot);
    }
    sheet_free(&last);
    hnn_observations_free(&lesson.train);
    hnn_observations_free(&lesson.test);
    return error->status;
}
