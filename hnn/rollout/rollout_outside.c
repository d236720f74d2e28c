/* Finds where a motion leaves the states and energies that its model was trained on (rollout.h). */
#include "rollout.h"
#include "hnn/model/internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

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
static bool state_outside(const hnn_model *model, const double *y, double energy, char *what,
                          size_t size)
{
    const struct hnn_range seen = hnn_model_range(model);
    size_t states = 2 * hnn_model_settings(model)->dof;
    char name[32];
    if (beyond(energy, seen.low[states], seen.high[states])) {
        snprintf(what, size, "H = %.6g, seen in training: %.6g to %.6g", energy, seen.low[states],
                 seen.high[states]);
        return true;
    }
    for (size_t k = 0; k < states; k++) {
        double value = y[k], turn = 2 * M_PI, middle = 0.5 * (seen.low[k] + seen.high[k]);
        if (k < HNN_ANGLES_MOST && hnn_model_settings(model)->angles >> k & 1)
            value -= turn * round((value - middle) / turn);
        if (beyond(value, seen.low[k], seen.high[k])) {
            hnn_model_component(model, k, name, sizeof name);
            snprintf(what, size, "%s = %.6g, seen in training: %.6g to %.6g", name, y[k],
                     seen.low[k], seen.high[k]);
            return true;
        }
    }
    return false;
}

size_t hnn_path_outside(hnn_model *model, const struct hnn_path *path, char *what, size_t size)
{
    if (!model || !path)
        return 0;
    size_t i = hnn_model_range(model).low && path->states == 2 * hnn_model_settings(model)->dof
                   ? 0
                   : path->n;
    for (; i < path->n; i++) {
        const double *y = path->x + i * path->states;
        if (state_outside(model, y, hnn_model_energy(model, y), what, size))
            break;
    }
    return i;
}

enum ad_status hnn_path_mass(const hnn_model *model, const struct hnn_path *path,
                             struct hnn_mass *mass, struct ad_error *error)
{
    if (AD_LACKS(error, model, path, mass))
        return error->status;
    size_t states = path->states, n = path->n;
    double *x = malloc(states * n * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t i = 0; i < n; i++)
        for (size_t r = 0; r < states; r++)
            x[r * n + i] = path->x[i * states + r];
    hnn_model_mass(model, n, x, mass, error);
    free(x);
    return error->status;
}
