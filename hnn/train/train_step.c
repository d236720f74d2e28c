/* Loss and gradient of one batch, in blocks of columns: one recording, compiled, run block after
   block. A block's data stay in the second-level cache from the forward to the end of the backward
   pass, where whole batches would go through memory for every operation; threads share out the
   blocks. The last block may be padded by samples of weight 0. Blocks are cut and summed in the
   same way whatever the number of threads. */
#include "train.h"

#include <stdlib.h>
#include <string.h>

/* Of a block at most, measured with 200 units: the values then stay in a cache of 1 MB. Fewer, or
   widths that are not whole vectors, make the products slow. Batches up to WHOLE are not worth
   cutting. */
enum { COLUMNS = 192, VECTOR = 16, WHOLE = 256 };

static void record(struct hnn_problem *p, const hnn_model *model,
                   const struct hnn_training *training)
{
    struct hnn_block_program *b = &p->block;
    b->parameters = ad_input(b->tape, 1, p->n, "parameters");
    b->x = hnn_record_samples(b->tape, p->by_rows, p->x_rows, b->columns, "x");
    b->target = hnn_record_samples(b->tape, p->by_rows, p->target_rows, b->columns, "target");
    b->weight = ad_input(b->tape, 1, b->columns, "weight");
    ad_var losses = hnn_record_losses(model, training, b->parameters, b->x, b->target);
    b->loss = ad_label(ad_dot(b->weight, losses), "loss");
    ad_grad(b->loss, 1, &b->parameters, &b->gradient);
}

/* One recording, and `workers` programs of it. */
static enum ad_status make(struct hnn_problem *p, size_t columns, size_t workers,
                           const hnn_model *model, const struct hnn_training *training,
                           struct ad_error *error)
{
    struct hnn_block_program *b = &p->block;
    b->columns = columns;
    b->tape = ad_tape_new(p->type);
    b->program = calloc(workers, sizeof *b->program);
    if (!b->tape || !b->program)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", p->batch);
    record(p, model, training);
    for (; b->workers < workers; b->workers++)
        if (ad_compile(b->tape, 2, (ad_var[]){b->loss, b->gradient}, &b->program[b->workers]) !=
            AD_OK)
            break;
    return hnn_tape_status(b->tape, error);
}

static bool allocate(struct hnn_problem *p, size_t columns)
{
    size_t bytes = hnn_type_bytes(p->type);
    const double share = 1 / (double)p->batch;
    if (!(p->weight = calloc(p->blocks * columns, bytes)))
        return false;
    for (size_t k = 0; k < p->batch; k++)
        hnn_from_double(p->type, 1, &share, (char *)p->weight + k * bytes);
    if (p->blocks == 1)
        return true;
    p->gradient = calloc(p->n, bytes);
    p->x = calloc(p->x_rows * p->batch, bytes);
    p->target = calloc(p->target_rows * p->batch, bytes);
    return p->gradient && p->x && p->target;
}

enum ad_status hnn_problem_new(struct hnn_problem *p, const hnn_model *model,
                               const struct hnn_training *training, size_t batch,
                               struct ad_error *error)
{
    size_t threads = training->threads ? training->threads : 1;
    size_t blocks = batch <= WHOLE ? 1 : (batch + COLUMNS - 1) / COLUMNS, columns = batch;
    if (blocks > 1)
        columns = ((batch + blocks - 1) / blocks + VECTOR - 1) / VECTOR * VECTOR;
    *p = (struct hnn_problem){.type = model->settings.precision,
                              .n = model->size,
                              .batch = batch,
                              .blocks = blocks,
                              .by_rows = hnn_by_rows(model, training),
                              .x_rows = hnn_x_rows(model, training),
                              .target_rows = hnn_target_rows(model, training)};
    size_t workers = threads < blocks ? threads : blocks;
    if (!allocate(p, columns))
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", batch);
    if (make(p, columns, workers, model, training, error) != AD_OK)
        return error->status;
    if (blocks == 1) {
        p->x = ad_data(p->block.program[0], p->block.x);
        p->target = ad_data(p->block.program[0], p->block.target);
        p->gradient = ad_data(p->block.program[0], p->block.gradient);
        ad_set_threads(p->block.program[0], threads);
    }
    return AD_OK;
}

