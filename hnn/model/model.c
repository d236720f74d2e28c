/* A model: settings, parameters, notes. */
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void hnn_to_double(enum ad_type type, size_t n, const void *from, double *to)
{
    const float *singles = from;
    if (type == AD_F64)
        memcpy(to, from, n * sizeof *to);
    else
        for (size_t k = 0; k < n; k++)
            to[k] = (double)singles[k];
}

void hnn_from_double(enum ad_type type, size_t n, const double *from, void *to)
{
    float *singles = to;
    if (type == AD_F64)
        memcpy(to, from, n * sizeof *from);
    else
        for (size_t k = 0; k < n; k++)
            singles[k] = (float)from[k];
}

enum ad_status hnn_model_blank(const struct hnn_settings *settings, hnn_model **out,
                               struct ad_error *error)
{
    const struct hnn_activation *activation = NULL;
    if (AD_LACKS(error, settings, out))
        return error->status;
    *out = NULL;
    const char *name = settings->network ? hnn_activations[0].name : settings->activation;
    if (hnn_activation_find(name, &activation, error) != AD_OK ||
        hnn_settings_check(settings, error) != AD_OK)
        return error->status;
    hnn_model *model = calloc(1, sizeof *model);
    if (!model)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    model->settings = *settings;
    model->settings.size = sizeof model->settings;
    model->settings.activation = activation->name;
    model->activation = activation;
    if (settings->network) {
        model->network = *settings->network;
        snprintf(model->network_name, sizeof model->network_name, "%s", settings->network->name);
        model->network.name = model->network_name;
        model->network.start = NULL; /* the caller's */
        model->settings.network = &model->network;
        model->settings.layers = 1;
    }
    model->scaling.energy = 1;
    model->evaluate_in = AD_F64;
    model->version = 1;
    model->seen = settings->pixels;
    hnn_layout(model);
    *out = model;
    return AD_OK;
}

enum ad_status hnn_model_make_room(hnn_model *model, struct ad_error *error)
{
    model->parameters = calloc(model->size, hnn_type_bytes(model->settings.precision));
    return model->parameters
               ? AD_OK
               : ad_fail(error, AD_E_MEMORY, "out of memory for %zu parameters", model->size);
}

enum ad_status hnn_model_new(const struct hnn_settings *settings, hnn_model **out,
                             struct ad_error *error)
{
    if (out)
        *out = NULL;
    if (AD_LACKS(error, settings, out))
        return error->status;
    AD_OWN(hnn_settings, settings, network, error);
    if ((settings->network && AD_LACKS(error, settings->network->start)) ||
        hnn_model_blank(settings, out, error) != AD_OK)
        return error->status;
    hnn_model *model = *out;
    double *values = malloc(model->size * sizeof *values);
    if (hnn_model_make_room(model, error) != AD_OK || !values)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu parameters", model->size);
    else if (settings->network)
        hnn_from_double(settings->precision, model->size, settings->network->start,
                        model->parameters);
    else if (hnn_start_draw(model, values, error) == AD_OK)
        hnn_from_double(settings->precision, model->size, values, model->parameters);
    if (error->status == AD_OK && settings->network)
        hnn_network_check_columns(model, error);
    free(values);
    if (error->status != AD_OK) {
        hnn_model_free(model);
        *out = NULL;
    }
    return error->status;
}

enum ad_status hnn_model_new_network(const struct hnn_network *network, enum hnn_kind kind,
                                     size_t dof, hnn_model **out, struct ad_error *error)
{
    struct hnn_settings settings = hnn_defaults(kind, dof);
    settings.precision = AD_F64;
    settings.network = network;
    if (out)
        *out = NULL;
    return AD_LACKS(error, network, out) ? error->status : hnn_model_new(&settings, out, error);
}

static void forget(struct note *note) { AD_FREE(note->name, note->text); }

void hnn_model_free(hnn_model *model)
{
    if (!model)
        return;
    for (size_t k = 0; k < model->n_notes; k++)
        forget(&model->note[k]);
    hnn_evaluator_free(model->one);
    hnn_evaluator_free(model->many);
    AD_FREE(model->scaling.centre, model->range, model->parameters, model);
}

