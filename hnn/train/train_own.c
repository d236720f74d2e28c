/* A loss of the caller's own in place of the mean square, and a check that it is one of single
   samples. */
#include "train.h"

#include <stdlib.h>

static size_t target_rows(const hnn_model *model, const struct hnn_training *training)
{
    size_t steps = training->rollout;
    return steps ? (hnn_states(model) + 1) * steps : hnn_states(model);
}

static ad_var record(const hnn_model *model, const struct hnn_training *training, ad_var parameters,
                     ad_var x, ad_var target)
{
    ad_var losses = training->loss(training->loss_context, model, parameters, x, target);
    if (ad_tape_error(x.tape)->status != AD_OK ||
        (ad_rows(losses) == 1 && ad_cols(losses) == ad_cols(x)))
        return losses;
    return ad_refuse(x.tape, AD_E_SHAPE, "the loss is %zu x %zu, expected 1 x %zu: one a sample",
                     ad_rows(losses), ad_cols(losses), ad_cols(x));
}

const struct hnn_objective hnn_learn_own = {false, hnn_state_rows, target_rows, record};

/* Losses of samples picked[first] ..., n of them, recorded together, with the model's parameters.
 */
static enum ad_status losses_of(const hnn_model *model, const struct hnn_training *training,
                                const struct hnn_data *data, size_t first, size_t n,
                                const uint32_t *picked, double *losses, struct ad_error *error)
{
    ad_tape *tape = ad_tape_new(data->type);
    ad_program *program = NULL;
    double *parameters = malloc(model->size * sizeof *parameters);
    if (tape && parameters) {
        ad_var w = ad_input(tape, 1, model->size, "parameters");
        ad_var x = ad_input(tape, data->x_rows, n, "x");
        ad_var target = ad_input(tape, data->target_rows, n, "target");
        ad_var out = ad_mul(1.0, record(model, training, w, x, target));
        hnn_to_double(data->type, model->size, model->parameters, parameters);
        if (ad_compile(tape, 1, &out, &program) == AD_OK) {
            ad_set(program, w, parameters);
            hnn_data_copy(data, picked, first, n, n, ad_data(program, x), ad_data(program, target));
            ad_run(program);
            ad_get(program, out, losses);
        }
        phys_tape_status(tape, error);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    ad_program_free(program);
    ad_tape_free(tape);
    free(parameters);
    return error->status;
}

enum ad_status hnn_own_loss_check(const hnn_model *model, const struct hnn_training *training,
                                  struct hnn_data *data, struct ad_error *error)
{
    const uint32_t picked[] = {0, data->n > 2 ? (uint32_t)(data->n / 2) : 0,
                               data->n > 1 ? (uint32_t)(data->n - 1) : 0};
    enum { N = sizeof picked / sizeof *picked };
    double together[N], alone[N];
    if (!training->loss)
        return AD_OK;
    if (data->samples.end && hnn_data_take(data, N, picked, error) != AD_OK)
        return error->status;
    losses_of(model, training, data, 0, N, picked, together, error);
    for (size_t k = 0; k < N && error->status == AD_OK; k++)
        losses_of(model, training, data, k, 1, picked, alone + k, error);
    if (error->status == AD_OK &&
        !hnn_agree(N, together, alone, data->type == AD_F32 ? 1e-3 : 1e-9))
        ad_fail(error, AD_E_ARGUMENT,
                "the loss of a sample among others is not that of it alone; expected column k to "
                "depend on columns k");
    return error->status;
}
