/* Models as safetensors (exchange.h). */
#include "autodiff/free.h"
#include "exchange.h"
#include "internal.h"
#include "maps.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char format[] = "leastaction model", note_prefix[] = "note.";
enum { TEXT = 32 + 8 * HNN_LAYERS_MOST };

/* ---- settings as texts ---- */

enum { N_NAMES = 4, N_NEEDED = 9, N_NUMBERS = 14 }; /* the others: 0 if there are none */

struct named {
    const char *key, *const *names;
    unsigned *index;
};

struct numbered {
    const char *key;
    uint64_t value, most;
};

static void names_of(unsigned index[N_NAMES], struct named named[N_NAMES])
{
    named[0] = (struct named){"model", hnn_kinds, &index[0]};
    named[1] = (struct named){"field", hnn_field_types, &index[1]};
    named[2] = (struct named){"start", hnn_starts, &index[2]};
    named[3] = (struct named){"precision", hnn_precisions, &index[3]};
}

static void numbers_of(const struct hnn_settings *s, struct numbered n[N_NUMBERS])
{
    const struct numbered all[N_NUMBERS] = {
        {"dof", s->dof, 1 << 20},
        {"layers", s->layers, HNN_LAYERS_MOST},
        {"separable", s->separable, 1},
        {"dissipation", s->dissipation, 1},
        {"quadratic", s->quadratic, 1},
        {"angles", s->angles, (UINT64_C(1) << HNN_ANGLES_MOST) - 1},
        {"pixels", s->pixels, 1 << 20},
        {"autoencoder", s->autoencoder, 1 << 20},
        {"seed", s->seed, UINT64_MAX},
        {"inputs", s->inputs, HNN_INPUTS_MOST},
        {"time", s->time, 1},
        {"controls", s->controls, HNN_INPUTS_MOST},
        {"lattice", s->lattice, HNN_FIXED_ENDS},
        {"control_network", s->control_network, 1},
    };
    memcpy(n, all, sizeof all);
}

/* ---- writing ---- */

struct writing {
    struct hnn_metadata *metadata;
    size_t n, room;
    bool failed;
};

static void add(struct writing *w, const char *prefix, const char *key, const char *text)
{
    char *full = malloc(strlen(prefix) + strlen(key) + 1), *copy = strdup(text);
    if (!full || !copy || w->n == w->room) {
        AD_FREE(full, copy);
        w->failed = true;
        return;
    }
    sprintf(full, "%s%s", prefix, key);
    w->metadata[w->n].key = full;
    w->metadata[w->n++].text = copy;
}

static void add_settings(struct writing *w, const hnn_model *model)
{
    const struct hnn_settings *s = &model->settings;
    unsigned index[N_NAMES] = {s->kind, s->field, s->start, s->precision};
    struct named named[N_NAMES];
    struct numbered number[N_NUMBERS];
    char text[TEXT] = "";
    add(w, "", "format", format);
    add(w, "", "version", "1");
    names_of(index, named);
    for (size_t k = 0; k < N_NAMES; k++)
        add(w, "", named[k].key, named[k].names[*named[k].index]);
    add(w, "", "activation", s->activation);
    for (size_t k = 0; k + 1 < s->layers; k++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%zu", k ? "," : "",
                 s->hidden[k]);
    add(w, "", "hidden", text);
    numbers_of(s, number);
    for (size_t k = 0; k < N_NUMBERS; k++) {
        if (k >= N_NEEDED && !number[k].value)
            continue;
        snprintf(text, sizeof text, "%" PRIu64, number[k].value);
        add(w, "", number[k].key, text);
    }
    for (size_t k = 0; k < model->n_notes; k++)
        add(w, note_prefix, model->note[k].name, model->note[k].text);
}

