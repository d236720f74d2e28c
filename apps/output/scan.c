/* Scans of parameters (scan.h). */
#include "apps/interrupt.h"
#include "autodiff/free.h"
#include "physics/io/grow.h"
#include "page.h"
#include "progress.h"
#include "report_rows.h"
#include "scan_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FILES_OF_MEMBER = 4 };

static struct result_column *column_of(struct scan *scan, const char *key, const char *unit,
                                       bool labelled)
{
    for (size_t k = 0; k < scan->n; k++)
        if (strcmp(scan->column[k].key, key) == 0)
            return &scan->column[k];
    double *value = malloc(scan->runs * sizeof *value);
    if (!value || !phys_grow(&scan->column, scan->n, sizeof *scan->column)) {
        free(value);
        scan->no_memory = true;
        return NULL;
    }
    for (size_t k = 0; k < scan->runs; k++)
        value[k] = NAN;
    struct result_column *column = &scan->column[scan->n++];
    *column = (struct result_column){.value = value, .labelled = labelled};
    snprintf(column->key, sizeof column->key, "%s", key);
    snprintf(column->unit, sizeof column->unit, "%s", unit);
    return column;
}

static void take(struct scan *scan, const struct report_row *row, const char *key, double value)
{
    struct scan_row taken = {.labelled = row->label && row->kind == NUMBER, .value = value};
    bool scanned = false;
    for (size_t a = 0; a < scan->axes; a++)
        scanned = scanned || strcmp(scan->axis[a].name, key) == 0;
    snprintf(taken.key, sizeof taken.key, "%s%s", scanned ? "result." : "", key);
    snprintf(taken.unit, sizeof taken.unit, "%s", row->unit);
    scan->no_memory |= fwrite(&taken, sizeof taken, 1, scan->rows) != 1;
}

/* Items of arrays and lists are counted from 1: modes.1.frequency. */
void scan_take(struct scan *scan, const struct report *report)
{
    for (size_t k = 0; k < report->n; k++) {
        const struct report_row *row = &report->row[k];
        char key[KEY], entry[KEY + 24];
        if (!row->key || (row->passing && !row->array)) /* times of the machine */
            continue;
        if (row->array) {
            size_t first = k;
            while (first > 0 && report->row[first - 1].array &&
                   strcmp(report->row[first - 1].array, row->array) == 0)
                first--;
            snprintf(key, sizeof key, "%s.%zu.%s", row->array,
                     row->item - report->row[first].item + 1, row->key);
        } else {
            snprintf(key, sizeof key, "%s%s%s", row->object ? row->object : "",
                     row->object ? "." : "", row->key);
        }
        if (row->kind == NUMBER)
            take(scan, row, key, row->number);
        else if (row->kind == COUNT || row->kind == FLAG)
            take(scan, row, key, (double)row->n);
        for (size_t i = 0; row->kind == LIST && row->n <= LONGEST && i < row->n; i++) {
            snprintf(entry, sizeof entry, "%s.%zu", key, i + 1);
            entry[KEY - 1] = '\0';
            take(scan, row, entry, row->list[i]);
        }
    }
}

