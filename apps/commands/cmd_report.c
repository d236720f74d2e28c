/* leastaction report: the runs of a folder on one page: a table, pictures, commands. */
#include "apps/command.h"
#include "apps/output/page.h"
#include "apps/output/result.h"
#include "apps/quote.h"

#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>

struct options {
    struct common common;
    const char *plot;
};

/* ---- the folder ---- */

enum { PICTURE_MOST = 1 << 20 }; /* bytes of a picture that is part of the page; others are links */

struct member {
    char *name, *path;
    struct stat status;
};

struct folder {
    size_t n;
    struct member *member; /* by name */
};

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct member *)a)->name, ((const struct member *)b)->name);
}

static void folder_free(struct folder *folder)
{
    for (size_t k = 0; k < folder->n; k++) {
        free(folder->member[k].name);
        free(folder->member[k].path);
    }
    free(folder->member);
}

static enum ad_status add(struct folder *folder, const char *directory, const char *name,
                          struct ad_error *error)
{
    struct member member = {.name = strdup(name)};
    char *start = text_joined(directory, "/");
    struct member *more = realloc(folder->member, (folder->n + 1) * sizeof *more);
    member.path = start ? text_joined(start, name) : NULL;
    free(start);
    if (more)
        folder->member = more;
    if (more && member.name && member.path) {
        if (stat(member.path, &member.status) == 0 && S_ISREG(member.status.st_mode)) {
            folder->member[folder->n++] = member;
            return AD_OK;
        }
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    free(member.name);
    free(member.path);
    return error->status;
}

static enum ad_status folder_read(const char *name, struct folder *folder, struct ad_error *error)
{
    DIR *members = opendir(name);
    *folder = (struct folder){0};
    if (!members)
        return ad_fail(error, AD_E_INPUT, "%s: cannot be read; expected a folder of runs", name);
    for (struct dirent *m; error->status == AD_OK && (m = readdir(members));)
        if (m->d_name[0] != '.')
            add(folder, name, m->d_name, error);
    closedir(members);
    if (folder->n)
        qsort(folder->member, folder->n, sizeof *folder->member, by_name);
    return error->status;
}

static bool ends_in(const char *name, const char *extension)
{
    const char *dot = strrchr(name, '.');
    return dot && strcasecmp(dot, extension) == 0;
}

/* Whether there is NAME.html for NAME.h5. */
static const char *page_of(const struct folder *folder, const char *name)
{
    const size_t stem = (size_t)(strrchr(name, '.') - name);
    for (size_t k = 0; k < folder->n; k++)
        if (strncmp(folder->member[k].name, name, stem) == 0 &&
            strcmp(folder->member[k].name + stem, ".html") == 0)
            return folder->member[k].name;
    return NULL;
}

/* ---- the table ---- */

/* A column: the first of some attributes that the run has. */
static const struct column {
    const char *title, *attribute[5];
} columns[] = {
    {"scene", {"scene", "task", "data"}},
    {"method", {"solver", "integrator", "method", "model"}},
    {"error", {"max_error", "true_distance", "error", "coordinate_mse", "chi_square"}},
    {"energy drift", {"energy_drift", "energy_mse", "norm_lost"}},
    {"action", {"action", "action_mean"}},
    {"Morse index", {"morse_index"}},
    {"verdict", {"stop", "error_against"}},
    {"program", {"program"}},
};
enum { COLUMNS = sizeof columns / sizeof *columns };

/* Texts and numbers of the file itself. */
struct attributes {
    struct attribute {
        char *text; /* NULL: a number */
        double number;
        bool there;
    } cell[COLUMNS][5];
    char *command;
    bool failed;
};

static void take(void *context, const struct phys_hdf5_item *item)
{
    struct attributes *a = context;
    if (item->object[0] || !item->attribute || item->kind == PHYS_HDF5_OTHER)
        return;
    if (item->kind == PHYS_HDF5_TEXT && strcmp(item->attribute, "command") == 0)
        a->failed |= !(a->command = strdup(item->text));
    for (size_t c = 0; c < COLUMNS; c++)
        for (size_t k = 0; k < 5 && columns[c].attribute[k]; k++)
            if (strcmp(item->attribute, columns[c].attribute[k]) == 0) {
                const bool text = item->kind == PHYS_HDF5_TEXT;
                char *copy = text ? strdup(item->text) : NULL;
                a->failed |= text && !copy;
                a->cell[c][k] = (struct attribute){copy, item->number,
                                                   text ? *item->text : isfinite(item->number)};
            }
}

static void write_cells(struct json *json, const char *file, const struct stat *status,
                        const struct attributes *a)
{
    char date[40] = "";
    struct tm when;
    if (gmtime_r(&status->st_mtime, &when))
        strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &when);
    json_array(json, "cells");
    json_text(json, NULL, file);
    for (size_t c = 0; c < COLUMNS; c++) {
        size_t k = 0;
        while (k < 4 && !a->cell[c][k].there)
            k++;
        if (!a->cell[c][k].there)
            json_null(json, NULL);
        else if (a->cell[c][k].text)
            json_text(json, NULL, a->cell[c][k].text);
        else
            json_number(json, NULL, a->cell[c][k].number);
    }
    json_text(json, NULL, date);
    json_end_array(json);
}

