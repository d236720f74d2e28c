/* Reads and writes model files: settings as attributes, each block of parameters as a dataset of
   its name. The file's checksum (physics/io/checksum.h) is verified first. */
#include "internal.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char format[] = "leastaction model";
enum { VERSION = 1 };

/* ---- settings as attributes ---- */

/* Those that are one of several names. */
struct choice {
    const char *name, *const *names;
    size_t index;
};

enum { N_CHOICES = 4 };

static void choices(const struct hnn_settings *s, struct choice c[N_CHOICES])
{
    c[0] = (struct choice){"model", hnn_kinds, s->kind};
    c[1] = (struct choice){"field", hnn_field_types, s->field};
    c[2] = (struct choice){"start", hnn_starts, s->start};
    c[3] = (struct choice){"precision", hnn_precisions, s->precision};
}

enum { WIDTHS_ROOM = 8 * HNN_LAYERS_MOST };

/* "200,200" */
static void widths_text(const struct hnn_settings *s, char text[WIDTHS_ROOM])
{
    size_t end = 0;
    text[0] = '\0';
    for (size_t k = 0; k + 1 < s->layers; k++)
        end += (size_t)snprintf(text + end, WIDTHS_ROOM - end, "%s%zu", k ? "," : "", s->hidden[k]);
}

static void write_settings(const hnn_model *model, phys_hdf5 *file)
{
    const struct hnn_settings *s = &model->settings;
    struct choice choice[N_CHOICES];
    char text[WIDTHS_ROOM], seed[24];
    choices(s, choice);
    widths_text(s, text);
    snprintf(seed, sizeof seed, "%" PRIu64, s->seed);
    phys_hdf5_text(file, "/", "format", format);
    phys_hdf5_integer(file, "/", "version", VERSION, NULL);
    for (size_t k = 0; k < N_CHOICES; k++)
        phys_hdf5_text(file, "/", choice[k].name, choice[k].names[choice[k].index]);
    phys_hdf5_integer(file, "/", "dof", (int64_t)s->dof, NULL);
    phys_hdf5_integer(file, "/", "layers", (int64_t)s->layers, NULL);
    phys_hdf5_text(file, "/", "hidden", text);
    phys_hdf5_text(file, "/", "activation", s->activation);
    phys_hdf5_integer(file, "/", "separable", s->separable, NULL);
    phys_hdf5_integer(file, "/", "dissipation", s->dissipation, NULL);
    phys_hdf5_text(file, "/", "seed", seed);
    if (s->angles)
        phys_hdf5_integer(file, "/", "angles", (int64_t)s->angles, NULL);
    if (s->quadratic)
        phys_hdf5_integer(file, "/", "quadratic", 1, NULL);
    if (s->control_network)
        phys_hdf5_integer(file, "/", "control_network", 1, NULL);
    if (s->lattice)
        phys_hdf5_integer(file, "/", "lattice", s->lattice, NULL);
    if (s->inputs) {
        phys_hdf5_integer(file, "/", "inputs", (int64_t)s->inputs, NULL);
        phys_hdf5_integer(file, "/", "controls", (int64_t)s->controls, NULL);
        phys_hdf5_integer(file, "/", "time", s->time, NULL);
    }
    if (s->pixels) {
        phys_hdf5_integer(file, "/", "pixels", (int64_t)s->pixels, NULL);
        phys_hdf5_integer(file, "/", "autoencoder", (int64_t)s->autoencoder, NULL);
    }
}

