/* The autoencoder of a model of pixels: four maps from an observation to its latent state, four
   back, the middle ones with residual links (K. He, X. Zhang, S. Ren, J. Sun, CVPR 2016), as in the
   code published with arXiv 1906.01563:
       h = relu(L1 x); h += relu(L2 h); h += relu(L3 h); z = L4 h. */
#include "internal.h"

#include <string.h>

/* Observations stay rows, one after another as frames lie in memory: a product takes samples either
   way, and nothing is transposed. */
enum order { COLUMNS, ROWS };

static ad_var linear(const hnn_model *model, ad_var parameters, size_t k, ad_var h, enum order in,
                     enum order out)
{
    ad_var weight = hnn_record_block(model, parameters, k);
    ad_var bias = hnn_record_block(model, parameters, k + 1);
    if (out == COLUMNS)
        return ad_add(ad_matmul(weight, false, h, in == ROWS), bias);
    return ad_add(ad_matmul(h, in == COLUMNS, weight, true), ad_reshape(bias, 1, ad_rows(bias)));
}

static ad_var coder(const hnn_model *model, ad_var parameters, size_t k, ad_var x, enum order in,
                    enum order out)
{
    ad_var h = ad_relu(linear(model, parameters, k, x, in, COLUMNS));
    for (size_t layer = 1; layer + 1 < HNN_CODER_LAYERS; layer++)
        h = ad_add(h, ad_relu(linear(model, parameters, k += 2, h, COLUMNS, COLUMNS)));
    return linear(model, parameters, k + 2, h, COLUMNS, out);
}

ad_var hnn_record_encode(const hnn_model *model, ad_var parameters, ad_var pixels)
{
    return ad_label(coder(model, parameters, model->encoder, pixels, ROWS, COLUMNS), "encoder");
}

ad_var hnn_record_decode(const hnn_model *model, ad_var parameters, ad_var x)
{
    return ad_label(coder(model, parameters, model->decoder, x, COLUMNS, ROWS), "decoder");
}

/* One run of either half, in the precision of the parameters. */
static enum ad_status run(const hnn_model *model, bool encode, size_t samples, const double *from,
                          double *to, struct ad_error *error)
{
    enum ad_type type = model->settings.precision;
    if (!model->settings.pixels)
        return ad_fail(error, AD_E_ARGUMENT, "a model of states has no autoencoder");
    if (samples == 0)
        return AD_OK;
    ad_tape *tape = ad_tape_new(type);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_program *program = NULL;
    ad_var parameters = ad_input(tape, 1, model->size, "parameters");
    ad_var x = encode ? ad_input(tape, samples, model->settings.pixels, "pixels")
                      : ad_input(tape, hnn_states(model), samples, "state");
    ad_var y =
        encode ? hnn_record_encode(model, parameters, x) : hnn_record_decode(model, parameters, x);
    ad_compile(tape, 1, &y, &program);
    if (hnn_tape_status(tape, error) == AD_OK) {
        memcpy(ad_data(program, parameters), model->parameters, model->size * hnn_type_bytes(type));
        ad_set(program, x, from);
        ad_run(program);
        ad_get(program, y, to);
    }
    ad_program_free(program);
    ad_tape_free(tape);
    return error->status;
}

enum ad_status hnn_model_encode(const hnn_model *model, size_t samples, const double *pixels,
                                double *x, struct ad_error *error)
{
    return run(model, true, samples, pixels, x, error);
}

enum ad_status hnn_model_decode(const hnn_model *model, size_t samples, const double *x,
                                double *pixels, struct ad_error *error)
{
    return run(model, false, samples, x, pixels, error);
}
