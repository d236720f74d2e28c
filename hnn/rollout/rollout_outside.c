/* Finds where a motion leaves the states and energies that its model was trained on (rollout.h). */
#include "rollout.h"
#include "hnn/model/internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Excess below this fraction of the range is ignored: H was evaluated at some states only, and
   starts are given with few digits. */
static const double margin = 1.0 / 200;

static bool beyond(double value, double low, double high)
{
    double slack = margin * (high - low);
    return value < low - slack || value > high + slack;
}

/* H first: a motion that leaves its level is no longer the learnt one, wherever its components are.
 */
static bool state_outside(hnn_model *model, const double *x, char *what, size_t size)
{
    const struct hnn_range seen = hnn_model_range(model);
    size_t states = hnn_states(model), rows = hnn_rows(model);
    double energy = hnn_model_energy(model, x);
    char name[32];
    if (beyond(energy, seen.low[rows], seen.high[rows])) {
        snprintf(what, size, "H = %.6g, seen in training: %.6g to %.6g", energy, seen.low[rows],
                 seen.high[rows]);
        return true;
    }
    for (size_t k = 0; k < rows; k++) {
        double value = x[k], turn = 2 * M_PI, middle = 0.5 * (seen.low[k] + seen.high[k]);
        if (k < HNN_ANGLES_MOST && hnn_model_settings(model)->angles >> k & 1)
            value -= turn * round((value - middle) / turn);
        if (beyond(value, seen.low[k], seen.high[k])) {
            if (k < states)
                hnn_model_component(model, k, name, sizeof name);
            else
                hnn_model_input(model, k - states, name, sizeof name);
            snprintf(what, size, "%s = %.6g, seen in training: %.6g to %.6g", name, x[k],
                     seen.low[k], seen.high[k]);
            return true;
        }
    }
    return false;
}

/* x [2n + m] of sample i. */
static enum ad_status enter(const hnn_model *model, const struct hnn_path *path, size_t i,
                            double *x, struct ad_error *error)
{
    memcpy(x, path->x + i * path->states, path->states * sizeof *x);
    return model->settings.inputs ? hnn_model_inputs(model, path->t[i], x + path->states, error)
                                  : AD_OK;
}

size_t hnn_path_outside(hnn_model *model, const struct hnn_path *path, char *what, size_t size)
{
    if (!model || !path)
        return 0;
    if (!hnn_model_range(model).low || path->states != hnn_states(model))
        return path->n;
    double *x = malloc(hnn_rows(model) * sizeof *x);
    struct ad_error unknown = {0};
    size_t i = x ? 0 : path->n;
    while (i < path->n && enter(model, path, i, x, &unknown) == AD_OK &&
           !state_outside(model, x, what, size))
        i++;
    free(x);
    return unknown.status == AD_OK ? i : path->n;
}

enum ad_status hnn_path_mass(const hnn_model *model, const struct hnn_path *path,
                             struct hnn_mass *mass, struct ad_error *error)
{
    if (AD_LACKS(error, model, path, mass))
        return error->status;
    size_t rows = hnn_rows(model), n = path->n;
    double *x = malloc(rows * (n + 1) * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *one = x + rows * n;
    for (size_t i = 0; i < n && enter(model, path, i, one, error) == AD_OK; i++)
        for (size_t r = 0; r < rows; r++)
            x[r * n + i] = one[r];
    if (error->status == AD_OK)
        hnn_model_mass(model, n, x, mass, error);
    free(x);
    return error->status;
}
