/* What a scan runs over (scan_parts.h): a parameter of the scene, --scan, or an option, --sweep and
   --seeds. */
#include "apps/option_values.h"
#include "hnn/hnn.h"
#include "physics/io/grow.h"
#include "scan_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT_OF(a) (sizeof(a) / sizeof(a)[0])

double scan_between(const struct axis_of_scan *a, double k)
{
    const double share = k / (double)(a->n - 1);
    if (a->list)
        return k;
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
    const struct axis_of_scan *a = &scan->axis[axis];
    const size_t place = scan_place(scan, axis, run);
    double value = NAN;
    if (!a->option)
        return scan_between(a, (double)place);
    return options_number(a->text[place], &value) ? value : (double)NAN;
}

const char *scan_word(const struct scan *scan, size_t axis, size_t run)
{
    const struct axis_of_scan *a = &scan->axis[axis];
    const char *text = a->option ? a->text[scan_place(scan, axis, run)] : NULL;
    double number;
    return text && !options_number(text, &number) ? text : NULL;
}

/* ---- reading ---- */

static enum ad_status refuse(const struct axis_of_scan *a, const char *text, struct ad_error *error)
{
    return ad_fail(error, AD_E_ARGUMENT,
                   "--%s: expected NAME=FROM:TO:N, N from 2, as in m=1:2:11, or "
                   "m=1:100:5:log%s, got '%s'",
                   a->flag, a->option ? ", or lr=1e-2,1e-3" : "", text);
}

/* FROM:TO:N, or FROM:TO:N:log */
static enum ad_status read_range(struct axis_of_scan *a, const char *values, const char *text,
                                 struct ad_error *error)
{
    char copy[256], *part[4] = {NULL}, *next = NULL;
    uint64_t n = 0;
    size_t parts = 0;
    snprintf(copy, sizeof copy, "%s", values);
    for (char *p = copy; p && parts < COUNT_OF(part); p = next) {
        next = strchr(p, ':');
        if (next)
            *next++ = '\0';
        part[parts++] = p;
    }
    if (parts < 3 || next || strlen(text) >= sizeof copy || !options_number(part[0], &a->from) ||
        !options_number(part[1], &a->to) || !options_integer(part[2], MOST, &n) || n < 2 ||
        a->from == a->to || (part[3] && strcmp(part[3], "log") != 0))
        return refuse(a, text, error);
    a->log = part[3] != NULL;
    if (a->log && !(a->from > 0 && a->to > 0))
        return ad_fail(error, AD_E_ARGUMENT, "--%s: log needs values above 0, got '%s'", a->flag,
                       text);
    a->n = (size_t)n;
    return AD_OK;
}

static enum ad_status add_text(struct axis_of_scan *a, const char *from, size_t length,
                               struct ad_error *error)
{
    char *copy = phys_grow(&a->text, a->n, sizeof *a->text) ? strndup(from, length) : NULL;
    if (!copy)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    a->text[a->n++] = copy;
    for (size_t k = 0; k + 1 < a->n; k++)
        if (strcmp(a->text[k], copy) == 0)
            return ad_fail(error, AD_E_ARGUMENT, "--%s: %s = %s twice", a->flag, a->name, copy);
    return AD_OK;
}

/* Values in six digits, which are those that the option gets. */
static enum ad_status write_range(struct axis_of_scan *a, struct ad_error *error)
{
    const size_t n = a->n;
    char text[32];
    for (size_t k = a->n = 0; k < n && error->status == AD_OK; k++) {
        const struct axis_of_scan all = {.from = a->from, .to = a->to, .n = n, .log = a->log};
        snprintf(text, sizeof text, "%.6g", scan_between(&all, (double)k));
        add_text(a, text, strlen(text), error);
    }
    return error->status;
}

static enum ad_status read_list(struct axis_of_scan *a, const char *values, const char *text,
                                struct ad_error *error)
{
    a->list = true;
    for (size_t length; error->status == AD_OK; values += length + 1) {
        length = strcspn(values, ",");
        if (length == 0)
            return refuse(a, text, error);
        add_text(a, values, length, error);
        if (!values[length])
            break;
    }
    return error->status;
}

