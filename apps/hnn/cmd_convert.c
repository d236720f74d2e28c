/* leastaction convert: models as HDF5 and as safetensors. */
#include "apps/command.h"
#include "apps/output/report.h"
#include "hnn/model/exchange.h"
#include "physics/io/checksum.h"

#include <string.h>

struct convert_options {
    struct common common;
    const char *model, *field, *activation;
};

static bool is_tensors(const char *file)
{
    const char *dot = strrchr(file, '.');
    return dot && strcmp(dot, ".safetensors") == 0;
}

static size_t choose(const char *option, const char *given, const char *const names[],
                     struct ad_error *error)
{
    size_t n = 0;
    while (names[n])
        n++;
    return given ? options_choose(option, given, n, names, error) : 0;
}

/* HDF5 that a program wrote without our checksum. */
static bool is_sealed(const char *file)
{
    char first[PHYS_CHECKSUM_BYTES] = "";
    FILE *in = fopen(file, "rb");
    const bool read = in && fread(first, 1, sizeof first - 1, in) > 0;
    if (in)
        fclose(in);
    return read && strncmp(first, "leastaction, sealed", 19) == 0;
}

static enum ad_status load(const struct convert_options *o, hnn_model **model,
                           struct hnn_exchange *exchange, struct ad_error *error)
{
    const char *file = o->common.argument[0], *unused = "is in the file; leave it out";
    struct hnn_settings assumed = hnn_defaults(HNN_HAMILTONIAN, 1);
    if (phys_hdf5_is(file)) {
        if (options_refuse(&o->common, "model field activation", unused, error) == AD_OK)
            hnn_model_load(file, model, error);
        exchange->own = true;
        return error->status;
    }
    const size_t kind = choose("model", o->model ? o->model : "hnn", hnn_kinds, error);
    assumed.field = (enum hnn_field_type)choose("field", o->field, hnn_field_types, error);
    assumed.kind = (enum hnn_kind)kind;
    assumed.activation = o->activation ? o->activation : "tanh";
    if (error->status == AD_OK &&
        hnn_model_import(file, &assumed, model, exchange, error) == AD_OK && exchange->own)
        options_refuse(&o->common, "model field activation", unused, error);
    return error->status;
}

static void report_model(const struct convert_options *o, const hnn_model *model,
                         const struct hnn_exchange *exchange, bool sealed, struct report *report)
{
    const struct hnn_settings *s = hnn_model_settings(model);
    report_line(report, "%s of %zu coordinate%s: %zu parameters", hnn_kinds[s->kind], s->dof,
                s->dof > 1 ? "s" : "", hnn_model_size(model));
    report_text(report, "model", NULL, hnn_kinds[s->kind]);
    report_count(report, "dof", NULL, s->dof);
    report_count(report, "layers", "layers", s->layers);
    report_count(report, "parameters", NULL, hnn_model_size(model));
    report_text(report, "activation", "activation", s->activation);
    report_text(report, "precision", "precision", hnn_precisions[s->precision]);
    report_flag(report, "assumed", NULL, !exchange->own);
    if (!exchange->own)
        report_line(report, "  model, field and activation are those of the options: the file does "
                            "not have them");
    report_number(report, "bias", exchange->bias != 0 ? "bias left out" : NULL, NULL,
                  exchange->bias);
    if (exchange->bias != 0)
        report_line(report, "  a constant of %s changes no motion",
                    s->kind == HNN_LAGRANGIAN ? "L" : "H");
    if (!sealed)
        report_line(report, "  warning: %s has no checksum: damage to it is not noticed",
                    o->common.argument[0]);
    report_flag(report, "checksum", NULL, sealed);
    report_text(report, "out", "file", o->common.out);
}

static int run(const void *values, struct ad_error *error)
{
    const struct convert_options *o = values;
    struct hnn_exchange exchange = {0};
    struct report report = {0};
    hnn_model *model = NULL;
    const char *out = o->common.out, *dot = out ? strrchr(out, '.') : NULL;
    if (!dot || (!is_tensors(out) && strcmp(dot, ".h5") != 0))
        return ad_fail(error, AD_E_ARGUMENT,
                       "--out: expected a name ending in .h5 or .safetensors, got '%s'",
                       out ? out : ""),
               command_status(error);
    const bool sealed = !phys_hdf5_is(o->common.argument[0]) || is_sealed(o->common.argument[0]);
    if (load(o, &model, &exchange, error) == AD_OK &&
        (is_tensors(out) ? hnn_model_export(model, out, error)
                         : hnn_model_save(model, out, o->common.command, error)) == AD_OK) {
        report_model(o, model, &exchange, sealed, &report);
        report_show(&report, &o->common, error);
    }
    hnn_model_free(model);
    return command_status(error);
}

#define AT(member) offsetof(struct convert_options, member)

static const struct option table[] = {
    {"out", "FILE", OPTION_OUTPUT, NULL, "the model: .h5, or .safetensors", AT(common.out)},
    {"model", "KIND", OPTION_TEXT, NULL, "of a file that does not say: hnn, lnn or baseline [hnn]",
     AT(model)},
    {"activation", "NAME", OPTION_TEXT, NULL, "likewise, as of `train` [tanh]", AT(activation)},
    {"field", "KIND", OPTION_TEXT, NULL,
     "likewise, of an hnn: symplectic, conservative or both [symplectic]", AT(field)},
};

const struct command command_convert = {
    .line =
        {.name = "convert",
         .what = "models as HDF5 and safetensors, as of PyTorch",
         .arguments = {"MODEL"},
         .options = table,
         .n_options = sizeof table / sizeof *table,
         .more =
             "MODEL is HDF5, as `train` writes it or with the same names by another program, or\n"
             "safetensors: a state dict of one perceptron, X.weight [out x in] and X.bias [out]\n"
             "in the order of the numbers in their names, or the one that shapes allow, of F64,\n"
             "F32, F16 or BF16. Its first map sees coordinates, then momenta (of lnn velocities).\n"
             "The bias of the last map is left out, and said; that of a baseline must be 0. Of "
             "two\n"
             "outputs of an hnn, F and H, those are kept that the field needs. Files that convert\n"
             "wrote have everything: back again, a model is the same to the last bit.\n\n"
             "  safetensors.torch.save_file(network.state_dict(), \"net.safetensors\")\n"
             "  leastaction convert net.safetensors --out model.h5"},
    .bytes = sizeof(struct convert_options),
    .run = run,
};
