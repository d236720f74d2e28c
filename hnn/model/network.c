/* Networks of the caller's own: checked when a model is made, and recognised in files by the field
   they had at a few fixed states. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE_MOST = 1 << 30 };

enum ad_status hnn_network_check(const struct hnn_settings *s, struct ad_error *error)
{
    const struct hnn_network *network = s->network;
    if (AD_LACKS(error, network->name, network->record))
        return error->status;
    size_t length = strlen(network->name);
    if (length < 1 || length >= HNN_NETWORK_NAME)
        return ad_fail(error, AD_E_ARGUMENT, "name of a network: expected 1 to %d characters",
                       HNN_NETWORK_NAME - 1);
    if (network->size < 1 || network->size > SIZE_MOST)
        return ad_fail(error, AD_E_ARGUMENT,
                       "parameters of network '%s': expected 1 to %d, got %zu", network->name,
                       SIZE_MOST, network->size);
    for (size_t k = 0; network->start && k < network->size; k++)
        if (!isfinite(network->start[k]))
            return ad_fail(error, AD_E_NONFINITE, "network '%s' starts with parameter %zu = %g",
                           network->name, k, network->start[k]);
    if (s->pixels || s->separable || s->dissipation || s->angles || s->quadratic)
        return ad_fail(error, AD_E_ARGUMENT,
                       "network '%s': expected a model of states, neither separable nor with a "
                       "learned dissipation, angles or a quadratic L",
                       network->name);
    return AD_OK;
}

ad_var hnn_network_record(const hnn_model *model, size_t outputs, ad_var parameters, ad_var x)
{
    const struct hnn_network *network = &model->network;
    ad_var y = network->record(network->context, parameters, x);
    if (ad_tape_error(x.tape)->status != AD_OK ||
        (ad_rows(y) == outputs && ad_cols(y) == ad_cols(x)))
        return y;
    return ad_refuse(x.tape, AD_E_SHAPE,
                     "network '%s' recorded a value of %zu x %zu, expected %zu x %zu",
                     network->name, ad_rows(y), ad_cols(y), outputs, ad_cols(x));
}

/* ---- the field at some states ---- */

/* Irregular, of the size of the states that the model was normalised to. */
static void put_states(const hnn_model *model, size_t first, size_t n, double *x)
{
    const struct hnn_scaling *s = &model->scaling;
    for (size_t r = 0; r < hnn_states(model); r++)
        for (size_t k = 0; k < n; k++) {
            double u = 0.3 + 0.9 * sin(1.0 + (double)r + 2.3 * (double)(first + k));
            x[r * n + k] = s->centre ? s->centre[r] + s->scale[r] * u : u;
        }
}

