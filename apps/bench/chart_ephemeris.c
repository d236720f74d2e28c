/* leastaction chart ephemeris: how far each step of the model brings it. */
#include "chart.h"
#include "apps/simulate/ephemeris_models.h"

#include <ctype.h>

static const char *const colours[EPHEMERIS_MODELS] = {"#9a9a9a", "#8fc7e8", "#3c8dc5", "#0b4f8a",
                                                      "#84bf63", "#f2b134", "#b8261b", "#722a72"};

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

static enum ad_status add_rows(struct sheet *sheet, const char *model,
                               const struct ephemeris_errors *errors, struct ad_error *error)
{
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        for (size_t day = 0; day <= errors->days; day++)
            sheet_row(sheet,
                      ROW(NAME(model), NAME(ephemeris_planet(k)), NUMBER(day),
                          NUMBER(errors->km[k * (errors->days + 1) + day])),
                      error);
    return error->status;
}

static enum ad_status measure(const struct ephemeris_tables *tables, struct sheet *sheet,
                              struct sheet *table, struct ad_error *error)
{
    struct ephemeris_errors e;
    for (size_t m = 0; m < EPHEMERIS_MODELS && error->status == AD_OK; m++) {
        const struct ephemeris_model *model = &ephemeris_models[m];
        if (ephemeris_measure(model, tables, &e, error) == AD_OK &&
            add_rows(sheet, model->name, &e, error) == AD_OK)
            sheet_row(table,
                      ROW(NAME(model->name), NUMBER(e.most.km[0]), NUMBER(e.most.km[1]),
                          NUMBER(e.most.km[2]), NUMBER(e.most.km[3]), NUMBER(e.evaluations),
                          NUMBER(e.seconds)),
                      error);
        ephemeris_errors_free(&e);
    }
    return error->status;
}

static void draw_planet(struct figure *figure, const struct sheet *sheet, size_t k, size_t days)
{
    char title[32], range[32];
    snprintf(title, sizeof title, "%c%s", toupper(ephemeris_planet(k)[0]), ephemeris_planet(k) + 1);
    snprintf(range, sizeof range, "[0:%zu]", days);
    figure_panel(figure,
                 &(struct panel){.title = title,
                                 .x = k >= 2 ? "day" : NULL,
                                 .y = k % 2 ? NULL : "distance from the tables (km)",
                                 .log = "y",
                                 .x_range = range,
                                 .y_range = "[1e-2:1e8]",
                                 .key = k + 1 < EPHEMERIS_PLANETS
                                            ? NULL
                                            : "at screen 0.53,0.07 center maxrows 4 Left reverse "
                                              "width -4"});
    for (size_t m = 0; m < EPHEMERIS_MODELS; m++)
        figure_curve(figure, &(struct curve){
                                 sheet,
                                 {"model", ephemeris_models[m].name, "planet", ephemeris_planet(k)},
                                 "day",
                                 "km",
                                 ephemeris_models[m].name,
                                 {colours[m], 0, 2, 0, NULL},
                                 NULL});
}

static void draw(const struct sheet *sheet, size_t days, struct plot *plot)
{
    static const struct layout layout = {1040, 640, NULL, 2, 2, 0.07, 0.99, 0.21, 0.95, 0.05, 0.09};
    struct figure figure;
    figure_begin(&figure, plot, &layout);
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        draw_planet(&figure, sheet, k, days);
    figure_end(&figure);
}

enum ad_status chart_ephemeris(struct chart *chart, struct ad_error *error)
{
    struct ephemeris_tables tables = {0};
    struct sheet table;
    char date[16];
    if (!chart->data)
        return ad_fail(error, AD_E_ARGUMENT,
                       "chart ephemeris needs --data DIR, a folder of Horizons tables");
    if (ephemeris_tables_open(chart->data, chart->from, chart->days, &tables, error) != AD_OK)
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
    ephemeris_tables_close(&tables);
    return error->status;
}
