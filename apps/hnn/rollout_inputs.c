/* Inputs of the models of a rollout: the time, numbers, or columns of a table (rollout.h). */
#include "rollout.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME = 64 };

static const char *const interpolations[] = {"linear", "hold"};

/* The last counts, as of --set. */
static const struct phys_setting *fixed(const struct rollout_options *o, const char *name)
{
    const struct phys_setting *last = NULL;
    for (size_t k = 0; k < o->fix.n; k++)
        if (strcmp(o->fix.setting[k].name, name) == 0)
            last = &o->fix.setting[k];
    return last;
}

char *rollout_input_columns(const struct rollout_options *o, const hnn_model *model)
{
    const struct hnn_settings *s = hnn_model_settings(model);
    char *list = calloc(s->inputs + 1, NAME), name[NAME];
    size_t end = 0;
    for (size_t k = s->time; list && k < s->inputs; k++) {
        hnn_model_input(model, k, name, sizeof name);
        if (!fixed(o, name))
            end += (size_t)sprintf(list + end, "%s%s", end ? "," : "", name);
    }
    return list;
}

static enum ad_status choose_hold(const struct rollout_options *o, struct rollout_model *m,
                                  struct ad_error *error)
{
    const char *name = o->interpolation;
    if (!name)
        name = hnn_model_noted(m->model, "interpolation");
    if (name)
        m->inputs.hold = options_choose("interpolation", name, 2, interpolations, error) == 1;
    return error->status;
}

static bool same_columns(const struct rollout_run *run, const char *columns)
{
    char *first = rollout_input_columns(run->options, run->model[0].model);
    bool same = first && strcmp(first, columns) == 0;
    free(first);
    return same;
}

enum ad_status rollout_give_inputs(struct rollout_run *run, struct rollout_model *m,
                                   struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    const struct hnn_settings *s = hnn_model_settings(m->model);
    if (!s->inputs || choose_hold(o, m, error) != AD_OK)
        return error->status;
    char *columns = rollout_input_columns(o, m->model), name[NAME];
    if (!columns)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool data = run->truth.n && run->truth.u;
    if (*columns && o->inputs)
        hnn_inputs_read(o->inputs, o->time_column ? o->time_column : "t", columns, &m->table,
                        error);
    else if (*columns && !data)
        ad_fail(error, AD_E_ARGUMENT,
                "%s: inputs %s: expected --inputs TABLE, --truth FILE with these columns, or --fix "
                "NAME=VALUE",
                m->file, columns);
    else if (*columns && m != run->model && !same_columns(run, columns))
        ad_fail(error, AD_E_ARGUMENT,
                "%s: inputs %s: the truth's file is read for those of %s; give both by --inputs",
                m->file, columns, run->model->file);
    m->inputs.n = s->inputs;
    m->inputs.table = !*columns ? NULL : o->inputs ? &m->table : &run->truth;
    free(columns);
    for (size_t k = 0, column = 0; k < s->inputs && error->status == AD_OK; k++) {
        struct hnn_input *in = &m->inputs.input[k];
        hnn_model_input(m->model, k, name, sizeof name);
        const struct phys_setting *given = fixed(o, name);
        if (k == 0 && s->time && given)
            ad_fail(error, AD_E_ARGUMENT, "--fix %s: it is the time of %s", name, m->file);
        in->source = k == 0 && s->time ? HNN_INPUT_TIME
                     : given           ? HNN_INPUT_VALUE
                                       : HNN_INPUT_COLUMN;
        in->value = given ? given->value : 0;
        in->column = in->source == HNN_INPUT_COLUMN ? column++ : 0;
    }
    const struct hnn_drive drive = {hnn_inputs_at, &m->inputs,
                                    hnn_inputs_constant(&m->inputs, s->inputs), NULL};
    if (error->status != AD_OK)
        return error->status;
    if (s->kind == HNN_LAGRANGIAN && !hnn_inputs_constant(&m->inputs, s->inputs - s->controls))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: its parameters are constant along a motion, as it was trained; give "
                       "them by --fix",
                       m->file);
    hnn_model_drive(m->model, &drive);
    if (!isnan(o->add_energy) && !hnn_model_conserves(m->model))
        ad_fail(error, AD_E_ARGUMENT, "--add-energy: the H of %s changes with its inputs", m->file);
    return error->status;
}

enum ad_status rollout_check_fixed(const struct rollout_run *run, struct ad_error *error)
{
    const struct rollout_options *o = run->options;
    bool used = false;
    char name[NAME];
    for (size_t f = 0; f < o->fix.n; f++) {
        bool found = false;
        for (size_t m = 0; m < run->n_models; m++)
            for (size_t k = 0; k < hnn_model_settings(run->model[m].model)->inputs; k++) {
                hnn_model_input(run->model[m].model, k, name, sizeof name);
                found = found || strcmp(name, o->fix.setting[f].name) == 0;
            }
        if (!found)
            return ad_fail(error, AD_E_ARGUMENT, "--fix %s: no model has this input",
                           o->fix.setting[f].name);
    }
    for (size_t m = 0; m < run->n_models; m++)
        used = used || run->model[m].inputs.table;
    if (!used && (o->inputs || o->interpolation))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--%s: no model has inputs beside the time and those of --fix",
                       o->inputs ? "inputs" : "interpolation");
    return AD_OK;
}
