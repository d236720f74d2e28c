/* A model as a scene: its L, or of a Hamiltonian model the L that goes with H by the Legendre
   transformation, recorded by what records it in training. */
#include "autodiff/free.h"
#include "internal.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 6, NAME = 48 };

/* Most change of p in the last round, relative to its width in training: the next is of the order
   of its square, and second derivatives of L are wrong by the square of that. */
static const double last_change = 1e-5;

/* Of a system; behind it are the start, q then v, and the inputs but the time. */
struct learnt {
    struct phys_scene scene;
    hnn_model *model;
    double *values; /* [size] parameters */
    char *file, (*name)[NAME];
    const char **coordinates;
    struct phys_param *params;
    struct hnn_drive drive; /* of hnn_system_drive; record NULL: none */
    double centre[HNN_LATTICE_MOST], width[HNN_LATTICE_MOST]; /* of p in training */
};
struct params {
    const struct learnt *of;
    double start[];
};

static size_t parameters_of(const hnn_model *model)
{
    return hnn_rows(model) - model->settings.time;
}

/* ---- L ---- */

/* (q, p or v) and the inputs `u`, where there are some. */
static ad_var with_inputs(const struct learnt *l, ad_var q, ad_var p, ad_var u)
{
    return ad_concat_rows(l->model->settings.inputs ? 3 : 2, (ad_var[]){q, p, u});
}

/* H, or L, of a state. */
struct at {
    const struct learnt *of;
    ad_var parameters, q, v, u;
};

static ad_var hamiltonian(const struct at *a, ad_var p)
{
    return hnn_model_record(a->of->model, a->parameters, with_inputs(a->of, a->q, p, a->u)).energy;
}

/* H_pp^-1 (H_p - v), a step of Newton's method for H_p(q, p) = v. H_pp of a lattice is diagonal. */
static ad_var correction(const struct at *a, ad_var p)
{
    size_t n = a->of->scene.dof;
    ad_var by = hnn_gradient(hamiltonian(a, p), p), row[HNN_LAGRANGIAN_MOST],
           off = ad_sub(by, a->v);
    if (n == 1 || a->of->model->settings.lattice)
        return ad_div(off, hnn_gradient(by, p));
    for (size_t k = 0; k < n; k++)
        row[k] = hnn_gradient(ad_row(by, k), p);
    return ad_solve(ad_concat_rows(n, row), off, AD_LU);
}

/* L = p v - H with H_p = v. p is iterated apart from derivatives, at most about its width in
   training a step, and NaN where it does not converge. Then one step is recorded with derivatives:
   p is wrong by O(d^2) at a distance d, L by O(d^4), so derivatives to the third order are exact.
 */
static ad_var transformed(const struct at *a)
{
    const struct learnt *l = a->of;
    size_t n = l->scene.dof;
    ad_var v = a->v, width = ad_const(v.tape, n, 1, l->width), step = v;
    ad_var p = ad_add(ad_mul(0.0, v), ad_const(v.tape, n, 1, l->centre));
    for (size_t k = 0; k < ROUNDS; k++) {
        step = ad_div(correction(a, p), width);
        p = ad_detach(ad_sub(p, ad_mul(width, ad_tanh(step))));
    }
    ad_var left = ad_sub(1, ad_sum_rows(ad_square(ad_mul(1 / last_change, step))));
    p = ad_detach(ad_add(p, ad_mul(DBL_MIN, ad_sqrt(left))));
    p = ad_sub(p, correction(a, p));
    return ad_sub(ad_sum_rows(ad_mul(p, v)), hamiltonian(a, p));
}

/* Rows of the inputs: the time, what drives the scene, or its parameters. */
static ad_var inputs(const struct params *p, ad_var q, ad_var t)
{
    const hnn_model *model = p->of->model;
    const struct hnn_drive *drive = &p->of->drive;
    ad_var row[HNN_INPUTS_MOST] = {t};
    for (size_t k = model->settings.time; k < model->settings.inputs; k++) {
        row[k] = drive->record ? drive->record(drive->context, k, t) : (ad_var){0};
        if (!row[k].tape)
            row[k] = ad_add(ad_mul(0.0, ad_row(q, 0)),
                            phys_param(p->start + hnn_states(model) + k - model->settings.time));
    }
    return ad_concat_rows(model->settings.inputs, row);
}

/* G(q) u, which no potential gives. */
static ad_var forces(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct params *p = params;
    ad_var parameters = ad_const(q.tape, 1, p->of->model->size, p->of->values);
    return hnn_record_force(p->of->model, parameters, with_inputs(p->of, q, v, inputs(p, q, t)));
}