enum ad_status hnn_model_export(const hnn_model *model, const char *file, struct ad_error *error)
{
    struct hnn_tensor_source tensor[HNN_BLOCKS_MOST + 2];
    struct hnn_metadata metadata[HNN_NOTES_MOST + N_NAMES + N_NUMBERS + 4];
    struct writing w = {metadata, 0, LENGTH(metadata), false};
    size_t n = 0, m;
    if (AD_LACKS(error, model, file))
        return error->status;
    if (model->settings.network)
        return ad_fail(error, AD_E_ARGUMENT,
                       "network '%s' is a program's own; expected perceptrons",
                       model->network.name);
    m = hnn_scaled(model);
    if (model->scaling.centre) /* doubles first, so that each lies at a multiple of its size */
        tensor[n++] =
            (struct hnn_tensor_source){"normalisation", AD_F64, 2, {3, m}, model->scaling.centre};
    if (model->range)
        tensor[n++] = (struct hnn_tensor_source){"range", AD_F64, 2, {2, m + 1}, model->range};
    for (size_t k = 0; k < model->n_blocks; k++) {
        const struct hnn_block *b = &model->block[k];
        const enum ad_type type = model->settings.precision;
        tensor[n++] = (struct hnn_tensor_source){b->name,
                                                 type,
                                                 b->bias ? 1 : 2,
                                                 {b->rows, b->cols},
                                                 (const char *)model->parameters +
                                                     b->offset * hnn_type_bytes(type)};
    }
    add_settings(&w, model);
    if (w.failed)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        hnn_tensors_write(file, n, tensor, w.n, metadata, error);
    for (size_t k = 0; k < w.n; k++) {
        AD_FREE(metadata[k].key, metadata[k].text);
    }
    return error->status;
}

/* ---- reading: files of ours ---- */

static bool read_number(const char *text, uint64_t most, uint64_t *value)
{
    char *end;
    errno = 0;
    *value = strtoull(text, &end, 10);
    return isdigit((unsigned char)*text) && *end == '\0' && errno == 0 && *value <= most;
}

static enum ad_status refuse_text(const struct hnn_tensors *t, const char *key,
                                  struct ad_error *error)
{
    const char *text = hnn_metadata_find(t, key);
    return ad_fail(error, AD_E_INPUT, "%s: __metadata__: %s is '%.60s', expected %s", t->file, key,
                   text ? text : "", "what leastaction convert writes");
}

static enum ad_status read_widths(const struct hnn_tensors *t, struct hnn_settings *s,
                                  struct ad_error *error)
{
    const char *text = hnn_metadata_find(t, "hidden");
    size_t n = 0;
    for (char *end; text && *text && n + 1 < HNN_LAYERS_MOST; text = *end == ',' ? end + 1 : end) {
        s->hidden[n++] = (size_t)strtoull(text, &end, 10);
        if (end == text)
            break;
    }
    return text && *text == '\0' && n + 1 == s->layers ? AD_OK : refuse_text(t, "hidden", error);
}

static enum ad_status read_settings(const struct hnn_tensors *t, struct hnn_settings *s,
                                    struct ad_error *error)
{
    unsigned index[N_NAMES] = {0};
    struct named named[N_NAMES];
    struct numbered number[N_NUMBERS];
    const char *version = hnn_metadata_find(t, "version");
    if (!version || strcmp(version, "1") != 0)
        return refuse_text(t, "version", error);
    names_of(index, named);
    for (size_t k = 0; k < N_NAMES; k++) {
        const char *text = hnn_metadata_find(t, named[k].key);
        while (text && named[k].names[*named[k].index] &&
               strcmp(named[k].names[*named[k].index], text) != 0)
            ++*named[k].index;
        if (!text || !named[k].names[*named[k].index])
            return refuse_text(t, named[k].key, error);
    }
    *s = hnn_defaults((enum hnn_kind)index[0], 1);
    s->field = (enum hnn_field_type)index[1];
    s->start = (enum hnn_start)index[2];
    s->precision = (enum ad_type)index[3];
    s->activation = hnn_metadata_find(t, "activation");
    numbers_of(s, number);
    for (size_t k = 0; k < N_NUMBERS; k++) {
        const char *text = hnn_metadata_find(t, number[k].key);
        if (!text && k >= N_NEEDED)
            continue;
        if (!text || !read_number(text, number[k].most, &number[k].value))
            return refuse_text(t, number[k].key, error);
    }
    s->dof = (size_t)number[0].value;
    s->layers = (size_t)number[1].value;
    s->separable = number[2].value;
    s->dissipation = number[3].value;
    s->quadratic = number[4].value;
    s->angles = number[5].value;
    s->pixels = (size_t)number[6].value;
    s->autoencoder = (size_t)number[7].value;
    s->seed = number[8].value;
    s->inputs = (size_t)number[9].value;
    s->time = number[10].value;
    s->controls = (size_t)number[11].value;
    s->lattice = (enum hnn_lattice)number[12].value;
    s->control_network = number[13].value;
    return s->activation ? read_widths(t, s, error) : refuse_text(t, "activation", error);
}