/* The files that a run of a command with members writes for itself. */
static enum ad_status name_files(const struct scan *scan, struct common *member,
                                 char *name[FILES_OF_MEMBER], struct ad_error *error)
{
    const struct command_line *line = &scan->command->line;
    size_t n = 0;
    for (size_t k = 0; k < options_rows(line); k++) {
        const struct option *option = options_row(line, k);
        const char **file = (const char **)(void *)((char *)member + option->offset);
        if (option->kind != OPTION_OUTPUT || file == &member->csv || !*file ||
            strcmp(*file, "-") == 0 || n == FILES_OF_MEMBER)
            continue;
        *file = name[n] = scan_member_file(scan, scan->run, *file);
        if (!name[n++])
            return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    return options_check_files(line, member, error);
}

/* The options of the run that is on, whose parameters are behind the others of --set. */
static enum ad_status set_member(const struct scan *scan, struct common *member,
                                 struct phys_setting *settings, char *name[FILES_OF_MEMBER],
                                 struct ad_error *error)
{
    const struct settings *set = &scan->common->set;
    size_t n = set->n;
    memcpy(member, scan->common, scan->command->bytes);
    if (n)
        memcpy(settings, set->setting, n * sizeof *settings);
    for (size_t a = 0; a < scan->axes; a++)
        if (!scan->axis[a].option)
            settings[n++] =
                (struct phys_setting){scan->axis[a].name, scan_value(scan, a, scan->run)};
    member->set = (struct settings){n, settings};
    if (!scan->command->line.members)
        member->out = NULL;
    member->quiet = true;
    member->json = false;
    member->ranks = NULL;
    member->scanning = (struct scan *)scan;
    if (scan_axes_store(scan, scan->run, member, error) == AD_OK && scan->command->line.members)
        name_files(scan, member, name, error);
    return error->status;
}

/* One run; `only_check`: whether it could be. */
static int run_one(struct scan *scan, bool only_check, struct ad_error *missed,
                   struct ad_error *error)
{
    int status = DONE;
    struct common *member = malloc(scan->command->bytes);
    struct phys_setting *settings = calloc(scan->common->set.n + scan->axes, sizeof *settings);
    char *name[FILES_OF_MEMBER] = {NULL};
    if (!member || !settings) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    } else if (set_member(scan, member, settings, name, error) == AD_OK && !only_check) {
        member->csv = member->plot = NULL; /* of the table */
        status = scan->command->run(member, missed);
        if (status == WRONG_USE && scan->run == 0) /* so would be all */
            *error = *missed;
    }
    for (size_t k = 0; k < FILES_OF_MEMBER; k++)
        free(name[k]);
    AD_FREE(member, settings);
    return status;
}

/* The head of a record; its rows follow. */
struct record_head {
    int status;
    struct ad_error missed;
};

