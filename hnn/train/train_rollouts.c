/* The loss on rollouts: for each sample the mean square of the states that a model reaches in K
   steps, less those that follow it in the data. With free starts the sample itself is an
   observation, too, and the motion that counts is the one nearest to all K + 1. */
#include "train.h"

struct rollout {
    const hnn_model *model;
    const struct hnn_training *training;
    ad_var parameters, x, target;
};

/* Rows of a target: the states after each step, then the lengths of the steps. */
static size_t target_rows(const hnn_model *model, const struct hnn_training *training)
{
    return (hnn_states(model) + 1) * training->rollout;
}

static ad_var start(const struct rollout *o)
{
    return o->model->settings.inputs ? ad_slice_rows(o->x, 0, hnn_states(o->model)) : o->x;
}

/* The state after step k. */
static ad_var step(const struct rollout *o, size_t k, ad_var at)
{
    size_t m = hnn_states(o->model), inputs = o->model->settings.inputs;
    struct hnn_step step = {.model = o->model,
                            .parameters = o->parameters,
                            .dt = ad_slice_rows(o->target, o->training->rollout * m + k, 1),
                            .hold = o->training->hold};
    if (inputs) {
        step.before = ad_slice_rows(o->x, m + k * inputs, inputs);
        step.after = ad_slice_rows(o->x, m + (k + 1) * inputs, inputs);
    }
    return hnn_record_step(&step, o->training->stepping, at);
}

/* The sum over steps, from a start. */
static ad_var squares(const struct rollout *o, ad_var at)
{
    size_t m = hnn_states(o->model);
    ad_var sum = {0};
    for (size_t k = 0; k < o->training->rollout; k++) {
        at = step(o, k, at);
        ad_var error = ad_sub(at, ad_slice_rows(o->target, k * m, m));
        ad_var part = hnn_mean_squares(error, o->model->scaling.scale);
        sum = k ? ad_add(sum, part) : part;
    }
    return sum;
}

/* ---- free starts ---- */

/* Of Gauss's and Newton's method, damped as by Levenberg and Marquardt, and the length of its
   differences in units of the states. */
enum { ROUNDS = 4 };
static const double little = 1e-2;

static ad_var all_squares(const struct rollout *o, ad_var at)
{
    return ad_add(hnn_mean_squares(ad_sub(at, start(o)), o->model->scaling.scale), squares(o, at));
}

/* How the states of a motion change with its start, by differences: rows of 1 + sum J^T J, in units
   of the states, the diagonal times 1 + damping; an estimate, which the method needs no better. */
static ad_var matrix(const struct rollout *o, ad_var unit, ad_var here, ad_var damping)
{
    size_t m = hnn_states(o->model);
    ad_var at[2 * HNN_STARTS_MOST], J[2 * HNN_STARTS_MOST],
        row[4 * HNN_STARTS_MOST * HNN_STARTS_MOST];
    double e[2 * HNN_STARTS_MOST] = {0};
    for (size_t i = 0; i < m; i++) {
        e[i] = 1;
        ad_var axis = ad_const(unit.tape, m, 1, e);
        e[i] = 0;
        at[i] = ad_add(here, ad_mul(little, ad_mul(unit, axis)));
        for (size_t j = 0; j < m; j++)
            row[i * m + j] = ad_add(ad_mul(0.0, ad_row(here, 0)), (double)(i == j));
    }
    for (size_t k = 0; k < o->training->rollout; k++) {
        here = step(o, k, here);
        for (size_t i = 0; i < m; i++) {
            at[i] = step(o, k, at[i]);
            J[i] = ad_mul(1 / little, ad_div(ad_sub(at[i], here), unit));
        }
        for (size_t i = 0; i < m; i++)
            for (size_t j = 0; j < m; j++)
                row[i * m + j] = ad_add(row[i * m + j], ad_sum_rows(ad_mul(J[i], J[j])));
    }
    for (size_t i = 0; i < m; i++)
        row[i * m + i] = ad_mul(row[i * m + i], ad_add(damping, 1.0));
    return ad_detach(ad_concat_rows(m * m, row));
}

/* The start of the nearest motion. The loss is least there, so that its derivative by the
   parameters is that at a fixed start. A round that does not lessen it is repeated, damped. */
static ad_var nearest(const struct rollout *o)
{
    size_t m = hnn_states(o->model);
    double ones[2 * HNN_STARTS_MOST];
    for (size_t k = 0; k < m; k++)
        ones[k] = 1;
    const double *scale = o->model->scaling.scale;
    ad_var unit = ad_const(o->x.tape, m, 1, scale ? scale : ones);
    ad_var at = start(o), F = all_squares(o, at), damping = ad_mul(0.0, ad_row(at, 0)), g = at;
    ad_grad(F, 1, &at, &g);
    for (size_t k = 0; k < ROUNDS; k++) {
        ad_var M = matrix(o, unit, at, damping);
        ad_var by = ad_solve(M, ad_mul(0.5 * (double)m, ad_mul(unit, g)), AD_LU);
        ad_var to = ad_detach(ad_sub(at, ad_mul(unit, by))), there = all_squares(o, to), slope = to;
        ad_grad(there, 1, &to, &slope);
        ad_var less = ad_lt(there, F);
        at = ad_detach(ad_select(less, to, at));
        g = ad_select(less, slope, g);
        F = ad_select(less, there, F);
        damping = ad_select(less, ad_mul(0.1, damping), ad_add(ad_mul(10.0, damping), 0.1));
    }
    return at;
}

static ad_var record(const hnn_model *model, const struct hnn_training *training, ad_var parameters,
                     ad_var x, ad_var target)
{
    const struct rollout o = {model, training, parameters, x, target};
    if (training->free_starts)
        return ad_mul(1 / (double)(training->rollout + 1), all_squares(&o, nearest(&o)));
    return ad_mul(1 / (double)training->rollout, squares(&o, start(&o)));
}

const struct hnn_objective hnn_learn_rollouts = {false, hnn_state_rows, target_rows, record};
