/* Records a model on a tape: networks, their scalars, and the field derived from these. Parameters
   are views of one flat vector, so their gradient is one flat vector, too. */
#include "internal.h"

#include <stdlib.h>

ad_var hnn_record_block(const hnn_model *model, ad_var parameters, size_t k)
{
    const struct hnn_block *b = &model->block[k];
    return ad_reshape(ad_slice_cols(parameters, b->offset, b->rows * b->cols), b->rows, b->cols);
}

ad_var hnn_record_network(const hnn_model *model, const struct hnn_net *net, ad_var parameters,
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
    size_t n = hnn_rows(model);
    if (!s->centre)
        return x;
    return ad_mul(ad_sub(x, column(x.tape, n, s->centre, false)),
                  column(x.tape, n, s->scale, true));
}

/* What the networks see: states and inputs, normalised, but sine and cosine of angles. Rows:
   coordinates, cosines, inputs, then momenta or velocities. */
static ad_var seen(const hnn_model *model, ad_var x)
{
    const struct hnn_settings *s = &model->settings;
    size_t n = s->dof, inputs = s->inputs - s->controls, parts = 0;
    ad_var in = normalised(model, x), part[2 * HNN_ANGLES_MOST + 2];
    if (!s->angles && !s->inputs)
        return in;
    if (!s->angles)
        part[parts++] = ad_slice_rows(in, 0, n);
    for (size_t k = 0; s->angles && k < n; k++)
        part[parts++] = s->angles >> k & 1 ? ad_sin(ad_row(x, k)) : ad_row(in, k);
    for (size_t k = 0; s->angles >> k; k++)
        if (s->angles >> k & 1)
            part[parts++] = ad_cos(ad_row(x, k));
    if (inputs)
        part[parts++] = ad_slice_rows(in, 2 * n, inputs);
    part[parts++] = ad_slice_rows(in, n, n);
    return ad_concat_rows(parts, part);
}

/* G u, G constant or row by row the outputs of its network. */
static ad_var product(const hnn_model *model, ad_var parameters, ad_var x, ad_var u)
{
    const size_t n = model->settings.dof, m = model->settings.controls;
    ad_var row[HNN_CONTROLLED_MOST];
    if (!model->settings.control_network)
        return ad_matmul(hnn_record_block(model, parameters, model->control), false, u, false);
    ad_var G =
        hnn_record_network(model, &model->net[model->n_nets - 1], parameters, seen(model, x));
    for (size_t i = 0; i < n; i++)
        row[i] = ad_sum_rows(ad_mul(ad_slice_rows(G, i * m, m), u));
    return ad_concat_rows(n, row);
}

/* u is in its unit and G in that of the rates of momenta. */
ad_var hnn_record_force(const hnn_model *model, ad_var parameters, ad_var x)
{
    const struct hnn_settings *s = &model->settings;
    size_t first = hnn_rows(model) - s->controls;
    ad_var u = ad_slice_rows(x, first, s->controls);
    const double *unit = model->scaling.rate;
    if (!unit)
        return product(model, parameters, x, u);
    u = ad_mul(u, column(x.tape, s->controls, model->scaling.scale + first, true));
    return ad_mul(product(model, parameters, x, u), column(x.tape, s->dof, unit + s->dof, false));
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
    r->field = model->settings.lattice
                   ? hnn_lattice_rates(model, parameters, x)
                   : hnn_record_network(model, &model->net[0], parameters, seen(model, x));
    if (s->rate)
        r->field = ad_mul(r->field, column(x.tape, hnn_states(model), s->rate, false));
}

static void record_hamiltonian(const hnn_model *model, ad_var parameters, ad_var x,
                               struct hnn_record *r)
{
    const struct hnn_settings *s = &model->settings;
    ad_var in = seen(model, x), plain = {0};
    ad_var out = s->lattice ? hnn_lattice_sum(model, parameters, x)
                            : hnn_record_network(model, &model->net[0], parameters, in);
    if (s->separable)
        out = ad_add(out, hnn_record_network(model, &model->net[1], parameters, in));
    if (s->field != HNN_SYMPLECTIC)
        plain = ad_slice_rows(hnn_gradient(scaled(model, ad_row(out, 0)), x), 0, 2 * s->dof);
    if (s->field != HNN_CONSERVATIVE) {
        r->energy = ad_label(scaled(model, ad_row(out, s->field == HNN_BOTH)), "H");
        r->field = symplectic(hnn_gradient(r->energy, x), s->dof);
    }
    if (s->field == HNN_CONSERVATIVE)
        r->field = plain;
    else if (s->field == HNN_BOTH)
        r->field = ad_add(r->field, plain);
    if (s->dissipation) {
        out = hnn_record_network(model, &model->net[1 + s->separable], parameters, in);
        r->dissipation = ad_label(scaled(model, out), "D");
        r->field = ad_sub(r->field, ad_slice_rows(hnn_gradient(r->dissipation, x), 0, 2 * s->dof));
    }
    if (s->controls) {
        ad_var push = hnn_record_force(model, parameters, x);
        r->field =
            ad_concat_rows(2, (ad_var[]){ad_slice_rows(r->field, 0, s->dof),
                                         ad_add(ad_slice_rows(r->field, s->dof, s->dof), push)});
    }
}

