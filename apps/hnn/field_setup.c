/* Sets up the grid of `leastaction field` and evaluates the model on it (field.h). */
#include "autodiff/free.h"
#include "field.h"
#include "apps/option_values.h"

#include <math.h>
#include <stdlib.h>

static enum ad_status choose_axes(const struct field_options *o, struct field *f,
                                  struct ad_error *error)
{
    double axes[2] = {1, (double)(f->states / 2 + 1)};
    const char *what = "two different components of the state, counted from 1";
    if (o->axes && numbers_read("axes", o->axes, 2, what, axes, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < 2; k++)
        if (!(axes[k] >= 1 && axes[k] <= (double)f->states) || axes[k] != floor(axes[k]))
            return ad_fail(error, AD_E_ARGUMENT, "--axes %s: expected %s, up to %zu", o->axes, what,
                           f->states);
    if (axes[0] == axes[1])
        return ad_fail(error, AD_E_ARGUMENT, "--axes %s: expected %s", o->axes, what);
    f->plane.across = (size_t)axes[0] - 1;
    f->plane.up = (size_t)axes[1] - 1;
    return AD_OK;
}

static enum ad_status choose_range(const char *option, const char *text, const struct field *f,
                                   size_t component, struct range *range, struct ad_error *error)
{
    const struct hnn_range seen = hnn_model_range(f->model);
    double ends[2];
    if (text) {
        if (numbers_read(option, text, 2, "the ends of a range", ends, error) == AD_OK &&
            !(ends[0] < ends[1]))
            ad_fail(error, AD_E_ARGUMENT, "--%s %s: expected the smaller end first", option, text);
        *range = (struct range){ends[0], ends[1]};
    } else if (seen.low && seen.low[component] < seen.high[component]) {
        *range = (struct range){seen.low[component], seen.high[component]};
    } else {
        ad_fail(error, AD_E_ARGUMENT, "missing --%s A,B: the model has no range of training",
                option);
    }
    return error->status;
}

static enum ad_status choose_at(const struct field_options *o, struct field *f,
                                struct ad_error *error)
{
    const struct hnn_range seen = hnn_model_range(f->model);
    f->plane.at = f->at = calloc(f->states, sizeof *f->at);
    if (!f->at)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < f->states && seen.low; k++)
        f->at[k] = 0.5 * (seen.low[k] + seen.high[k]);
    return o->at ? numbers_read("at", o->at, f->states, "a state", f->at, error) : AD_OK;
}

static enum ad_status choose(const struct field_options *o, struct field *f, struct ad_error *error)
{
    if (o->grid < 2 || o->grid > 4096)
        return ad_fail(error, AD_E_ARGUMENT, "--grid %zu: expected 2 to 4096", o->grid);
    if (hnn_model_load(o->common.argument[0], &f->model, error) != AD_OK)
        return error->status;
    if (hnn_model_settings(f->model)->inputs)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: a field of states alone is drawn, its own has inputs, too; try "
                       "leastaction rollout",
                       o->common.argument[0]);
    if (hnn_model_ode(f->model, &f->ode, error) != AD_OK)
        return error->status;
    f->states = f->ode.n;
    f->n = o->grid;
    f->samples = f->n * f->n;
    if (choose_axes(o, f, error) == AD_OK &&
        choose_range("across", o->across, f, f->plane.across, &f->plane.x, error) == AD_OK &&
        choose_range("up", o->up, f, f->plane.up, &f->plane.y, error) == AD_OK)
        choose_at(o, f, error);
    return error->status;
}

/* Columns are points, a row of the grid after the other. */
static enum ad_status evaluate(struct field *f, struct ad_error *error)
{
    size_t states = f->states, samples = f->samples;
    f->x = malloc(((2 * states + 1) * samples + states) * sizeof *f->x);
    if (!f->x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", samples);
    f->rate = f->x + states * samples;
    f->H = f->rate + states * samples;
    double *state = f->H + samples;
    for (size_t i = 0; i < samples; i++) {
        field_state(&f->plane, states, f->n, i % f->n, i / f->n, state);
        for (size_t k = 0; k < states; k++)
            f->x[k * samples + i] = state[k];
    }
    return hnn_model_evaluate(f->model, samples, f->x, f->rate, f->H, error);
}

enum ad_status field_setup(const struct field_options *options, struct field *field,
                           struct ad_error *error)
{
    *field = (struct field){0};
    return choose(options, field, error) == AD_OK ? evaluate(field, error) : error->status;
}

void field_free(struct field *f)
{
    AD_FREE(f->x, f->at);
    phys_ode_free(&f->ode);
    hnn_model_free(f->model);
}
