/* The objective of models of pixels, trained jointly (S. Greydanus et al., arXiv 1906.01563,
   section 5, as in the published code): with z = encode(x), z' = encode(x') one frame later, and z
   = (q, p),
       mean (x - decode(z))^2 + mean (p - (q' - q))^2 + 0.1 mean (z' - z - f(z))^2,
   each a mean over its own components. The first term trains the autoencoder. The second makes p
   the velocity of q in units of a frame; without it coordinates and momenta could not be told
   apart. The third is one explicit Euler step of the field f. */
#include "train.h"

static const double field_weight = 0.1;

/* The encoder's inputs: an observation and the next one, which begins a frame later. */
static size_t seen_twice(const hnn_model *model, const struct hnn_training *training)
{
    (void)training;
    return model->seen + model->shift;
}

static size_t pixels(const hnn_model *model, const struct hnn_training *training)
{
    (void)training;
    return model->settings.pixels;
}

/* weight * mean over components of the squares, [1 x samples]. */
static ad_var term(double weight, ad_var residual)
{
    return ad_mul(weight / (double)ad_rows(residual), ad_sum_rows(ad_square(residual)));
}

static ad_var record(const hnn_model *model, const struct hnn_training *training, ad_var parameters,
                     ad_var seen, ad_var x)
{
    (void)training;
    size_t n = model->settings.dof, samples = ad_rows(x);
    ad_var now = ad_slice_cols(seen, 0, model->seen);
    ad_var next = ad_slice_cols(seen, ad_cols(seen) - model->seen, model->seen);
    ad_var both = hnn_record_encode_all(model, parameters, 2, (ad_var[]){now, next});
    ad_var z = ad_slice_cols(both, 0, samples), z_next = ad_slice_cols(both, samples, samples);
    ad_var step = ad_sub(z_next, z);
    ad_var missed = ad_square(ad_sub(hnn_record_decode(model, parameters, z), x));
    ad_var shown = ad_mul(1 / (double)ad_cols(x), ad_reshape(ad_sum_cols(missed), 1, samples));
    ad_var canonical = term(1, ad_sub(ad_slice_rows(z, n, n), ad_slice_rows(step, 0, n)));
    ad_var field = hnn_model_record(model, parameters, z).field;
    ad_var moved = term(field_weight, ad_sub(step, field));
    return ad_label(ad_add(ad_add(shown, canonical), moved), "loss of pixels");
}

const struct hnn_objective hnn_learn_pixels = {true, seen_twice, pixels, record};