/* Runs one and keeps its record; the result is the rank. */
static enum ad_status record_one(void *context, size_t run, void *rank, struct ad_error *error)
{
    struct scan *scan = context;
    struct scan_record *record = &scan->record[run];
    struct record_head head = {0};
    scan->run = run;
    scan->rows = open_memstream(&record->bytes, &record->n);
    if (!scan->rows)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    scan->no_memory |= fwrite(&head, sizeof head, 1, scan->rows) != 1; /* its place */
    head.status = run_one(scan, false, &head.missed, error);
    scan->no_memory |= fclose(scan->rows) != 0;
    if (scan->no_memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(record->bytes, &head, sizeof head);
    if (rank)
        *(size_t *)rank = scan->common->ranks->rank;
    if (interrupted() && error->status == AD_OK)
        ad_fail(error, AD_E_ACCURACY, "ended on request in run %zu of %zu%s", run + 1, scan->runs,
                scan->command->line.members ? "; --resume goes on" : "");
    return error->status;
}

/* The first run of a scan is one of all ranks, because wrong use ends the scan there; members,
   which leave files, are checked before they run. */
static size_t first_dealt(const struct scan *scan) { return scan->command->line.members ? 0 : 1; }

static enum ad_status record_next(void *context, size_t k, void *rank, struct ad_error *error)
{
    return record_one(context, first_dealt(context) + k, rank, error);
}

/* A record into the table, in the order of runs. */
static void enter(struct scan *scan, size_t run)
{
    struct scan_record *record = &scan->record[run];
    struct record_head head;
    struct scan_row row;
    memcpy(&head, record->bytes, sizeof head);
    scan->status[run] = head.status;
    if (head.status != DONE && scan->missed++ == 0) {
        scan->first = run;
        scan->why = head.missed;
    }
    for (size_t at = sizeof head; at + sizeof row <= record->n; at += sizeof row) {
        memcpy(&row, record->bytes + at, sizeof row);
        struct result_column *column = column_of(scan, row.key, row.unit, row.labelled);
        if (column)
            column->value[run] = row.value;
    }
    free(record->bytes);
    *record = (struct scan_record){0};
}

static enum ad_status run_ranks(struct scan *scan, struct ad_error *error)
{
    struct ad_ranks *ranks = scan->common->ranks;
    const size_t runs = scan->runs, first = first_dealt(scan);
    size_t *rank = calloc(runs, sizeof *rank);
    if (!rank)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (first > 0 && record_one(scan, 0, rank, error) == AD_OK)
        enter(scan, 0);
    if (ad_ranks_agree(ranks, error) == AD_OK)
        ad_ranks_deal(ranks, runs - first, sizeof *rank, record_next, scan, rank + first, error);
    for (size_t k = first; k < runs && error->status == AD_OK; k++) {
        struct scan_record *record = &scan->record[k];
        void *bytes = record->bytes;
        ad_ranks_spread(ranks, rank[k], &bytes, &record->n, error);
        record->bytes = bytes;
        if (error->status == AD_OK)
            enter(scan, k);
    }
    free(rank);
    return error->status;
}

static bool has_panels(const struct scan *scan)
{
    bool any = false;
    for (size_t k = 0; k < scan->n; k++)
        any = any || scan->column[k].panel > 0;
    return any;
}

/* What cannot be shown is told behind the tables, which are written. */
static enum ad_status run_all(void *context, struct ad_error *error)
{
    struct scan *scan = context;
    struct progress progress;
    progress_start(&progress, scan->common->quiet || !scan->command->line.members, NULL);
    if (scan->common->ranks)
        run_ranks(scan, error);
    for (size_t k = 0; !scan->common->ranks && k < scan->runs && error->status == AD_OK; k++) {
        if (progress_due(&progress))
            progress_line(&progress, (double)k, (double)scan->runs, "run %zu of %zu", k + 1,
                          scan->runs);
        if (record_one(scan, k, NULL, error) == AD_OK)
            enter(scan, k);
    }
    progress_end(&progress);
    if (scan->no_memory)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (error->status == AD_OK && scan_choose(scan, &scan->unshown) == AD_OK &&
        scan->common->plot && !page_wanted(scan->common->plot) && !has_panels(scan))
        ad_fail(&scan->unshown, AD_E_ARGUMENT,
                "--plot: no number changes with the scan; choose with --curves");
    return error->status;
}

/* " at lr = 1e-2, seed = 3" */
static void name_run(const struct scan *scan, size_t run, size_t size, char *text)
{
    size_t used = 0;
    for (size_t a = 0; a < scan->axes && used < size; a++) {
        const struct axis_of_scan *axis = &scan->axis[a];
        const char *between = a ? ", " : "";
        used += (size_t)(axis->option ? snprintf(text + used, size - used, "%s%s = %s", between,
                                                 axis->name, axis->text[scan_place(scan, a, run)])
                                      : snprintf(text + used, size - used, "%s%s = %g", between,
                                                 axis->name, scan_value(scan, a, run)));
    }
}

/* Files of the members that are none of the inputs are found before the first run. */
static enum ad_status check_members(struct scan *scan, struct ad_error *error)
{
    struct ad_error missed = {0};
    for (scan->run = 0; scan->run < scan->runs && error->status == AD_OK; scan->run++)
        run_one(scan, true, &missed, error);
    return error->status;
}

int scan_run(const struct command *command, const struct common *common, struct ad_error *error)
{
    struct common table = *common; /* whose outputs are those of the table */
    struct scan scan = {.command = command, .common = common, .runs = 1};
    char where[200];
    table.log = command->line.members ? NULL : common->log;
    if (scan_axes_read(&scan, error) == AD_OK && check_members(&scan, error) == AD_OK) {
        scan.status = calloc(scan.runs, sizeof *scan.status);
        scan.record = calloc(scan.runs, sizeof *scan.record);
        if (!scan.status || !scan.record) {
            ad_fail(error, AD_E_MEMORY, "out of memory");
        } else if (outputs_run(&scan_outputs, &table, &scan, run_all, error) == AD_OK &&
                   scan.unshown.status != AD_OK) {
            *error = scan.unshown;
        } else if (error->status == AD_OK && scan.missed) {
            name_run(&scan, scan.first, sizeof where, where);
            ad_fail(error, AD_E_ACCURACY,
                    "%zu of %zu runs did not reach what was asked; at %s: %.200s", scan.missed,
                    scan.runs, where, scan.why.message);
        }
    }
    for (size_t k = 0; k < scan.n; k++)
        free(scan.column[k].value);
    for (size_t k = 0; scan.record && k < scan.runs; k++)
        free(scan.record[k].bytes);
    AD_FREE(scan.column, scan.status, scan.record);
    scan_axes_free(&scan);
    return command_status(error);
}
