/* leastaction chart hnn: runs its parts. */
#include "chart_hnn.h"

size_t networks_of_chart(size_t width, struct network networks[NETWORKS_MOST])
{
    static const size_t widths[] = {QUICK_WIDTH, 100, PUBLISHED_WIDTH, 400};
    static const enum hnn_kind kinds[] = {HNN_HAMILTONIAN, HNN_BASELINE};
    static const enum ad_type types[] = {AD_F32, AD_F64};
    size_t n = 0;
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++)
        for (size_t k = 0; k < 2; k++)
            for (size_t t = 0; t < 2; t++)
                if (!width || widths[w] == width)
                    networks[n++] =
                        (struct network){kinds[k], types[t], widths[w], PUBLISHED_BATCH};
    return n;
}

struct hnn_settings network_settings(const struct network *network)
{
    struct hnn_settings settings = hnn_defaults(network->kind, 1);
    settings.hidden[0] = settings.hidden[1] = network->width;
    settings.precision = network->type;
    return settings;
}

enum ad_status chart_hnn(struct chart *chart, struct ad_error *error)
{
    hnn_model *model = NULL;
    if (chart_steps(chart, error) == AD_OK && chart_losses(chart, error) == AD_OK &&
        chart_learning(chart, &model, error) == AD_OK)
        chart_rollouts(chart, model, error);
    hnn_model_free(model);
    return error->status;
}
