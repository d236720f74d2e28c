/* leastaction view: a stored run as a page to explore in a browser. */
#include "apps/command.h"
#include "apps/output/page.h"
#include "apps/output/result.h"
#include "apps/quote.h"

#include <stdlib.h>
#include <string.h>

struct options {
    struct common common;
    const char *plot;
};

/* run.html for run.h5. */
static char *name_beside(const char *file)
{
    const char *slash = strrchr(file, '/'), *dot = strrchr(slash ? slash : file, '.');
    char *stem = dot ? strndup(file, (size_t)(dot - file)) : strdup(file);
    char *name = stem ? text_joined(stem, ".html") : NULL;
    free(stem);
    return name;
}

static enum ad_status write_page(const char *file, const char *name, struct ad_error *error)
{
    phys_hdf5 *run = NULL;
    struct result page = {0};
    if (phys_hdf5_open(file, &run, error) == AD_OK && result_begin(&page, name, error) == AD_OK &&
        page_of_run(run, file, page.out, error) == AD_OK)
        result_commit(&page, error);
    phys_hdf5_close(run);
    result_abandon(&page);
    return error->status;
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    const char *file = options->common.argument[0];
    char *beside = name_beside(file);
    const char *name = options->plot ? options->plot : beside;
    if (!beside)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (!page_wanted(name))
        ad_fail(error, AD_E_ARGUMENT, "--plot: expected a name ending in .html, got '%s'", name);
    else if (options->plot || page_may_replace(name, error) == AD_OK)
        write_page(file, name, error);
    if (error->status == AD_OK && options->common.json) {
        struct json json;
        json_open(&json, stdout);
        json_text(&json, "file", file);
        json_text(&json, "page", name);
        json_close(&json);
    } else if (error->status == AD_OK && !options->common.quiet) {
        quote_terminal_line(stdout, "wrote ", name);
    }
    free(beside);
    return command_status(error);
}

static const struct option table[] = {
    {"plot", "FILE.html", OPTION_OUTPUT, NULL, "the page to write [RUN.html beside the run]",
     offsetof(struct options, plot)},
};

const struct command command_view = {
    .line = {.name = "view",
             .what = "page of a stored run, to explore in a browser",
             .arguments = {"RUN.h5"},
             .options = table,
             .n_options = sizeof table / sizeof *table,
             .more = "The same page as --plot FILE.html of the run itself: one file that needs no "
                     "network."},
    .bytes = sizeof(struct options),
    .run = run,
};
