/* The range of states and energies in training; a network extrapolates beyond it. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

static void widen(const double *values, size_t n, double *low, double *high)
{
    for (size_t i = 0; i < n; i++) {
        *low = fmin(*low, values[i]);
        *high = fmax(*high, values[i]);
    }
}

enum ad_status hnn_range_states(hnn_model *model, size_t n, size_t steps, const double *x,
                                struct ad_error *error)
{
    size_t states = hnn_rows(model), width = states + 1, inputs = model->settings.inputs;
    if (!model->range && !(model->range = malloc(2 * width * sizeof *model->range)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *low = model->range, *high = low + width;
    for (size_t k = 0; k < states; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        for (size_t j = 0; j == 0 || (j <= steps && k >= states - inputs); j++)
            widen(x + (k + j * inputs) * n, n, &low[k], &high[k]);
    }
    low[states] = high[states] = NAN;
    return AD_OK;
}

enum ad_status hnn_range_energy(hnn_model *model, size_t n, const double *x, struct ad_error *error)
{
    if (model->settings.kind == HNN_SYMPNET) /* no H */
        return AD_OK;
    size_t states = hnn_rows(model), few = n < HNN_RANGE_ENERGIES ? n : HNN_RANGE_ENERGIES,
           stride = n / few;
    double *some = malloc((states + 1) * few * sizeof *some), *low = model->range + states;
    if (!some)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *energy = some + states * few, *high = low + states + 1;
    for (size_t k = 0; k < states; k++)
        for (size_t i = 0; i < few; i++)
            some[k * few + i] = x[k * n + i * stride];
    if (hnn_model_evaluate(model, few, some, NULL, energy, error) == AD_OK) {
        *low = INFINITY;
        *high = -INFINITY;
        widen(energy, few, low, high);
    }
    free(some);
    return error->status;
}

enum ad_status hnn_model_see(hnn_model *model, size_t n, const double *x, struct ad_error *error)
{
    if (AD_LACKS(error, model, x))
        return error->status;
    if (n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "what a model has seen: expected states, got none");
    if (hnn_range_states(model, n, 0, x, error) == AD_OK)
        hnn_range_energy(model, n, x, error);
    return error->status;
}

struct hnn_range hnn_model_range(const hnn_model *model)
{
    if (!model)
        return (struct hnn_range){NULL, NULL};
    size_t width = hnn_rows(model) + 1;
    return (struct hnn_range){model->range, model->range ? model->range + width : NULL};
}