static enum ad_status write_run(struct json *json, const struct folder *folder,
                                const struct member *member, struct ad_error *error)
{
    struct attributes attributes = {0};
    phys_hdf5 *file = NULL;
    if (phys_hdf5_open(member->path, &file, error) == AD_OK &&
        phys_hdf5_list(file, take, &attributes, error) == AD_OK && attributes.failed)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_hdf5_close(file);
    if (error->status == AD_OK) {
        json_object(json, NULL);
        json_text(json, "page", page_of(folder, member->name));
        json_text(json, "command", attributes.command);
        write_cells(json, member->name, &member->status, &attributes);
        json_end_object(json);
    }
    free(attributes.command);
    for (size_t c = 0; c < COLUMNS; c++)
        for (size_t k = 0; k < 5; k++)
            free(attributes.cell[c][k].text);
    return error->status;
}

/* ---- the pictures ---- */

static const struct {
    const char *extension, *type;
} pictures[] = {{".svg", "image/svg+xml"}, {".png", "image/png"}, {".gif", "image/gif"}};
enum { TYPES = sizeof pictures / sizeof *pictures };

static enum ad_status write_picture(struct json *json, const struct member *member,
                                    const char *type, struct ad_error *error)
{
    const size_t size = (size_t)member->status.st_size;
    unsigned char *bytes = size <= PICTURE_MOST ? malloc(size + 1) : NULL;
    FILE *in = bytes ? fopen(member->path, "rb") : NULL;
    if (bytes && (!in || fread(bytes, 1, size, in) != size))
        ad_fail(error, AD_E_INPUT, "%s: cannot be read", member->path);
    json_object(json, NULL);
    json_text(json, "name", member->name);
    json_text(json, "type", type);
    if (bytes && error->status == AD_OK)
        json_base64(json, "data", size, bytes);
    json_end_object(json);
    if (in)
        fclose(in);
    free(bytes);
    return error->status;
}

/* ---- the page ---- */

static size_t write_members(struct json *json, const char *title, const struct folder *folder,
                            struct ad_error *error)
{
    size_t runs = 0;
    json_text(json, "kind", "report");
    json_text(json, "title", title);
    json_array(json, "columns");
    json_text(json, NULL, "run");
    for (size_t c = 0; c < COLUMNS; c++)
        json_text(json, NULL, columns[c].title);
    json_text(json, NULL, "date");
    json_end_array(json);
    json_array(json, "runs");
    for (size_t k = 0; k < folder->n && error->status == AD_OK; k++)
        if (ends_in(folder->member[k].name, ".h5")) {
            write_run(json, folder, &folder->member[k], error);
            runs++;
        }
    json_end_array(json);
    json_array(json, "pictures");
    for (size_t k = 0; k < folder->n && error->status == AD_OK; k++)
        for (size_t t = 0; t < TYPES; t++)
            if (ends_in(folder->member[k].name, pictures[t].extension))
                write_picture(json, &folder->member[k], pictures[t].type, error);
    json_end_array(json);
    return runs;
}

static enum ad_status write_report(const char *directory, const char *name, size_t *runs,
                                   struct ad_error *error)
{
    struct folder folder;
    struct page page;
    struct result out = {0};
    if (folder_read(directory, &folder, error) == AD_OK &&
        result_begin(&out, name, error) == AD_OK && page_begin(&page, error) == AD_OK) {
        *runs = write_members(&page.json, directory, &folder, error);
        if (error->status == AD_OK && *runs == 0)
            ad_fail(error, AD_E_INPUT, "%s: no run in it; expected files ending in .h5", directory);
        if (page_end(&page, out.out, error) == AD_OK)
            result_commit(&out, error);
    }
    result_abandon(&out);
    folder_free(&folder);
    return error->status;
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    const char *directory = options->common.argument[0];
    char *within = text_joined(directory, "/index.html");
    const char *name = options->plot ? options->plot : within;
    size_t runs = 0;
    if (!within)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (!page_wanted(name))
        ad_fail(error, AD_E_ARGUMENT, "--plot: expected a name ending in .html, got '%s'", name);
    else if (options->plot || page_may_replace(name, error) == AD_OK)
        write_report(directory, name, &runs, error);
    if (error->status == AD_OK && options->common.json) {
        struct json json;
        json_open(&json, stdout);
        json_text(&json, "page", name);
        json_count(&json, "runs", runs);
        json_close(&json);
    } else if (error->status == AD_OK && !options->common.quiet) {
        printf("%zu runs; ", runs);
        quote_terminal_line(stdout, "wrote ", name);
    }
    free(within);
    return command_status(error);
}

static const struct option table[] = {
    {"plot", "FILE.html", OPTION_OUTPUT, NULL, "the page to write [index.html in the folder]",
     offsetof(struct options, plot)},
};

const struct command command_report = {
    .line = {.name = "report",
             .what = "page of the runs in a folder: results, pictures, commands",
             .arguments = {"FOLDER"},
             .options = table,
             .n_options = sizeof table / sizeof *table,
             .more = "The page has a row for each run file (.h5), links to a page NAME.html beside "
                     "NAME.h5,\nand the pictures of the folder."},
    .bytes = sizeof(struct options),
    .run = run,
};
