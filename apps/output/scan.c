/* Scans of parameters (scan.h). */
#include "apps/interrupt.h"
#include "autodiff/free.h"
#include "hnn/hnn.h"
#include "physics/io/grow.h"
#include "report_rows.h"
#include "scan_parts.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT_OF(a) (sizeof(a) / sizeof(a)[0])

double scan_between(const struct axis_of_scan *a, double k)
{
    const double share = k / (double)(a->n - 1);
    if (share == 1)
        return a->to;
    return a->log ? a->from * pow(a->to / a->from, share) : a->from + (a->to - a->from) * share;
}

size_t scan_place(const struct scan *scan, size_t axis, size_t run)
{
    return axis + 1 < scan->axes ? run / scan->axis[1].n : run % scan->axis[axis].n;
}

double scan_value(const struct scan *scan, size_t axis, size_t run)
{
    return scan_between(&scan->axis[axis], (double)scan_place(scan, axis, run));
}

/* NAME=FROM:TO:N, or NAME=FROM:TO:N:log */
static enum ad_status read_axis(struct scan *scan, const char *text, struct ad_error *error)
{
    struct axis_of_scan *a = &scan->axis[scan->axes];
    char copy[256], *part[4] = {NULL}, *next = NULL;
    uint64_t n = 0;
    size_t parts = 0;
    snprintf(copy, sizeof copy, "%s", text);
    char *equals = strchr(copy, '=');
    for (char *p = equals ? equals + 1 : NULL; p && parts < COUNT_OF(part); p = next) {
        next = strchr(p, ':');
        if (next)
            *next++ = '\0';
        part[parts++] = p;
    }
    if (!equals || parts < 3 || next || strlen(text) >= sizeof copy ||
        !options_number(part[0], &a->from) || !options_number(part[1], &a->to) ||
        !options_integer(part[2], MOST, &n) || n < 2 || a->from == a->to ||
        (part[3] && strcmp(part[3], "log") != 0))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--scan: expected NAME=FROM:TO:N, N from 2, as in m=1:2:11, or "
                       "m=1:100:5:log, got '%s'",
                       text);
    a->log = part[3] != NULL;
    if (a->log && !(a->from > 0 && a->to > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--scan: log needs values above 0, got '%s'", text);
    a->n = (size_t)n;
    snprintf(a->name, sizeof a->name, "%.*s", (int)(equals - copy), copy);
    scan->axes++;
    return AD_OK;
}

/* Names and units of the parameters, before anything runs. */
static enum ad_status check_axes(struct scan *scan, struct ad_error *error)
{
    struct phys_system system;
    const struct settings *set = &scan->common->set;
    for (size_t k = 0; k < COUNT_OF(scan->common->argument); k++)
        if (scan->common->line->arguments[k] && strstr(scan->common->line->arguments[k], "SCENE"))
            scan->scene = scan->common->argument[k];
    if (!scan->scene)
        return ad_fail(error, AD_E_ARGUMENT, "--scan needs a scene");
    if (hnn_system_open(scan->scene, &system, error) == AD_OK)
        for (size_t k = 0; k < scan->axes && error->status == AD_OK; k++) {
            struct axis_of_scan *a = &scan->axis[k];
            for (size_t i = 0; i < set->n; i++)
                if (strcmp(set->setting[i].name, a->name) == 0)
                    ad_fail(error, AD_E_ARGUMENT, "--scan does not go with --set %s", a->name);
            if (k == 1 && strcmp(a->name, scan->axis[0].name) == 0)
                ad_fail(error, AD_E_ARGUMENT, "--scan: %s twice", a->name);
            if (isnan(phys_system_get(&system, a->name)))
                phys_system_set(&system, a->name, a->from, error); /* names the nearest */
            for (size_t i = 0; i < system.scene->n_params; i++)
                if (strcmp(system.scene->params[i].name, a->name) == 0)
                    snprintf(a->unit, sizeof a->unit, "%s",
                             system.scene->params[i].unit ? system.scene->params[i].unit : "");
        }
    phys_system_close(&system);
    return error->status;
}

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

/* One run, with the scanned values behind the others of --set. */
static void run_one(struct scan *scan, struct ad_error *error)
{
    struct ad_error missed = {0};
    const struct settings *set = &scan->common->set;
    struct common *member = malloc(scan->command->bytes);
    struct phys_setting *settings = calloc(set->n + scan->axes, sizeof *settings);
    if (member && settings) {
        memcpy(member, scan->common, scan->command->bytes);
        if (set->n)
            memcpy(settings, set->setting, set->n * sizeof *settings);
        for (size_t a = 0; a < scan->axes; a++)
            settings[set->n + a] =
                (struct phys_setting){scan->axis[a].name, scan_value(scan, a, scan->run)};
        member->set = (struct settings){set->n + scan->axes, settings};
        member->out = member->csv = member->plot = NULL;
        member->quiet = true;
        member->json = false;
        member->scanning = scan;
        const int status = scan->command->run(member, &missed);
        scan->status[scan->run] = status;
        if (status == WRONG_USE && scan->done == 0) /* so would be all */
            *error = missed;
        if (status != DONE && scan->missed++ == 0) {
            scan->first = scan->run;
            scan->why = missed;
        }
        scan->done += status != WRONG_USE;
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
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
    for (; scan->run < scan->runs && error->status == AD_OK; scan->run++) {
        run_one(scan, error);
        if (interrupted() && error->status == AD_OK)
            return ad_fail(error, AD_E_ACCURACY, "--scan: ended on request after %zu of %zu runs",
                           scan->run + 1, scan->runs);
    }
    if (scan->no_memory)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    return error->status == AD_OK ? choose(scan, error) : error->status;
}

int scan_run(const struct command *command, const struct common *common, struct ad_error *error)
{
    struct scan scan = {.command = command, .common = common, .runs = 1};
    if (common->scan.n > AXES)
        ad_fail(error, AD_E_ARGUMENT, "--scan: at most %d parameters, got %zu", AXES,
                common->scan.n);
    for (size_t k = 0; k < common->scan.n && error->status == AD_OK; k++)
        if (read_axis(&scan, common->scan.text[k], error) == AD_OK)
            scan.runs *= scan.axis[k].n;
    if (error->status == AD_OK && scan.runs > MOST)
        ad_fail(error, AD_E_ARGUMENT, "--scan: %zu runs; expected at most %d", scan.runs, MOST);
    if (error->status == AD_OK && check_axes(&scan, error) == AD_OK) {
        scan.status = calloc(scan.runs, sizeof *scan.status);
        if (!scan.status)
            ad_fail(error, AD_E_MEMORY, "out of memory");
        else if (outputs_run(&scan_outputs, common, &scan, run_all, error) == AD_OK && scan.missed)
            ad_fail(error, AD_E_ACCURACY,
                    "%zu of %zu runs did not reach what was asked; at %s = %g: %.300s", scan.missed,
                    scan.runs, scan.axis[0].name, scan_value(&scan, 0, scan.first),
                    scan.why.message);
    }
    for (size_t k = 0; k < scan.n; k++)
        free(scan.column[k].value);
    AD_FREE(scan.column, scan.status);
    return command_status(error);
}
