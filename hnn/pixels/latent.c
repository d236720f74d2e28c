/* Motion in the latent space of a model of pixels (latent.h). */
#include "latent.h"
#include "autodiff/sized.h"
#include "hnn/model/internal.h"

#include <stdlib.h>

enum ad_status hnn_observe(const hnn_model *model, const float *observation, double *x0,
                           struct ad_error *error)
{
    if (AD_LACKS(error, model, observation, x0))
        return error->status;
    size_t pixels = model->settings.pixels;
    double *values = malloc(pixels * sizeof *values + 1);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for an observation");
    hnn_to_double(AD_F32, pixels, observation, values);
    hnn_model_encode(model, 1, values, x0, error);
    free(values);
    return error->status;
}

/* Samples are columns there, and rows here. */
static void transpose_states(const struct hnn_path *path, double *x)
{
    for (size_t i = 0; i < path->n; i++)
        for (size_t k = 0; k < path->states; k++)
            x[k * path->n + i] = path->x[i * path->states + k];
}

enum ad_status hnn_show(const hnn_model *model, const struct hnn_path *path, size_t frame,
                        float *frames, struct ad_error *error)
{
    if (AD_LACKS(error, model, path, frames))
        return error->status;
    size_t n = path->n, pixels = model->settings.pixels;
    if (path->states != hnn_states(model))
        return ad_fail(error, AD_E_ARGUMENT, "a path of %zu components, the model has %zu",
                       path->states, hnn_states(model));
    if (pixels && frame > pixels)
        return ad_fail(error, AD_E_ARGUMENT, "a frame of %zu pixels of an observation of %zu",
                       frame, pixels);
    double *x = calloc((path->states + pixels) * n, sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu frames", n);
    double *seen = x + path->states * n;
    transpose_states(path, x);
    if (hnn_model_decode(model, n, x, seen, error) == AD_OK)
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < frame; k++)
                frames[i * frame + k] = (float)seen[i * pixels + k];
    free(x);
    return error->status;
}

enum ad_status hnn_pixels_predict(hnn_model *model, const float *observation,
                                  const struct hnn_rollout_settings *settings, size_t frame,
                                  struct hnn_path *path, float *frames,
                                  struct hnn_rollout_info *info, struct ad_error *error)
{
    if (path)
        *path = (struct hnn_path){0};
    if (AD_LACKS(error, model, observation, settings, path, frames))
        return error->status;
    AD_OWN(hnn_rollout_settings, settings, reverse, error);
    struct phys_ode ode = {0};
    double *x0 = malloc(hnn_states(model) * sizeof *x0);
    if (!x0)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (hnn_observe(model, observation, x0, error) == AD_OK &&
             hnn_model_ode(model, &ode, error) == AD_OK &&
             hnn_rollout(&ode, settings, x0, path, info, error) == AD_OK &&
             hnn_show(model, path, frame, frames, error) != AD_OK)
        hnn_path_free(path);
    phys_ode_free(&ode);
    free(x0);
    return error->status;
}
