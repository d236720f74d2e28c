/* Loss and gradient of one batch, in blocks of columns: one recording, compiled, run block after
   block. A block's data stay in the second-level cache from the forward to the end of the backward
   pass, where whole batches would go through memory for every operation; threads share out the
   blocks. The last block may be padded by samples of weight 0. Blocks are cut and summed in the
   same way whatever the number of threads. */
#include "train.h"
#include "autodiff/exec/pool.h"

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
    bool by_rows = hnn_by_rows(model, training);
    b->x = hnn_record_samples(b->tape, by_rows, p->data->x_rows, b->columns, "x");
    b->target = hnn_record_samples(b->tape, by_rows, p->data->target_rows, b->columns, "target");
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

static bool allocate(struct hnn_problem *p, size_t columns, bool all)
{
    size_t bytes = hnn_type_bytes(p->type);
    const double share = 1 / (double)p->batch;
    if (!(p->weight = calloc(p->blocks * columns, bytes)))
        return false;
    for (size_t k = 0; k < p->batch; k++)
        hnn_from_double(p->type, 1, &share, (char *)p->weight + k * bytes);
    if (!all)
        p->drawn = malloc(p->batch * sizeof *p->drawn);
    if (p->blocks > 1)
        p->gradient = calloc(p->n, bytes);
    return (all || p->drawn) && (p->blocks == 1 || p->gradient);
}

static void copy_block(const struct hnn_problem *p, ad_program *program, size_t first)
{
    size_t columns = p->block.columns;
    hnn_data_copy(p->data, p->drawn, first, p->batch - first < columns ? p->batch - first : columns,
                  columns, ad_data(program, p->block.x), ad_data(program, p->block.target));
}

enum ad_status hnn_problem_new(struct hnn_problem *p, const hnn_model *model,
                               const struct hnn_training *training, const struct hnn_data *data,
                               struct ad_error *error)
{
    size_t threads = training->threads ? training->threads : 1;
    size_t batch = training->batch ? training->batch : data->n;
    size_t blocks = batch <= WHOLE ? 1 : (batch + COLUMNS - 1) / COLUMNS, columns = batch;
    if (blocks > 1)
        columns = ((batch + blocks - 1) / blocks + VECTOR - 1) / VECTOR * VECTOR;
    *p = (struct hnn_problem){.type = model->settings.precision,
                              .n = model->size,
                              .batch = batch,
                              .blocks = blocks,
                              .data = data};
    size_t workers = threads < blocks ? threads : blocks;
    if (!allocate(p, columns, training->batch == 0))
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", batch);
    if (make(p, columns, workers, model, training, error) != AD_OK)
        return error->status;
    if (blocks == 1) {
        p->gradient = ad_data(p->block.program[0], p->block.gradient);
        ad_set_threads(p->block.program[0], threads);
    }
    if (blocks == 1 && !p->drawn)
        copy_block(p, p->block.program[0], 0);
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
    free(p->drawn);
    if (p->blocks > 1)
        free(p->gradient);
    *p = (struct hnn_problem){0};
}

void *hnn_problem_point(const struct hnn_problem *p)
{
    return ad_data(p->block.program[0], p->block.parameters);
}

const void *hnn_problem_gradient(const struct hnn_problem *p) { return p->gradient; }

static void run_block(const struct hnn_problem *p, ad_program *program, size_t first,
                      double *products)
{
    const struct hnn_block_program *b = &p->block;
    const size_t bytes = hnn_type_bytes(p->type);
    void *parameters = ad_data(program, b->parameters);
    const void *point = hnn_problem_point(p);
    if (parameters != point)
        memcpy(parameters, point, p->n * bytes);
    if (p->blocks > 1 || p->drawn)
        copy_block(p, program, first);
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

/* Blocks are added in order, whatever thread ran them. */
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

struct round {
    const struct hnn_problem *p;
    double *products;
    size_t first; /* block of the first worker */
};

static void run_worker(void *context, size_t thread, size_t k)
{
    const struct round *round = context;
    const struct hnn_problem *p = round->p;
    (void)thread;
    run_block(p, p->block.program[k], (round->first + k) * p->block.columns, round->products);
}

/* As many blocks at once as there are workers; sums in the order of blocks. */
static double evaluate(const struct hnn_problem *p, size_t workers, double *products)
{
    double loss = 0;
    struct round round = {p, products, 0};
    for (; round.first < p->blocks; round.first += workers) {
        const size_t left = p->blocks - round.first, n = left < workers ? left : workers;
        ad_parallel(n, n, run_worker, &round);
        for (size_t k = 0; k < n; k++)
            add_block(p, p->block.program[k], round.first + k, &loss);
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
