/* leastaction chart paths: runs its three parts. */
#include "chart_paths.h"

const struct layout figure_of_six = {.width = 1120,
                                     .height = 680,
                                     .rows = 2,
                                     .columns = 3,
                                     .room = {0.075, 0.78, 0.08, 0.9},
                                     .gap = {0.045, 0.1}};

enum ad_status chart_paths(struct chart *chart, struct ad_error *error)
{
    json_object(&chart->json, "orders");
    chart_rules(chart, error);
    json_end_object(&chart->json);
    json_object(&chart->json, "distances");
    if (error->status == AD_OK)
        chart_solvers(chart, error);
    json_end_object(&chart->json);
    if (error->status == AD_OK)
        chart_boundaries(chart, error);
    return error->status;
}
