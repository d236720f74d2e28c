/* leastaction chart: runs a measurement that makes a chart (chart.h). */
#include "chart.h"
#include "apps/command.h"

#include <stdlib.h>

struct options {
    struct common common;
    struct chart chart;
};

static const struct kind {
    const char *name;
    enum ad_status (*draw)(struct chart *chart, struct ad_error *error);
} kinds[] = {
#define CHART(name) {#name, chart_##name},
#include "charts.def"
#undef CHART
};

enum { N_KINDS = sizeof kinds / sizeof *kinds };

static const struct kind *find_kind(const char *name, struct ad_error *error)
{
    const char *names[N_KINDS];
    for (size_t k = 0; k < N_KINDS; k++)
        names[k] = kinds[k].name;
    size_t k = phys_find("chart", name, N_KINDS, names, error);
    return k < N_KINDS ? &kinds[k] : NULL;
}

/* Pictures first, because gnuplot may fail. */
static void commit(struct chart *chart, struct ad_error *error)
{
    for (size_t k = 0; k < chart->pictures && error->status == AD_OK; k++)
        plot_commit(&chart->picture[k], error);
    for (size_t k = 0; k < chart->sheets && error->status == AD_OK; k++)
        result_commit(&chart->csv[k], error);
    for (size_t k = 0; k < chart->pictures; k++)
        plot_abandon(&chart->picture[k]);
    for (size_t k = 0; k < chart->sheets; k++) {
        result_abandon(&chart->csv[k]);
        sheet_free(&chart->sheet[k]);
    }
}

static int make(const struct kind *kind, struct chart *chart, bool json, struct ad_error *error)
{
    char *text = NULL;
    size_t length;
    FILE *memory = open_memstream(&text, &length);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory"), command_status(error);
    json_open(&chart->json, memory);
    kind->draw(chart, error);
    commit(chart, error);
    json_close(&chart->json);
    fclose(memory);
    if (error->status == AD_OK && chart->missed)
        fprintf(stderr, "leastaction: %s\n", chart->missed);
    if (error->status == AD_OK && json)
        fputs(text, stdout);
    free(text);
    return error->status != AD_OK ? command_status(error) : chart->missed ? NOT_REACHED : DONE;
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    static const char *const formats[] = {"svg", "png"};
    const struct kind *kind = find_kind(options->common.argument[0], error);
    if (!kind || options_choose("format", options->chart.format, 2, formats, error) == 2)
        return WRONG_USE;
    struct chart *chart = malloc(sizeof *chart);
    if (!chart)
        return ad_fail(error, AD_E_MEMORY, "out of memory"), command_status(error);
    *chart = options->chart;
    chart->quiet = options->common.quiet;
    int status = make(kind, chart, options->common.json, error);
    free(chart);
    return status;
}

#define AT(member) offsetof(struct options, chart.member)

static const struct option table[] = {
    {"out", "DIR", OPTION_OUTPUT, "charts", "folder for the data and the pictures", AT(folder)},
    {"format", "svg|png", OPTION_TEXT, "svg", "of the pictures", AT(format)},
    {"quick", NULL, OPTION_FLAG, NULL, "fewer repetitions, a smaller range", AT(quick)},
    {"data", "DIR", OPTION_INPUT, NULL, "ephemeris: a folder of Horizons tables", AT(data)},
    {"from", "DATE|INDEX", OPTION_TEXT, NULL, "ephemeris: first epoch [the published one]",
     AT(from)},
    {"days", "N", OPTION_COUNT, NULL, "ephemeris: how many days [65]", AT(days)},
    {"latency", "S", OPTION_POSITIVE, "2e-6", "scale: of a message, in s", AT(latency)},
    {"bandwidth", "B", OPTION_POSITIVE, "1e10", "scale: between two ranks, in bytes/s",
     AT(bandwidth)},
    {"flops", "F", OPTION_POSITIVE, "2e9", "scale: operations of a rank, in 1/s", AT(flops)},
};

#define CHART(name) ", " #name
static const char what[] = "speed against accuracy, measured"
#include "charts.def"
    ;
#undef CHART

const struct command command_chart = {
    .line = {.name = "chart",
             .what = what,
             .arguments = {"KIND"},
             .names = true,
             .options = table,
             .n_options = sizeof table / sizeof *table},
    .bytes = sizeof(struct options),
    .run = run,
};
