/* A rank's share of a data set: a first pass over the file (data_table.c) counts its rows and keeps
   times and trials, a second one makes the samples of the share. Rows of others are passed over; of
   HDF5 they are not read. */
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
    const bool all = !ranks || ranks->count == 1 || n <= 2 * MARGIN;
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

/* ---- samples of all ranks ---- */

struct taking {
    const struct ad_ranks *ranks;
    const struct hnn_samples *samples;
    const size_t *rows;
    double dt;
    const uint32_t *picked;
    size_t n;
};

/* Row r, counted over x, target and steps; NULL: steps of length dt. */
static const double *row_of(const struct taking *t, size_t r)
{
    const struct hnn_samples *s = t->samples;
    const size_t held = hnn_samples_held(s), x = t->rows[0], targets = t->rows[1];
    return r < x             ? s->x + r * held
           : r < x + targets ? s->target + (r - x) * held
           : s->steps        ? s->steps + (r - x - targets) * held
                             : NULL;
}

/* Those that are in the even part of rank `rank`, this one; 0 for the others. */
static enum ad_status take_own(void *context, size_t rank, double *values, struct ad_error *error)
{
    const struct taking *t = context;
    const size_t all = t->samples->n;
    size_t first = t->samples->end ? ad_ranks_first(t->ranks, all, rank) : 0;
    size_t end = t->samples->end ? ad_ranks_first(t->ranks, all, rank + 1) : all;
    for (size_t r = 0; r < t->rows[0] + t->rows[1] + t->rows[2]; r++) {
        const double *row = row_of(t, r);
        for (size_t i = 0; i < t->n; i++) {
            size_t k = t->picked[i];
            bool own = k >= first && k < end;
            values[r * t->n + i] = !own ? 0 : row ? row[k - t->samples->begin] : t->dt;
        }
    }
    return error->status;
}

enum ad_status hnn_samples_take(struct ad_ranks *ranks, const struct hnn_samples *samples,
                                const size_t rows[3], double dt, size_t n, const uint32_t *picked,
                                double *taken, struct ad_error *error)
{
    if (AD_LACKS(error, samples, rows, picked, taken))
        return error->status;
    struct taking t = {ranks, samples, rows, dt, picked, n};
    return samples->end
               ? ad_ranks_sum(ranks, ranks ? ranks->count : 1, (rows[0] + rows[1] + rows[2]) * n,
                              take_own, &t, taken, error)
               : take_own(&t, 0, taken, error);
}

/* ---- the file ---- */

bool hnn_share_possible(const struct hnn_dataset_settings *s, const char *file)
{
    struct stat status;
    return s->ranks && s->ranks->count > 1 && file && stat(file, &status) == 0 &&
           S_ISREG(status.st_mode); /* a pipe is read once */
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

/* Rows `at` and on of a read belong to samples of the part. */
static bool needs(const struct hnn_part *part, size_t at)
{
    const struct hnn_table *table = part->table;
    return at < part->last + table->after && at + PHYS_CSV_ROWS + table->before > part->first;
}

/* Of rows before `end` the samples whose rows are all there. */
static void take_until(const struct hnn_dataset_settings *s, struct hnn_part *part, size_t parts,
                       size_t end)
{
    size_t after = part->table->after, until = end > after ? end - after : 0;
    for (size_t k = 0; k < parts; k++) {
        struct hnn_part *p = &part[k];
        p->to = until < p->last ? until : p->last;
        p->to = p->to > p->from ? p->to : p->from;
    }
    hnn_parts_take(s, part, parts);
}

enum ad_status hnn_share_read(const struct hnn_dataset_settings *s, struct hnn_part *part,
                              size_t parts, struct ad_error *error)
{
    struct hnn_table *table = part->table;
    struct hnn_source *source;
    size_t at = 0;
    if (hnn_source_open(table->file, s->skip_rows, &source, error) != AD_OK)
        return error->status;
    source->skip_missing = s->skip_missing;
    table->from = 0;
    for (size_t rows = 1, kept; rows; at += kept) {
        bool wanted = false;
        for (size_t k = 0; k < parts; k++)
            wanted |= needs(&part[k], at);
        for (size_t k = 0; k < table->plan.n; k++)
            table->reads[k] =
                s->skip_missing || ((wanted || at == 0) && !hnn_table_whole(table, k));
        if (hnn_table_next(table, source, at, &rows, &kept, NULL, error) != AD_OK ||
            at + kept > table->rows)
            break;
        if (wanted)
            take_until(s, part, parts, at + kept);
        hnn_table_slide(table, at + kept, table->before + table->after);
    }
    hnn_source_close(source);
    if (error->status == AD_OK && at != table->rows)
        ad_fail(error, AD_E_INPUT, "%s: had %zu rows, and has another number now", table->file,
                table->rows);
    return error->status;
}
