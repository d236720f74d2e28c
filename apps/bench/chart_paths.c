/* leastaction chart paths: its two parts. */
#include "chart_paths.h"
#include "apps/command.h"

#include <math.h>
#include <stdlib.h>

double path_distance(size_t n, const double *path, const double *reference)
{
    double sum = 0, norm = 0;
    for (size_t k = 0; k < n; k++) {
        sum += (path[k] - reference[k]) * (path[k] - reference[k]);
        norm += reference[k] * reference[k];
    }
    return sqrt(sum / norm);
}

int chart_paths(const struct chart_settings *settings, struct ad_error *error)
{
    struct json json;
    char *text = NULL;
    size_t length;
    FILE *memory = open_memstream(&text, &length);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory"), command_status(error);
    json_open(&json, memory);
    json_object(&json, "orders");
    chart_rules(settings, &json, error);
    json_end_object(&json);
    json_object(&json, "distances");
    if (error->status == AD_OK)
        chart_solvers(settings, &json, error);
    json_end_object(&json);
    json_close(&json);
    fclose(memory);
    if (error->status == AD_OK && settings->json)
        fputs(text, stdout);
    free(text);
    return error->status == AD_OK ? DONE : command_status(error);
}
