/* Settings of a model: defaults, names, and checks. */
#include "internal.h"
#include "autodiff/sized.h"

#include <string.h>

const char *const hnn_kinds[] = {"baseline", "hnn", "lnn", "sympnet", NULL};
const char *const hnn_field_types[] = {"symplectic", "conservative", "both", NULL};
const char *const hnn_starts[] = {"orthogonal", "xavier", "he", NULL};
const char *const hnn_precisions[] = {"f32", "f64", NULL};
const char *const hnn_lattices[] = {"none", "ring", "fixed", NULL};

/* D. Hendrycks, K. Gimpel, arXiv 1606.08415: x Phi(x) as approximate='tanh' of PyTorch has it. */
static ad_var gelu(ad_var x)
{
    ad_var u = ad_add(x, ad_mul(0.044715, ad_cube(x)));
    return ad_mul(x, ad_sigmoid(ad_mul(1.5957691216057308, u))); /* 2 sqrt(2 / pi) */
}

static ad_var elu(ad_var x) { return ad_select(ad_gt(x, 0), x, ad_expm1(x)); }

static ad_var swish(ad_var x) { return ad_mul(x, ad_sigmoid(x)); }

const struct hnn_activation hnn_activations[] = {
    {"tanh", ad_tanh},
    {"relu", ad_relu},
    {"sigmoid", ad_sigmoid},
    {"softplus", ad_softplus},
    {"sine", ad_sin},
    {"swish", swish},
    {"silu", swish}, /* another name of it */
    {"gelu", gelu},
    {"elu", elu},
    {NULL, NULL},
};

void hnn_defaults_to(struct hnn_settings *settings, enum hnn_kind kind, size_t dof)
{
    const struct hnn_settings defaults = {.size = sizeof defaults,
                                          .kind = kind,
                                          .dof = dof,
                                          .layers = 3,
                                          .hidden = {200, 200},
                                          .activation = "tanh",
                                          .field = HNN_SYMPLECTIC,
                                          .precision = AD_F32,
                                          .start = HNN_ORTHOGONAL};
    AD_GIVE(settings, &defaults);
}

enum ad_status hnn_find(const char *what, const char *name, const char *const names[],
                        size_t *index, struct ad_error *error)
{
    size_t n = 0;
    while (names[n])
        n++;
    if (!name)
        return ad_fail(error, AD_E_ARGUMENT, "no %s: expected a name such as %s, got NULL", what,
                       names[0]);
    size_t k = phys_find(what, name, n, names, error);
    if (k == n)
        return AD_E_ARGUMENT;
    *index = k;
    return AD_OK;
}

enum ad_status hnn_activation_find(const char *name, const struct hnn_activation **activation,
                                   struct ad_error *error)
{
    const char *names[LENGTH(hnn_activations)];
    size_t k = 0;
    for (; hnn_activations[k].name; k++)
        names[k] = hnn_activations[k].name;
    names[k] = NULL;
    if (hnn_find("activation", name, names, &k, error) == AD_OK)
        *activation = hnn_activations + k;
    return error->status;
}

static enum ad_status refuse(struct ad_error *error, const char *what)
{
    return ad_fail(error, AD_E_ARGUMENT, "%s", what);
}

/* Limits keep the number of parameters, at most about 1e9, far from overflow. */
enum { WIDTH_MOST = 1 << 14, DOF_MOST = 1 << 12, PIXELS_MOST = 1 << 16 };

static enum ad_status check_autoencoder(const struct hnn_settings *s, struct ad_error *error)
{
    if (s->pixels > PIXELS_MOST)
        return ad_fail(error, AD_E_ARGUMENT,
                       "pixels of an observation: expected at most %d, got %zu", PIXELS_MOST,
                       s->pixels);
    if (s->pixels && (s->autoencoder < 1 || s->autoencoder > WIDTH_MOST))
        return ad_fail(error, AD_E_ARGUMENT, "width of the autoencoder: expected 1 to %d, got %zu",
                       WIDTH_MOST, s->autoencoder);
    return AD_OK;
}

/* A number that is none of the enum's would choose a name behind the end of a table. */
static enum ad_status check_choices(const struct hnn_settings *s, struct ad_error *error)
{
    const struct {
        const char *what, *const *names;
        size_t index;
    } choice[] = {{"model", hnn_kinds, s->kind},
                  {"field", hnn_field_types, s->field},
                  {"start", hnn_starts, s->start},
                  {"precision", hnn_precisions, s->precision},
                  {"lattice", hnn_lattices, s->lattice}};
    for (size_t k = 0; k < LENGTH(choice); k++) {
        size_t n = 0;
        while (choice[k].names[n])
            n++;
        if (choice[k].index >= n)
            return ad_fail(error, AD_E_ARGUMENT, "%s of a model: expected 0 to %zu, got %zu",
                           choice[k].what, n - 1, choice[k].index);
    }
    return AD_OK;
}

