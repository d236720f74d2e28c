/* Scans of parameters (scan.h). */
#include "apps/interrupt.h"
#include "autodiff/free.h"
#include "physics/io/grow.h"
#include "progress.h"
#include "report_rows.h"
#include "scan_parts.h"

#include <ctype.h>
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
    struct result_column *column =
        column_of(scan, key, row->unit, row->label && row->kind == NUMBER);
    if (column)
        column->value[scan->run] = value;
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
    member->scanning = (struct scan *)scan;
    if (scan_axes_store(scan, scan->run, member, error) == AD_OK && scan->command->line.members)
        name_files(scan, member, name, error);
    return error->status;
}

/* One run; `only_check`: whether it could be. */
static void run_one(struct scan *scan, bool only_check, struct ad_error *error)
{
    struct ad_error missed = {0};
    struct common *member = malloc(scan->command->bytes);
    struct phys_setting *settings = calloc(scan->common->set.n + scan->axes, sizeof *settings);
    char *name[FILES_OF_MEMBER] = {NULL};
    if (!member || !settings) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    } else if (set_member(scan, member, settings, name, error) == AD_OK && !only_check) {
        member->csv = member->plot = NULL; /* of the table */
        const int status = scan->command->run(member, &missed);
        scan->status[scan->run] = status;
        if (status == WRONG_USE && scan->done == 0) /* so would be all */
            *error = missed;
        if (status != DONE && scan->missed++ == 0) {
            scan->first = scan->run;
            scan->why = missed;
        }
        scan->done += status != WRONG_USE;
    }
    for (size_t k = 0; k < FILES_OF_MEMBER; k++)
        free(name[k]);
    AD_FREE(member, settings);
}

static bool varies(const struct scan *scan, const struct result_column *column)
{
    double low = INFINITY, high = -INFINITY;
    for (size_t k = 0; k < scan->runs; k++) {
        low = fmin(low, isnan(column->value[k]) ? low : column->value[k]);
        high = fmax(high, isnan(column->value[k]) ? high : column->value[k]);
    }
    return low < high;
}

/* Whether a key is the one asked for; items FROM-TO there are any of these. */
static bool matches(const char *key, const char *asked, size_t length)
{
    const char *end = asked + length;
    for (; asked < end; asked++, key++) {
        char *dash, *behind, *after;
        const unsigned long from = strtoul(asked, &dash, 10);
        if (isdigit((unsigned char)*asked) && *dash == '-') {
            const unsigned long to = strtoul(dash + 1, &behind, 10),
                                item = strtoul(key, &after, 10);
            return after > key && item >= from && item <= to &&
                   matches(after, behind, behind < end ? (size_t)(end - behind) : 0);
        }
        if (*asked != *key)
            return false;
    }
    return *key == 0;
}

/* --curves KEY,...; else the first that the text has and that vary. */
static enum ad_status choose(struct scan *scan, struct ad_error *error)
{
    size_t shown = 0;
    const char *names = scan->common->curves;
    for (size_t length; names && *names; names += length + (names[length] == ',')) {
        size_t found = 0, fresh = 0;
        length = strcspn(names, ",");
        for (size_t k = 0; k < scan->n; k++) {
            struct result_column *column = &scan->column[k];
            if (!matches(column->key, names, length))
                continue;
            found++;
            if (!column->shown) {
                fresh++;
                column->panel = shown + 1;
            }
            column->shown = true;
        }
        if (found == 0)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--curves: no number '%.*s' in the results; --json lists them",
                           (int)length, names);
        if (found > 1 && scan->axes == AXES)
            return ad_fail(error, AD_E_ARGUMENT,
                           "--curves: '%.*s' are %zu numbers; a map shows one", (int)length, names,
                           found);
        shown += fresh > 0;
        if (shown > PANELS)
            return ad_fail(error, AD_E_ARGUMENT, "--curves: expected at most %d", PANELS);
    }
    for (size_t k = 0; k < 2 * scan->n && !scan->common->curves && shown < PANELS; k++) {
        struct result_column *column = &scan->column[k % scan->n]; /* those of the run first */
        const bool item = strchr(column->key, '.') != NULL;
        if (item == (k >= scan->n) && column->labelled && varies(scan, column)) {
            column->shown = true;
            column->panel = ++shown;
        }
    }
    return AD_OK;
}

static enum ad_status run_all(void *context, struct ad_error *error)
{
    struct scan *scan = context;
    const bool members = scan->command->line.members;
    struct progress progress;
    progress_start(&progress, scan->common->quiet || !members, NULL);
    for (scan->run = 0; scan->run < scan->runs && error->status == AD_OK; scan->run++) {
        if (progress_due(&progress))
            progress_line(&progress, (double)scan->run, (double)scan->runs, "run %zu of %zu",
                          scan->run + 1, scan->runs);
        run_one(scan, false, error);
        if (interrupted() && error->status == AD_OK)
            ad_fail(error, AD_E_ACCURACY, "ended on request in run %zu of %zu%s", scan->run + 1,
                    scan->runs, members ? "; --resume goes on" : "");
    }
    progress_end(&progress);
    if (scan->no_memory)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    return error->status == AD_OK ? choose(scan, error) : error->status;
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
    for (scan->run = 0; scan->run < scan->runs && error->status == AD_OK; scan->run++)
        run_one(scan, true, error);
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
        if (!scan.status) {
            ad_fail(error, AD_E_MEMORY, "out of memory");
        } else if (outputs_run(&scan_outputs, &table, &scan, run_all, error) == AD_OK &&
                   scan.missed) {
            name_run(&scan, scan.first, sizeof where, where);
            ad_fail(error, AD_E_ACCURACY,
                    "%zu of %zu runs did not reach what was asked; at %s: %.200s", scan.missed,
                    scan.runs, where, scan.why.message);
        }
    }
    for (size_t k = 0; k < scan.n; k++)
        free(scan.column[k].value);
    AD_FREE(scan.column, scan.status);
    scan_axes_free(&scan);
    return command_status(error);
}
