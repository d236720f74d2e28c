/* The autoencoder of a model of pixels: four maps from an observation to its latent state, four
   back, the middle ones with residual links (K. He, X. Zhang, S. Ren, J. Sun, CVPR 2016), as in the
   code published with arXiv 1906.01563:
       h = relu(L1 x); h += relu(L2 h); h += relu(L3 h); z = L4 h. */
#include "internal.h"

#include <math.h>
#include <string.h>

/* Observations stay rows, one after another as frames lie in memory: a product takes samples either
   way, and nothing is transposed. */
enum order { COLUMNS, ROWS };

static ad_var linear(const hnn_model *model, ad_var parameters, size_t k, ad_var h, enum order out)
{
    ad_var weight = hnn_record_block(model, parameters, k);
    ad_var bias = hnn_record_block(model, parameters, k + 1);
    if (out == COLUMNS)
        return ad_add(ad_matmul(weight, false, h, false), bias);
    return ad_add(ad_matmul(h, true, weight, true), ad_reshape(bias, 1, ad_rows(bias)));
}

/* The first map's relu and the maps after it. */
static ad_var coder(const hnn_model *model, ad_var parameters, size_t k, ad_var h, enum order out)
{
    h = ad_relu(h);
    for (size_t layer = 1; layer + 1 < HNN_CODER_LAYERS; layer++)
        h = ad_add(h, ad_relu(linear(model, parameters, k += 2, h, COLUMNS)));
    return linear(model, parameters, k + 2, h, out);
}

/* Products with the first weight stand apart, so that no observation is copied; all behind it sees
   one wide matrix. Each parameter is then cut out once, and its gradient computed where it goes. */
ad_var hnn_record_encode_all(const hnn_model *model, ad_var parameters, size_t n,
                             const ad_var pixels[])
{
    size_t k = model->encoder;
    ad_var weight = hnn_record_block(model, parameters, k), h[HNN_ENCODE_MOST];
    for (size_t i = 0; i < n; i++)
        h[i] = ad_matmul(weight, false, pixels[i], true);
    ad_var first = ad_add(ad_concat_cols(n, h), hnn_record_block(model, parameters, k + 1));
    return ad_label(coder(model, parameters, k, first, COLUMNS), "encoder");
}

/* The checks of hnn_model_record. */
static bool fits(const hnn_model *model, ad_var parameters, size_t found, bool encodes)
{
    size_t expected = !model ? 0 : encodes ? model->settings.pixels : hnn_states(model);
    return model && model->settings.pixels && ad_cols(parameters) == model->size &&
           found == expected;
}

static ad_var refuse(ad_var x)
{
    return x.tape ? ad_refuse(x.tape, AD_E_SHAPE, "no autoencoder of these parameters and values")
                  : x;
}

ad_var hnn_record_encode(const hnn_model *model, ad_var parameters, ad_var pixels)
{
    if (!fits(model, parameters, ad_cols(pixels), true))
        return refuse(pixels);
    return hnn_record_encode_all(model, parameters, 1, &pixels);
}

ad_var hnn_record_decode(const hnn_model *model, ad_var parameters, ad_var x)
{
    if (!fits(model, parameters, ad_rows(x), false))
        return refuse(x);
    ad_var first = linear(model, parameters, model->decoder, x, COLUMNS);
    return ad_label(coder(model, parameters, model->decoder, first, ROWS), "decoder");
}

/* One run of either half, in the precision of the parameters. */
static enum ad_status run(const hnn_model *model, bool encode, size_t samples, const double *from,
                          double *to, struct ad_error *error)
{
    enum ad_type type = model->settings.precision;
    if (!model->settings.pixels)
        return ad_fail(error, AD_E_ARGUMENT, "a model of states has no autoencoder");
    size_t size = encode ? model->settings.pixels : hnn_states(model);
    for (size_t k = 0; k < size * samples; k++)
        if (!isfinite(from[k]))
            return ad_fail(error, AD_E_NONFINITE,
                           "%s %zu of sample %zu is %g, expected a finite number",
                           encode ? "pixel" : "state", encode ? k % size : k / samples,
                           encode ? k / size : k % samples, from[k]);
    if (samples == 0)
        return AD_OK;
    ad_tape *tape = ad_tape_new(type);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_program *program = NULL;
    ad_var parameters = ad_input(tape, 1, model->size, "parameters");
    ad_var x =
        encode ? ad_input(tape, samples, size, "pixels") : ad_input(tape, size, samples, "state");
    ad_var y =
        encode ? hnn_record_encode(model, parameters, x) : hnn_record_decode(model, parameters, x);
    ad_compile(tape, 1, &y, &program);
    if (phys_tape_status(tape, error) == AD_OK) {
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
    if (AD_LACKS(error, model, pixels, x))
        return error->status;
    return run(model, true, samples, pixels, x, error);
}

enum ad_status hnn_model_decode(const hnn_model *model, size_t samples, const double *x,
                                double *pixels, struct ad_error *error)
{
    if (AD_LACKS(error, model, x, pixels))
        return error->status;
    return run(model, false, samples, x, pixels, error);
}