static enum ad_status read_finite(const struct hnn_tensors *t, const struct hnn_tensor *from,
                                  size_t first, size_t n, double *values, struct ad_error *error)
{
    hnn_tensor_values(t, from, first, n, values, error);
    for (size_t k = 0; k < n && error->status == AD_OK; k++)
        if (!isfinite(values[k]))
            ad_fail(error, AD_E_INPUT, "%s: '%.100s': element %zu is not finite", t->file,
                    from->name, first + k + 1);
    return error->status;
}

/* The last map of ours has no bias. */
static enum ad_status check_last(const struct hnn_tensors *t, const struct hnn_maps *m,
                                 const hnn_model *model, struct hnn_exchange *exchange,
                                 struct ad_error *error)
{
    const struct hnn_tensor *bias = m->bias[m->n - 1];
    double value;
    for (size_t k = 0; bias && k < bias->n; k++) {
        if (read_finite(t, bias, k, 1, &value, error) != AD_OK)
            return error->status;
        if (value != 0 && model->settings.kind == HNN_BASELINE)
            return ad_fail(
                error, AD_E_INPUT,
                "%s: '%.80s' is %g: the last map of a baseline has no bias here; expected "
                "a network trained without it (torch.nn.Linear(..., bias=False))",
                t->file, bias->name, value);
        exchange->bias = value != 0 ? value : exchange->bias;
    }
    return AD_OK;
}

/* ---- reading: parameters ---- */

/* The tensor of block k, of which rows from *first on are the block's. */
static const struct hnn_tensor *tensor_of(const struct hnn_tensors *t, const struct hnn_maps *m,
                                          const hnn_model *model, size_t k, size_t *first)
{
    const struct hnn_block *b = &model->block[k];
    *first = 0;
    if (!m->n)
        return hnn_tensor_find(t, b->name);
    if (k / 2 + 1 == m->n)
        hnn_maps_outputs(&model->settings, m->weight[k / 2]->dims[0], first);
    return b->bias ? m->bias[k / 2] : m->weight[k / 2];
}

/* `some`: its rows may be some of the tensor's. */
static bool fits(const struct hnn_tensor *t, const struct hnn_block *b, size_t first, bool some)
{
    return t->rank == (b->bias ? 1 : 2) && (b->bias || t->dims[1] == b->cols) &&
           (some ? t->dims[0] >= first + b->rows : t->dims[0] == b->rows);
}

static enum ad_status read_blocks(const struct hnn_tensors *t, const struct hnn_maps *m,
                                  hnn_model *model, struct ad_error *error)
{
    size_t first;
    for (size_t k = 0; k < model->n_blocks; k++) {
        const struct hnn_block *b = &model->block[k];
        const struct hnn_tensor *from = tensor_of(t, m, model, k, &first);
        if (from ? !fits(from, b, first, m->n > 0) : !(m->n && b->bias))
            return ad_fail(error, AD_E_INPUT, "%s: '%s' %s, expected %zu x %zu", t->file, b->name,
                           from ? "has another shape" : "is missing", b->rows, b->cols);
    }
    double *values = malloc(t->n ? model->size * sizeof *values : 1);
    if (!values || hnn_model_make_room(model, error) != AD_OK)
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu parameters", model->size);
    for (size_t k = 0; k < model->n_blocks && error->status == AD_OK; k++) {
        const struct hnn_block *b = &model->block[k];
        const struct hnn_tensor *from = tensor_of(t, m, model, k, &first);
        const size_t n = b->rows * b->cols, bytes = hnn_type_bytes(model->settings.precision);
        if (from && read_finite(t, from, first * b->cols, n, values, error) == AD_OK)
            hnn_from_double(model->settings.precision, n, values,
                            (char *)model->parameters + b->offset * bytes);
    }
    free(values);
    return error->status;
}

