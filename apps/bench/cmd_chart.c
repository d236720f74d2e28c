/* leastaction chart: measurements that make a chart, one function each. */
#include "apps/command.h"
#include "charts.h"
#include "physics/physics.h"

struct options {
    struct common common;
    bool quick;
    const char *folder, *format, *data, *from;
    size_t days;
};

static const struct chart {
    const char *name;
    int (*draw)(const struct chart_settings *settings, struct ad_error *error);
} charts[] = {
    {"gradients", chart_gradients},
    {"linear", chart_linear},
    {"integrators", chart_integrators},
    {"paths", chart_paths},
    {"ephemeris", chart_ephemeris},
    {"gas", chart_gas},
    {"hnn", chart_hnn},
    {"quantum", chart_quantum},
    {"jobs", chart_jobs},
};

enum { N_CHARTS = sizeof charts / sizeof *charts };

static const struct chart *find_chart(const char *name, struct ad_error *error)
{
    const char *names[N_CHARTS];
    for (size_t k = 0; k < N_CHARTS; k++)
        names[k] = charts[k].name;
    size_t k = phys_find("chart", name, N_CHARTS, names, error);
    return k < N_CHARTS ? &charts[k] : NULL;
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    static const char *const formats[] = {"svg", "png"};
    const struct chart *chart = find_chart(options->common.argument[0], error);
    const struct chart_settings settings = {
        .folder = options->folder,
        .format = options->format,
        .quick = options->quick,
        .json = options->common.json,
        .quiet = options->common.quiet,
        .data = options->data,
        .from = options->from,
        .days = options->days,
    };
    if (!chart || options_choose("format", options->format, 2, formats, error) == 2)
        return WRONG_USE;
    return chart->draw(&settings, error);
}

#define AT(member) offsetof(struct options, member)

static const struct option table[] = {
    {"out", "DIR", OPTION_TEXT, "charts", "folder for the data and the pictures", AT(folder)},
    {"format", "svg|png", OPTION_TEXT, "svg", "of the pictures", AT(format)},
    {"quick", NULL, OPTION_FLAG, NULL, "fewer repetitions, a smaller range", AT(quick)},
    {"data", "DIR", OPTION_TEXT, NULL, "ephemeris: a folder of Horizons tables", AT(data)},
    {"from", "DATE|INDEX", OPTION_TEXT, NULL, "ephemeris: first epoch [the published one]",
     AT(from)},
    {"days", "N", OPTION_COUNT, NULL, "ephemeris: how many days [65]", AT(days)},
};

const struct command command_chart = {
    .line = {.name = "chart",
             .what = "speed against accuracy, measured: gradients, linear, integrators, paths, "
                     "ephemeris, gas, hnn, quantum, jobs",
             .arguments = {"KIND"},
             .options = table,
             .n_options = sizeof table / sizeof *table},
    .bytes = sizeof(struct options),
    .run = run,
};
