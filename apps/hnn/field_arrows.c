/* Vector fields of models in pictures (field.h). */
#include "field.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double between(struct range range, double share)
{
    return range.low + share * (range.high - range.low);
}

void field_state(const struct field_plane *plane, size_t states, size_t n, size_t i, size_t j,
                 double *state)
{
    memcpy(state, plane->at, states * sizeof *state);
    state[plane->across] = between(plane->x, (double)i / (double)(n - 1));
    state[plane->up] = between(plane->y, (double)j / (double)(n - 1));
}

/* In units of the picture, because the axes have different units and ranges. */
static double length(const struct field_plane *plane, const double *rate)
{
    return hypot(rate[plane->across] / (plane->x.high - plane->x.low),
                 rate[plane->up] / (plane->y.high - plane->y.low));
}

enum ad_status field_arrows(hnn_model *model, const struct field_plane *plane, size_t n, FILE *out,
                            struct ad_error *error)
{
    const struct hnn_settings *s = hnn_model_settings(model);
    size_t states = 2 * s->dof, rows = states + s->inputs;
    double *rate = malloc((n * n * states + rows) * sizeof *rate), longest = 0;
    if (!rate)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *state = rate + n * n * states;
    struct field_plane inside = *plane; /* half a cell from the edges */
    inside.x = range_with_margins(plane->x, -0.5 / (double)n, -0.5 / (double)n);
    inside.y = range_with_margins(plane->y, -0.5 / (double)n, -0.5 / (double)n);
    for (size_t k = 0; k < n * n && error->status == AD_OK; k++) {
        field_state(&inside, rows, n, k % n, k / n, state);
        if (hnn_model_field(model, state, rate + k * states) != AD_OK)
            ad_fail(error, AD_E_MEMORY, "out of memory");
        longest = fmax(longest, length(plane, rate + k * states));
    }
    double scale = longest > 0 ? 0.95 / (double)n / longest : 0;
    for (size_t k = 0; k < n * n && error->status == AD_OK; k++) {
        const double *r = rate + k * states;
        field_state(&inside, rows, n, k % n, k / n, state);
        fprintf(out, "%.6g %.6g %.6g %.6g %.6g\n", state[plane->across], state[plane->up],
                scale * r[plane->across], scale * r[plane->up],
                hypot(r[plane->across], r[plane->up]));
    }
    free(rate);
    return error->status;
}
