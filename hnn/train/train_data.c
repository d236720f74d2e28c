/* Samples for training, and seeded permutations of them. */
#include "train.h"
#include "autodiff/hash.h"

#include <stdlib.h>

/* A hash that identifies these samples. */
static uint64_t hash_of(const struct hnn_data *data)
{
    const struct hnn_samples *s = &data->samples;
    size_t states = data->target_rows - data->rollout, low = SIZE_MAX, high = 0;
    if (!s->frames) {
        uint64_t hash = ad_hash(AD_HASH_BEGIN, s->x, data->x_rows * s->n * sizeof *s->x);
        hash = ad_hash(hash, s->target, states * s->n * sizeof *s->target);
        return s->steps ? ad_hash(hash, s->steps, data->rollout * s->n * sizeof *s->steps)
                        : ad_hash(hash, &data->dt, sizeof data->dt);
    }
    for (size_t k = 0; k < s->n; k++) {
        low = s->first[k] < low ? s->first[k] : low;
        high = s->first[k] > high ? s->first[k] : high;
    }
    return ad_hash(ad_hash(AD_HASH_BEGIN, s->first, s->n * sizeof *s->first),
                   s->frames + low * s->frame,
                   ((high - low) * s->frame + data->target_rows) * sizeof *s->frames);
}

void hnn_data_new(struct hnn_data *data, enum ad_type type, const struct hnn_training *training,
                  const struct hnn_samples *samples, const struct hnn_lit *lit, size_t x_rows,
                  size_t target_rows)
{
    *data = (struct hnn_data){.type = type,
                              .n = samples->n,
                              .x_rows = x_rows,
                              .target_rows = target_rows,
                              .rollout = training->rollout,
                              .dt = training->dt,
                              .samples = *samples,
                              .lit = lit};
    data->hash = data->n ? hash_of(data) : 0;
}

void hnn_data_free(struct hnn_data *data)
{
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

void hnn_data_draw(struct hnn_data *data, size_t count, uint32_t *drawn)
{
    for (size_t k = 0; k < count; k++) {
        if (data->position == data->n)
            permute(data);
        drawn[k] = data->order[data->position++];
    }
}

static void put(enum ad_type type, double value, void *to, size_t at)
{
    if (type == AD_F32)
        ((float *)to)[at] = (float)value;
    else
        ((double *)to)[at] = value;
}

/* Rows of column k of from [rows x n] to column `col` of to [... x cols]. */
static void copy_column(const struct hnn_data *data, size_t rows, const double *from, size_t k,
                        void *to, size_t cols, size_t col)
{
    for (size_t r = 0; r < rows; r++)
        put(data->type, from[r * data->n + k], to, r * cols + col);
}

/* A window of frames, or their lit pixels alone, to row `row`. */
static void copy_window(const struct hnn_data *data, size_t size, const float *from,
                        const struct hnn_lit *lit, void *to, size_t row)
{
    if (lit && lit->pixel)
        for (size_t k = 0; k < size; k++)
            put(data->type, (double)from[k / lit->n * data->samples.frame + lit->pixel[k % lit->n]],
                to, row * size + k);
    else
        for (size_t k = 0; k < size; k++)
            put(data->type, (double)from[k], to, row * size + k);
}

void hnn_data_copy(const struct hnn_data *data, const uint32_t *picked, size_t first, size_t count,
                   size_t cols, void *x, void *target)
{
    const struct hnn_samples *s = &data->samples;
    size_t states = data->target_rows - data->rollout;
    for (size_t col = 0; col < count; col++) {
        size_t k = picked ? picked[first + col] : first + col < data->n ? first + col : data->n - 1;
        if (s->frames) {
            const float *window = s->frames + s->first[k] * s->frame;
            copy_window(data, data->x_rows, window, data->lit, x, col);
            copy_window(data, data->target_rows, window, NULL, target, col);
            continue;
        }
        copy_column(data, data->x_rows, s->x, k, x, cols, col);
        copy_column(data, states, s->target, k, target, cols, col);
        for (size_t r = 0; r < data->rollout; r++)
            put(data->type, s->steps ? s->steps[r * data->n + k] : data->dt, target,
                (states + r) * cols + col);
    }
}
