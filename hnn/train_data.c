/* Samples for training, and seeded permutations of them. */
#include "train.h"

#include <stdlib.h>
#include <string.h>

static void *convert(enum ad_type type, size_t n, const double *values)
{
    void *out = malloc(n * hnn_type_bytes(type) + 1);
    if (out)
        hnn_from_double(type, n, values, out);
    return out;
}

/* FNV-1a (G. Fowler, L. Noll, P. Vo), 64 bits: tells one set of samples from another. */
static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t n)
{
    const unsigned char *b = bytes;
    for (size_t k = 0; k < n; k++)
        hash = (hash ^ b[k]) * 0x100000001b3;
    return hash;
}

enum ad_status hnn_data_new(struct hnn_data *data, enum ad_type type,
                            const struct hnn_samples *samples, size_t x_rows, size_t target_rows,
                            struct ad_error *error)
{
    size_t n = samples->n;
    *data = (struct hnn_data){.type = type, .n = n, .x_rows = x_rows, .target_rows = target_rows};
    if (n == 0)
        return AD_OK;
    data->x = convert(type, x_rows * n, samples->x);
    data->target = convert(type, target_rows * n, samples->target);
    if (!data->x || !data->target)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu samples", n);
    data->hash = hash_bytes(0xcbf29ce484222325, data->x, x_rows * n * hnn_type_bytes(type));
    data->hash = hash_bytes(data->hash, data->target, target_rows * n * hnn_type_bytes(type));
    return AD_OK;
}

void hnn_data_free(struct hnn_data *data)
{
    free(data->x);
    free(data->target);
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

static void copy_column(enum ad_type type, size_t rows, const void *from, size_t from_cols,
                        size_t from_col, void *to, size_t to_cols, size_t to_col)
{
    size_t bytes = hnn_type_bytes(type);
    for (size_t r = 0; r < rows; r++)
        memcpy((char *)to + (r * to_cols + to_col) * bytes,
               (const char *)from + (r * from_cols + from_col) * bytes, bytes);
}

static void copy_sample(const struct hnn_data *data, size_t sample, size_t count, size_t col,
                        void *x, void *target)
{
    copy_column(data->type, data->x_rows, data->x, data->n, sample, x, count, col);
    copy_column(data->type, data->target_rows, data->target, data->n, sample, target, count, col);
}

void hnn_data_draw(struct hnn_data *data, size_t count, void *x, void *target)
{
    for (size_t col = 0; col < count; col++) {
        if (data->position == data->n)
            permute(data);
        copy_sample(data, data->order[data->position++], count, col, x, target);
    }
}

void hnn_data_copy(const struct hnn_data *data, size_t first, size_t count, void *x, void *target)
{
    for (size_t col = 0; col < count; col++)
        copy_sample(data, first + col < data->n ? first + col : data->n - 1, count, col, x, target);
}
