/* Columns of a CSV file (physics/io/csv.h) as a source of data sets. */
#include "data_source.h"

#include <stdio.h>
#include <stdlib.h>

struct text {
    struct hnn_source source;
    struct phys_csv csv;
};

static enum ad_status text_read(struct hnn_source *source, size_t room, double *const *to,
                                size_t *rows, struct ad_error *error)
{
    struct phys_csv *csv = &((struct text *)source)->csv;
    csv->skip_missing = csv->leave_out = source->skip_missing;
    phys_csv_read(csv, room, to, 1, rows, error);
    source->crc = csv->lines.crc;
    source->left_out = csv->left_out;
    return error->status;
}

static void text_place(const struct hnn_source *source, size_t k, char *text, size_t size)
{
    snprintf(text, size, "%s:%zu", source->file, ((const struct text *)source)->csv.line[k]);
}

static void text_close(struct hnn_source *source)
{
    phys_csv_close(&((struct text *)source)->csv);
    free(source);
}

static const struct hnn_source_kind text_kind = {text_read, text_place, text_close};

enum ad_status hnn_text_open(const char *file, size_t skip, struct hnn_source **source,
                             struct ad_error *error)
{
    struct text *t = calloc(1, sizeof *t);
    if (!t)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", file);
    const struct phys_csv *csv = &t->csv;
    enum ad_status status = phys_csv_open(&t->csv, file, skip, error);
    t->source = (struct hnn_source){.kind = &text_kind,
                                    .file = file,
                                    .columns = csv->columns,
                                    .names_line = csv->names_line,
                                    .name = csv->name,
                                    .units_line = csv->units_line,
                                    .mixed_line = csv->mixed_line,
                                    .ordered = true};
    if (status == AD_OK)
        *source = &t->source;
    else
        text_close(&t->source);
    return status;
}
