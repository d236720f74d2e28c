/* Samples for training, and seeded permutations of them. */
#include "train.h"
#include "autodiff/hash.h"

#include <stdlib.h>
#include <string.h>

static void float_frames(enum ad_type type, size_t n, const float *from, void *to)
{
    if (type == AD_F32)
        memcpy(to, from, n * sizeof *from);
    else
        for (size_t k = 0; k < n; k++)
            ((double *)to)[k] = (double)from[k];
}

/* Only the lit pixels of frames [n x frame]. */
static void pick(enum ad_type type, const struct hnn_lit *lit, size_t n, size_t frame,
                 const void *from, void *to)
{
    size_t bytes = hnn_type_bytes(type);
    const char *source = from;
    char *goal = to;
    for (size_t i = 0; i < n; i++, source += frame * bytes)
        for (size_t k = 0; k < lit->n; k++, goal += bytes)
            memcpy(goal, source + lit->pixel[k] * bytes, bytes);
}

/* All frames from the first to the last that a sample needs: a target is an observation, x the lit
   pixels of it and of the frame behind it. */
static bool copy_frames(struct hnn_data *data, const struct hnn_samples *samples,
                        const struct hnn_lit *lit)
{
    size_t low = SIZE_MAX, high = 0, frame = samples->frame;
    for (size_t k = 0; k < samples->n; k++) {
        low = samples->first[k] < low ? samples->first[k] : low;
        high = samples->first[k] > high ? samples->first[k] : high;
    }
    size_t size = (high - low + 1) * frame + data->target_rows, count = size / frame;
    size_t bytes = hnn_type_bytes(data->type);
    data->values = malloc((size + (lit->pixel ? count * lit->n : 0)) * bytes);
    data->first = malloc(samples->n * sizeof *data->first);
    if (!data->values || !data->first)
        return false;
    float_frames(data->type, size, samples->frames + low * frame, data->values);
    for (size_t k = 0; k < samples->n; k++)
        data->first[k] = samples->first[k] - low;
    data->x = data->target = data->values;
    data->x_frame = data->target_frame = frame;
    if (lit->pixel) {
        char *picked = (char *)data->values + size * bytes;
        pick(data->type, lit, count, frame, data->values, picked);
        data->x = picked;
        data->x_frame = lit->n;
    }
    data->hash = ad_hash(data->hash, data->values, size * bytes);
    data->hash = ad_hash(data->hash, data->first, samples->n * sizeof *data->first);
    return true;
}

/* Behind the targets of rollouts stand their steps, [K x n]. */
static void copy_steps(const struct hnn_data *data, const struct hnn_samples *samples,
                       const struct hnn_training *training, void *to)
{
    if (samples->steps) {
        hnn_from_double(data->type, training->rollout * data->n, samples->steps, to);
        return;
    }
    for (size_t k = 0; k < training->rollout * data->n; k++)
        hnn_from_double(data->type, 1, &training->dt, (char *)to + k * hnn_type_bytes(data->type));
}

static bool copy_columns(struct hnn_data *data, const struct hnn_samples *samples,
                         const struct hnn_training *training)
{
    size_t x = data->x_rows * data->n, target = data->target_rows * data->n;
    size_t states = target - training->rollout * data->n;
    size_t bytes = hnn_type_bytes(data->type);
    char *values = data->values = malloc((x + target) * bytes);
    if (!values)
        return false;
    hnn_from_double(data->type, x, samples->x, values);
    hnn_from_double(data->type, states, samples->target, values + x * bytes);
    copy_steps(data, samples, training, values + (x + states) * bytes);
    data->x = values;
    data->target = values + x * bytes;
    data->hash = ad_hash(data->hash, values, (x + target) * bytes);
    return true;
}

enum ad_status hnn_data_new(struct hnn_data *data, enum ad_type type,
                            const struct hnn_training *training, const struct hnn_samples *samples,
                            const struct hnn_lit *lit, size_t x_rows, size_t target_rows,
                            struct ad_error *error)
{
    size_t n = samples->n;
    *data = (struct hnn_data){.type = type, .n = n, .x_rows = x_rows, .target_rows = target_rows};
    if (n == 0)
        return AD_OK;
    data->hash = AD_HASH_BEGIN;
    if (!(samples->frames ? copy_frames(data, samples, lit)
                          : copy_columns(data, samples, training)))
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", n);
    return AD_OK;
}

void hnn_data_free(struct hnn_data *data)
{
    free(data->values);
    free(data->first);
    free(data->order);
    *data = (struct hnn_data){0};
}

/* R. A. Fisher, F. Yates; R. Durstenfeld, Algorithm 235. */
static void permute(struct hnn_data *data)
{
    data->epoch = data->random;
    data->position = 0;
    for (size_t k = 0; k < data->n; k++)
        data->order[k] = (uint32_t)k;
    for (size_t k = data->n; k > 1; k--) {
        size_t j = (size_t)(phys_random_uniform(&data->random) * (double)k);
        uint32_t kept = data->order[k - 1];
        data->order[k - 1] = data->order[j];
        data->order[j] = kept;
    }
}

enum ad_status hnn_data_shuffle(struct hnn_data *data, uint64_t seed, struct ad_error *error)
{
    if (data->n > UINT32_MAX)
        return ad_fail(error, AD_E_ARGUMENT, "batches are drawn from at most %lu samples, not %zu",
                       (unsigned long)UINT32_MAX, data->n);
    data->order = malloc(data->n * sizeof *data->order);
    if (!data->order)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", data->n);
    phys_random_seed(&data->random, seed);
    permute(data);
    return AD_OK;
}

void hnn_data_return(struct hnn_data *data, const struct phys_random *epoch, size_t position)
{
    data->random = *epoch;
    permute(data);
    data->position = position;
}

/* Sample k becomes column `col` of to [rows x cols], or row `col` of to [cols x rows]. */
static void copy_sample(const struct hnn_data *data, size_t rows, const void *from, size_t frame,
                        size_t k, void *to, size_t cols, size_t col)
{
    size_t bytes = hnn_type_bytes(data->type);
    const char *source = from;
    char *goal = to;
    if (data->first)
        memcpy(goal + col * rows * bytes, source + data->first[k] * frame * bytes, rows * bytes);
    else
        for (size_t r = 0; r < rows; r++)
            memcpy(goal + (r * cols + col) * bytes, source + (r * data->n + k) * bytes, bytes);
}

static void copy_both(const struct hnn_data *data, size_t k, size_t cols, size_t col, void *x,
                      void *target)
{
    copy_sample(data, data->x_rows, data->x, data->x_frame, k, x, cols, col);
    copy_sample(data, data->target_rows, data->target, data->target_frame, k, target, cols, col);
}

void hnn_data_draw(struct hnn_data *data, size_t count, void *x, void *target)
{
    for (size_t col = 0; col < count; col++) {
        if (data->position == data->n)
            permute(data);
        copy_both(data, data->order[data->position++], count, col, x, target);
    }
}

void hnn_data_copy(const struct hnn_data *data, size_t first, size_t count, void *x, void *target)
{
    for (size_t col = 0; col < count; col++)
        copy_both(data, first + col < data->n ? first + col : data->n - 1, count, col, x, target);
}