enum ad_status hnn_model_write(const hnn_model *model, phys_hdf5 *file, const char *command,
                               struct ad_error *error)
{
    const struct hnn_settings *s = &model->settings;
    const struct hnn_scaling *scaling = &model->scaling;
    write_settings(model, file);
    if (command)
        phys_hdf5_text(file, "/", "command", command);
    phys_hdf5_folder(file, "notes");
    for (size_t k = 0; k < model->n_notes; k++)
        phys_hdf5_text(file, "notes", model->note[k].name, model->note[k].text);
    for (size_t k = 0; k < model->n_blocks; k++) {
        const struct hnn_block *b = &model->block[k];
        const char *values =
            (const char *)model->parameters + b->offset * hnn_type_bytes(s->precision);
        phys_hdf5_write(file, b->name, s->precision, b->bias ? 1 : 2, (size_t[]){b->rows, b->cols},
                        values);
    }
    if (scaling->centre)
        phys_hdf5_write(file, "normalisation", AD_F64, 2, (size_t[]){3, hnn_scaled(model)},
                        scaling->centre);
    if (model->range) {
        phys_hdf5_write(file, "range", AD_F64, 2, (size_t[]){2, hnn_rows(model) + 1}, model->range);
        phys_hdf5_text(file, "range", "axes",
                       s->inputs ? "least and largest seen; state, inputs, then H"
                                 : "least and largest seen; state, then H");
    }
    return s->network ? hnn_network_write(model, file, error) : AD_OK;
}

enum ad_status hnn_model_save(const hnn_model *model, const char *name, const char *command,
                              struct ad_error *error)
{
    phys_hdf5 *file;
    if (AD_LACKS(error, model, name))
        return error->status;
    if (phys_hdf5_create(name, &file, error) != AD_OK)
        return error->status;
    if (hnn_model_write(model, file, command, error) == AD_OK)
        return phys_hdf5_commit(file, error);
    phys_hdf5_abandon(file);
    return error->status;
}

/* ---- reading ---- */

struct reading {
    const char *name; /* of the file */
    phys_hdf5 *file;
    const struct hnn_network *network; /* of the caller, or NULL */
    struct ad_error *error;
};

static bool failed(const struct reading *r) { return r->error->status != AD_OK; }

static char *read_text(const struct reading *r, const char *name)
{
    char *text = NULL;
    if (!failed(r))
        phys_hdf5_get_text(r->file, "/", name, &text, r->error);
    return text;
}

static size_t read_count(const struct reading *r, const char *name, size_t most)
{
    double value = 0;
    if (failed(r) || phys_hdf5_get(r->file, "/", name, &value, r->error) != AD_OK)
        return 0;
    if (!(value >= 0 && value <= (double)most) || value != (double)(size_t)value)
        ad_fail(r->error, AD_E_INPUT, "%s: attribute '%s' is %g, expected a number up to %zu",
                r->name, name, value, most);
    return failed(r) ? 0 : (size_t)value;
}

static bool has(const struct reading *r, const char *name)
{
    double value;
    struct ad_error none = {0};
    return phys_hdf5_get(r->file, "/", name, &value, &none) == AD_OK;
}

static size_t read_choice(const struct reading *r, const struct choice *choice)
{
    char *text = read_text(r, choice->name);
    size_t index = 0;
    struct ad_error why = {0};
    if (text && hnn_find(choice->name, text, choice->names, &index, &why) != AD_OK)
        ad_fail(r->error, AD_E_INPUT, "%s: %s", r->name, why.message);
    free(text);
    return index;
}

static void read_format(const struct reading *r)
{
    char *text = NULL;
    struct ad_error none = {0};
    phys_hdf5_get_text(r->file, "/", "format", &text, &none);
    if (none.status == AD_E_MEMORY)
        ad_fail(r->error, none.status, "%s", none.message);
    if (!text || strcmp(text, format) != 0)
        ad_fail(r->error, AD_E_INPUT,
                "%s: not a model: expected a file that `leastaction train` wrote", r->name);
    free(text);
    if (!failed(r) && read_count(r, "version", 1 << 20) != VERSION && !failed(r))
        ad_fail(r->error, AD_E_INPUT, "%s: is of another version, expected %d", r->name, VERSION);
}

