/* Loss and gradient of one batch: a compiled program that runs block by block of samples
   (autodiff/compile/passes.c). Samples that are drawn are copied to it; all of them once. */
#include "train.h"
#include "autodiff/singular.h"

#include <math.h>
#include <stdlib.h>

static void record(struct hnn_problem *p, const hnn_model *model,
                   const struct hnn_training *training)
{
    bool by_rows = hnn_by_rows(model, training);
    p->parameters = ad_input(p->tape, 1, p->n, "parameters");
    p->x = hnn_record_samples(p->tape, by_rows, p->data->x_rows, p->batch, "x");
    p->target = hnn_record_samples(p->tape, by_rows, p->data->target_rows, p->batch, "target");
    p->loss = ad_label(ad_mean(hnn_record_losses(model, training, p->parameters, p->x, p->target)),
                       "loss");
    ad_grad(p->loss, 1, &p->parameters, &p->gradient);
}

static void copy_samples(const struct hnn_problem *p)
{
    hnn_data_copy(p->data, p->drawn, 0, p->batch, p->batch, ad_data(p->program, p->x),
                  ad_data(p->program, p->target));
}

enum ad_status hnn_problem_new(struct hnn_problem *p, const hnn_model *model,
                               const struct hnn_training *training, const struct hnn_data *data,
                               struct ad_error *error)
{
    size_t batch = training->batch ? training->batch : data->n;
    *p = (struct hnn_problem){.type = model->settings.precision,
                              .n = model->size,
                              .batch = batch,
                              .clip = training->clip,
                              .data = data};
    p->tape = ad_tape_new(p->type);
    if (training->batch)
        p->drawn = malloc(batch * sizeof *p->drawn);
    if (!p->tape || (training->batch && !p->drawn))
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", batch);
    record(p, model, training);
    ad_compile(p->tape, 2, (ad_var[]){p->loss, p->gradient}, &p->program);
    if (hnn_tape_status(p->tape, error) != AD_OK)
        return error->status;
    ad_set_threads(p->program, training->threads ? training->threads : 1);
    if (!p->drawn)
        copy_samples(p);
    return AD_OK;
}

void hnn_problem_free(struct hnn_problem *p)
{
    ad_program_free(p->program);
    ad_tape_free(p->tape);
    free(p->drawn);
    *p = (struct hnn_problem){0};
}

void *hnn_problem_point(const struct hnn_problem *p) { return ad_data(p->program, p->parameters); }

const void *hnn_problem_gradient(const struct hnn_problem *p)
{
    return ad_data(p->program, p->gradient);
}

/* A norm that is not finite stays, for the error that names the step. */
static void clip(const struct hnn_problem *p)
{
    double *g64 = ad_data(p->program, p->gradient), square = 0;
    float *g32 = ad_data(p->program, p->gradient);
    for (size_t k = 0; k < p->n; k++)
        square += p->type == AD_F32 ? (double)g32[k] * (double)g32[k] : g64[k] * g64[k];
    const double factor = p->clip / sqrt(square);
    if (!(factor < 1) || !isfinite(square))
        return;
    for (size_t k = 0; k < p->n; k++)
        if (p->type == AD_F32)
            g32[k] = (float)(factor * (double)g32[k]);
        else
            g64[k] *= factor;
}

double hnn_problem_evaluate(const struct hnn_problem *p)
{
    double loss;
    if (p->drawn)
        copy_samples(p);
    ad_run(p->program);
    ad_get(p->program, p->loss, &loss);
    if (p->clip > 0)
        clip(p);
    return loss;
}

size_t hnn_problem_singular(const struct hnn_problem *p)
{
    size_t column = ad_program_singular(p->program);
    return column >= p->batch ? p->data->n : p->drawn ? p->drawn[column] : column;
}

double hnn_problem_products(const struct hnn_problem *p)
{
    if (p->drawn)
        copy_samples(p);
    return ad_run_timed(p->program);
}
