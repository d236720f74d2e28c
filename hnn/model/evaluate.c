/* Evaluates a model by programs of its own, compiled when first needed. They have their own
   precision: integrators with small tolerances need a field without the rounding of f32. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

struct hnn_evaluator {
    size_t samples;
    enum ad_type type;
    uint64_t version; /* of the parameters in the programs */
    ad_tape *tape;
    ad_var parameters, x, rate, energy, kick, drift;
    ad_program *for_rate, *for_energy, *for_kick, *for_drift;
};

void hnn_evaluator_free(struct hnn_evaluator *e)
{
    if (!e)
        return;
    ad_program_free(e->for_rate);
    ad_program_free(e->for_energy);
    ad_program_free(e->for_kick);
    ad_program_free(e->for_drift);
    ad_tape_free(e->tape);
    free(e);
}

static void record(struct hnn_evaluator *e, const hnn_model *model)
{
    size_t n = model->settings.dof;
    e->parameters = ad_input(e->tape, 1, model->size, "parameters");
    e->x = ad_input(e->tape, hnn_rows(model), e->samples, "x");
    struct hnn_record r = hnn_model_record(model, e->parameters, e->x);
    e->rate = ad_mul(1.0, r.field);
    ad_compile(e->tape, 1, &e->rate, &e->for_rate);
    if (r.energy.tape) {
        e->energy = r.energy;
        ad_compile(e->tape, 1, &e->energy, &e->for_energy);
    }
    if (model->settings.separable && !model->settings.dissipation && e->samples == 1) {
        e->drift = ad_mul(1.0, ad_slice_rows(r.field, 0, n));
        e->kick = ad_mul(1.0, ad_slice_rows(r.field, n, n));
        ad_compile(e->tape, 1, &e->drift, &e->for_drift);
        ad_compile(e->tape, 1, &e->kick, &e->for_kick);
    }
}

static enum ad_status evaluator_new(const hnn_model *model, size_t samples,
                                    struct hnn_evaluator **out, struct ad_error *error)
{
    struct hnn_evaluator *e = calloc(1, sizeof *e);
    if (!e || !(e->tape = ad_tape_new(model->evaluate_in))) {
        free(e);
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    }
    e->samples = samples;
    e->type = model->evaluate_in;
    record(e, model);
    if (phys_tape_status(e->tape, error) != AD_OK)
        hnn_evaluator_free(e);
    else
        *out = e;
    return error->status;
}

static enum ad_status load_parameters(struct hnn_evaluator *e, const hnn_model *model,
                                      struct ad_error *error)
{
    double *values = malloc(model->size * sizeof *values);
    if (!values)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_program *programs[] = {e->for_rate, e->for_energy, e->for_kick, e->for_drift};
    hnn_to_double(model->settings.precision, model->size, model->parameters, values);
    for (size_t k = 0; k < LENGTH(programs); k++)
        if (programs[k])
            ad_set(programs[k], e->parameters, values);
    free(values);
    e->version = model->version;
    return AD_OK;
}

/* The evaluator in a slot of the model, as it must be now. */
static enum ad_status prepare(const hnn_model *model, size_t samples, struct hnn_evaluator **slot,
                              struct ad_error *error)
{
    struct hnn_evaluator *e = *slot;
    if (e && (e->samples != samples || e->type != model->evaluate_in)) {
        hnn_evaluator_free(e);
        *slot = NULL;
    }
    if (!*slot && evaluator_new(model, samples, slot, error) != AD_OK)
        return error->status;
    return (*slot)->version == model->version ? AD_OK : load_parameters(*slot, model, error);
}

static void run(const struct hnn_evaluator *e, ad_program *program, ad_var out, const double *x,
                double *values)
{
    ad_set(program, e->x, x);
    ad_run(program);
    ad_get(program, out, values);
}

static void run_energy(const struct hnn_evaluator *e, const double *x, double *energy)
{
    if (e->for_energy)
        run(e, e->for_energy, e->energy, x, energy);
    else
        for (size_t k = 0; k < e->samples; k++)
            energy[k] = NAN;
}

void hnn_model_evaluate_in(hnn_model *model, enum ad_type type)
{
    if (model && (type == AD_F32 || type == AD_F64))
        model->evaluate_in = type;
}

/* x [(2n + m) x samples] */
static enum ad_status check_states(const hnn_model *model, size_t samples, const double *x,
                                   struct ad_error *error)
{
    size_t rows = hnn_rows(model), n = model->settings.dof;
    for (size_t k = 2 * n * samples; k < rows * samples; k++)
        if (!isfinite(x[k]))
            return ad_fail(error, AD_E_NONFINITE, "input %zu of sample %zu is %g",
                           k / samples - 2 * n + 1, k % samples, x[k]);
    for (size_t k = 0; k < 2 * n * samples; k++)
        if (!isfinite(x[k]))
            return ad_fail(error, AD_E_NONFINITE,
                           "%c%zu of sample %zu is %g, expected a finite state",
                           hnn_letter(model, k / samples), k / samples % n + 1, k % samples, x[k]);
    return AD_OK;
}

enum ad_status hnn_model_field(hnn_model *model, const double *x, double *rate)
{
    struct ad_error error = {0};
    if (!AD_LACKS(&error, model, x, rate) && check_states(model, 1, x, &error) == AD_OK &&
        prepare(model, 1, &model->one, &error) == AD_OK)
        run(model->one, model->one->for_rate, model->one->rate, x, rate);
    return error.status;
}