/* [rows x cols] of the file, to be freed; NULL: none, or an error. */
static double *read_array(const struct hnn_tensors *t, const char *name, size_t rows, size_t cols,
                          struct ad_error *error)
{
    const struct hnn_tensor *from = hnn_tensor_find(t, name);
    double *values = NULL;
    if (!from || error->status != AD_OK)
        return NULL;
    if (from->rank != 2 || from->dims[0] != rows || from->dims[1] != cols)
        ad_fail(error, AD_E_INPUT, "%s: '%s' has another shape, expected %zu x %zu", t->file, name,
                rows, cols);
    else if (!(values = malloc(rows * cols * sizeof *values)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        hnn_tensor_values(t, from, 0, rows * cols, values, error);
    return values;
}

static enum ad_status read_rest(const struct hnn_tensors *t, hnn_model *model,
                                struct ad_error *error)
{
    struct ad_error why = {0};
    const size_t m = hnn_scaled(model);
    double *v = read_array(t, "normalisation", 3, m, error);
    if (v && error->status == AD_OK &&
        hnn_model_normalise(model, v, v + m, v + 2 * m, &why) != AD_OK)
        ad_fail(error, AD_E_INPUT, "%s: 'normalisation': %s", t->file, why.message);
    free(v);
    model->range = read_array(t, "range", 2, hnn_rows(model) + 1, error);
    for (size_t k = 0; k < t->n_metadata && error->status == AD_OK; k++)
        if (strncmp(t->metadata[k].key, note_prefix, strlen(note_prefix)) == 0)
            hnn_model_note(model, t->metadata[k].key + strlen(note_prefix), t->metadata[k].text,
                           error);
    return error->status;
}

static enum ad_status build(const struct hnn_tensors *t, const struct hnn_settings *assumed,
                            hnn_model **model, struct hnn_exchange *exchange,
                            struct ad_error *error)
{
    struct hnn_settings settings;
    struct hnn_maps maps = {0};
    struct ad_error why = {0};
    const char *ours = hnn_metadata_find(t, "format");
    exchange->own = ours && strcmp(ours, format) == 0;
    if (exchange->own)
        read_settings(t, &settings, error);
    else if (assumed->kind == HNN_SYMPNET)
        ad_fail(error, AD_E_ARGUMENT,
                "%s: perceptrons of another program are no sympnet; try --model hnn", t->file);
    else if (hnn_maps_find(t, &maps, error) == AD_OK)
        hnn_maps_settings(t, &maps, assumed, &settings, error);
    if (error->status != AD_OK)
        return error->status;
    if (hnn_model_blank(&settings, model, &why) != AD_OK)
        return ad_fail(error, why.status == AD_E_MEMORY ? AD_E_MEMORY : AD_E_INPUT, "%s: %s",
                       t->file, why.message);
    if (read_blocks(t, &maps, *model, error) == AD_OK && exchange->own)
        read_rest(t, *model, error);
    return maps.n && error->status == AD_OK ? check_last(t, &maps, *model, exchange, error)
                                            : error->status;
}

enum ad_status hnn_model_import(const char *file, const struct hnn_settings *assumed,
                                hnn_model **model, struct hnn_exchange *exchange,
                                struct ad_error *error)
{
    struct hnn_tensors tensors;
    if (model)
        *model = NULL;
    if (AD_LACKS(error, file, assumed, model, exchange))
        return error->status;
    *exchange = (struct hnn_exchange){0};
    if (hnn_tensors_read(file, &tensors, error) == AD_OK)
        build(&tensors, assumed, model, exchange, error);
    hnn_tensors_free(&tensors);
    if (error->status != AD_OK) {
        hnn_model_free(*model);
        *model = NULL;
    }
    return error->status;
}