static bool can_be_swept(const struct option *option)
{
    static const char *const others[] = {"seeds", "curves"};
    bool is = option->kind == OPTION_TEXT ||
              (option->kind >= OPTION_NUMBER && option->kind <= OPTION_SEED);
    for (size_t k = 0; k < COUNT_OF(others); k++)
        is = is && strcmp(option->name, others[k]) != 0;
    return is;
}

/* The row of an option whose value is no file. */
static enum ad_status find_option(const struct scan *scan, struct axis_of_scan *a,
                                  struct ad_error *error)
{
    const struct command_line *line = &scan->command->line;
    const char *names[64];
    const struct option *rows[64];
    size_t n = 0;
    for (size_t k = 0; k < options_rows(line) && n < COUNT_OF(names); k++)
        if (can_be_swept(options_row(line, k))) {
            rows[n] = options_row(line, k);
            names[n] = rows[n]->name;
            n++;
        }
    const size_t found = phys_find("option to sweep", a->name, n, names, error);
    if (error->status != AD_OK)
        return error->status;
    a->option = rows[found];
    if (scan->common->given >> options_find(line, a->name, strlen(a->name)) & 1)
        return ad_fail(error, AD_E_ARGUMENT, "--%s does not go with --%s", a->flag, a->name);
    return AD_OK;
}

static enum ad_status read_axis(struct scan *scan, const char *flag, const char *text,
                                struct ad_error *error)
{
    if (scan->axes == AXES)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: at most %d of --scan, --sweep and --seeds",
                       flag, AXES);
    struct axis_of_scan *a = &scan->axis[scan->axes++];
    const char *equals = strchr(text, '=');
    a->flag = flag;
    if (!equals || (size_t)(equals - text) >= sizeof a->name)
        return refuse(a, text, error);
    snprintf(a->name, sizeof a->name, "%.*s", (int)(equals - text), text);
    if (strcmp(flag, "scan") == 0)
        return read_range(a, equals + 1, text, error);
    if (find_option(scan, a, error) != AD_OK)
        return error->status;
    return strchr(equals, ',')                               ? read_list(a, equals + 1, text, error)
           : read_range(a, equals + 1, text, error) == AD_OK ? write_range(a, error)
                                                             : error->status;
}

/* FROM:TO, every whole number. */
static enum ad_status read_seeds(struct scan *scan, const char *text, struct ad_error *error)
{
    const char *colon = strchr(text, ':');
    char all[96] = "";
    uint64_t from, to;
    if (colon && colon - text < 30) {
        snprintf(all, sizeof all, "%.*s", (int)(colon - text), text);
        if (options_integer(all, MOST_SEED, &from) && options_integer(colon + 1, MOST_SEED, &to) &&
            from < to) {
            snprintf(all, sizeof all, "seed=%llu:%llu:%llu", (unsigned long long)from,
                     (unsigned long long)to, (unsigned long long)(to - from + 1));
            return read_axis(scan, "seeds", all, error);
        }
    }
    return ad_fail(error, AD_E_ARGUMENT, "--seeds: expected FROM:TO, as in 0:9, got '%s'", text);
}

/* ---- checking ---- */

/* Names and units of the parameters of the scene. */
static enum ad_status check_parameters(struct scan *scan, struct ad_error *error)
{
    struct phys_system system;
    const struct settings *set = &scan->common->set;
    if (!scan->scene)
        return ad_fail(error, AD_E_ARGUMENT, "--scan needs a scene");
    if (hnn_system_open(scan->scene, &system, error) == AD_OK)
        for (size_t k = 0; k < scan->axes && error->status == AD_OK; k++) {
            struct axis_of_scan *a = &scan->axis[k];
            for (size_t i = 0; i < set->n && !a->option; i++)
                if (strcmp(set->setting[i].name, a->name) == 0)
                    ad_fail(error, AD_E_ARGUMENT, "--scan does not go with --set %s", a->name);
            if (!a->option && isnan(phys_system_get(&system, a->name)))
                phys_system_set(&system, a->name, a->from, error); /* names the nearest */
            for (size_t i = 0; i < system.scene->n_params && !a->option; i++)
                if (strcmp(system.scene->params[i].name, a->name) == 0)
                    snprintf(a->unit, sizeof a->unit, "%s",
                             system.scene->params[i].unit ? system.scene->params[i].unit : "");
        }
    phys_system_close(&system);
    return error->status;
}

