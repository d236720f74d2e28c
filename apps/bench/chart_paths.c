/* leastaction chart paths: runs its two parts. */
#include "chart_paths.h"

const struct layout figure_of_six = {1120, 640,  NULL,  2,   3,    0.06, 0.78,
                                     0.08, 0.94, 0.045, 0.1, NULL, 0};

enum ad_status chart_paths(struct chart *chart, struct ad_error *error)
{
    json_object(&chart->json, "orders");
    chart_rules(chart, error);
    json_end_object(&chart->json);
    json_object(&chart->json, "distances");
    if (error->status == AD_OK)
        chart_solvers(chart, error);
    json_end_object(&chart->json);
    return error->status;
}