const struct hnn_settings *hnn_model_settings(const hnn_model *model)
{
    return model ? &model->settings : NULL;
}
size_t hnn_model_size(const hnn_model *model) { return model ? model->size : 0; }
const void *hnn_model_parameters(const hnn_model *model)
{
    return model ? model->parameters : NULL;
}

const struct hnn_block *hnn_model_blocks(const hnn_model *model, size_t *n)
{
    if (n)
        *n = model ? model->n_blocks : 0;
    return model ? model->block : NULL;
}

void hnn_model_set_parameters(hnn_model *model, const void *parameters)
{
    if (!model || !parameters)
        return;
    memcpy(model->parameters, parameters, model->size * hnn_type_bytes(model->settings.precision));
    model->version++;
}

/* ---- remarks ---- */

static size_t find_note(const hnn_model *model, const char *name)
{
    size_t k = 0;
    while (k < model->n_notes && strcmp(model->note[k].name, name) != 0)
        k++;
    return k;
}

const char *hnn_model_noted(const hnn_model *model, const char *name)
{
    size_t k = model && name ? find_note(model, name) : 0;
    return model && name && k < model->n_notes ? model->note[k].text : NULL;
}

enum ad_status hnn_model_note(hnn_model *model, const char *name, const char *text,
                              struct ad_error *error)
{
    if (AD_LACKS(error, model, name))
        return error->status;
    size_t k = find_note(model, name);
    if (k < model->n_notes) {
        forget(&model->note[k]);
        model->note[k] = model->note[--model->n_notes];
    }
    if (!text)
        return AD_OK;
    struct note note = {strdup(name), strdup(text)};
    if (model->n_notes < HNN_NOTES_MOST && note.name && note.text) {
        model->note[model->n_notes++] = note;
        return AD_OK;
    }
    forget(&note);
    return ad_fail(error, AD_E_MEMORY, "no room for a remark on the model");
}

/* Letters, digits and joining characters, which are valid in every file format and picture. */
static bool is_plain(const char *name, size_t n)
{
    bool digits = true;
    for (size_t k = 0; k < n; k++) {
        unsigned char c = (unsigned char)name[k];
        bool digit = c >= '0' && c <= '9', letter = (c | 0x20) >= 'a' && (c | 0x20) <= 'z';
        if (!digit && !letter && c < 0x80 && !strchr("_.", c))
            return false;
        digits = digits && digit;
    }
    return n && !digits;
}

/* Name k of the `wanted` ones that a note lists; false: there are others, or not plain ones. */
static bool name_noted(const char *at, size_t wanted, size_t k, char *name, size_t size)
{
    const char *found = NULL;
    size_t n = 0, length = 0;
    bool plain = at != NULL;
    for (; plain && at; n++, at = at[length] ? at + length + 1 : NULL) {
        length = strcspn(at, ",");
        plain = is_plain(at, length) && length < size;
        found = n == k ? at : found;
    }
    if (!plain || n != wanted || !found)
        return false;
    snprintf(name, size, "%.*s", (int)strcspn(found, ","), found);
    return true;
}

void hnn_model_component(const hnn_model *model, size_t k, char *name, size_t size)
{
    if (!name || !size)
        return;
    size_t states = model ? hnn_states(model) : 0, half = states / 2;
    if (!name_noted(hnn_model_noted(model, "state"), states, k, name, size))
        snprintf(name, size, "%c%zu", model ? hnn_letter(model, k) : 'q', half ? k % half + 1 : 0);
}

void hnn_model_input(const hnn_model *model, size_t k, char *name, size_t size)
{
    if (!name || !size)
        return;
    size_t inputs = model ? model->settings.inputs : 0;
    if (!name_noted(hnn_model_noted(model, "inputs"), inputs, k, name, size))
        snprintf(name, size, "u%zu", k + 1);
}

/* ---- inputs along a motion ---- */

void hnn_model_drive(hnn_model *model, const struct hnn_drive *drive)
{
    if (model)
        model->drive = drive ? *drive : (struct hnn_drive){0};
}

