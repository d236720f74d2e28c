/* The autoencoder of a model of pixels: four maps from an observation to its latent state, four
   back, the middle ones with residual links (K. He, X. Zhang, S. Ren, J. Sun, CVPR 2016), as in the
   code published with arXiv 1906.01563:
       h = relu(L1 x); h += relu(L2 h); h += relu(L3 h); z = L4 h. */
#include "internal.h"

#include <string.h>

static ad_var linear(const hnn_model *model, ad_var parameters, size_t k, ad_var h)
{
    ad_var z = ad_matmul(hnn_record_block(model, parameters, k), false, h, false);
    return ad_add(z, hnn_record_block(model, parameters, k + 1));
}

static ad_var coder(const hnn_model *model, ad_var parameters, size_t k, ad_var x)
{
    ad_var h = ad_relu(linear(model, parameters, k, x));
    for (size_t layer = 1; layer + 1 < HNN_CODER_LAYERS; layer++)
        h = ad_add(h, ad_relu(linear(model, parameters, k += 2, h)));
    return linear(model, parameters, k + 2, h);
}

ad_var hnn_record_encode(const hnn_model *model, ad_var parameters, ad_var pixels)
{
    return ad_label(coder(model, parameters, model->encoder, pixels), "encoder");
}

ad_var hnn_record_decode(const hnn_model *model, ad_var parameters, ad_var x)
{
    return ad_label(coder(model, parameters, model->decoder, x), "decoder");
}

/* One run of either half, in the precision of the parameters. */
static enum ad_status run(const hnn_model *model, bool encode, size_t samples, const double *from,
                          double *to, struct ad_error *error)
{
    enum ad_type type = model->settings.precision;
    size_t rows = encode ? model->settings.pixels : hnn_states(model);
    if (!model->settings.pixels)
        return ad_fail(error, AD_E_ARGUMENT, "a model of states has no autoencoder");
    if (samples == 0)
        return AD_OK;
    ad_tape *tape = ad_tape_new(type);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_program *program = NULL;
    ad_var parameters = ad_input(tape, 1, model->size, "parameters");
    ad_var x = ad_input(tape, rows, samples, "x");
    ad_var y = coder(model, parameters, encode ? model->encoder : model->decoder, x);
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
