/* The loss on a tape, mean square of what the model says less what was measured; and over all
   samples. */
#include "train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Larger sets are looked at in pieces, so that the activations of all samples need not be held. */
enum { PIECE = 4096 };

size_t hnn_target_rows(const hnn_model *model, const struct hnn_training *training)
{
    return hnn_states(model) * (training->rollout ? training->rollout : 1);
}

static ad_var field_at(const hnn_model *model, ad_var parameters, ad_var x)
{
    return hnn_model_record(model, parameters, x).field;
}

/* One step of the classical Runge-Kutta method. */
static ad_var runge_kutta(const hnn_model *model, ad_var parameters, ad_var x, double dt)
{
    ad_var k1 = field_at(model, parameters, x);
    ad_var k2 = field_at(model, parameters, ad_add(x, ad_mul(dt / 2, k1)));
    ad_var k3 = field_at(model, parameters, ad_add(x, ad_mul(dt / 2, k2)));
    ad_var k4 = field_at(model, parameters, ad_add(x, ad_mul(dt, k3)));
    ad_var middle = ad_mul(2.0, ad_add(k2, k3));
    return ad_add(x, ad_mul(dt / 6, ad_add(ad_add(k1, middle), k4)));
}

/* 1/values as a column. */
static ad_var inverse(ad_tape *tape, size_t n, const double *values)
{
    double *c = malloc(n * sizeof *c);
    if (!c)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        c[k] = 1 / values[k];
    ad_var out = ad_const(tape, n, 1, c);
    free(c);
    return out;
}

ad_var hnn_record_residual(const hnn_model *model, const struct hnn_training *training,
                           ad_var parameters, ad_var x, ad_var target)
{
    size_t m = hnn_states(model), steps = training->rollout;
    const double *units = steps ? model->scaling.scale : model->scaling.rate;
    ad_var residual, at = x;
    if (steps == 0)
        residual = ad_sub(field_at(model, parameters, x), target);
    ad_var *part = steps ? malloc(steps * sizeof *part) : NULL;
    if (steps && !part)
        return ad_refuse(x.tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < steps; k++) {
        at = runge_kutta(model, parameters, at, training->dt);
        part[k] = ad_sub(at, ad_slice_rows(target, k * m, m));
        if (units)
            part[k] = ad_mul(part[k], inverse(x.tape, m, units));
    }
    if (steps)
        residual = ad_concat_rows(steps, part);
    else if (units)
        residual = ad_mul(residual, inverse(x.tape, m, units));
    free(part);
    return residual;
}

/* ---- all samples ---- */

enum ad_status hnn_survey_new(struct hnn_survey *s, const hnn_model *model,
                              const struct hnn_training *training, const struct hnn_data *data,
                              struct ad_error *error)
{
    *s = (struct hnn_survey){.data = data, .piece = data->n < PIECE ? data->n : PIECE};
    if (data->n == 0)
        return AD_OK;
    s->tape = ad_tape_new(data->type);
    if (!s->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s->parameters = ad_input(s->tape, 1, model->size, "parameters");
    s->x = ad_input(s->tape, data->x_rows, s->piece, "x");
    s->target = ad_input(s->tape, data->target_rows, s->piece, "target");
    ad_var residual = hnn_record_residual(model, training, s->parameters, s->x, s->target);
    s->squares = ad_sum_rows(ad_square(residual));
    ad_compile(s->tape, 1, &s->squares, &s->program);
    if (hnn_tape_status(s->tape, error) != AD_OK)
        return error->status;
    ad_set_threads(s->program, training->threads ? training->threads : 1);
    if (s->piece == data->n)
        hnn_data_copy(data, 0, data->n, ad_data(s->program, s->x), ad_data(s->program, s->target));
    return AD_OK;
}

void hnn_survey_free(struct hnn_survey *s)
{
    ad_program_free(s->program);
    ad_tape_free(s->tape);
    *s = (struct hnn_survey){0};
}

/* Sum of the first `count` squares of a piece. */
static double sum_squares(const struct hnn_survey *s, size_t count)
{
    const void *squares = ad_data(s->program, s->squares);
    double sum = 0;
    for (size_t k = 0; k < count; k++)
        sum += s->data->type == AD_F32 ? (double)((const float *)squares)[k]
                                       : ((const double *)squares)[k];
    return sum;
}

double hnn_survey_loss(const struct hnn_survey *s, const void *point, size_t bytes)
{
    const struct hnn_data *data = s->data;
    double sum = 0;
    if (!s->program)
        return NAN;
    memcpy(ad_data(s->program, s->parameters), point, bytes);
    for (size_t first = 0; first < data->n; first += s->piece) {
        size_t count = data->n - first < s->piece ? data->n - first : s->piece;
        if (s->piece < data->n)
            hnn_data_copy(data, first, s->piece, ad_data(s->program, s->x),
                          ad_data(s->program, s->target));
        ad_run(s->program);
        sum += sum_squares(s, count);
    }
    return sum / ((double)data->n * (double)data->target_rows);
}
