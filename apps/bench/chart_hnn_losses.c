/* The first losses of a training from weights and samples given by a formula, so that peers can
   reproduce them (chart_hnn.h, scripts/peers/training.py). */
#include "chart_hnn.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 20 };

/* Without structure, and the same in any language: number k of a sequence in [-1, 1]. */
static double number(size_t k) { return sin(0.7 * (double)(k * k)); }

static void put(enum ad_type type, void *to, size_t k, double value)
{
    if (type == AD_F32)
        ((float *)to)[k] = (float)value;
    else
        ((double *)to)[k] = value;
}

/* Weights of about unit gain. */
static enum ad_status begin(hnn_model *model, struct ad_error *error)
{
    size_t n, bytes = hnn_model_size(model) * sizeof(double);
    const struct hnn_block *block = hnn_model_blocks(model, &n);
    void *parameters = malloc(bytes);
    if (!parameters)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu bytes", bytes);
    for (const struct hnn_block *b = block; b < block + n; b++)
        for (size_t k = b->offset; k < b->offset + b->rows * b->cols; k++)
            put(hnn_model_settings(model)->precision, parameters, k,
                number(k) * (b->bias ? 0.1 : sqrt(2 / (double)b->cols)));
    hnn_model_set_parameters(model, parameters);
    free(parameters);
    return AD_OK;
}

/* States, and the rates of q^2 + p^2: [2 x n] each. */
static void fill(size_t n, double *values)
{
    for (size_t k = 0; k < 2 * n; k++)
        values[k] = number(k);
    for (size_t k = 0; k < n; k++) {
        values[2 * n + k] = 2 * values[n + k];
        values[3 * n + k] = -2 * values[k];
    }
}

static enum ad_status train(const struct network *network, struct sheet *sheet,
                            struct ad_error *error)
{
    double *values = malloc(4 * network->batch * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", network->batch);
    const struct hnn_samples samples = {
        .n = network->batch, .x = values, .target = values + 2 * network->batch};
    struct hnn_training training = hnn_training_defaults();
    const struct hnn_settings settings = network_settings(network);
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    enum hnn_stop stop;
    size_t rows = 0;
    training.steps = STEPS;
    training.every = 1;
    fill(network->batch, values);
    if (hnn_model_new(&settings, &model, error) == AD_OK && begin(model, error) == AD_OK &&
        hnn_trainer_new(model, &training, &samples, &(struct hnn_samples){0}, &trainer, error) ==
            AD_OK &&
        hnn_trainer_run(trainer, &stop, error) == AD_OK) {
        const struct hnn_row *row = hnn_trainer_history(trainer, &rows);
        for (size_t k = 0; k < rows; k++)
            sheet_row(sheet,
                      ROW(NAME(hnn_kinds[network->kind]), NAME(hnn_precisions[network->type]),
                          NUMBER(network->width), NUMBER(network->batch), NUMBER(row[k].step),
                          NUMBER(row[k].train_loss)),
                      error);
    }
    hnn_trainer_free(trainer);
    hnn_model_free(model);
    free(values);
    return error->status;
}

enum ad_status chart_losses(struct chart *chart, struct ad_error *error)
{
    static const struct column columns[] = {
        {.key = "model"}, {.key = "precision"},          {.key = "width"}, {.key = "batch"},
        {.key = "step"},  {.key = "loss", .digits = 17}, {.key = NULL}};
    struct network networks[NETWORKS_MOST];
    struct sheet *sheet = chart_sheet(chart, "hnn-losses", columns, error);
    size_t n = networks_of_chart(PUBLISHED_WIDTH, networks);
    if (!chart->quick)
        networks[n++] = WIDE_NETWORK;
    for (size_t k = 0; k < n && error->status == AD_OK; k++)
        train(&networks[k], sheet, error);
    return error->status;
}