/* u M u/2, of the upper triangle of M by rows. */
static ad_var quadratic(size_t n, ad_var triangle, ad_var u)
{
    ad_var sum = {0};
    for (size_t i = 0, first = 0; i < n; first += n - i, i++) {
        ad_var row = ad_mul(ad_slice_rows(triangle, first, n - i), ad_slice_rows(u, i, n - i));
        ad_var beside = ad_sub(ad_sum_rows(row), ad_mul(0.5, ad_row(row, 0)));
        ad_var part = ad_mul(ad_row(u, i), beside);
        sum = i ? ad_add(sum, part) : part;
    }
    return sum;
}

/* E (sum (v/scale)^2/2 + network): of v and not of v - centre, so that its own motion is free. */
ad_var hnn_record_L(const hnn_model *model, ad_var parameters, ad_var x)
{
    size_t n = model->settings.dof;
    const double *scale = model->scaling.scale;
    ad_var v = ad_slice_rows(x, n, n);
    if (scale)
        v = ad_mul(v, column(x.tape, n, scale + n, true));
    ad_var kinetic = ad_mul(0.5, ad_sum_rows(ad_square(v)));
    ad_var out = model->settings.lattice
                     ? hnn_lattice_sum(model, parameters, x)
                     : hnn_record_network(model, &model->net[0], parameters, seen(model, x));
    if (model->settings.quadratic)
        out = ad_add(ad_row(out, 0), quadratic(n, ad_slice_rows(out, 1, n * (n + 1) / 2), v));
    return ad_label(scaled(model, ad_add(kinetic, out)), "L");
}

/* M a = L_q - L_vq v - L_vt + G u, M = L_vv, H = L_v v - L; rows of L_vq and of M are gradients of
   one L_v. */
ad_var hnn_record_lagrangian(const hnn_model *model, ad_var parameters, ad_var x,
                             struct hnn_record *r)
{
    size_t n = model->settings.dof;
    if (model->settings.lattice)
        return hnn_lattice_lagrangian(model, parameters, x, r);
    ad_var v = ad_slice_rows(x, n, n), L = hnn_record_L(model, parameters, x),
           by = hnn_gradient(L, x);
    ad_var p = ad_slice_rows(by, n, n), mass[HNN_LAGRANGIAN_MOST], along[HNN_LAGRANGIAN_MOST];
    for (size_t k = 0; k < n; k++) {
        ad_var row = hnn_gradient(ad_row(p, k), x);
        along[k] = ad_sum_rows(ad_mul(ad_slice_rows(row, 0, n), v));
        if (model->settings.time)
            along[k] = ad_add(along[k], ad_row(row, 2 * n));
        mass[k] = ad_slice_rows(row, n, n);
    }
    ad_var M = ad_label(ad_concat_rows(n, mass), "L_vv");
    ad_var push = ad_sub(ad_slice_rows(by, 0, n), ad_concat_rows(n, along));
    if (model->settings.controls)
        push = ad_add(push, hnn_record_force(model, parameters, x));
    r->field = ad_concat_rows(2, (ad_var[]){v, ad_solve(M, push, AD_LU)});
    r->energy = ad_label(ad_sub(ad_sum_rows(ad_mul(p, v)), L), "H");
    return M;
}

struct hnn_record hnn_model_record(const hnn_model *model, ad_var parameters, ad_var x)
{
    struct hnn_record r = {.field = x};
    if (!model) {
        r.field = x.tape ? ad_refuse(x.tape, AD_E_ARGUMENT, "a model to record: got NULL") : x;
        return r;
    }
    if (ad_rows(parameters) != 1 || ad_cols(parameters) != model->size ||
        ad_rows(x) != hnn_rows(model)) {
        r.field =
            ad_refuse(x.tape, AD_E_SHAPE, "a model of %zu parameters and %zu states on %zu and %zu",
                      model->size, hnn_rows(model), ad_cols(parameters), ad_rows(x));
        return r;
    }
    if (model->settings.kind == HNN_SYMPNET) {
        r.field = ad_refuse(x.tape, AD_E_ARGUMENT,
                            "a sympnet has no field: it is a map over steps of time");
        return r;
    }
    if (model->settings.kind == HNN_BASELINE)
        record_baseline(model, parameters, x, &r);
    else if (model->settings.kind == HNN_LAGRANGIAN)
        hnn_record_lagrangian(model, parameters, x, &r);
    else
        record_hamiltonian(model, parameters, x, &r);
    r.field = ad_label(r.field, "field");
    return r;
}
