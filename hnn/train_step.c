/* Loss and gradient of one batch: one program, run over blocks of the batch's columns. What a block
   needs stays in the second-level cache from the forward pass to the end of the backward one, where
   whole batches go through memory for every operation; and blocks are what threads share out. They
   are cut and added up in the same way whatever the number of threads. */
#include "train.h"

#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 256 }; /* of a block at most; fewer make the products slow */

/* The last block ends with the batch, and so begins within the block before: those columns have
   weight 0 there. */
static size_t first_of(const struct hnn_problem *p, size_t block)
{
    size_t first = block * p->columns;
    return first + p->columns <= p->batch ? first : p->batch - p->columns;
}

static void record(struct hnn_problem *p, const hnn_model *model,
                   const struct hnn_training *training)
{
    p->parameters = ad_input(p->tape, 1, model->size, "parameters");
    p->in_x = ad_input(p->tape, p->x_rows, p->columns, "x");
    p->in_target = ad_input(p->tape, p->target_rows, p->columns, "target");
    p->weight = ad_input(p->tape, 1, p->columns, "weight");
    ad_var losses = hnn_record_losses(model, training, p->parameters, p->in_x, p->in_target);
    if (p->blocks > 1)
        losses = ad_mul(p->weight, losses);
    ad_var mean = ad_mul(1 / (double)p->batch, ad_sum(losses));
    p->loss = ad_label(mean, "loss");
    ad_grad(p->loss, 1, &p->parameters, &p->gradient);
}

/* One program for each thread, all of one recording. */
static void compile(struct hnn_problem *p, size_t threads)
{
    for (size_t k = 0; k < p->workers; k++)
        if (ad_compile(p->tape, 2, (ad_var[]){p->loss, p->gradient}, &p->program[k]) == AD_OK &&
            p->blocks == 1)
            ad_set_threads(p->program[k], threads);
}

static bool allocate(struct hnn_problem *p)
{
    size_t bytes = hnn_type_bytes(p->type);
    p->program = calloc(p->workers, sizeof *p->program);
    p->losses = calloc(p->blocks, sizeof *p->losses);
    if (p->blocks == 1)
        return p->program && p->losses;
    p->x = calloc(p->x_rows * p->batch, bytes);
    p->target = calloc(p->target_rows * p->batch, bytes);
    p->gradients = calloc(p->blocks * p->n, bytes);
    return p->program && p->losses && p->x && p->target && p->gradients;
}

enum ad_status hnn_problem_new(struct hnn_problem *p, const hnn_model *model,
                               const struct hnn_training *training, size_t batch,
                               struct ad_error *error)
{
    enum ad_type type = model->settings.precision;
    size_t threads = training->threads ? training->threads : 1;
    *p = (struct hnn_problem){.type = type,
                              .n = model->size,
                              .batch = batch,
                              .blocks = (batch + COLUMNS - 1) / COLUMNS,
                              .x_rows = hnn_x_rows(model, training),
                              .target_rows = hnn_target_rows(model, training),
                              .tape = ad_tape_new(type)};
    p->columns = (batch + p->blocks - 1) / p->blocks;
    p->workers = threads < p->blocks ? threads : p->blocks;
    if (!p->tape || !allocate(p))
        return ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", batch);
    record(p, model, training);
    compile(p, threads);
    if (hnn_tape_status(p->tape, error) == AD_OK && p->blocks == 1) {
        p->x = ad_data(p->program[0], p->in_x);
        p->target = ad_data(p->program[0], p->in_target);
    }
    return error->status;
}

void hnn_problem_free(struct hnn_problem *p)
{
    for (size_t k = 0; p->program && k < p->workers; k++)
        ad_program_free(p->program[k]);
    free(p->program);
    if (p->blocks > 1) {
        free(p->x);
        free(p->target);
    }
    free(p->losses);
    free(p->gradients);
    ad_tape_free(p->tape);
    *p = (struct hnn_problem){0};
}

void *hnn_problem_point(const struct hnn_problem *p)
{
    return ad_data(p->program[0], p->parameters);
}

const void *hnn_problem_gradient(const struct hnn_problem *p)
{
    return p->gradients ? p->gradients : ad_data(p->program[0], p->gradient);
}

/* Columns first ... of a [rows x batch] matrix. */
static void copy_columns(const struct hnn_problem *p, size_t rows, const void *from, size_t first,
                         void *to)
{
    size_t bytes = hnn_type_bytes(p->type);
    for (size_t r = 0; r < rows; r++)
        memcpy((char *)to + r * p->columns * bytes,
               (const char *)from + (r * p->batch + first) * bytes, p->columns * bytes);
}

static void set_weights(const struct hnn_problem *p, size_t block, ad_program *program)
{
    void *weight = ad_data(program, p->weight);
    size_t again = block * p->columns - first_of(p, block);
    for (size_t k = 0; k < p->columns; k++)
        if (p->type == AD_F32)
            ((float *)weight)[k] = k >= again;
        else
            ((double *)weight)[k] = k >= again;
}

static void run_block(const struct hnn_problem *p, size_t block, ad_program *program)
{
    size_t first = first_of(p, block), bytes = p->n * hnn_type_bytes(p->type);
    if (p->blocks > 1) {
        copy_columns(p, p->x_rows, p->x, first, ad_data(program, p->in_x));
        copy_columns(p, p->target_rows, p->target, first, ad_data(program, p->in_target));
        set_weights(p, block, program);
    }
    ad_run(program);
    ad_get(program, p->loss, &p->losses[block]);
    if (p->gradients)
        memcpy((char *)p->gradients + block * bytes, ad_data(program, p->gradient), bytes);
}

/* Adds the gradients of all blocks into the first, in their order. */
static void add_gradients(const struct hnn_problem *p)
{
    for (size_t block = 1; block < p->blocks; block++)
        if (p->type == AD_F32) {
            float *sum = p->gradients;
            for (size_t k = 0; k < p->n; k++)
                sum[k] += sum[block * p->n + k];
        } else {
            double *sum = p->gradients;
            for (size_t k = 0; k < p->n; k++)
                sum[k] += sum[block * p->n + k];
        }
}

double hnn_problem_evaluate(const struct hnn_problem *p)
{
    const void *point = hnn_problem_point(p);
    double loss = 0;
#pragma omp parallel for num_threads((int)p->workers) schedule(static, 1) if (p->workers > 1)
    for (size_t worker = 0; worker < p->workers; worker++) {
        ad_program *program = p->program[worker];
        if (worker > 0)
            memcpy(ad_data(program, p->parameters), point, p->n * hnn_type_bytes(p->type));
        for (size_t block = worker; block < p->blocks; block += p->workers)
            run_block(p, block, program);
    }
    for (size_t block = 0; block < p->blocks; block++)
        loss += p->losses[block];
    add_gradients(p);
    return loss;
}