static void read_widths(const struct reading *r, struct hnn_settings *s)
{
    char *text = read_text(r, "hidden"), *at = text;
    size_t n = 0;
    while (at && *at && n + 1 < HNN_LAYERS_MOST) {
        s->hidden[n++] = (size_t)strtoul(at, &at, 10);
        if (*at != ',')
            break;
        at++;
    }
    if (text && (*at || n + 1 != s->layers))
        ad_fail(r->error, AD_E_INPUT, "%s: attribute 'hidden' is '%s', expected %zu widths",
                r->name, text, s->layers - 1);
    free(text);
}

static void read_settings(const struct reading *r, struct hnn_settings *s)
{
    struct choice choice[N_CHOICES];
    *s = hnn_defaults(HNN_HAMILTONIAN, 1);
    read_format(r);
    if (!failed(r))
        hnn_network_expect(r->network, r->name, r->file, r->error);
    s->network = r->network;
    choices(s, choice);
    s->kind = (enum hnn_kind)read_choice(r, &choice[0]);
    s->field = (enum hnn_field_type)read_choice(r, &choice[1]);
    s->start = (enum hnn_start)read_choice(r, &choice[2]);
    s->precision = (enum ad_type)read_choice(r, &choice[3]);
    s->dof = read_count(r, "dof", 1 << 20);
    s->layers = read_count(r, "layers", HNN_LAYERS_MOST);
    read_widths(r, s);
    s->separable = read_count(r, "separable", 1);
    s->dissipation = read_count(r, "dissipation", 1);
    char *seed = read_text(r, "seed");
    s->seed = seed ? strtoull(seed, NULL, 10) : 0;
    free(seed);
    if (has(r, "angles"))
        s->angles = read_count(r, "angles", ((size_t)1 << HNN_ANGLES_MOST) - 1);
    s->quadratic = has(r, "quadratic") && read_count(r, "quadratic", 1);
    s->control_network = has(r, "control_network") && read_count(r, "control_network", 1);
    if (has(r, "lattice"))
        s->lattice = (enum hnn_lattice)read_count(r, "lattice", HNN_FIXED_ENDS);
    if (has(r, "inputs")) {
        s->inputs = read_count(r, "inputs", HNN_INPUTS_MOST);
        s->controls = read_count(r, "controls", HNN_INPUTS_MOST);
        s->time = read_count(r, "time", 1);
    }
    if (has(r, "pixels")) {
        s->pixels = read_count(r, "pixels", 1 << 20);
        s->autoencoder = read_count(r, "autoencoder", 1 << 20);
    }
}

static void check_shape(const struct reading *r, const struct hnn_block *b)
{
    struct phys_hdf5_item item;
    if (failed(r) || phys_hdf5_shape(r->file, b->name, &item, r->error) != AD_OK)
        return;
    if (item.rank != (b->bias ? 1 : 2) || item.dims[0] != b->rows ||
        (!b->bias && item.dims[1] != b->cols))
        ad_fail(r->error, AD_E_INPUT, "%s: '%s' has another shape, expected %zu x %zu", r->name,
                b->name, b->rows, b->cols);
}

static void read_block(const struct reading *r, hnn_model *model, const struct hnn_block *b,
                       double *values)
{
    enum ad_type type = model->settings.precision;
    if (!failed(r) && phys_hdf5_read(r->file, b->name, 0, b->rows, values, r->error) == AD_OK)
        hnn_from_double(type, b->rows * b->cols, values,
                        (char *)model->parameters + b->offset * hnn_type_bytes(type));
}

static void read_normalisation(const struct reading *r, hnn_model *model, double *values)
{
    struct phys_hdf5_item item;
    struct ad_error none = {0}, why = {0};
    size_t m = hnn_scaled(model);
    if (failed(r) || phys_hdf5_shape(r->file, "normalisation", &item, &none) != AD_OK)
        return;
    if (item.rank != 2 || item.dims[0] != 3 || item.dims[1] != m)
        ad_fail(r->error, AD_E_INPUT, "%s: 'normalisation' has another shape, expected 3 x %zu",
                r->name, m);
    else if (phys_hdf5_read(r->file, "normalisation", 0, 3, values, r->error) == AD_OK &&
             hnn_model_normalise(model, values, values + m, values + 2 * m, &why) != AD_OK)
        ad_fail(r->error, AD_E_INPUT, "%s: damaged: %s", r->name, why.message);
}

