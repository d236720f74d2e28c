/* Follows the steps of a SympNet (rollout.h). */
#include "autodiff/clock.h"
#include "autodiff/sized.h"
#include "hnn/model/internal.h"
#include "rollout.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Outputs are whole steps apart, to the digits that times are printed with. */
static const double whole = 1e-4;

struct map {
    ad_tape *tape;
    ad_var x[2]; /* input of the step on, and of the one back */
    ad_var out[2];
    ad_program *program[2];
};

static enum ad_status compile(const hnn_model *model, double dt, struct map *m,
                              struct ad_error *error)
{
    double *values = malloc(model->size * sizeof *values);
    m->tape = ad_tape_new(AD_F64);
    if (values && m->tape) {
        hnn_to_double(model->settings.precision, model->size, model->parameters, values);
        ad_var w = ad_const(m->tape, 1, model->size, values), h = ad_const(m->tape, 1, 1, &dt);
        for (int back = 0; back < 2; back++) {
            m->x[back] = ad_input(m->tape, hnn_states(model), 1, "x");
            m->out[back] = hnn_record_map(model, w, m->x[back], h, back);
            ad_compile(m->tape, 1, &m->out[back], &m->program[back]);
        }
        phys_tape_status(m->tape, error);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    free(values);
    return error->status;
}

static enum ad_status step(const struct map *m, bool back, size_t times, size_t n, double *y,
                           struct ad_error *error)
{
    for (size_t k = 0; k < times; k++) {
        ad_set(m->program[back], m->x[back], y);
        ad_run(m->program[back]);
        ad_get(m->program[back], m->out[back], y);
    }
    for (size_t k = 0; k < n; k++)
        if (!isfinite(y[k]))
            return ad_fail(error, AD_E_NONFINITE, "component %zu of the state is %g", k + 1, y[k]);
    return AD_OK;
}

static enum ad_status follow(const struct map *m, const struct hnn_rollout_settings *s,
                             const double *x0, struct hnn_path *path, struct hnn_rollout_info *info,
                             struct ad_error *error)
{
    size_t states = path->states;
    double *y = malloc(states * sizeof *y), square = 0;
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(y, x0, states * sizeof *y);
    for (size_t i = 0; i < s->n && error->status == AD_OK; i++) {
        double steps = i ? (s->t[i] - s->t[i - 1]) / s->dt : 0;
        if (!(fabs(steps - round(steps)) <= whole) || (i && !(steps > 0.5 && steps < 1e9)))
            ad_fail(
                error, AD_E_ARGUMENT,
                "a sympnet moves in steps of %.9g: expected outputs that are whole steps apart, "
                "got t = %.9g and then %.9g",
                s->dt, s->t[i ? i - 1 : 0], s->t[i]);
        else if (step(m, false, (size_t)round(steps), states, y, error) == AD_OK)
            memcpy(path->x + i * states, y, states * sizeof *y);
        info->evaluations += error->status == AD_OK ? (size_t)round(steps) : 0;
    }
    if (error->status == AD_OK && s->reverse &&
        step(m, true, info->evaluations, states, y, error) == AD_OK) {
        for (size_t k = 0; k < states; k++)
            square += (y[k] - x0[k]) * (y[k] - x0[k]);
        info->reversal_error = sqrt(square);
    }
    free(y);
    return error->status;
}

enum ad_status hnn_map_rollout(const hnn_model *model, const struct hnn_rollout_settings *settings,
                               const double *x0, struct hnn_path *path,
                               struct hnn_rollout_info *info, struct ad_error *error)
{
    struct hnn_rollout_info unused = {0};
    struct map map = {0};
    info = info ? info : &unused;
    if (path)
        *path = (struct hnn_path){0};
    if (AD_LACKS(error, model, settings, x0, path))
        return error->status;
    AD_OWN(hnn_rollout_settings, settings, reverse, error);
    *info = (struct hnn_rollout_info){.reversal_error = NAN};
    if (settings->n == 0 || AD_LACKS(error, settings->t) || settings->add != 0 ||
        !(settings->dt > 0 && isfinite(settings->dt)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "a sympnet needs outputs and a step dt, and takes no added energy");
    *path = (struct hnn_path){.states = hnn_states(model), .n = settings->n};
    path->t = malloc(path->n * sizeof *path->t);
    path->x = malloc(path->states * path->n * sizeof *path->x);
    double began = ad_now();
    if (!path->t || !path->x)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu outputs", path->n);
    else if (compile(model, settings->dt, &map, error) == AD_OK)
        follow(&map, settings, x0, path, info, error);
    info->seconds = ad_now() - began;
    if (error->status == AD_OK)
        memcpy(path->t, settings->t, path->n * sizeof *path->t);
    else
        hnn_path_free(path);
    ad_program_free(map.program[0]);
    ad_program_free(map.program[1]);
    ad_tape_free(map.tape);
    return error->status;
}
