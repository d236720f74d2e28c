/* leastaction dump: prints the contents of a run file as text, CSV or JSON. */
#include "apps/command.h"
#include "apps/output/json.h"
#include "apps/quote.h"
#include "apps/output/result.h"
#include "physics/io/hdf5_file.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct options {
    struct common common;
    const char *dataset, *csv;
};

/* ---- contents ---- */

static void print_shape(FILE *out, const struct phys_hdf5_item *item)
{
    for (size_t k = 0; k < item->rank; k++)
        fprintf(out, "%s%zu", k ? " x " : "", item->dims[k]);
}

struct text_listing {
    FILE *out;
    char number[128]; /* name of the last number: its unit, which follows, is printed on the same
                         line */
};

static void print_name(FILE *out, const char *attribute, const char *after)
{
    fputs("    ", out);
    quote_terminal(out, attribute);
    fputs(after, out);
}

static void list_text(void *context, const struct phys_hdf5_item *item)
{
    struct text_listing *listing = context;
    size_t length = strlen(listing->number);
    if (length && item->attribute && strncmp(item->attribute, listing->number, length) == 0 &&
        strcmp(item->attribute + length, ".unit") == 0) {
        quote_terminal_line(listing->out, " ", item->text);
        listing->number[0] = '\0';
        return;
    }
    if (length)
        fputc('\n', listing->out);
    listing->number[0] = '\0';
    if (!item->attribute) {
        fputc('/', listing->out);
        quote_terminal(listing->out, item->object);
        if (item->kind != PHYS_HDF5_FOLDER) {
            fprintf(listing->out, "  %s [", phys_hdf5_kind_name(item->kind));
            print_shape(listing->out, item);
            fputc(']', listing->out);
        }
        fputc('\n', listing->out);
    } else if (item->kind == PHYS_HDF5_TEXT) {
        print_name(listing->out, item->attribute, " = ");
        quote_terminal_line(listing->out, "", item->text);
    } else if (item->kind == PHYS_HDF5_OTHER) {
        print_name(listing->out, item->attribute, " (not shown)\n");
    } else {
        print_name(listing->out, item->attribute, " = ");
        fprintf(listing->out, "%.17g", item->number);
        snprintf(listing->number, sizeof listing->number, "%s", item->attribute);
    }
}

static void list_csv(void *context, const struct phys_hdf5_item *item)
{
    FILE *out = context;
    quote_csv_name(out, "/", item->object);
    fputc(',', out);
    quote_csv_name(out, "", item->attribute ? item->attribute : "");
    fprintf(out, ",%s,", phys_hdf5_kind_name(item->kind));
    print_shape(out, item);
    fputc(',', out);
    if (item->text)
        quote_csv(out, item->text);
    else if (item->attribute && item->kind != PHYS_HDF5_OTHER)
        fprintf(out, "%.17g", item->number);
    fputc('\n', out);
}

struct json_listing {
    struct json json;
    bool open; /* an object and its attributes are */
};

static void end_object(struct json_listing *listing)
{
    if (!listing->open)
        return;
    json_end_object(&listing->json);
    json_end_object(&listing->json);
}

static void list_json(void *context, const struct phys_hdf5_item *item)
{
    struct json_listing *listing = context;
    struct json *json = &listing->json;
    if (item->attribute) {
        if (item->kind == PHYS_HDF5_TEXT || item->kind == PHYS_HDF5_OTHER)
            json_text(json, item->attribute, item->text);
        else
            json_number(json, item->attribute, item->number);
        return;
    }
    end_object(listing);
    listing->open = true;
    json_object(json, NULL);
    json_text(json, "object", item->object);
    json_text(json, "kind", phys_hdf5_kind_name(item->kind));
    json_array(json, "shape");
    for (size_t k = 0; k < item->rank; k++)
        json_count(json, NULL, item->dims[k]);
    json_end_array(json);
    json_object(json, "attributes");
}

static enum ad_status contents(phys_hdf5 *file, const struct options *options, FILE *csv,
                               struct ad_error *error)
{
    if (csv) {
        fputs("object,attribute,kind,shape,value\n", csv);
        phys_hdf5_list(file, list_csv, csv, error);
    }
    if (options->common.json) {
        struct json_listing listing = {0};
        json_open(&listing.json, stdout);
        json_text(&listing.json, "file", options->common.argument[0]);
        json_array(&listing.json, "contents");
        phys_hdf5_list(file, list_json, &listing, error);
        end_object(&listing);
        json_end_array(&listing.json);
        json_close(&listing.json);
    } else if (!csv) {
        struct text_listing listing = {.out = stdout};
        phys_hdf5_list(file, list_text, &listing, error);
        if (listing.number[0])
            fputc('\n', stdout);
    }
    return error->status;
}

/* ---- one dataset ---- */

enum { AT_ONCE = 1 << 15 }; /* numbers read at once, if a record has not more */

/* Rows of the last dimension (one number a row where there is only one); with three dimensions and
   more, the indices of the others come first. */