static void read_range(const struct reading *r, hnn_model *model)
{
    struct phys_hdf5_item item;
    struct ad_error none = {0};
    size_t width = hnn_rows(model) + 1;
    if (failed(r) || phys_hdf5_shape(r->file, "range", &item, &none) != AD_OK)
        return;
    if (item.rank != 2 || item.dims[0] != 2 || item.dims[1] != width)
        ad_fail(r->error, AD_E_INPUT, "%s: 'range' has another shape, expected 2 x %zu", r->name,
                width);
    else if (!(model->range = malloc(2 * width * sizeof *model->range)))
        ad_fail(r->error, AD_E_MEMORY, "out of memory");
    else
        phys_hdf5_read(r->file, "range", 0, 2, model->range, r->error);
}

struct note_reading {
    hnn_model *model;
    struct ad_error *error;
};

static void read_note(void *context, const struct phys_hdf5_item *item)
{
    const struct note_reading *n = context;
    if (item->attribute && strcmp(item->object, "notes") == 0 && item->kind == PHYS_HDF5_TEXT)
        hnn_model_note(n->model, item->attribute, item->text, n->error);
}

/* Memory is allocated by the size of the data in the file, not by the settings. */
static void read_parameters(const struct reading *r, hnn_model *model)
{
    for (size_t k = 0; k < model->n_blocks; k++)
        check_shape(r, &model->block[k]);
    if (failed(r) || hnn_model_make_room(model, r->error) != AD_OK)
        return;
    size_t room = model->size + 3 * hnn_scaled(model);
    double *values = malloc(room * sizeof *values);
    if (!values) {
        ad_fail(r->error, AD_E_MEMORY, "out of memory");
        return;
    }
    for (size_t k = 0; k < model->n_blocks; k++)
        read_block(r, model, &model->block[k], values);
    read_normalisation(r, model, values);
    read_range(r, model);
    free(values);
}

static enum ad_status load(const char *name, const struct hnn_network *network, hnn_model **model,
                           struct ad_error *error)
{
    struct reading r = {.name = name, .network = network, .error = error};
    if (phys_hdf5_open(name, &r.file, error) != AD_OK)
        return error->status;
    struct hnn_settings settings;
    struct ad_error why = {0};
    read_settings(&r, &settings);
    char *activation = read_text(&r, "activation");
    settings.activation = activation;
    if (!failed(&r) && hnn_model_blank(&settings, model, &why) != AD_OK)
        ad_fail(error, why.status == AD_E_MEMORY ? AD_E_MEMORY : AD_E_INPUT, "%s: %s", name,
                why.message);
    free(activation);
    if (*model) {
        read_parameters(&r, *model);
        if (!failed(&r))
            phys_hdf5_list(r.file, read_note, &(struct note_reading){*model, error}, error);
        if (!failed(&r) && network)
            hnn_network_verify(*model, name, r.file, error);
    }
    phys_hdf5_close(r.file);
    if (failed(&r)) {
        hnn_model_free(*model);
        *model = NULL;
    }
    return error->status;
}

enum ad_status hnn_model_load(const char *name, hnn_model **model, struct ad_error *error)
{
    if (model)
        *model = NULL;
    return AD_LACKS(error, name, model) ? error->status : load(name, NULL, model, error);
}

enum ad_status hnn_model_load_network(const char *name, const struct hnn_network *network,
                                      hnn_model **model, struct ad_error *error)
{
    if (model)
        *model = NULL;
    return AD_LACKS(error, name, network, model) ? error->status
                                                 : load(name, network, model, error);
}
