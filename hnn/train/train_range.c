/* The latent range of a model of pixels: the encoded observations at the end of training. */
#include "autodiff/free.h"
#include "train.h"

#include <stdlib.h>

enum { OBSERVATIONS = 2048, PIECE = 256 }; /* at most, evenly among them; encoded at once */

enum ad_status hnn_range_latents(hnn_trainer *t, struct ad_error *error)
{
    struct hnn_data *d = &t->train;
    size_t pixels = t->model->settings.pixels, states = hnn_states(t->model);
    size_t stride = (d->n + OBSERVATIONS - 1) / OBSERVATIONS, n = (d->n + stride - 1) / stride;
    double *seen = malloc(PIECE * (pixels + states) * sizeof *seen);
    double *x = malloc(states * n * sizeof *x);
    uint32_t picked[PIECE];
    if (!seen || !x)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu latent states", n);
    for (size_t first = 0; first < n && error->status == AD_OK; first += PIECE) {
        size_t count = n - first < PIECE ? n - first : PIECE;
        double *latent = seen + PIECE * pixels;
        for (size_t k = 0; k < count; k++)
            picked[k] = (uint32_t)((first + k) * stride);
        if (d->samples.end && hnn_data_take(d, count, picked, error) != AD_OK)
            break;
        for (size_t k = 0; k < count; k++)
            for (size_t j = 0; j < pixels; j++)
                seen[k * pixels + j] = (double)hnn_data_window(d, picked, k)[j];
        if (hnn_model_encode(t->model, count, seen, latent, error) == AD_OK)
            for (size_t i = 0; i < count; i++)
                for (size_t k = 0; k < states; k++)
                    x[k * n + first + i] = latent[k * count + i];
    }
    if (error->status == AD_OK)
        hnn_model_see(t->model, n, x, error);
    AD_FREE(seen, x);
    return error->status;
}
