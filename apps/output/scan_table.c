/* The table of a scan (scan_parts.h): text, JSON, CSV, HDF5. */
#include "apps/quote.h"
#include "autodiff/free.h"
#include "physics/io/checksum.h"
#include "scan_parts.h"

#include <stdlib.h>
#include <string.h>

const char *scan_subject(const struct scan *scan)
{
    return scan->scene                 ? scan->scene
           : scan->common->argument[0] ? scan->common->argument[0]
                                       : "defaults";
}

bool scan_over_seeds(const struct scan *scan)
{
    return strcmp(scan->axis[scan->axes - 1].flag, "seeds") == 0;
}

struct spread scan_spread(const struct scan *scan, const struct result_column *column, size_t point)
{
    const size_t seeds = scan->axis[scan->axes - 1].n;
    return spread_of(seeds, &column->value[point * seeds], 1);
}

static void report_values(const struct scan *scan, size_t axes, size_t run, struct report *report)
{
    for (size_t a = 0; a < axes; a++) {
        const char *name = scan->axis[a].name, *word = scan_word(scan, a, run);
        if (word)
            report_text(report, name, name, word);
        else
            report_number(report, name, name, scan->axis[a].unit, scan_value(scan, a, run));
    }
}

/* A row a number shown and a point, over its seeds. */
static void report_spreads(const struct scan *scan, struct report *report)
{
    const size_t seeds = scan->axis[scan->axes - 1].n;
    for (size_t k = 0; k < scan->n; k++)
        for (size_t p = 0; p < scan->runs / seeds && scan->column[k].shown; p++) {
            const struct spread s = scan_spread(scan, &scan->column[k], p);
            report_item(report, "spread");
            report_text(report, "number", "over seeds", scan->column[k].key);
            report_values(scan, scan->axes - 1, p * seeds, report);
            report_spread(report, "seeds", scan->column[k].unit, &s);
        }
    report_item(report, NULL);
}

static void write_report(const void *context, struct report *report)
{
    const struct scan *scan = context;
    report_line(report, "%s of %s: %zu runs\n", scan->command->line.name, scan_subject(scan),
                scan->runs);
    report_count(report, "runs", NULL, scan->runs);
    report_count(report, "missed", NULL, scan->missed);
    report->passing = true; /* the file has datasets */
    for (size_t r = 0; r < scan->runs; r++) {
        report_item(report, "scan");
        report_values(scan, scan->axes, r, report);
        report_count(report, "status", NULL, (size_t)scan->status[r]);
        for (size_t k = 0; k < scan->n; k++)
            report_number(report, scan->column[k].key,
                          scan->column[k].shown ? scan->column[k].key : NULL, scan->column[k].unit,
                          scan->column[k].value[r]);
    }
    report_item(report, NULL);
    if (scan_over_seeds(scan))
        report_spreads(scan, report);
    report->passing = false;
}

static void write_value(const struct scan *scan, size_t axis, size_t run, FILE *out)
{
    const char *word = scan_word(scan, axis, run);
    if (word)
        quote_csv(out, word);
    else
        fprintf(out, "%.17g", scan_value(scan, axis, run));
}

static void write_csv(const void *context, FILE *out)
{
    const struct scan *scan = context;
    for (size_t a = 0; a < scan->axes; a++)
        fprintf(out, "%s,", scan->axis[a].name);
    fputs("status", out);
    for (size_t k = 0; k < scan->n; k++)
        fprintf(out, ",%s", scan->column[k].key);
    fputc('\n', out);
    for (size_t r = 0; r < scan->runs; r++) {
        for (size_t a = 0; a < scan->axes; a++) {
            write_value(scan, a, r, out);
            fputc(',', out);
        }
        fprintf(out, "%d", scan->status[r]);
        for (size_t k = 0; k < scan->n; k++)
            csv_number(out, 17, scan->column[k].value[r]);
        fputc('\n', out);
    }
}

/* What was scanned; words as their places, with an attribute that has one a line. */
static enum ad_status write_axis(const struct scan *scan, size_t axis, phys_hdf5 *file,
                                 struct ad_error *error)
{
    const struct axis_of_scan *a = &scan->axis[axis];
    const size_t stride = axis + 1 < scan->axes ? scan->axis[1].n : 1;
    double *value = malloc(a->n * sizeof *value);
    char name[KEY];
    size_t length = 1, words = 0;
    for (size_t k = 0; k < a->n; k++)
        length += a->option ? strlen(a->text[k]) + 1 : 0;
    char *text = calloc(length, 1), *end = text;
    if (value && text) {
        snprintf(name, sizeof name, "scanned/%s", a->name);
        for (size_t k = 0; k < a->n; k++) {
            words += scan_word(scan, axis, k * stride) != NULL;
            if (a->option)
                end += sprintf(end, "%s%s", k ? "\n" : "", a->text[k]);
        }
        for (size_t k = 0; k < a->n; k++)
            value[k] = words ? (double)k : scan_value(scan, axis, k * stride);
        phys_hdf5_write(file, name, AD_F64, 1, &a->n, value);
        phys_hdf5_text(file, name, "unit", a->unit);
        phys_hdf5_integer(file, name, "axis", (int64_t)axis, NULL);
        if (words)
            phys_hdf5_text(file, name, "values", text);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    AD_FREE(value, text);
    return error->status;
}

/* Files of the runs, beside that of the table, and their checksums. */
static enum ad_status write_members(const struct scan *scan, phys_hdf5 *file,
                                    struct ad_error *error)
{
    char *texts[2] = {NULL};
    size_t n;
    FILE *names = open_memstream(&texts[0], &n), *hashes = open_memstream(&texts[1], &n);
    bool memory = names && hashes;
    for (size_t r = 0; r < scan->runs && memory; r++) {
        char hash[PHYS_CHECKSUM_DIGITS + 1] = "";
        char *name =
            scan->status[r] != DONE ? strdup("") : scan_member_file(scan, r, scan->common->out);
        const char *slash = name ? strrchr(name, '/') : NULL;
        memory = name != NULL;
        if (memory && *name)
            phys_checksum_read(name, hash);
        fprintf(names, "%s%s", r ? "\n" : "", slash ? slash + 1 : name ? name : "");
        fprintf(hashes, "%s%s", r ? "\n" : "", hash);
        free(name);
    }
    memory = !(names && fclose(names) != 0) && memory;
    memory = !(hashes && fclose(hashes) != 0) && memory;
    if (memory) {
        phys_hdf5_text(file, "/", "members", texts[0]);
        phys_hdf5_text(file, "/", "checksums", texts[1]);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    AD_FREE(texts[0], texts[1]);
    return error->status;
}

/* Numbers over the scanned values: [n], or [n of the first x n of the second]. */
static enum ad_status write_file(const void *context, phys_hdf5 *file, struct ad_error *error)
{
    const struct scan *scan = context;
    const size_t shape[AXES] = {scan->axis[0].n, scan->axis[1].n};
    char name[KEY + 16];
    for (size_t a = 0; a < scan->axes && error->status == AD_OK; a++)
        write_axis(scan, a, file, error);
    if (scan->command->line.members && error->status == AD_OK)
        write_members(scan, file, error);
    for (size_t k = 0; k < scan->n; k++) {
        snprintf(name, sizeof name, "results/%s", scan->column[k].key);
        phys_hdf5_write(file, name, AD_F64, scan->axes, shape, scan->column[k].value);
        if (*scan->column[k].unit)
            phys_hdf5_text(file, name, "unit", scan->column[k].unit);
    }
    return error->status;
}

const struct output_kind scan_outputs = {write_report, write_file, write_csv, scan_draw, NULL};
