/* leastaction chart ephemeris: how far each step of the model brings it. */
#include "charts.h"
#include "apps/command.h"
#include "apps/simulate/ephemeris_models.h"
#include "apps/output/json.h"

#include <ctype.h>
#include <stdlib.h>

static const char *const colours[EPHEMERIS_MODELS] = {"#9a9a9a", "#8fc7e8", "#3c8dc5", "#0b4f8a",
                                                      "#84bf63", "#f2b134", "#b8261b", "#722a72"};

static void write_rows(const struct ephemeris_model *model, const struct ephemeris_errors *errors,
                       FILE *out)
{
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        for (size_t day = 0; day <= errors->days; day++)
            fprintf(out, "\"%s\",%s,%zu,%.6g\n", model->name, ephemeris_planet(k), day,
                    errors->km[k * (errors->days + 1) + day]);
}

/* A block a model: day, and the distance of each planet. */
static void write_block(const struct ephemeris_model *model, const struct ephemeris_errors *errors,
                        FILE *out)
{
    fprintf(out, "# %s: day, km\n", model->name);
    for (size_t day = 1; day <= errors->days; day++) {
        fprintf(out, "%zu", day);
        for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
            fprintf(out, " %.6g", errors->km[k * (errors->days + 1) + day]);
        fputc('\n', out);
    }
    fputs("\n\n", out);
}

static void draw(const struct ephemeris_tables *tables, struct plot *plot)
{
    FILE *out = plot->script;
    plot->height = 640;
    fprintf(out,
            "set multiplot layout 2,2 margins 0.07,0.99,0.21,0.95 spacing 0.05,0.09\n"
            "set border 3 lc rgb '#606060'\nset tics nomirror\nset logscale y\n"
            "set format y '10^{%%T}'\nset xrange [0:%zu]\nset yrange [1e-2:1e8]\n"
            "set grid ytics lt 1 lc rgb '#e0e0e0'\nunset key\n",
            tables->days);
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++) {
        if (k == EPHEMERIS_PLANETS - 1) /* one legend for all */
            fputs("set key at screen 0.53,0.07 center maxrows 4 Left reverse width -4\n", out);
        fprintf(out,
                "set title '%c%s' offset 0,-0.7\nset ylabel '%s'\nset xlabel '%s' offset 0,0.6\n"
                "plot ",
                toupper(ephemeris_planet(k)[0]), ephemeris_planet(k) + 1,
                k % 2 == 0 ? "distance from the tables / km" : "", k >= 2 ? "day" : "");
        for (size_t m = 0; m < EPHEMERIS_MODELS; m++)
            fprintf(out, "data index %zu using 1:%zu with lines lw 2 lc rgb '%s' title '%s'%s", m,
                    k + 2, colours[m], ephemeris_models[m].name,
                    m + 1 < EPHEMERIS_MODELS ? ", \\\n    " : "\n");
    }
    fputs("unset multiplot\n", out);
}

static void print_head(const struct ephemeris_tables *tables)
{
    char date[16];
    phys_horizons_date(tables->table->jd[tables->first], date, sizeof date);
    printf("%zu days from %s, the largest distance from the tables in km, seen from the Sun\n\n"
           "%-44s",
           tables->days, date, "");
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        printf("%10s", ephemeris_planet(k));
    printf("%13s%10s\n", "evaluations", "ms");
}

static void print_row(const struct ephemeris_model *model, const struct ephemeris_errors *errors)
{
    printf("%-44s", model->name);
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        printf("%10.3g", errors->most.km[k]);
    printf("%13zu%10.3g\n", errors->evaluations, 1e3 * errors->seconds);
}

static void json_row(struct json *json, const struct ephemeris_model *model,
                     const struct ephemeris_errors *errors)
{
    json_object(json, NULL);
    json_text(json, "model", model->name);
    for (size_t k = 0; k < EPHEMERIS_PLANETS; k++)
        json_number(json, ephemeris_planet(k), errors->most.km[k]);
    json_count(json, "evaluations", errors->evaluations);
    json_number(json, "seconds", errors->seconds);
    json_end_object(json);
}

static enum ad_status measure(const struct chart_settings *settings,
                              const struct ephemeris_tables *tables, FILE *csv, FILE *data,
                              struct json *json, struct ad_error *error)
{
    struct ephemeris_errors errors;
    if (!settings->quiet && !settings->json)
        print_head(tables);
    for (size_t m = 0; m < EPHEMERIS_MODELS && error->status == AD_OK; m++) {
        const struct ephemeris_model *model = &ephemeris_models[m];
        if (ephemeris_measure(model, tables, &errors, error) == AD_OK) {
            write_rows(model, &errors, csv);
            write_block(model, &errors, data);
            json_row(json, model, &errors);
            if (!settings->quiet && !settings->json)
                print_row(model, &errors);
        }
        ephemeris_errors_free(&errors);
    }
    return error->status;
}

static enum ad_status chart(const struct chart_settings *settings,
                            const struct ephemeris_tables *tables, struct json *json,
                            struct ad_error *error)
{
    struct result csv = {0};
    struct plot plot = {0};
    if (chart_csv(settings, "ephemeris", &csv, error) == AD_OK &&
        chart_picture(settings, "ephemeris", &plot, error) == AD_OK) {
        fputs("model,planet,day,km\n", csv.out);
        draw(tables, &plot);
        if (measure(settings, tables, csv.out, plot.data, json, error) == AD_OK &&
            plot_commit(&plot, error) == AD_OK)
            result_commit(&csv, error);
    }
    plot_abandon(&plot);
    if (error->status != AD_OK)
        result_abandon(&csv);
    return error->status;
}

int chart_ephemeris(const struct chart_settings *settings, struct ad_error *error)
{
    struct ephemeris_tables tables = {0};
    struct json json;
    char *text = NULL;
    size_t length;
    if (!settings->data)
        return ad_fail(error, AD_E_ARGUMENT,
                       "chart ephemeris needs --data DIR, a folder of "
                       "Horizons tables"),
               WRONG_USE;
    FILE *memory = open_memstream(&text, &length);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory"), command_status(error);
    json_open(&json, memory);
    json_array(&json, "models");
    if (ephemeris_tables_open(settings->data, settings->from, settings->days, &tables, error) ==
        AD_OK)
        chart(settings, &tables, &json, error);
    json_end_array(&json);
    json_close(&json);
    fclose(memory);
    if (error->status == AD_OK && settings->json)
        fputs(text, stdout);
    free(text);
    ephemeris_tables_close(&tables);
    return error->status == AD_OK ? DONE : command_status(error);
}