static enum ad_status check_lagrangian(const struct hnn_settings *s, struct ad_error *error)
{
    if (s->dof > HNN_LAGRANGIAN_MOST && !s->lattice)
        return ad_fail(error, AD_E_ARGUMENT,
                       "coordinates of a Lagrangian model: expected at most %d, got %zu",
                       HNN_LAGRANGIAN_MOST, s->dof);
    if (s->pixels)
        return refuse(error, "a Lagrangian model learns from states, not from pixels");
    if (strcmp(s->activation, "relu") == 0)
        return refuse(error,
                      "activation relu has no second derivative, of which a Lagrangian model "
                      "is made; try tanh");
    return AD_OK;
}

static enum ad_status check_sympnet(const struct hnn_settings *s, struct ad_error *error)
{
    if (s->dof > HNN_SYMPNET_MOST || s->layers < 2)
        return ad_fail(
            error, AD_E_ARGUMENT,
            "a sympnet: expected at most %d coordinates, and 2 modules (layers) or more, "
            "got %zu and %zu",
            HNN_SYMPNET_MOST, s->dof, s->layers);
    for (size_t k = 1; k + 1 < s->layers; k++)
        if (s->hidden[k] != s->hidden[0])
            return refuse(error, "modules of a sympnet: expected one width of all");
    if (s->pixels || s->angles || s->inputs)
        return refuse(error, "a sympnet learns from states alone, without angles or inputs");
    return AD_OK;
}

static enum ad_status check_inputs(const struct hnn_settings *s, struct ad_error *error)
{
    if (s->inputs > HNN_INPUTS_MOST || s->controls > s->inputs)
        return ad_fail(error, AD_E_ARGUMENT,
                       "inputs of a model: expected at most %d, controls among them, got %zu and "
                       "%zu",
                       HNN_INPUTS_MOST, s->inputs, s->controls);
    if (s->time && s->inputs == s->controls)
        return refuse(error, "the time of a model: expected an input that is no control");
    if (s->inputs && (s->pixels || s->network))
        return refuse(error, "a model with inputs learns from states, by perceptrons");
    if (s->control_network && (!s->controls || s->dof > HNN_CONTROLLED_MOST))
        return refuse(error, "a network for G(q) needs controls, and at most 64 coordinates");
    if (s->controls && s->kind == HNN_BASELINE)
        return refuse(error, "a baseline has no matrix of controls; give it them as inputs");
    return AD_OK;
}

static enum ad_status check_lattice(const struct hnn_settings *s, struct ad_error *error)
{
    if (s->kind == HNN_SYMPNET || s->field != HNN_SYMPLECTIC || s->separable || s->dissipation ||
        s->angles || s->quadratic || s->inputs || s->pixels || s->network)
        return refuse(error, "a lattice: expected a baseline, hnn or lnn of states alone, without "
                             "angles, inputs, a quadratic or separable form, or a dissipation");
    return s->dof > HNN_LATTICE_MOST
               ? ad_fail(error, AD_E_ARGUMENT, "sites of a lattice: expected at most %d, got %zu",
                         HNN_LATTICE_MOST, s->dof)
               : AD_OK;
}

enum ad_status hnn_settings_check(const struct hnn_settings *s, struct ad_error *error)
{
    if (check_choices(s, error) != AD_OK)
        return error->status;
    if (s->dof < 1 || s->dof > DOF_MOST)
        return ad_fail(error, AD_E_ARGUMENT,
                       "degrees of freedom of a model: expected 1 to %d, got %zu", DOF_MOST,
                       s->dof);
    if (check_inputs(s, error) != AD_OK || (s->lattice && check_lattice(s, error) != AD_OK))
        return error->status;
    if (s->network && s->kind == HNN_SYMPNET)
        return refuse(error, "a sympnet has modules of its own; expected no network");
    if (s->network)
        return hnn_network_check(s, error);
    if (s->layers < 1 || s->layers > HNN_LAYERS_MOST)
        return ad_fail(error, AD_E_ARGUMENT, "layers of a network: expected 1 to %d, got %zu",
                       HNN_LAYERS_MOST, s->layers);
    for (size_t k = 0; k + 1 < s->layers; k++)
        if (s->hidden[k] < 1 || s->hidden[k] > WIDTH_MOST)
            return ad_fail(error, AD_E_ARGUMENT,
                           "width of a hidden layer: expected 1 to %d, got %zu", WIDTH_MOST,
                           s->hidden[k]);
    if (s->angles && s->pixels)
        return refuse(error, "latent states have no angles; expected none");
    if (s->angles && (s->dof > HNN_ANGLES_MOST || s->angles >> s->dof))
        return ad_fail(error, AD_E_ARGUMENT,
                       "angles of a model: expected some of its %zu coordinates, of %d at most",
                       s->dof, HNN_ANGLES_MOST);
    bool symplectic = s->kind == HNN_HAMILTONIAN && s->field == HNN_SYMPLECTIC;
    if (s->separable && !symplectic)
        return refuse(error, "a separable H needs model hnn and field symplectic");
    if (s->dissipation && !symplectic)
        return refuse(error, "a learned dissipation needs model hnn and field symplectic");
    if (s->quadratic && s->kind != HNN_LAGRANGIAN)
        return refuse(error, "an L quadratic in velocities needs model lnn");
    if ((s->kind == HNN_LAGRANGIAN && check_lagrangian(s, error) != AD_OK) ||
        (s->kind == HNN_SYMPNET && check_sympnet(s, error) != AD_OK))
        return error->status;
    return check_autoencoder(s, error);
}
