#include "scene_inputs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME = 64 };

static bool is_set(const struct common *common, const char *name)
{
    for (size_t k = 0; k < common->set.n; k++)
        if (strcmp(common->set.setting[k].name, name) == 0)
            return true;
    return false;
}

/* Fills the sources, and lists the columns. */
static void choose(const struct common *common, const hnn_model *model, struct hnn_inputs *inputs,
                   char *columns)
{
    const struct hnn_settings *s = hnn_model_settings(model);
    char name[NAME];
    size_t n = 0, end = 0;
    inputs->n = s->inputs;
    for (size_t k = 0; k < s->inputs; k++) {
        struct hnn_input *in = &inputs->input[k];
        hnn_model_input(model, k, name, sizeof name);
        *in = (struct hnn_input){.source = HNN_INPUT_TIME};
        if (k == 0 && s->time)
            continue;
        in->source = is_set(common, name) ? HNN_INPUT_VALUE : HNN_INPUT_COLUMN;
        if (in->source == HNN_INPUT_VALUE)
            continue;
        in->column = n++;
        end += (size_t)sprintf(columns + end, "%s%s", end ? "," : "", name);
    }
}

enum ad_status scene_inputs_read(const struct common *common, const char *file,
                                 struct phys_system *system, struct scene_inputs *to,
                                 struct ad_error *error)
{
    hnn_model *model = hnn_system_model(system);
    char columns[HNN_INPUTS_MOST * NAME] = "", name[NAME];
    if (!file)
        return AD_OK;
    if (model)
        choose(common, model, &to->inputs, columns);
    if (!*columns)
        return ad_fail(error, AD_E_ARGUMENT,
                       "--inputs %s: expected a model with inputs that --set does not give", file);
    const char *held = hnn_model_noted(model, "interpolation");
    to->inputs.hold = held && strcmp(held, "hold") == 0;
    to->inputs.table = &to->table;
    if (hnn_inputs_read(file, "t", columns, &to->table, error) != AD_OK)
        return error->status;
    const struct hnn_settings *s = hnn_model_settings(model);
    for (size_t k = s->time; k < s->inputs; k++) {
        hnn_model_input(model, k, name, sizeof name);
        if (to->inputs.input[k].source == HNN_INPUT_VALUE)
            to->inputs.input[k].value = phys_system_get(system, name);
    }
    if (s->kind == HNN_LAGRANGIAN && !hnn_inputs_constant(&to->inputs, s->inputs - s->controls))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--inputs %s: parameters of a Lagrangian model are constant along a motion; "
                       "give them by --set",
                       file);
    const struct hnn_drive drive = {hnn_inputs_at, &to->inputs, false, hnn_inputs_record};
    return hnn_system_drive(system, &drive, error);
}

void scene_inputs_free(struct scene_inputs *inputs) { hnn_path_free(&inputs->table); }
