/* A rank's share of a data set whose rows are samples by themselves: a first pass over the file
   counts its rows, a second one keeps those of the share. Rows of others are passed over; of HDF5
   they are not read. */
#include "autodiff/free.h"
#include "autodiff/hash.h"
#include "data_table.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

/* Beyond its even part a rank holds this much, which blocks and pieces of the training reach. */
enum { MARGIN = 8192 };

void hnn_samples_share(const struct ad_ranks *ranks, size_t n, size_t *begin, size_t *end)
{
    size_t rank = ranks ? ranks->rank : 0;
    size_t first = ad_ranks_first(ranks, n, rank), last = ad_ranks_first(ranks, n, rank + 1);
    const bool all = n <= 2 * MARGIN;
    *begin = !all && first > MARGIN ? first - MARGIN : 0;
    *end = all ? 0 : n - last > MARGIN ? last + MARGIN : n;
}

/* ---- sums over all samples ---- */

enum { BLOCK = 4096 }; /* samples, under MARGIN */

struct summing {
    const struct hnn_samples *samples;
    hnn_samples_add *add;
    void *context;
    size_t n;
};

static enum ad_status sum_block(void *context, size_t block, double *sum, struct ad_error *error)
{
    const struct summing *s = context;
    size_t begin = s->samples->begin, first = block * BLOCK, left = s->samples->n - first;
    for (size_t i = 0; i < s->n; i++)
        sum[i] = 0;
    for (size_t k = first; k < first + (left < BLOCK ? left : BLOCK); k++)
        s->add(s->context, k - begin, sum);
    return error->status;
}

enum ad_status hnn_samples_sum(struct ad_ranks *ranks, const struct hnn_samples *samples, size_t n,
                               hnn_samples_add *add, void *context, double *sum,
                               struct ad_error *error)
{
    if (AD_LACKS(error, samples, add, sum))
        return error->status;
    struct summing s = {samples, add, context, n};
    return ad_ranks_sum(samples->end ? ranks : NULL, (samples->n + BLOCK - 1) / BLOCK, n, sum_block,
                        &s, sum, error);
}

/* ---- the file ---- */

bool hnn_share_possible(const struct hnn_dataset_settings *s, const struct hnn_table *table,
                        const char *file)
{
    const struct hnn_plan *plan = &table->plan;
    struct stat status;
    return s->ranks && s->ranks->count > 1 && plan->rate && plan->time == HNN_NO_COLUMN &&
           plan->trial == HNN_NO_COLUMN && !s->skip_missing && plan->inputs == 0 && file &&
           stat(file, &status) == 0 && S_ISREG(status.st_mode); /* a pipe is read once */
}

/* Rows from `at` on: into the columns of the table, room for some, or nowhere. */
static size_t pass(struct hnn_table *table, struct hnn_source *source, size_t at, bool wanted,
                   struct ad_error *error)
{
    size_t rows = 0;
    double **to = calloc(source->columns, sizeof *to);
    if (!to)
        ad_fail(error, AD_E_MEMORY, "%s: out of memory after %zu rows", table->file, at);
    /* The first rows tell how many HDF5 has. */
    for (size_t k = 0; k < table->plan.n && (wanted || at == 0) && to; k++)
        to[table->plan.column[k]] = table->column[k];
    if (error->status == AD_OK)
        source->kind->read(source, PHYS_CSV_ROWS, to, &rows, error);
    free(to);
    return error->status == AD_OK ? rows : 0;
}

enum ad_status hnn_share_count(struct hnn_table *table, struct hnn_source *source,
                               struct ad_error *error)
{
    uint64_t hash = AD_HASH_BEGIN;
    for (size_t k = 0; k < table->plan.n; k++)
        if (!(table->column[k] = malloc(PHYS_CSV_ROWS * sizeof **table->column)))
            return ad_fail(error, AD_E_MEMORY, "%s: out of memory", table->file);
    for (size_t rows = 1; rows; table->rows += rows) {
        rows = pass(table, source, table->rows, false, error);
        for (size_t k = 0; k < table->plan.n && table->rows == 0; k++)
            hash = ad_hash(hash, table->column[k], rows * sizeof **table->column);
    }
    table->trials = table->rows > 0;
    table->fingerprint = ad_hash(hash, &source->crc, sizeof source->crc);
    return error->status;
}

/* Ranks that read other files would train towards something else. */
enum ad_status hnn_share_agree(const struct hnn_dataset_settings *s, const struct hnn_table *table,
                               struct ad_error *error)
{
    char text[96];
    if (ad_ranks_agree(s->ranks, error) != AD_OK || !table->shared)
        return error->status;
    snprintf(text, sizeof text, "%zu rows of fingerprint %016" PRIx64, table->rows,
             table->fingerprint);
    return ad_ranks_same(s->ranks, table->file, text, error);
}

static size_t count_roles(const struct hnn_part *part, size_t from, size_t to)
{
    size_t n = 0;
    for (size_t i = from; i < to && i < part->table->rows; i++)
        n += part->table->role[i] == part->role;
    return n;
}

/* Of rows `at` ... at + rows - 1, the next of which is sample `next` of the part. */
static void take_rows(const struct hnn_part *part, size_t at, size_t rows, size_t next)
{
    const struct hnn_table *table = part->table;
    const struct hnn_plan *plan = &table->plan;
    size_t held = part->end - part->begin;
    for (size_t i = 0; i < rows && at + i < table->rows; i++) {
        if (table->role[at + i] != part->role)
            continue;
        size_t k = next++;
        for (size_t c = 0; c < plan->components && k >= part->begin && k < part->end; c++) {
            part->x[c * held + k - part->begin] = hnn_table_column(table, plan->state[c])[i];
            part->target[c * held + k - part->begin] = hnn_table_column(table, plan->rate[c])[i];
        }
    }
}

enum ad_status hnn_share_read(const struct hnn_dataset_settings *s, const struct hnn_part *part,
                              size_t parts, struct ad_error *error)
{
    struct hnn_table *table = part->table;
    struct hnn_source *source;
    size_t at = 0, next[2] = {0};
    if (hnn_source_open(table->file, s->skip_rows, &source, error) != AD_OK)
        return error->status;
    for (size_t rows = 1; rows; at += rows) {
        bool wanted = false;
        for (size_t k = 0; k < parts; k++)
            wanted |= next[k] < part[k].end &&
                      next[k] + count_roles(&part[k], at, at + PHYS_CSV_ROWS) > part[k].begin;
        rows = pass(table, source, at, wanted, error);
        for (size_t k = 0; k < parts && wanted; k++)
            take_rows(&part[k], at, rows, next[k]);
        for (size_t k = 0; k < parts; k++)
            next[k] += count_roles(&part[k], at, at + rows);
    }
    hnn_source_close(source);
    if (error->status == AD_OK && at != table->rows)
        ad_fail(error, AD_E_INPUT, "%s: had %zu rows, and has %zu now", table->file, table->rows,
                at);
    return error->status;
}
