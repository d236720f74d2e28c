/* Milliseconds of a training step beside its floor, and microseconds of a field (chart_hnn.h). */
#include "chart_hnn.h"
#include "apps/bench/measure/training_speed.h"

#include <math.h>

enum { ROUNDS = 21, ROUNDS_QUICK = 2, THREADS = 2 }; /* rounds of the published width */

struct evaluation {
    hnn_model *model;
    double rate[2];
};

static void evaluate(void *context)
{
    struct evaluation *e = context;
    hnn_model_field(e->model, (double[]){0.5, -0.7}, e->rate);
}

/* One state at a time, as integrators ask for it, in the precision of the weights. */
static enum ad_status field_microseconds(const struct network *network, size_t rounds, double *us,
                                         struct ad_error *error)
{
    struct evaluation e = {0};
    struct timed job = {.run = evaluate, .context = &e};
    struct hnn_settings settings = network_settings(network);
    if (hnn_model_new(&settings, &e.model, error) == AD_OK) {
        hnn_model_evaluate_in(e.model, network->type);
        time_in_turn(1, &job, rounds);
        *us = 1e-3 * job.nanoseconds;
    }
    hnn_model_free(e.model);
    return error->status;
}

static const struct column columns[] = {
    {.key = "model", .title = "model", .width = -9},
    {.key = "precision", .title = "type", .width = 4},
    {.key = "threads", .title = "threads", .width = 7, .shown = 3},
    {.key = "batch", .title = "samples", .width = 7, .shown = 5},
    {.key = "width", .title = "width", .width = 5, .shown = 5},
    {.key = "step_ms", .digits = 4, .title = "ms/step", .width = 9, .shown = 2, .fixed = true},
    {.key = "blas_share", .digits = 3, .title = "OpenBLAS", .width = 9, .shown = 2, .fixed = true},
    {.key = "products_ms", .digits = 4, .title = "products", .width = 9, .shown = 2, .fixed = true},
    {.key = "activation_ms", .digits = 4, .title = "tanh", .width = 9, .shown = 2, .fixed = true},
    {.key = "floor_ms", .no_csv = true},
    {.key = "ratio", .title = "ratio", .width = 6, .shown = 2, .fixed = true, .no_csv = true},
    {.key = "hand_ms", .digits = 4, .title = "by hand", .width = 9, .shown = 2, .fixed = true},
    {.key = "hand_ratio", .digits = 4, .title = "ratio", .width = 6, .shown = 2, .fixed = true},
    {.key = "field_us", .digits = 4, .title = "us/field", .width = 9, .shown = 1, .fixed = true},
    {.key = NULL},
};

/* Wide networks are timed less often: a batch of theirs is longer, and disturbed less. */
static enum ad_status one_network(bool quick, const struct network *network, struct sheet *sheet,
                                  struct ad_error *error)
{
    struct training_speed s;
    double field_us = NAN;
    const struct hnn_settings model = network_settings(network);
    size_t rounds = 1 + (size_t)(quick ? ROUNDS_QUICK : ROUNDS) * PUBLISHED_WIDTH / network->width;
    field_microseconds(network, rounds, &field_us, error);
    for (size_t threads = 1; threads <= THREADS && error->status == AD_OK; threads++) {
        if (training_speed_measure(&model, network->batch, threads, rounds, &s, error) != AD_OK)
            break;
        double least = s.products_ms + s.activation_ms;
        sheet_row(sheet,
                  ROW(NAME(hnn_kinds[network->kind]), NAME(hnn_precisions[network->type]),
                      NUMBER(threads), NUMBER(network->batch), NUMBER(network->width),
                      NUMBER(s.step_ms), NUMBER(s.share), NUMBER(s.products_ms),
                      NUMBER(s.activation_ms), NUMBER(least), NUMBER(s.step_ms / least),
                      NUMBER(s.hand_ms), NUMBER(s.hand_ratio), NUMBER(field_us)),
                  error);
    }
    return error->status;
}

enum ad_status chart_steps(struct chart *chart, struct ad_error *error)
{
    struct network networks[NETWORKS_MOST];
    size_t n = networks_of_chart(chart->quick ? QUICK_WIDTH : 0, networks);
    if (!chart->quick)
        networks[n++] = WIDE_NETWORK;
    struct sheet *sheet = chart_sheet(chart, "hnn-steps", columns, error);
    for (size_t k = 0; k < n && error->status == AD_OK; k++)
        one_network(chart->quick, &networks[k], sheet, error);
    sheet_json(sheet, "steps", &chart->json);
    if (error->status == AD_OK && !chart->quiet)
        puts(
            "a step of Adam, 2-width-width-outputs, tanh; OpenBLAS: its share of loss and "
            "gradient\non one thread; ratio: to the floor, the products and the tanh alone, and to "
            "the step by hand; field: of one state\n");
    return error->status;
}
