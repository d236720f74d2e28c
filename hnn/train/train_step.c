/* Loss and gradient of one batch: a compiled program that runs block by block of samples
   (autodiff/compile/passes.c). A large batch is cut into blocks of one size, which ranks share;
   their sum has a fixed tree. The samples of a batch of one block are copied to it once, where it
   is all of them. */
#include "train.h"
#include "autodiff/free.h"
#include "autodiff/singular.h"

#include <math.h>
#include <stdlib.h>

/* Samples of a block: of smaller ones the sums would take a hundredth of the time. Frames have
   hundreds of pixels each. Batches of more blocks than MANY have larger ones, for more threads. */
enum { LEAST = 1024, LEAST_FRAMES = 100, MANY = 64, MOST = 4096 };

static void divide(struct hnn_problem *p, bool by_rows)
{
    size_t least = by_rows ? LEAST_FRAMES : LEAST, even = p->batch / MANY;
    size_t size = even < least ? least : even < MOST ? even : MOST;
    p->blocks = p->batch < 2 * size ? 1 : p->batch / size;
    p->block = (p->batch + p->blocks - 1) / p->blocks;
    p->blocks = (p->batch + p->block - 1) / p->block;
}

static void record(struct hnn_problem *p, const hnn_model *model,
                   const struct hnn_training *training)
{
    bool by_rows = hnn_by_rows(model, training);
    p->parameters = ad_input(p->tape, 1, p->n, "parameters");
    p->x = hnn_record_samples(p->tape, by_rows, p->data->x_rows, p->block, "x");
    p->target = hnn_record_samples(p->tape, by_rows, p->data->target_rows, p->block, "target");
    ad_var losses = hnn_record_losses(model, training, p->parameters, p->x, p->target);
    if (p->blocks == 1) {
        p->loss = ad_mean(losses);
    } else {
        p->weights = ad_input(p->tape, 1, p->block, "weights");
        p->loss = ad_sum(ad_mul(p->weights, losses));
    }
    ad_label(p->loss, "loss");
    ad_grad(p->loss, 1, &p->parameters, &p->gradient);
}

/* Samples of block k; beyond the last one that again, of weight 0. */
static void copy_block(const struct hnn_problem *p, size_t k)
{
    size_t first = k * p->block, left = p->batch - first;
    size_t count = left < p->block ? left : p->block;
    hnn_data_copy(p->data, p->drawn, first, count, p->block, ad_data(p->program, p->x),
                  ad_data(p->program, p->target));
    for (size_t i = 0; p->blocks > 1 && i < p->block; i++) {
        double weight = i < count ? 1 / (double)p->batch : 0;
        hnn_from_double(p->type, 1, &weight,
                        (char *)ad_data(p->program, p->weights) + i * hnn_type_bytes(p->type));
    }
}

enum ad_status hnn_problem_new(struct hnn_problem *p, const hnn_model *model,
                               const struct hnn_training *training, const struct hnn_data *data,
                               struct ad_error *failed, struct ad_error *error)
{
    *p = (struct hnn_problem){.type = model->settings.precision,
                              .n = model->size,
                              .batch = training->batch ? training->batch : data->n,
                              .clip = training->clip,
                              .ranks = training->ranks,
                              .failed = failed,
                              .data = data};
    divide(p, hnn_by_rows(model, training));
    p->tape = ad_tape_new(p->type);
    p->sum = malloc((p->n + 1) * sizeof *p->sum);
    if (training->batch)
        p->drawn = malloc(p->batch * sizeof *p->drawn);
    if (!p->tape || !p->sum || (training->batch && !p->drawn))
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", p->batch);
    record(p, model, training);
    ad_compile(p->tape, 2, (ad_var[]){p->loss, p->gradient}, &p->program);
    if (phys_tape_status(p->tape, error) != AD_OK)
        return error->status;
    ad_set_threads(p->program, training->threads ? training->threads : 1);
    if (!p->drawn && p->blocks == 1)
        copy_block(p, 0);
    return AD_OK;
}

void hnn_problem_free(struct hnn_problem *p)
{
    ad_program_free(p->program);
    ad_tape_free(p->tape);
    AD_FREE(p->drawn, p->sum);
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

/* Runs the program on block k; the gradient and the loss to values [n + 1]; NULL: left there. */
static enum ad_status run_block(const struct hnn_problem *p, size_t k, double *values,
                                struct ad_error *error)
{
    if (p->drawn || p->blocks > 1)
        copy_block(p, k);
    ad_run(p->program);
    size_t column = ad_program_singular(p->program), at = k * p->block + column;
    if (column < p->block && at < p->batch)
        return ad_fail(error, AD_E_NONFINITE, "L_vv of training sample %zu is singular",
                       (p->drawn ? p->drawn[at] : at) + 1);
    if (values) {
        hnn_to_double(p->type, p->n, hnn_problem_gradient(p), values);
        ad_get(p->program, p->loss, values + p->n);
    }
    return AD_OK;
}

static enum ad_status add_block(void *context, size_t k, double *values, struct ad_error *error)
{
    return run_block(context, k, values, error);
}

double hnn_problem_evaluate(const struct hnn_problem *p)
{
    struct hnn_problem own = *p; /* for a callback's context, which is not const */
    double *loss = p->sum + p->n;
    if (p->blocks == 1) {
        if (run_block(p, 0, NULL, p->failed) == AD_OK)
            ad_get(p->program, p->loss, loss);
    } else {
        ad_ranks_sum(p->ranks, p->blocks, p->n + 1, add_block, &own, p->sum, p->failed);
        for (size_t k = 0; k < p->n && p->failed->status != AD_OK; k++)
            p->sum[k] = NAN;
        hnn_from_double(p->type, p->n, p->sum, ad_data(p->program, p->gradient));
    }
    if (p->failed->status != AD_OK)
        return NAN;
    if (p->clip > 0)
        clip(p);
    return *loss;
}

double hnn_problem_products(const struct hnn_problem *p)
{
    if (p->drawn || p->blocks > 1)
        copy_block(p, 0);
    return ad_run_timed(p->program);
}