struct table {
    const struct phys_hdf5_item *item;
    size_t rows, columns; /* of one record */
    size_t many;          /* records read at once */
    double *records;
};

static void print_record(FILE *out, const struct table *table, size_t record, const double *values,
                         const char *separator, int digits)
{
    for (size_t row = 0; row < table->rows; row++) {
        if (table->item->rank > 2)
            fprintf(out, "%zu%s%zu%s", record, separator, row, separator);
        for (size_t k = 0; k < table->columns; k++)
            fprintf(out, "%s%.*g", k ? separator : "", digits, *values++);
        fputc('\n', out);
    }
}

static void json_record(struct json *json, const struct table *table, const double *values)
{
    if (table->item->rank > 1)
        json_array(json, NULL);
    for (size_t row = 0; row < table->rows; row++) {
        if (table->item->rank > 2)
            json_array(json, NULL);
        for (size_t k = 0; k < table->columns; k++)
            json_number(json, NULL, *values++);
        if (table->item->rank > 2)
            json_end_array(json);
    }
    if (table->item->rank > 1)
        json_end_array(json);
}

/* Some records at a time, so that a long history needs the memory of these. */
static enum ad_status print_records(phys_hdf5 *file, const struct options *options,
                                    const struct table *table, FILE *csv, struct json *json,
                                    struct ad_error *error)
{
    const size_t all = table->item->dims[0];
    for (size_t record = 0; record < all; record++) {
        size_t at = record % table->many,
               n = all - record < table->many ? all - record : table->many;
        const double *values = table->records + at * table->rows * table->columns;
        if (at == 0 &&
            phys_hdf5_read(file, options->dataset, record, n, table->records, error) != AD_OK)
            return error->status;
        if (json)
            json_record(json, table, values);
        if (csv)
            print_record(csv, table, record, values, ",", 17);
        else if (!json)
            print_record(stdout, table, record, values, "  ", 10);
    }
    return AD_OK;
}

static enum ad_status print_dataset(phys_hdf5 *file, const struct options *options,
                                    const struct table *table, FILE *csv, struct ad_error *error)
{
    struct json json;
    if (!options->common.json)
        return print_records(file, options, table, csv, NULL, error);
    json_open(&json, stdout);
    json_text(&json, "file", options->common.argument[0]);
    json_text(&json, "dataset", options->dataset);
    json_array(&json, "values");
    enum ad_status status = print_records(file, options, table, csv, &json, error);
    json_end_array(&json);
    json_close(&json);
    return status;
}

static enum ad_status dataset(phys_hdf5 *file, const struct options *options, FILE *csv,
                              struct ad_error *error)
{
    struct phys_hdf5_item item;
    struct table table = {.item = &item, .rows = 1, .columns = 1};
    struct ad_error why = {0};
    if (phys_hdf5_shape(file, options->dataset, &item, &why) != AD_OK)
        return ad_fail(error, why.status, "%s; leastaction dump %s lists all", why.message,
                       options->common.argument[0]);
    if (item.rank < 1 || item.rank > 3)
        return ad_fail(error, AD_E_INPUT, "%s: '%s' has %zu dimensions, expected 1 to 3",
                       options->common.argument[0], options->dataset, item.rank);
    if (item.rank > 1)
        table.columns = item.dims[item.rank - 1];
    if (item.rank > 2)
        table.rows = item.dims[1];
    if (table.columns && table.rows > SIZE_MAX / sizeof(double) / table.columns)
        return ad_fail(error, AD_E_INPUT, "%s: '%s' is too large", options->common.argument[0],
                       options->dataset);
    const size_t record = table.rows * table.columns;
    table.many = record && record < AT_ONCE ? AT_ONCE / record : 1;
    table.records = malloc(table.many * record * sizeof(double) + 1);
    if (!table.records)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    print_dataset(file, options, &table, csv, error);
    free(table.records);
    return error->status;
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    phys_hdf5 *file;
    struct result csv;
    if (phys_hdf5_open(options->common.argument[0], &file, error) != AD_OK)
        return command_status(error);
    if (result_begin(&csv, options->csv, error) == AD_OK) {
        if ((options->dataset ? dataset : contents)(file, options, csv.out, error) == AD_OK)
            result_commit(&csv, error);
        else
            result_abandon(&csv);
    }
    phys_hdf5_close(file);
    return command_status(error);
}

#define AT(member) offsetof(struct options, member)

static const struct option table[] = {
    {"dataset", "NAME", OPTION_TEXT, NULL, "print its numbers [list the contents]", AT(dataset)},
    {"csv", "FILE", OPTION_OUTPUT, NULL, "as CSV; - is standard output", AT(csv)},
};

const struct command command_dump = {
    .line = {.name = "dump",
             .what = "the contents of a run file as text, CSV or JSON",
             .arguments = {"FILE.h5"},
             .options = table,
             .n_options = sizeof table / sizeof *table},
    .bytes = sizeof(struct options),
    .run = run,
};