static void release(struct hnn_block_program *b)
{
    for (size_t k = 0; k < b->workers; k++)
        ad_program_free(b->program[k]);
    free(b->program);
    ad_tape_free(b->tape);
}

void hnn_problem_free(struct hnn_problem *p)
{
    release(&p->block);
    free(p->weight);
    if (p->blocks > 1) {
        free(p->x);
        free(p->target);
        free(p->gradient);
    }
    *p = (struct hnn_problem){0};
}

void *hnn_problem_point(const struct hnn_problem *p)
{
    return ad_data(p->block.program[0], p->block.parameters);
}

const void *hnn_problem_gradient(const struct hnn_problem *p) { return p->gradient; }

/* Samples first ... of a [rows x batch] matrix, or of one by rows, to a block. */
static void copy_samples(const struct hnn_problem *p, size_t rows, const void *from, size_t first,
                         void *to)
{
    size_t bytes = hnn_type_bytes(p->type), columns = p->block.columns;
    size_t count = p->batch - first < columns ? p->batch - first : columns;
    if (p->by_rows)
        memcpy(to, (const char *)from + first * rows * bytes, count * rows * bytes);
    for (size_t r = 0; r < rows && !p->by_rows; r++)
        memcpy((char *)to + r * columns * bytes,
               (const char *)from + (r * p->batch + first) * bytes, count * bytes);
}

static void run_block(const struct hnn_problem *p, ad_program *program, size_t first,
                      double *products)
{
    const struct hnn_block_program *b = &p->block;
    const size_t bytes = hnn_type_bytes(p->type);
    void *parameters = ad_data(program, b->parameters);
    const void *point = hnn_problem_point(p);
    if (parameters != point)
        memcpy(parameters, point, p->n * bytes);
    if (p->blocks > 1) {
        copy_samples(p, p->x_rows, p->x, first, ad_data(program, b->x));
        copy_samples(p, p->target_rows, p->target, first, ad_data(program, b->target));
    }
    memcpy(ad_data(program, b->weight), (const char *)p->weight + first * bytes,
           b->columns * bytes);
    if (products)
        *products += ad_run_timed(program);
    else
        ad_run(program);
}

static void add_gradient(const struct hnn_problem *p, const void *term)
{
    if (p->type == AD_F32) {
        float *sum = p->gradient;
        const float *g = term;
#pragma omp simd
        for (size_t k = 0; k < p->n; k++)
            sum[k] += g[k];
    } else {
        double *sum = p->gradient;
        const double *g = term;
#pragma omp simd
        for (size_t k = 0; k < p->n; k++)
            sum[k] += g[k];
    }
}

/* Blocks are added in their order, whoever ran them. */
static void add_block(const struct hnn_problem *p, ad_program *program, size_t block, double *loss)
{
    const struct hnn_block_program *b = &p->block;
    double term;
    ad_get(program, b->loss, &term);
    *loss += term;
    if (p->blocks == 1)
        return;
    if (block == 0)
        memcpy(p->gradient, ad_data(program, b->gradient), p->n * hnn_type_bytes(p->type));
    else
        add_gradient(p, ad_data(program, b->gradient));
}

static double evaluate(const struct hnn_problem *p, size_t workers, double *products)
{
    double loss = 0;
#pragma omp parallel for ordered schedule(static, 1) num_threads((int)workers) if (workers > 1)
    for (size_t block = 0; block < p->blocks; block++) {
        ad_program *program = p->block.program[block % workers];
        run_block(p, program, block * p->block.columns, products);
#pragma omp ordered
        add_block(p, program, block, &loss);
    }
    return loss;
}

double hnn_problem_evaluate(const struct hnn_problem *p)
{
    return evaluate(p, p->block.workers, NULL);
}

double hnn_problem_products(const struct hnn_problem *p)
{
    double seconds = 0;
    evaluate(p, 1, &seconds);
    return seconds;
}