enum ad_status hnn_probe(const hnn_model *model, const double *parameters, size_t first, size_t n,
                         double *field, struct ad_error *error)
{
    size_t states = hnn_states(model);
    double *x = malloc(states * n * sizeof *x);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_program *program = NULL;
    if (x && tape) {
        ad_var w = ad_input(tape, 1, model->size, "parameters"),
               at = ad_input(tape, states, n, "x");
        ad_var out = ad_mul(1.0, hnn_model_record(model, w, at).field);
        put_states(model, first, n, x);
        if (ad_compile(tape, 1, &out, &program) == AD_OK) {
            ad_set(program, w, parameters);
            ad_set(program, at, x);
            ad_run(program);
            ad_get(program, out, field);
        }
        phys_tape_status(tape, error);
    } else {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    ad_program_free(program);
    ad_tape_free(tape);
    free(x);
    return error->status;
}

bool hnn_agree(size_t n, const double *a, const double *b, double tolerance)
{
    double size = 0;
    for (size_t k = 0; k < n; k++)
        size = isfinite(a[k]) ? fmax(size, fabs(a[k])) : size;
    for (size_t k = 0; k < n; k++)
        if (isfinite(a[k]) != isfinite(b[k]) ||
            (isfinite(a[k]) && fabs(a[k] - b[k]) > tolerance * size))
            return false;
    return true;
}

/* Parameters near the first ones, which may all be 0. */
enum ad_status hnn_network_check_columns(const hnn_model *model, struct ad_error *error)
{
    size_t states = hnn_states(model), n = HNN_PROBES * states;
    double *values = malloc((model->size + 3 * n) * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu parameters", model->size);
    double *together = values + model->size, *alone = together + n, *one = alone + n;
    hnn_to_double(model->settings.precision, model->size, model->parameters, values);
    for (size_t k = 0; k < model->size; k++)
        values[k] += 0.05 * sin(1 + (double)k);
    hnn_probe(model, values, 0, HNN_PROBES, together, error);
    for (size_t k = 0; k < HNN_PROBES && error->status == AD_OK; k++)
        if (hnn_probe(model, values, k, 1, one, error) == AD_OK)
            for (size_t r = 0; r < states; r++)
                alone[r * HNN_PROBES + k] = one[r];
    if (error->status == AD_OK && !hnn_agree(n, together, alone, 1e-9))
        ad_fail(error, AD_E_ARGUMENT,
                "network '%s' has another field for a state among others than for it alone; "
                "expected column k to depend on column k",
                model->network.name);
    free(values);
    return error->status;
}

/* ---- in files ---- */

static enum ad_status present_field(const hnn_model *model, double *field, struct ad_error *error)
{
    double *values = malloc(model->size * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu parameters", model->size);
    hnn_to_double(model->settings.precision, model->size, model->parameters, values);
    hnn_probe(model, values, 0, HNN_PROBES, field, error);
    free(values);
    return error->status;
}

enum ad_status hnn_network_write(const hnn_model *model, phys_hdf5 *file, struct ad_error *error)
{
    size_t states = hnn_states(model);
    double *field = malloc(HNN_PROBES * states * sizeof *field);
    if (!field)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (present_field(model, field, error) == AD_OK) {
        phys_hdf5_text(file, "/", "network", model->network.name);
        phys_hdf5_write(file, "network.field", AD_F64, 2, (size_t[]){states, HNN_PROBES}, field);
    }
    free(field);
    return error->status;
}

void hnn_network_expect(const struct hnn_network *network, const char *name, phys_hdf5 *file,
                        struct ad_error *error)
{
    char *there = NULL;
    struct ad_error none = {0};
    phys_hdf5_get_text(file, "/", "network", &there, &none);
    if (none.status == AD_E_MEMORY)
        ad_fail(error, none.status, "%s", none.message);
    if (there && !network)
        ad_fail(error, AD_E_INPUT,
                "%s: has network '%s' of another program (hnn_model_load_network); expected a "
                "model of perceptrons",
                name, there);
    else if (network && (!there || !network->name || strcmp(there, network->name) != 0))
        ad_fail(error, AD_E_INPUT, "%s: has network '%s', expected '%s'", name,
                there ? there : "of perceptrons", network->name ? network->name : "");
    free(there);
}

void hnn_network_verify(const hnn_model *model, const char *name, phys_hdf5 *file,
                        struct ad_error *error)
{
    struct phys_hdf5_item item;
    size_t states = hnn_states(model), n = HNN_PROBES * states;
    double *field = malloc(2 * n * sizeof *field);
    if (!field) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
    } else if (phys_hdf5_shape(file, "network.field", &item, error) == AD_OK) {
        if (item.rank != 2 || item.dims[0] != states || item.dims[1] != HNN_PROBES)
            ad_fail(error, AD_E_INPUT, "%s: 'network.field' has another shape, expected %zu x %d",
                    name, states, HNN_PROBES);
        else if (phys_hdf5_read(file, "network.field", 0, states, field, error) == AD_OK &&
                 present_field(model, field + n, error) == AD_OK &&
                 !hnn_agree(n, field, field + n, 1e-6))
            ad_fail(error, AD_E_INPUT,
                    "%s: network '%s' had another field when it was saved; expected the same "
                    "function",
                    name, model->network.name);
    }
    free(field);
}
