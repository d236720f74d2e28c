/* Records a model on a tape: networks, their scalars, and the field derived from these. Parameters
   are views of one flat vector, so their gradient is one flat vector, too. */
#include "internal.h"

#include <stdlib.h>

ad_var hnn_record_block(const hnn_model *model, ad_var parameters, size_t k)
{
    const struct hnn_block *b = &model->block[k];
    return ad_reshape(ad_slice_cols(parameters, b->offset, b->rows * b->cols), b->rows, b->cols);
}

/* Outputs [outputs x samples] at states x [2n x samples]. */
static ad_var network(const hnn_model *model, const struct hnn_net *net, ad_var parameters,
                      ad_var x)
{
    if (model->settings.network)
        return hnn_network_record(model, net->outputs, parameters, x);
    size_t layers = model->settings.layers, k = net->block;
    ad_var h = net->inputs < ad_rows(x) ? ad_slice_rows(x, net->first, net->inputs) : x;
    for (size_t layer = 0; layer + 1 < layers; layer++, k += 2) {
        ad_var z = ad_matmul(hnn_record_block(model, parameters, k), false, h, false);
        h = model->activation->record(ad_add(z, hnn_record_block(model, parameters, k + 1)));
    }
    return ad_matmul(hnn_record_block(model, parameters, k), false, h, false);
}

/* 1/values, or values, as a constant column. */
static ad_var column(ad_tape *tape, size_t n, const double *values, bool inverse)
{
    double *c = malloc(n * sizeof *c);
    if (!c)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < n; k++)
        c[k] = inverse ? 1 / values[k] : values[k];
    ad_var out = ad_const(tape, n, 1, c);
    free(c);
    return out;
}

static ad_var normalised(const hnn_model *model, ad_var x)
{
    const struct hnn_scaling *s = &model->scaling;
    size_t n = hnn_states(model);
    if (!s->centre)
        return x;
    return ad_mul(ad_sub(x, column(x.tape, n, s->centre, false)),
                  column(x.tape, n, s->scale, true));
}

static ad_var gradient(ad_var scalar, ad_var x)
{
    ad_var g = x;
    ad_grad(scalar, 1, &x, &g);
    return g;
}

/* (q, p) -> (p, -q) on the rows of a gradient. */
static ad_var symplectic(ad_var g, size_t n)
{
    return ad_concat_rows(2, (ad_var[]){ad_slice_rows(g, n, n), ad_neg(ad_slice_rows(g, 0, n))});
}

static ad_var scaled(const hnn_model *model, ad_var scalar)
{
    double size = model->scaling.energy;
    return size == 1 ? scalar : ad_mul(size, scalar);
}

static void record_baseline(const hnn_model *model, ad_var parameters, ad_var x,
                            struct hnn_record *r)
{
    const struct hnn_scaling *s = &model->scaling;
    r->field = network(model, &model->net[0], parameters, normalised(model, x));
    if (s->rate)
        r->field = ad_mul(r->field, column(x.tape, hnn_states(model), s->rate, false));
}

static void record_hamiltonian(const hnn_model *model, ad_var parameters, ad_var x,
                               struct hnn_record *r)
{
    const struct hnn_settings *s = &model->settings;
    ad_var seen = normalised(model, x), plain = {0};
    ad_var out = network(model, &model->net[0], parameters, seen);
    if (s->separable)
        out = ad_add(out, network(model, &model->net[1], parameters, seen));
    if (s->field != HNN_SYMPLECTIC)
        plain = gradient(scaled(model, ad_row(out, 0)), x);
    if (s->field != HNN_CONSERVATIVE) {
        r->energy = ad_label(scaled(model, ad_row(out, s->field == HNN_BOTH)), "H");
        r->field = symplectic(gradient(r->energy, x), s->dof);
    }
    if (s->field == HNN_CONSERVATIVE)
        r->field = plain;
    else if (s->field == HNN_BOTH)
        r->field = ad_add(r->field, plain);
    if (s->dissipation) {
        out = network(model, &model->net[model->n_nets - 1], parameters, seen);
        r->dissipation = ad_label(scaled(model, out), "D");
        r->field = ad_sub(r->field, gradient(r->dissipation, x));
    }
}

struct hnn_record hnn_model_record(const hnn_model *model, ad_var parameters, ad_var x)
{
    struct hnn_record r = {.field = x};
    if (!model) {
        r.field = x.tape ? ad_refuse(x.tape, AD_E_ARGUMENT, "a model to record: got NULL") : x;
        return r;
    }
    if (ad_rows(parameters) != 1 || ad_cols(parameters) != model->size ||
        ad_rows(x) != hnn_states(model)) {
        r.field =
            ad_refuse(x.tape, AD_E_SHAPE, "a model of %zu parameters and %zu states on %zu and %zu",
                      model->size, hnn_states(model), ad_cols(parameters), ad_rows(x));
        return r;
    }
    if (model->settings.kind == HNN_BASELINE)
        record_baseline(model, parameters, x, &r);
    else
        record_hamiltonian(model, parameters, x, &r);
    r.field = ad_label(r.field, "field");
    return r;
}
