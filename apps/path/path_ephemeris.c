/* Sets up the ephemeris scene from Horizons tables or its own state vectors (path.h). */
#include "path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char all_bodies[] = "sun,mercury,venus,earth,mars";

/* The published span begins at this day of the last year of the tables. */
enum { PAPER_DAY = 148, PAPER_YEAR = 365, DAY = 86400 };

static enum ad_status refuse(const struct path_options *options, bool ephemeris,
                             struct ad_error *error)
{
    if (!ephemeris &&
        options_refuse(&options->common, "data from days dims bodies",
                       "is for the scene ephemeris only; leave it out", error) != AD_OK)
        return error->status;
    if (!options->data &&
        options_refuse(&options->common, "from days",
                       "needs --data DIR, a folder of Horizons tables", error) != AD_OK)
        return error->status;
    if (options->dims != OPTION_NO_COUNT && options->dims != 2 && options->dims != 3)
        return ad_fail(error, AD_E_ARGUMENT, "--dims: expected 2 or 3, got %zu", options->dims);
    if (options->days != OPTION_NO_COUNT && options->slices != OPTION_NO_COUNT &&
        options->days != options->slices)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--days %zu and --slices %zu disagree; leave out one of them", options->days,
                       options->slices);
    return AD_OK;
}

static enum ad_status find_first(const struct path_options *options, struct path_run *run,
                                 struct ad_error *error)
{
    const struct phys_horizons *table = run->tables;
    if (options->from)
        return phys_horizons_epoch(table, options->from, &run->first_epoch, error);
    if (run->preset && table->n >= PAPER_YEAR)
        run->first_epoch = table->n - PAPER_YEAR + PAPER_DAY;
    return AD_OK;
}

/* Epochs are equally spaced; Julian dates carry their step to 40 microseconds. */
static enum ad_status find_span(const struct path_options *options, struct path_run *run,
                                struct ad_error *error)
{
    const struct phys_horizons *table = run->tables;
    struct phys_path_settings *settings = &run->settings;
    size_t first = run->first_epoch;
    if (options->days != OPTION_NO_COUNT)
        settings->slices = options->days;
    if (first >= table->n || settings->slices > table->n - first)
        return ad_fail(error, AD_E_INPUT,
                       "%s: --days %zu from index %zu needs %zu epochs, there are %zu",
                       options->data, settings->slices, first, first + settings->slices, table->n);
    double step = (table->jd[first + 1] - table->jd[first]) * DAY;
    if (!isnan(options->dt) && fabs(options->dt - step) > 1e-3)
        return ad_fail(error, AD_E_ARGUMENT, "--dt %.9g: the epochs are %.9g s apart", options->dt,
                       step);
    settings->dt = round(step * 1e3) / 1e3;
    return AD_OK;
}

enum ad_status path_ephemeris(const struct path_options *options, struct path_run *run,
                              double **observed, struct ad_error *error)
{
    bool ephemeris = strcmp(run->system.scene->name, "ephemeris") == 0;
    *observed = NULL;
    if (refuse(options, ephemeris, error) != AD_OK || !ephemeris)
        return error->status;
    const char *bodies = options->bodies ? options->bodies : all_bodies;
    size_t dims = options->dims != OPTION_NO_COUNT ? options->dims
                  : run->preset                    ? 2
                                                   : run->system.dims;
    if (!options->data)
        return options->bodies || dims != run->system.dims
                   ? phys_ephemeris_choose(&run->system, bodies, dims, error)
                   : AD_OK;
    if (phys_horizons_folder(options->data, bodies, &run->n_tables, &run->tables, error) != AD_OK ||
        find_first(options, run, error) != AD_OK || find_span(options, run, error) != AD_OK)
        return error->status;
    size_t slices = run->settings.slices;
    size_t rows = run->settings.rule->degree * run->n_tables * dims;
    *observed = malloc(rows * slices * sizeof **observed);
    if (!*observed)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    return phys_ephemeris_use(&run->system, run->n_tables, run->tables, run->first_epoch, slices,
                              dims, *observed, error);
}

/* Of a body's greatest distance from the centre. Models of the inner planets err by a hundredth in
   years; another stationary path goes round another way, or another number of times. */
static const double other_path = 0.1;

enum ad_status path_ephemeris_judge(const struct path_run *run, struct ad_error *error)
{
    size_t n = run->settings.slices, dims = run->system.dims;
    for (size_t b = 0; b < run->n_tables && !run->preset && !path_wants_all(run->options); b++) {
        double off = 0, size = 0;
        for (size_t i = 0; i < n; i++) {
            const double *seen = run->tables[b].position + 3 * (run->first_epoch + i);
            double apart = 0, distance = 0;
            for (size_t d = 0; d < dims; d++) {
                apart += pow(run->path[(b * dims + d) * n + i] - seen[d], 2);
                distance += seen[d] * seen[d];
            }
            off = fmax(off, sqrt(apart));
            size = fmax(size, sqrt(distance));
        }
        if (!(off <= other_path * size))
            return ad_fail(error, AD_E_ACCURACY,
                           "%s is %.3g km from its table: another stationary path between the same "
                           "ends; try %sfewer --days, or --all for several",
                           run->tables[b].target, off / 1e3,
                           run->options->init ? "--init table, " : "");
    }
    return error->status;
}