double hnn_model_energy(hnn_model *model, const double *x)
{
    struct ad_error error = {0};
    double energy = NAN;
    if (model && x && prepare(model, 1, &model->one, &error) == AD_OK)
        run_energy(model->one, x, &energy);
    return energy;
}

enum ad_status hnn_model_evaluate(hnn_model *model, size_t samples, const double *x, double *rate,
                                  double *energy, struct ad_error *error)
{
    if (AD_LACKS(error, model) || samples == 0 || AD_LACKS(error, x) ||
        check_states(model, samples, x, error) != AD_OK ||
        prepare(model, samples, &model->many, error) != AD_OK)
        return error->status;
    if (rate)
        run(model->many, model->many->for_rate, model->many->rate, x, rate);
    if (energy)
        run_energy(model->many, x, energy);
    return AD_OK;
}

/* ---- as a vector field ---- */

static enum ad_status check(const hnn_model *model, size_t first, size_t n, double t,
                            const double *rate, struct ad_error *error)
{
    size_t dof = model->settings.dof;
    for (size_t k = 0; k < n; k++)
        if (!isfinite(rate[k]))
            return ad_fail(error, AD_E_NONFINITE,
                           "the model's rate of %c%zu is not finite at t = %g",
                           hnn_letter(model, first + k), (first + k) % dof + 1, t);
    return AD_OK;
}

/* Numbers `part` [n] of the state, rows from `first` on, and the inputs at t, into a program. */
static enum ad_status put(const hnn_model *model, ad_program *program, double t, size_t first,
                          size_t n, const double *part, struct ad_error *error)
{
    const struct hnn_evaluator *e = model->one;
    size_t bytes = hnn_type_bytes(e->type), inputs = model->settings.inputs;
    double u[HNN_INPUTS_MOST];
    char *x = ad_data(program, e->x);
    hnn_from_double(e->type, n, part, x + first * bytes);
    if (inputs && hnn_model_inputs(model, t, u, error) == AD_OK)
        hnn_from_double(e->type, inputs, u, x + hnn_states(model) * bytes);
    return error->status;
}

static enum ad_status ode_field(void *context, double t, const double *y, double *rate,
                                struct ad_error *error)
{
    hnn_model *model = context;
    size_t n = hnn_states(model);
    if (prepare(model, 1, &model->one, error) != AD_OK ||
        put(model, model->one->for_rate, t, 0, n, y, error) != AD_OK)
        return error->status;
    ad_run(model->one->for_rate);
    ad_get(model->one->for_rate, model->one->rate, rate);
    return check(model, 0, n, t, rate, error);
}

/* The other half of the state does not enter: whatever the program has there stays. */
static enum ad_status half(hnn_model *model, bool kick, double t, const double *part, double *rate,
                           struct ad_error *error)
{
    size_t n = model->settings.dof, first = kick ? 0 : n;
    if (prepare(model, 1, &model->one, error) != AD_OK)
        return error->status;
    const struct hnn_evaluator *e = model->one;
    ad_program *program = kick ? e->for_kick : e->for_drift;
    if (put(model, program, t, first, n, part, error) != AD_OK)
        return error->status;
    ad_run(program);
    ad_get(program, kick ? e->kick : e->drift, rate);
    return check(model, n - first, n, t, rate, error);
}

static enum ad_status ode_kick(void *context, double t, const double *q, double *rate,
                               struct ad_error *error)
{
    return half(context, true, t, q, rate, error);
}

static enum ad_status ode_drift(void *context, double t, const double *p, double *rate,
                                struct ad_error *error)
{
    return half(context, false, t, p, rate, error);
}

static double ode_energy(void *context, double t, const double *y)
{
    hnn_model *model = context;
    struct ad_error error = {0};
    double energy;
    if (prepare(model, 1, &model->one, &error) != AD_OK || !model->one->for_energy ||
        put(model, model->one->for_energy, t, 0, hnn_states(model), y, &error) != AD_OK)
        return NAN;
    ad_run(model->one->for_energy);
    ad_get(model->one->for_energy, model->one->energy, &energy);
    return energy;
}

static void ode_component(const void *context, size_t k, char *name, size_t size)
{
    hnn_model_component(context, k, name, size);
}

enum ad_status hnn_model_ode(hnn_model *model, struct phys_ode *ode, struct ad_error *error)
{
    if (ode)
        *ode = (struct phys_ode){0};
    if (AD_LACKS(error, model, ode))
        return error->status;
    const struct hnn_settings *s = &model->settings;
    *ode = (struct phys_ode){.name = "the model",
                             .n = hnn_states(model),
                             .field = ode_field,
                             .component = ode_component,
                             .context = model};
    double u[HNN_INPUTS_MOST];
    if (s->inputs && !model->drive.at && hnn_model_inputs(model, 0, u, error) != AD_OK)
        return error->status;
    if (prepare(model, 1, &model->one, error) != AD_OK)
        return error->status;
    ode->canonical = s->kind == HNN_HAMILTONIAN && s->field == HNN_SYMPLECTIC && !s->dissipation;
    if (model->one->for_energy)
        ode->energy = ode_energy;
    if (model->one->for_kick) {
        ode->kick = ode_kick;
        ode->drift = ode_drift;
    }
    return AD_OK;
}