static enum ad_status check_axes(struct scan *scan, struct ad_error *error)
{
    bool parameters = false;
    for (size_t k = 0; k < scan->axes; k++) {
        const struct axis_of_scan *a = &scan->axis[k];
        parameters = parameters || !a->option;
        for (size_t i = 0; a->option && i < a->n; i++)
            if (scan->command->line.members && strchr(a->text[i], '/'))
                return ad_fail(error, AD_E_ARGUMENT, "--%s: %s cannot be part of a file name",
                               a->flag, a->text[i]);
    }
    if (scan->axes > 1 && !scan->axis[0].option == !scan->axis[1].option &&
        strcmp(scan->axis[0].name, scan->axis[1].name) == 0)
        return ad_fail(error, AD_E_ARGUMENT, "--%s: %s twice", scan->axis[1].flag,
                       scan->axis[1].name);
    for (size_t k = 0; k < COUNT_OF(scan->common->argument); k++)
        if (scan->common->line->arguments[k] && strstr(scan->common->line->arguments[k], "SCENE"))
            scan->scene = scan->common->argument[k];
    return parameters ? check_parameters(scan, error) : AD_OK;
}

enum ad_status scan_axes_read(struct scan *scan, struct ad_error *error)
{
    const struct common *c = scan->common;
    for (size_t k = 0; k < c->scan.n && error->status == AD_OK; k++)
        read_axis(scan, "scan", c->scan.text[k], error);
    for (size_t k = 0; k < c->sweep.n && error->status == AD_OK; k++)
        read_axis(scan, "sweep", c->sweep.text[k], error);
    if (c->seeds && error->status == AD_OK)
        read_seeds(scan, c->seeds, error);
    for (size_t k = 0; k < scan->axes; k++)
        scan->runs *= scan->axis[k].n;
    if (error->status == AD_OK && scan->runs > MOST)
        ad_fail(error, AD_E_ARGUMENT, "--%s: %zu runs; expected at most %d", scan->axis[0].flag,
                scan->runs, MOST);
    return error->status == AD_OK ? check_axes(scan, error) : error->status;
}

void scan_axes_free(struct scan *scan)
{
    for (size_t k = 0; k < AXES; k++) {
        for (size_t i = 0; scan->axis[k].text && i < scan->axis[k].n; i++)
            free(scan->axis[k].text[i]);
        free(scan->axis[k].text);
    }
}

/* ---- a run ---- */

enum ad_status scan_axes_store(const struct scan *scan, size_t run, struct common *member,
                               struct ad_error *error)
{
    const struct command_line *line = &scan->command->line;
    for (size_t k = 0; k < scan->axes && error->status == AD_OK; k++) {
        const struct axis_of_scan *a = &scan->axis[k];
        if (a->option && option_store(a->option, a->text[scan_place(scan, k, run)], (char *)member,
                                      error) == AD_OK)
            member->given |= UINT64_C(1) << options_find(line, a->name, strlen(a->name));
    }
    return error->status;
}

char *scan_member_file(const struct scan *scan, size_t run, const char *file)
{
    const char *slash = strrchr(file, '/'), *dot = strrchr(slash ? slash : file, '.');
    size_t size = strlen(file) + 1, stem = dot ? (size_t)(dot - file) : size - 1, used = stem;
    for (size_t k = 0; k < scan->axes; k++)
        size +=
            strlen(scan->axis[k].name) + strlen(scan->axis[k].text[scan_place(scan, k, run)]) + 2;
    char *name = malloc(size);
    if (!name)
        return NULL;
    memcpy(name, file, stem);
    for (size_t k = 0; k < scan->axes; k++)
        used += (size_t)snprintf(name + used, size - used, "-%s=%s", scan->axis[k].name,
                                 scan->axis[k].text[scan_place(scan, k, run)]);
    snprintf(name + used, size - used, "%s", file + stem);
    return name;
}
