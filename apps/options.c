/* Command lines from tables (options.h). */
#include "autodiff/free.h"
#include "option_values.h"
#include "file_names.h"
#include "quote.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define AT(member) offsetof(struct common, member)

static const struct option general[] = {
    {"help", NULL, OPTION_FLAG, NULL, "this text", AT(help)},
    {"version", NULL, OPTION_FLAG, NULL, "the version", AT(version)},
    {"json", NULL, OPTION_FLAG, NULL, "one JSON object as the last line", AT(json)},
    {"quiet", NULL, OPTION_FLAG, NULL, "print errors and requested output only", AT(quiet)},
    {"seed", "N", OPTION_SEED, "1", "seed of all random numbers", AT(seed)},
    {"threads", "N", OPTION_SOME, "1", "results do not depend on it", AT(threads)},
    {"verbose", NULL, OPTION_FLAG, NULL, "or -v: also report what ran as machine code, or why not",
     AT(verbose)},
    {"no-native", NULL, OPTION_FLAG, NULL, "never compile long runs to machine code",
     AT(no_native)},
};

static const struct option scene[] = {
    {"set", "NAME=VALUE", OPTION_SETTINGS, NULL, "a parameter of the scene; repeatable", AT(set)},
};

static const struct option scans[] = {
    {"scan", "NAME=FROM:TO:N", OPTION_TEXTS, NULL,
     "runs at N values of a parameter, or, given twice, of two; :log spaces them so", AT(scan)},
};

static const struct option sweeps[] = {
    {"sweep", "OPTION=VALUE,...", OPTION_TEXTS, NULL,
     "runs with each of some values of an option, or FROM:TO:N[:log], in six digits", AT(sweep)},
    {"seeds", "FROM:TO", OPTION_TEXT, NULL, "runs with each --seed from FROM to TO", AT(seeds)},
    {"curves", "KEY,...", OPTION_TEXT, NULL,
     "which numbers of such runs are shown, by their JSON keys [those that vary]; of items FROM-TO "
     "all as points of one panel: events.30-40.v.1",
     AT(curves)},
};

static const struct option tables[] = {
    {"csv", "FILE", OPTION_OUTPUT, NULL,
     "with --sweep or --seeds: their table; - is standard output", AT(csv)},
};

static const struct option outputs[] = {
    {"out", "FILE.h5", OPTION_OUTPUT, NULL, "everything, as HDF5", AT(out)},
    {"csv", "FILE", OPTION_OUTPUT, NULL, "the result as CSV; - is standard output", AT(csv)},
    {"log", "FILE", OPTION_OUTPUT, NULL,
     "progress while it runs, as CSV: seconds, done, total, seconds left", AT(log)},
    {"plot", "FILE", OPTION_PICTURE, NULL,
     "picture: .svg, .png or animated .gif; .html: a page to explore", AT(plot)},
};

enum { FILES_MOST = 16 }; /* arguments and options of a subcommand that name files */

#define COUNT(table) (sizeof(table) / sizeof(table)[0])

/* ---- the rows of a command line: its own, then the common ones ---- */

enum { PARTS = 7 };

struct part {
    const struct option *row;
    size_t n;
};

static void find_parts(const struct command_line *line, struct part part[PARTS])
{
    const bool scanned = line->scene && line->outputs;
    const struct part all[PARTS] = {{line->options, line->n_options},
                                    {scene, line->scene ? COUNT(scene) : 0},
                                    {outputs, line->outputs ? COUNT(outputs) : 0},
                                    {tables, line->members ? COUNT(tables) : 0},
                                    {scans, scanned ? COUNT(scans) : 0},
                                    {sweeps, scanned || line->members ? COUNT(sweeps) : 0},
                                    {general, COUNT(general)}};
    memcpy(part, all, sizeof all);
}

size_t options_rows(const struct command_line *line)
{
    struct part part[PARTS];
    size_t rows = 0;
    find_parts(line, part);
    for (size_t p = 0; p < PARTS; p++)
        rows += part[p].n;
    return rows;
}

const struct option *options_row(const struct command_line *line, size_t k)
{
    struct part part[PARTS];
    size_t p = 0;
    find_parts(line, part);
    while (k >= part[p].n)
        k -= part[p++].n;
    return &part[p].row[k];
}

