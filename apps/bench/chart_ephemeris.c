/* leastaction chart ephemeris: the distance from Horizons tables, model by model. */
#include "chart.h"
#include "apps/options.h"
#include "physics/ephemeris/models.h"

#include <ctype.h>

static const char *const colours[PHYS_EPHEMERIS_MODELS] = {
    "#9a9a9a", "#8fc7e8", "#56b4e9", "#0b4f8a", "#84bf63", "#f2b134", "#b8261b", "#cc79a7"};

static const struct column columns[] = {
    {.key = "model"}, {.key = "planet"}, {.key = "day"}, {.key = "km"}, {.key = NULL}};

/* The largest distance over all days, a planet a column. */
static const struct column table_columns[] = {
    {.key = "model", .title = "largest distance from the tables (km)", .width = -44},
    {.key = "mercury", .title = "mercury", .width = 10, .shown = 3},
    {.key = "venus", .title = "venus", .width = 10, .shown = 3},
    {.key = "earth", .title = "earth", .width = 10, .shown = 3},
    {.key = "mars", .title = "mars", .width = 10, .shown = 3},
    {.key = "evaluations", .title = "evaluations", .width = 12, .shown = 9},
    {.key = "seconds", .title = "CPU time (ms)", .width = 13, .shown = 3, .scale = 1e3},
    {.key = NULL},
};

static enum ad_status measure(const struct phys_ephemeris_tables *tables, struct sheet *sheet,
                              struct sheet *table, struct ad_error *error)
{
    for (size_t m = 0; m < PHYS_EPHEMERIS_MODELS && error->status == AD_OK; m++) {
        const struct phys_ephemeris_model *model = &phys_ephemeris_models[m];
        struct phys_ephemeris_track track, seen = {0};
        struct phys_ephemeris_distances off = {0};
        if (phys_ephemeris_measure(model, tables, &track, &off, error) == AD_OK)
            phys_ephemeris_track_tables(tables, track.dims, &seen, error);
        for (size_t k = 0; k < PHYS_EPHEMERIS_PLANETS; k++)
            for (size_t day = 0; day <= tables->days && error->status == AD_OK; day++)
                sheet_row(sheet,
                          ROW(NAME(model->name), NAME(phys_ephemeris_planet(k)), NUMBER(day),
                              NUMBER(phys_ephemeris_apart(&track, &seen, day, k))),
                          error);
        sheet_row(table,
                  ROW(NAME(model->name), NUMBER(off.km[0]), NUMBER(off.km[1]), NUMBER(off.km[2]),
                      NUMBER(off.km[3]), NUMBER(track.evaluations), NUMBER(track.seconds)),
                  error);
        phys_ephemeris_track_free(&track);
        phys_ephemeris_track_free(&seen);
    }
    return error->status;
}

static void draw_planet(struct figure *figure, const struct sheet *sheet, size_t k, size_t days)
{
    char title[32], range[32];
    snprintf(title, sizeof title, "%c%s", toupper(phys_ephemeris_planet(k)[0]),
             phys_ephemeris_planet(k) + 1);
    snprintf(range, sizeof range, "[0:%zu]", days);
    figure_panel(figure,
                 &(struct panel){.title = title,
                                 .x = k >= 2 ? "day" : NULL,
                                 .y = k % 2 ? NULL : "distance from the tables (km)",
                                 .log = "y",
                                 .x_range = range,
                                 .y_range = "[1e-2:1e8]",
                                 .key = k + 1 < PHYS_EPHEMERIS_PLANETS
                                            ? NULL
                                            : "at screen 0.53,0.07 center maxrows 4 Left reverse "
                                              "width -4"});
    for (size_t m = 0; m < PHYS_EPHEMERIS_MODELS; m++)
        figure_curve(figure, sheet, "day", "km", phys_ephemeris_models[m].name,
                     STYLE(colours[m], 0, 2, 0), "model", phys_ephemeris_models[m].name, "planet",
                     phys_ephemeris_planet(k));
}

static void draw(const struct sheet *sheet, size_t days, struct plot *plot)
{
    static const struct layout layout = {.width = 1040,
                                         .height = 670,
                                         .title = "Distance of models from the tables",
                                         .rows = 2,
                                         .columns = 2,
                                         .room = {0.07, 0.99, 0.21, 0.9},
                                         .gap = {0.05, 0.09}};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t k = 0; k < PHYS_EPHEMERIS_PLANETS; k++)
        draw_planet(&figure, sheet, k, days);
    figure_end(&figure);
}

enum ad_status chart_ephemeris(struct chart *chart, struct ad_error *error)
{
    struct phys_ephemeris_tables tables = {0};
    struct sheet table;
    char date[16];
    if (!chart->data)
        return ad_fail(error, AD_E_ARGUMENT,
                       "chart ephemeris needs --data DIR, a folder of Horizons tables");
    if (phys_ephemeris_tables_read(chart->data, chart->from, option_count_or(chart->days, 65),
                                   &tables, error) != AD_OK)
        return error->status;
    struct sheet *sheet = chart_sheet(chart, "ephemeris", columns, error);
    struct plot *plot = chart_picture(chart, "ephemeris", error);
    phys_horizons_date(tables.table->jd[tables.first], date, sizeof date);
    if (!chart->quiet)
        printf("%zu days from %s, seen from the Sun\n", tables.days, date);
    sheet_open(&table, table_columns, NULL, chart_terminal(chart));
    if (error->status == AD_OK && measure(&tables, sheet, &table, error) == AD_OK) {
        sheet_json(&table, "models", &chart->json);
        draw(sheet, tables.days, plot);
    }
    sheet_free(&table);
    phys_ephemeris_tables_free(&tables);
    return error->status;
}