/* A state as recorded, v being p of a Hamiltonian. */
static struct at at(const struct params *p, ad_var q, ad_var v, ad_var t)
{
    const hnn_model *model = p->of->model;
    struct at a = {p->of, ad_const(q.tape, 1, model->size, p->of->values), q, v, t};
    if (model->settings.inputs)
        a.u = inputs(p, q, t);
    return a;
}

/* q G u: controls push with G u where G is constant, and this is its potential. */
static ad_var pushed(const struct at *a, ad_var scalar, double sign)
{
    const hnn_model *model = a->of->model;
    if (!model->settings.controls || model->settings.control_network)
        return scalar;
    ad_var push = hnn_record_force(model, a->parameters, with_inputs(a->of, a->q, a->v, a->u));
    return ad_add(scalar, ad_mul(sign, ad_sum_rows(ad_mul(a->q, push))));
}

static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct params *p = params;
    const hnn_model *model = p->of->model;
    const struct at a = at(p, q, v, t);
    return pushed(&a,
                  model->settings.kind == HNN_LAGRANGIAN
                      ? hnn_record_L(model, a.parameters, with_inputs(p->of, q, v, a.u))
                      : transformed(&a),
                  1);
}

static ad_var scene_hamiltonian(ad_var q, ad_var p, ad_var t, const void *params)
{
    const struct at a = at(params, q, p, t);
    return pushed(&a, hamiltonian(&a, p), -1);
}

/* Those inputs, for what is measured of the model itself. */
static enum ad_status inputs_at(void *context, double t, double *u, struct ad_error *error)
{
    const struct params *p = context;
    const hnn_model *model = p->of->model;
    const size_t time = model->settings.time;
    u[0] = t;
    memcpy(u + time, p->start + hnn_states(model), (model->settings.inputs - time) * sizeof *u);
    return error->status;
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    const struct params *p = params;
    size_t n = p->of->scene.dof;
    (void)seed, (void)error;
    memcpy(q, p->start, n * sizeof *q);
    memcpy(v, p->start + n, n * sizeof *v);
    return AD_OK;
}

/* ---- the scene ---- */

static enum ad_status check(const char *file, const struct hnn_settings *s, struct ad_error *error)
{
    bool hamiltonian = s->kind == HNN_HAMILTONIAN && s->field == HNN_SYMPLECTIC;
    const char *why = s->pixels                ? "learnt from pixels: its coordinates are latent"
                      : s->dissipation         ? "a learnt dissipation, which no Lagrangian gives"
                      : s->kind == HNN_SYMPNET ? "a sympnet, which has no H or L"
                      : s->dof > HNN_LAGRANGIAN_MOST && !s->lattice ? "more than 32 coordinates"
                      : hamiltonian && strcmp(s->activation, "relu") == 0
                          ? "activation relu: H has no second derivatives"
                      : !hamiltonian && s->kind != HNN_LAGRANGIAN
                          ? "a field that is not derived from an H or L"
                          : NULL;
    return why ? ad_fail(error, AD_E_INPUT, "%s: no scene: %s; try leastaction rollout", file, why)
               : AD_OK;
}

/* Where it starts and how long it moves, from the range of training: a quarter of it from the
   middle of q, at rest; dt as 0.025 is to an oscillator of frequency 1. */
static void choose_span(struct learnt *l, double x[])
{
    size_t n = l->scene.dof;
    const struct hnn_range seen = hnn_model_range(l->model);
    bool lagrangian = l->model->settings.kind == HNN_LAGRANGIAN;
    double rate[2 * HNN_LATTICE_MOST], shortest = INFINITY;
    const size_t H = hnn_rows(l->model);
    for (size_t k = 2 * n; k < H; k++) /* inputs: the middle of what was seen */
        x[k] = seen.low ? (seen.low[k] + seen.high[k]) / 2 : 0;
    for (size_t k = 0; k < 2 * n; k++) {
        double low = seen.low ? seen.low[k] : -1, high = seen.low ? seen.high[k] : 1;
        bool rest = k >= n && low <= 0 && high >= 0;
        x[k] = rest ? 0 : (low + high) / 2 + (k < n ? (high - low) / 4 : 0);
        if (k < n) {
            double other = seen.low ? seen.high[n + k] - seen.low[n + k] : 2,
                   energy = seen.low ? seen.high[H] - seen.low[H] : 0.5,
                   time = (high - low) * (lagrangian ? 1 / other : other / (8 * energy));
            shortest = isfinite(time) && time > 0 ? fmin(shortest, time) : shortest;
            continue;
        }
        l->centre[k - n] = x[k];
        l->width[k - n] = high > low ? high - low : 1;
    }
    l->scene.slices = 101;
    l->scene.dt = isfinite(shortest) ? 0.025 * shortest : 0.025;
    if (!lagrangian && hnn_model_field(l->model, x, rate) == AD_OK)
        memcpy(x + n, rate, n * sizeof *x);
}