size_t options_find(const struct command_line *line, const char *name, size_t length)
{
    size_t k = 0;
    while (k < options_rows(line) && (strlen(options_row(line, k)->name) != length ||
                                      strncmp(options_row(line, k)->name, name, length) != 0))
        k++;
    return k;
}

enum ad_status options_refuse(const struct common *common, const char *names, const char *what,
                              struct ad_error *error)
{
    for (size_t length; *names; names += length + (names[length] == ' ')) {
        length = strcspn(names, " ");
        if (common->given >> options_find(common->line, names, length) & 1)
            return ad_fail(error, AD_E_ARGUMENT, "--%.*s %s", (int)length, names, what);
    }
    return AD_OK;
}

enum ad_status options_unused(const struct common *common, size_t n, const struct unused rows[],
                              struct ad_error *error)
{
    for (size_t k = 0; k < n && error->status == AD_OK; k++)
        if (rows[k].so)
            options_refuse(common, rows[k].names, rows[k].what, error);
    return error->status;
}

enum ad_status options_conflicts(size_t n, const struct conflict rows[], struct ad_error *error)
{
    for (size_t k = 0; k < n; k++)
        if (rows[k].wrong)
            return ad_fail(error, AD_E_ARGUMENT, "%s", rows[k].what);
    return AD_OK;
}

static enum ad_status unknown(const struct command_line *line, const char *name, size_t length,
                              struct ad_error *error)
{
    const char *names[64], *nearest;
    char given[64];
    size_t n = 0;
    for (; n < options_rows(line) && n < COUNT(names); n++)
        names[n] = options_row(line, n)->name;
    snprintf(given, sizeof given, "%.*s", (int)length, name);
    nearest = phys_nearest(given, n, names);
    if (nearest)
        return ad_fail(error, AD_E_ARGUMENT, "unknown option --%s; did you mean --%s?", given,
                       nearest);
    return ad_fail(error, AD_E_ARGUMENT, "unknown option --%s; leastaction %s --help lists them",
                   given, line->name);
}

/* ---- words ---- */

static enum ad_status needs_value(const struct option *option, struct ad_error *error)
{
    return ad_fail(error, AD_E_ARGUMENT, "--%s needs a value: --%s %s", option->name, option->name,
                   option->placeholder);
}

static enum ad_status parse_option(const struct command_line *line, int argc, char *const argv[],
                                   int *word, char *values, struct ad_error *error)
{
    const char *name = argv[*word] + 2, *equals = strchr(name, '=');
    size_t length = equals ? (size_t)(equals - name) : strlen(name);
    size_t row = options_find(line, name, length);
    if (row == options_rows(line))
        return unknown(line, name, length, error);
    const struct option *option = options_row(line, row);
    ((struct common *)(void *)values)->given |= UINT64_C(1) << row;
    if (option->kind == OPTION_FLAG) {
        if (equals)
            return ad_fail(error, AD_E_ARGUMENT, "--%s takes no value, got '%s'; give it alone",
                           option->name, equals + 1);
        return option_store(option, "", values, error);
    }
    if (!equals && (*word + 1 >= argc || strncmp(argv[*word + 1], "--", 2) == 0))
        return needs_value(option, error);
    const char *value = equals ? equals + 1 : argv[++*word];
    return *value ? option_store(option, value, values, error) : needs_value(option, error);
}

/* "leastaction path SCENE [options]" */
static void usage(const struct command_line *line, size_t size, char *text)
{
    size_t used = (size_t)snprintf(text, size, "leastaction %s", line->name);
    for (size_t k = 0; k < COUNT(line->arguments) && line->arguments[k] && used < size; k++)
        used += (size_t)snprintf(text + used, size - used, " %s", line->arguments[k]);
    if (used < size)
        snprintf(text + used, size - used, " [options]");
}

static enum ad_status parse_argument(const struct command_line *line, const char *word,
                                     struct common *common, struct ad_error *error)
{
    size_t k = common->n_arguments;
    char form[128];
    usage(line, sizeof form, form);
    if (k >= COUNT(common->argument) || !line->arguments[k])
        return ad_fail(error, AD_E_ARGUMENT, "unexpected argument '%s'; expected: %s", word, form);
    common->argument[common->n_arguments++] = word;
    return AD_OK;
}