bool hnn_model_conserves(const hnn_model *model)
{
    const struct hnn_settings *s = model ? &model->settings : NULL;
    return s && (!s->inputs || (!s->time && !s->controls && model->drive.constant));
}

enum ad_status hnn_model_inputs(const hnn_model *model, double t, double *u, struct ad_error *error)
{
    if (AD_LACKS(error, model, u))
        return error->status;
    const struct hnn_settings *s = &model->settings;
    char name[32];
    if (model->drive.at)
        return model->drive.at(model->drive.context, t, u, error);
    if (s->time)
        u[0] = t;
    if (s->inputs <= s->time)
        return AD_OK;
    hnn_model_input(model, s->time, name, sizeof name);
    return ad_fail(error, AD_E_ARGUMENT, "the model has an input %s, which nothing gives", name);
}

/* ---- normalisation ---- */

/* Of the size of H: with it, H_p/scale_p has about the size of dq/dt, and H_q/scale_q that of
   dp/dt; the geometric mean of the 2n answers. */
static double energy_size(const hnn_model *model)
{
    const struct hnn_scaling *s = &model->scaling;
    size_t n = model->settings.dof;
    double sum = 0;
    for (size_t k = 0; k < 2 * n; k++)
        sum += log(s->rate[k] * s->scale[(k + n) % (2 * n)]);
    return exp(sum / (double)(2 * n));
}

/* Sites of a lattice get the centre, deviation and rate of all of them together; all [3 x m]. */
static void share(size_t sites, size_t m, double *all)
{
    for (double *centre = all; centre <= all + sites; centre += sites) {
        double *scale = centre + m, *rate = scale + m, mean = 0, square = 0, rates = 0;
        for (size_t k = 0; k < sites; k++) {
            mean += centre[k] / (double)sites;
            rates += rate[k] * rate[k] / (double)sites;
        }
        for (size_t k = 0; k < sites; k++)
            square += (scale[k] * scale[k] + pow(centre[k] - mean, 2)) / (double)sites;
        for (size_t k = 0; k < sites; k++) {
            centre[k] = mean;
            scale[k] = sqrt(square);
            rate[k] = sqrt(rates);
        }
    }
}

enum ad_status hnn_model_normalise(hnn_model *model, const double *centre, const double *scale,
                                   const double *rate, struct ad_error *error)
{
    if (AD_LACKS(error, model, centre, scale, rate))
        return error->status;
    size_t states = hnn_states(model), m = hnn_scaled(model), bytes = m * sizeof(double);
    if (model->settings.pixels)
        return ad_fail(error, AD_E_ARGUMENT, "latent states cannot be normalised beforehand");
    for (size_t k = 0; k < m; k++)
        if (!isfinite(centre[k]) || !(scale[k] > 0) || !isfinite(scale[k]) ||
            (k < states && !(rate[k] > 0 && isfinite(rate[k]))))
            return ad_fail(error, AD_E_ARGUMENT,
                           "%s %zu cannot be normalised: expected a finite deviation above 0, "
                           "got %g",
                           k < states ? "state component" : "input",
                           k < states ? k + 1 : k - states + 1,
                           k < states && scale[k] > 0 ? rate[k] : scale[k]);
    double *all = malloc(3 * bytes);
    if (!all)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(all, centre, bytes);
    memcpy(all + m, scale, bytes);
    for (size_t k = 0; k < m; k++)
        all[2 * m + k] = k < states ? rate[k] : 1;
    for (uint64_t bits = model->settings.angles, k = 0; bits; bits >>= 1, k++)
        if (bits & 1) { /* an angle's size is a radian */
            all[k] = 0;
            all[m + k] = 1;
        }
    if (model->settings.lattice)
        share(states / 2, m, all);
    free(model->scaling.centre);
    model->scaling = (struct hnn_scaling){.centre = all, .scale = all + m, .rate = all + 2 * m};
    model->scaling.energy = energy_size(model);
    model->normalised++;
    hnn_evaluator_free(model->one);
    hnn_evaluator_free(model->many);
    model->one = model->many = NULL;
    return AD_OK;
}