static void learnt_free(void *held)
{
    struct learnt *l = held;
    if (!l)
        return;
    hnn_model_free(l->model);
    AD_FREE(l->values, l->file, l->name, l->coordinates, l->params, l);
}

static enum ad_status describe(struct learnt *l, const char *file, struct ad_error *error)
{
    hnn_model *model = l->model;
    size_t n = model->settings.dof;
    double x[2 * HNN_LATTICE_MOST + HNN_INPUTS_MOST];
    const size_t n_params = parameters_of(model), time = model->settings.time;
    l->values = malloc(model->size * sizeof *l->values);
    l->file = strdup(file);
    l->name = calloc(n + n_params, sizeof *l->name); /* of coordinates, then of parameters */
    l->coordinates = calloc(n, sizeof *l->coordinates);
    l->params = calloc(n_params, sizeof *l->params);
    if (!l->values || !l->file || !l->name || !l->coordinates || !l->params)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %s", file);
    hnn_to_double(model->settings.precision, model->size, model->parameters, l->values);
    const char *unit = hnn_model_noted(model, "unit");
    l->scene = (struct phys_scene){
        .version = PHYS_SCENE_VERSION,
        .size = sizeof l->scene,
        .name = l->file,
        .what = model->settings.kind == HNN_LAGRANGIAN ? "the L of a learnt model"
                                                       : "the H of a learnt model",
        .dof = n,
        .dims = 1,
        .coordinates = l->coordinates,
        .unit = unit ? unit : "1",
        .time_unit = "1",
        .energy_unit = "1",
        .params = l->params,
        .n_params = n_params,
        .params_bytes = sizeof(struct params) + n_params * sizeof(double),
        .lagrangian = lagrangian,
        .hamiltonian = model->settings.kind == HNN_LAGRANGIAN ? NULL : scene_hamiltonian,
        .forces = model->settings.control_network ? forces : NULL,
        .start = start,
        .picture = PHYS_PICTURE_TIME,
    };
    choose_span(l, x);
    for (size_t k = 0; k < 2 * n; k++) {
        char name[NAME - 8];
        hnn_model_component(model, k % n, name, sizeof name);
        if (k < n)
            l->coordinates[k] = strcpy(l->name[k], name);
        snprintf(l->name[n + k], NAME, "%s%s0", k < n ? "" : "v_", name);
        l->params[k] =
            (struct phys_param){l->name[n + k], k < n ? l->scene.unit : "1",
                                k < n ? "coordinate at the start" : "velocity at the start", x[k],
                                sizeof(struct params) + k * sizeof(double)};
    }
    for (size_t k = 2 * n; k < n_params; k++) {
        hnn_model_input(model, k - 2 * n + time, l->name[n + k], NAME);
        l->params[k] = (struct phys_param){l->name[n + k], "1", "input of the model", x[k + time],
                                           sizeof(struct params) + k * sizeof(double)};
    }
    return AD_OK;
}

static bool is_model(const char *name)
{
    const char *end = strrchr(name, '.');
    return end && strcmp(end, ".h5") == 0;
}

enum ad_status hnn_system_open(const char *name, struct phys_system *system, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, system) || AD_LACKS(error, name))
        return error->status;
    if (!is_model(name))
        return phys_system_open(name, system, error);
    struct learnt *l = calloc(1, sizeof *l);
    if (!l)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %s", name);
    if (hnn_model_load(name, &l->model, error) == AD_OK &&
        check(name, &l->model->settings, error) == AD_OK && describe(l, name, error) == AD_OK)
        phys_system_make(&l->scene, system, error);
    if (!system->params) {
        learnt_free(l);
        *system = (struct phys_system){0};
        return error->status;
    }
    ((struct params *)system->params)->of = l;
    if (l->model->settings.inputs)
        l->model->drive = (struct hnn_drive){inputs_at, system->params, true, NULL};
    system->library = l;
    system->close = learnt_free;
    return error->status;
}

enum ad_status hnn_system_drive(struct phys_system *system, const struct hnn_drive *drive,
                                struct ad_error *error)
{
    static const struct hnn_drive none = {0};
    if (AD_LACKS(error, system))
        return error->status;
    hnn_model *model = hnn_system_model(system);
    if (!model || !model->settings.inputs || (drive && !(drive->at && drive->record)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "inputs of a scene: expected a model that has some, and what gives them");
    ((struct learnt *)system->library)->drive = drive ? *drive : none;
    model->drive = drive ? *drive : (struct hnn_drive){inputs_at, system->params, true, NULL};
    return AD_OK;
}

hnn_model *hnn_system_model(const struct phys_system *system)
{
    return system && system->close == learnt_free ? ((struct learnt *)system->library)->model
                                                  : NULL;
}