/* No output may be an input or another output. A picture without gnuplot leaves its data and
   script. */
enum ad_status options_check_files(const struct command_line *line, const struct common *common,
                                   struct ad_error *error)
{
    struct file_name files[FILES_MOST];
    char *beside[2] = {NULL, NULL};
    size_t n = 0;
    for (size_t k = 0; k < common->n_arguments && !line->names; k++)
        files[n++] = (struct file_name){"", line->arguments[k], common->argument[k], false};
    for (size_t k = 0; k < options_rows(line) && n + 3 <= FILES_MOST; k++) {
        const struct option *option = options_row(line, k);
        if (option->kind < OPTION_INPUT || option->kind > OPTION_PICTURE)
            continue;
        const char *file = *(const char *const *)((const char *)common + option->offset);
        bool output = option->kind != OPTION_INPUT;
        files[n++] = (struct file_name){"--", option->name, file, output};
        if (option->kind != OPTION_PICTURE || !file)
            continue;
        beside[0] = text_joined(file, ".dat");
        beside[1] = text_joined(file, ".gp");
        files[n++] = (struct file_name){"--", option->name, beside[0], true};
        files[n++] = (struct file_name){"--", option->name, beside[1], true};
    }
    file_names_check(n, files, error);
    AD_FREE(beside[0], beside[1]);
    return error->status;
}

static enum ad_status check_arguments(const struct command_line *line, const struct common *common,
                                      struct ad_error *error)
{
    char form[128];
    usage(line, sizeof form, form);
    for (size_t k = common->n_arguments; k < COUNT(line->arguments) && line->arguments[k]; k++)
        if (line->arguments[k][0] != '[')
            return ad_fail(error, AD_E_ARGUMENT, "missing argument %s; expected: %s",
                           line->arguments[k], form);
    return options_check_files(line, common, error);
}

enum ad_status options_parse(const struct command_line *line, int argc, char *const argv[],
                             void *values, struct ad_error *error)
{
    struct common *common = values;
    enum ad_status status = AD_OK;
    common->line = line;
    for (size_t k = 0; k < options_rows(line); k++)
        option_store_default(options_row(line, k), values);
    for (int k = 0; k < argc && status == AD_OK; k++) {
        if (strcmp(argv[k], "-h") == 0)
            common->help = true;
        else if (strcmp(argv[k], "-v") == 0)
            common->verbose = true;
        else if (argv[k][0] == '-' && argv[k][1] != '\0' && argv[k][1] != '-')
            status =
                ad_fail(error, AD_E_ARGUMENT, "unknown option %s; options begin with --", argv[k]);
        else if (strncmp(argv[k], "--", 2) == 0)
            status = parse_option(line, argc, argv, &k, values, error);
        else
            status = parse_argument(line, argv[k], common, error);
        if (common->help || common->version)
            return status;
    }
    return status == AD_OK ? check_arguments(line, common, error) : status;
}

void options_free(const struct command_line *line, void *values)
{
    for (size_t k = 0; k < options_rows(line); k++)
        option_release(options_row(line, k), values);
}

/* ---- help ---- */

static void help_row(const struct option *option, FILE *out)
{
    char left[64];
    snprintf(left, sizeof left, "--%s%s%s", option->name, option->placeholder ? " " : "",
             option->placeholder ? option->placeholder : "");
    fprintf(out, "  %-24s  %s", left, option->help);
    if (option->fallback)
        fprintf(out, " [%s]", option->fallback);
    fputc('\n', out);
}

void options_help(const struct command_line *line, FILE *out)
{
    fprintf(out, "leastaction %s", line->name);
    for (size_t k = 0; k < COUNT(line->arguments) && line->arguments[k]; k++)
        fprintf(out, " %s", line->arguments[k]);
    fprintf(out, " [options]\n\n%s\n\n", line->what);
    for (size_t k = 0; k < options_rows(line); k++) {
        if (k > 0 && k == line->n_options)
            fputc('\n', out);
        help_row(options_row(line, k), out);
    }
    if (line->more)
        fprintf(out, "\n%s\n", line->more);
}
