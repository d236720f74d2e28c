/* Samples for training, and seeded permutations of them. */
#include "train.h"
#include "autodiff/free.h"
#include "autodiff/hash.h"
#include "hnn/data/data.h"

#include <stdlib.h>

enum { PARTS = 4 }; /* of a hash: 16 bits each, so that sums of 2^32 are exact */

/* Pixels of an observation and the next one. */
static size_t window_of(const struct hnn_data *data)
{
    return data->target_rows + data->samples.frame;
}

/* A hash of each sample, added up: that of all, whoever holds them. */
static void add_hash(void *context, size_t k, double *sum)
{
    const struct hnn_data *data = context;
    const struct hnn_samples *s = &data->samples;
    size_t states = data->target_rows - data->rollout, at = s->begin + k, n = data->held;
    uint64_t hash = ad_hash(AD_HASH_BEGIN, &at, sizeof at);
    if (s->frames) {
        hash =
            ad_hash(hash, s->frames + s->first[at] * s->frame, window_of(data) * sizeof *s->frames);
        states = 0;
    }
    for (size_t r = 0; r < data->x_rows && !s->frames; r++)
        hash = ad_hash(hash, s->x + r * n + k, sizeof *s->x);
    for (size_t r = 0; r < states; r++)
        hash = ad_hash(hash, s->target + r * n + k, sizeof *s->target);
    for (size_t r = 0; r < data->rollout && s->steps; r++)
        hash = ad_hash(hash, s->steps + r * n + k, sizeof *s->steps);
    for (size_t i = 0; i < PARTS; i++)
        sum[i] += (double)(hash >> 16 * i & 0xffff);
}

static enum ad_status hash_samples(struct hnn_data *data, struct ad_error *error)
{
    double sum[PARTS];
    if (hnn_samples_sum(data->ranks, &data->samples, PARTS, add_hash, data, sum, error) == AD_OK)
        data->hash = ad_hash(ad_hash(AD_HASH_BEGIN, sum, sizeof sum), &data->dt, sizeof data->dt);
    return error->status;
}

enum ad_status hnn_data_new(struct hnn_data *data, enum ad_type type,
                            const struct hnn_training *training, const struct hnn_samples *samples,
                            const struct hnn_lit *lit, size_t x_rows, size_t target_rows,
                            struct ad_error *error)
{
    *data = (struct hnn_data){.type = type,
                              .n = samples->n,
                              .held = hnn_samples_held(samples),
                              .x_rows = x_rows,
                              .target_rows = target_rows,
                              .rollout = training->rollout,
                              .dt = samples->steps ? 0 : training->dt,
                              .samples = *samples,
                              .ranks = training->ranks,
                              .lit = lit};
    return data->n ? hash_samples(data, error) : AD_OK;
}

void hnn_data_free(struct hnn_data *data)
{
    AD_FREE(data->order, data->taken, data->windows);
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

struct taking {
    const struct hnn_data *data;
    const uint32_t *picked;
    size_t n;
};

/* Windows of samples in the even part of rank `rank`, this one; 0 for the others. */
static enum ad_status take_own(void *context, size_t rank, double *values, struct ad_error *error)
{
    const struct taking *t = context;
    const struct hnn_samples *s = &t->data->samples;
    const size_t size = window_of(t->data), first = ad_ranks_first(t->data->ranks, s->n, rank),
                 end = ad_ranks_first(t->data->ranks, s->n, rank + 1);
    for (size_t i = 0; i < t->n; i++) {
        const size_t k = t->picked[i];
        const bool own = k >= first && k < end;
        for (size_t j = 0; j < size; j++)
            values[i * size + j] = own ? (double)s->frames[s->first[k] * s->frame + j] : 0;
    }
    return error->status;
}

/* Pixels are as they were: one rank's, and zeros added to them. */
static enum ad_status take_windows(struct hnn_data *data, size_t n, const uint32_t *picked,
                                   struct ad_error *error)
{
    struct taking t = {data, picked, n};
    const size_t numbers = n * window_of(data);
    float *windows = realloc(data->windows, numbers * sizeof *windows);
    double *values = malloc(numbers * sizeof *values);
    if (windows)
        data->windows = windows;
    if (!windows || !values)
        ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", n);
    if (ad_ranks_agree(data->ranks, error) == AD_OK &&
        ad_ranks_sum(data->ranks, data->ranks->count, numbers, take_own, &t, values, error) ==
            AD_OK)
        for (size_t k = 0; k < numbers; k++)
            windows[k] = (float)values[k];
    free(values);
    return error->status;
}

enum ad_status hnn_data_take(struct hnn_data *data, size_t n, const uint32_t *picked,
                             struct ad_error *error)
{
    const size_t rows[] = {data->x_rows, data->target_rows - data->rollout, data->rollout};
    if (data->samples.frames)
        return take_windows(data, n, picked, error);
    double *taken = realloc(data->taken, (data->x_rows + data->target_rows) * n * sizeof *taken);
    if (taken)
        data->taken = taken;
    else
        ad_fail(error, AD_E_MEMORY, "out of memory for a batch of %zu samples", n);
    data->n_taken = n;
    return ad_ranks_agree(data->ranks, error) == AD_OK
               ? hnn_samples_take(data->ranks, &data->samples, rows, data->dt, n, picked, taken,
                                  error)
               : error->status;
}

/* ---- copies to a program ---- */

/* Rows of column k of from [rows x n] to column `col` of to [... x cols]. */
static void copy_column(const struct hnn_data *data, size_t rows, const double *from, size_t n,
                        size_t k, void *to, size_t cols, size_t col)
{
    for (size_t r = 0; r < rows; r++)
        put(data->type, from[r * n + k], to, r * cols + col);
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

const float *hnn_data_window(const struct hnn_data *data, const uint32_t *picked, size_t k)
{
    const struct hnn_samples *s = &data->samples;
    return data->windows ? data->windows + k * window_of(data)
                         : s->frames + s->first[picked[k]] * s->frame;
}

void hnn_data_copy(const struct hnn_data *data, const uint32_t *picked, size_t first, size_t count,
                   size_t cols, void *x, void *target)
{
    const struct hnn_samples *s = &data->samples;
    size_t states = data->target_rows - data->rollout;
    for (size_t col = 0; col < count; col++) {
        size_t k = picked ? picked[first + col] : first + col < data->n ? first + col : data->n - 1;
        if (s->frames) {
            const float *window = picked ? hnn_data_window(data, picked, first + col)
                                         : s->frames + s->first[k] * s->frame;
            copy_window(data, data->x_rows, window, data->lit, x, col);
            copy_window(data, data->target_rows, window, NULL, target, col);
            continue;
        }
        if (picked && data->taken) {
            size_t n = data->n_taken;
            copy_column(data, data->x_rows, data->taken, n, first + col, x, cols, col);
            copy_column(data, data->target_rows, data->taken + data->x_rows * n, n, first + col,
                        target, cols, col);
            continue;
        }
        copy_column(data, data->x_rows, s->x, data->held, k - s->begin, x, cols, col);
        copy_column(data, states, s->target, data->held, k - s->begin, target, cols, col);
        for (size_t r = 0; r < data->rollout; r++)
            put(data->type, s->steps ? s->steps[r * data->held + k - s->begin] : data->dt, target,
                (states + r) * cols + col);
    }
}
