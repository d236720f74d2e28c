/* Records the loss: for each sample the mean square of the difference between prediction and
   target; and evaluates it over all samples. */
#include "train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Larger sets are evaluated in pieces, to limit the memory of activations: this many samples at
   most, and this many numbers. */
enum { PIECE = 4096, PIECE_VALUES = 1 << 19 };

static size_t piece_of(const struct hnn_data *data)
{
    size_t most = PIECE_VALUES / data->x_rows + 1;
    most = most < PIECE ? most : PIECE;
    return data->n < most ? data->n : most;
}

size_t hnn_state_rows(const hnn_model *model, const struct hnn_training *training)
{
    return hnn_rows(model) + model->settings.inputs * training->rollout;
}

static ad_var field_at(const hnn_model *model, ad_var parameters, ad_var x)
{
    return hnn_model_record(model, parameters, x).field;
}

ad_var hnn_mean_squares(ad_var residual, const double *units)
{
    size_t n = ad_rows(residual);
    if (!units)
        return ad_mul(1 / (double)n, ad_sum_rows(ad_square(residual)));
    double *inverse = malloc(n * sizeof *inverse);
    if (!inverse)
        return ad_refuse(residual.tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        inverse[k] = 1 / units[k];
    ad_var scaled = ad_mul(residual, ad_const(residual.tape, n, 1, inverse));
    free(inverse);
    return hnn_mean_squares(scaled, NULL);
}

/* ---- rates ---- */

static size_t rates(const hnn_model *model, const struct hnn_training *training)
{
    (void)training;
    return hnn_states(model);
}

static ad_var record_rates(const hnn_model *model, const struct hnn_training *training,
                           ad_var parameters, ad_var x, ad_var target)
{
    (void)training;
    return hnn_mean_squares(ad_sub(field_at(model, parameters, x), target), model->scaling.rate);
}

static const struct hnn_objective learn_rates = {false, hnn_state_rows, rates, record_rates};

/* ---- the choice ---- */

static const struct hnn_objective *objective(const hnn_model *model,
                                             const struct hnn_training *training)
{
    return model->settings.pixels ? &hnn_learn_pixels
           : training->loss       ? &hnn_learn_own
           : training->rollout    ? &hnn_learn_rollouts
                                  : &learn_rates;
}

size_t hnn_x_rows(const hnn_model *model, const struct hnn_training *training)
{
    return objective(model, training)->x_rows(model, training);
}

size_t hnn_target_rows(const hnn_model *model, const struct hnn_training *training)
{
    return objective(model, training)->target_rows(model, training);
}

bool hnn_by_rows(const hnn_model *model, const struct hnn_training *training)
{
    return objective(model, training)->by_rows;
}

ad_var hnn_record_samples(ad_tape *tape, bool by_rows, size_t components, size_t samples,
                          const char *label)
{
    return by_rows ? ad_input(tape, samples, components, label)
                   : ad_input(tape, components, samples, label);
}

ad_var hnn_record_losses(const hnn_model *model, const struct hnn_training *training,
                         ad_var parameters, ad_var x, ad_var target)
{
    return objective(model, training)->record(model, training, parameters, x, target);
}

/* ---- all samples ---- */

enum ad_status hnn_loss_evaluator_new(struct hnn_loss_evaluator *s, const hnn_model *model,
                                      const struct hnn_training *training,
                                      const struct hnn_data *data, struct ad_error *failed,
                                      struct ad_error *error)
{
    *s = (struct hnn_loss_evaluator){
        .ranks = training->ranks, .failed = failed, .data = data, .piece = piece_of(data)};
    if (data->n == 0)
        return AD_OK;
    s->tape = ad_tape_new(data->type);
    if (!s->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->parameters = ad_input(s->tape, 1, model->size, "parameters");
    bool by_rows = hnn_by_rows(model, training);
    s->x = hnn_record_samples(s->tape, by_rows, data->x_rows, s->piece, "x");
    s->target = hnn_record_samples(s->tape, by_rows, data->target_rows, s->piece, "target");
    s->losses = hnn_record_losses(model, training, s->parameters, s->x, s->target);
    ad_compile(s->tape, 1, &s->losses, &s->program);
    if (phys_tape_status(s->tape, error) != AD_OK)
        return error->status;
    ad_set_threads(s->program, training->threads ? training->threads : 1);
    if (s->piece == data->n)
        hnn_data_copy(data, NULL, 0, data->n, data->n, ad_data(s->program, s->x),
                      ad_data(s->program, s->target));
    return AD_OK;
}

void hnn_loss_evaluator_free(struct hnn_loss_evaluator *s)
{
    ad_program_free(s->program);
    ad_tape_free(s->tape);
    *s = (struct hnn_loss_evaluator){0};
}

/* Sum of the first `count` losses of a piece. */
static double sum_losses(const struct hnn_loss_evaluator *s, size_t count)
{
    const void *losses = ad_data(s->program, s->losses);
    double sum = 0;
    for (size_t k = 0; k < count; k++)
        sum += s->data->type == AD_F32 ? (double)((const float *)losses)[k]
                                       : ((const double *)losses)[k];
    return sum;
}

static enum ad_status add_piece(void *context, size_t k, double *sum, struct ad_error *error)
{
    const struct hnn_loss_evaluator *s = context;
    const struct hnn_data *data = s->data;
    size_t first = k * s->piece, left = data->n - first;
    if (s->piece < data->n)
        hnn_data_copy(data, NULL, first, s->piece, s->piece, ad_data(s->program, s->x),
                      ad_data(s->program, s->target));
    ad_run(s->program);
    *sum = sum_losses(s, left < s->piece ? left : s->piece);
    return error->status;
}

double hnn_evaluate_loss(const struct hnn_loss_evaluator *s, const void *point, size_t bytes)
{
    struct hnn_loss_evaluator own = *s;
    double sum;
    if (!s->program)
        return NAN;
    memcpy(ad_data(s->program, s->parameters), point, bytes);
    size_t n = s->data->n, pieces = (n + s->piece - 1) / s->piece;
    if (ad_ranks_sum(pieces > 1 ? s->ranks : NULL, pieces, 1, add_piece, &own, &sum, s->failed) !=
        AD_OK)
        return NAN;
    return sum / (double)n;
}
