/* Layout of the parameters in the flat vector: by network and layer, weight before bias. */
#include "internal.h"

#include <stdio.h>

static void add_block(hnn_model *model, const char *room, const char *prefix, size_t layer,
                      bool bias, size_t rows, size_t cols)
{
    struct hnn_block *b = &model->block[model->n_blocks++];
    *b = (struct hnn_block){.bias = bias, .rows = rows, .cols = cols, .offset = model->size};
    if (model->settings.network)
        snprintf(b->name, sizeof b->name, "network.parameters");
    else
        snprintf(b->name, sizeof b->name, "%s%slinear%zu.%s", room, prefix, layer + 1,
                 bias ? "bias" : "weight");
    model->size += rows * cols;
}

static void add_net(hnn_model *model, const char *prefix, size_t first, size_t inputs,
                    size_t outputs)
{
    const struct hnn_settings *s = &model->settings;
    const char *room = s->pixels ? "hnn." : "";
    model->net[model->n_nets++] = (struct hnn_net){prefix, first, inputs, outputs, model->n_blocks};
    if (s->network)
        add_block(model, "", "", 0, true, s->network->size, 1);
    for (size_t k = 0, in = inputs; k < s->layers && !s->network; k++) {
        bool last = k + 1 == s->layers;
        size_t out = last ? outputs : s->hidden[k];
        add_block(model, room, prefix, k, false, out, in);
        if (!last)
            add_block(model, room, prefix, k, true, out, 1);
        in = out;
    }
}

/* Half of an autoencoder; its layers are numbered from `first`. Returns its first block. */
static size_t add_coder(hnn_model *model, size_t first, size_t inputs, size_t outputs)
{
    size_t block = model->n_blocks, width = model->settings.autoencoder;
    for (size_t k = 0; k < HNN_CODER_LAYERS; k++) {
        size_t in = k ? width : inputs, out = k + 1 < HNN_CODER_LAYERS ? width : outputs;
        add_block(model, "autoencoder.", "", first + k, false, out, in);
        add_block(model, "autoencoder.", "", first + k, true, out, 1);
    }
    return block;
}

void hnn_layout(hnn_model *model)
{
    const struct hnn_settings *s = &model->settings;
    size_t n = s->dof, angles = 0;
    for (uint64_t bits = s->angles; bits; bits &= bits - 1)
        angles++;
    /* Rows of what is seen: q of the coordinates, m of inputs, n of momenta or velocities. */
    size_t q = n + angles, m = s->inputs - s->controls;
    model->size = model->n_blocks = model->n_nets = 0;
    if (s->pixels) {
        model->encoder = add_coder(model, 0, model->seen, 2 * n);
        model->decoder = add_coder(model, HNN_CODER_LAYERS, 2 * n, s->pixels);
    }
    if (s->kind == HNN_SYMPNET) {
        for (size_t k = 0; k < s->layers; k++) {
            add_block(model, "", "module.", k, false, s->hidden[0], n);
            add_block(model, "", "module.", k, true, s->hidden[0], 1);
            add_block(model, "", "size.", k, false, 1, s->hidden[0]);
        }
    } else if (s->lattice) {
        add_net(model, "", 0, s->kind == HNN_BASELINE ? 4 : 3, s->kind == HNN_BASELINE ? 2 : 1);
    } else if (s->kind == HNN_BASELINE) {
        add_net(model, "", 0, q + m + n, 2 * n);
    } else if (s->quadratic) {
        add_net(model, "", 0, q + m, 1 + n * (n + 1) / 2);
    } else if (s->separable) {
        add_net(model, "kinetic.", q, m + n, 1);
        add_net(model, "potential.", 0, q + m, 1);
    } else {
        add_net(model, "", 0, q + m + n, s->field == HNN_BOTH ? 2 : 1);
    }
    if (s->dissipation)
        add_net(model, "dissipation.", 0, q + m + n, 1);
    model->control = model->n_blocks;
    if (s->control_network)
        add_net(model, "control.", 0, q + m, n * s->controls);
    else if (s->controls)
        add_block(model, "", "control.", 0, false, n, s->controls);
}
