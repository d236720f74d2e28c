/* One step of a model in time, as losses on rollouts record it: Runge-Kutta, or a symplectic method
   (Z. Chen, J. Zhang, M. Arjovsky, L. Bottou, "Symplectic Recurrent Neural Networks", ICLR 2020,
   arXiv 1909.13334). */
#include "train.h"

#include <float.h>

const char *const hnn_steppings[] = {"runge-kutta", "leapfrog", "midpoint", NULL};

/* Inputs at this part of the step: linear in time, or those before it, but for the time. */
static ad_var inputs_at(const struct hnn_step *s, double part)
{
    size_t m = s->model->settings.inputs;
    ad_var linear = ad_add(s->before, ad_mul(part, ad_sub(s->after, s->before)));
    if (part == 0 || (s->hold && !s->model->settings.time))
        return s->before;
    if (!s->hold || m == 1)
        return linear;
    return ad_concat_rows(2, (ad_var[]){ad_row(linear, 0), ad_slice_rows(s->before, 1, m - 1)});
}

static ad_var field(const struct hnn_step *s, ad_var x, double part)
{
    if (s->model->settings.inputs)
        x = ad_concat_rows(2, (ad_var[]){x, inputs_at(s, part)});
    return hnn_model_record(s->model, s->parameters, x).field;
}

/* The classical method of order 4. */
static ad_var runge_kutta(const struct hnn_step *s, ad_var x)
{
    ad_var dt = s->dt, half = ad_mul(0.5, dt);
    ad_var k1 = field(s, x, 0);
    ad_var k2 = field(s, ad_add(x, ad_mul(half, k1)), 0.5);
    ad_var k3 = field(s, ad_add(x, ad_mul(half, k2)), 0.5);
    ad_var k4 = field(s, ad_add(x, ad_mul(dt, k3)), 1);
    ad_var middle = ad_mul(2.0, ad_add(k2, k3));
    return ad_add(x, ad_mul(ad_mul(1.0 / 6, dt), ad_add(ad_add(k1, middle), k4)));
}

/* Half a kick, a drift, half a kick, of H = T(p) + V(q). */
static ad_var leapfrog(const struct hnn_step *s, ad_var x)
{
    size_t n = s->model->settings.dof;
    ad_var half = ad_mul(0.5, s->dt), q = ad_slice_rows(x, 0, n), p = ad_slice_rows(x, n, n);
    p = ad_add(p, ad_mul(half, ad_slice_rows(field(s, x, 0), n, n)));
    x = ad_concat_rows(2, (ad_var[]){q, p});
    q = ad_add(q, ad_mul(s->dt, ad_slice_rows(field(s, x, 0.5), 0, n)));
    x = ad_concat_rows(2, (ad_var[]){q, p});
    p = ad_add(p, ad_mul(half, ad_slice_rows(field(s, x, 1), n, n)));
    return ad_concat_rows(2, (ad_var[]){q, p});
}

/* ---- the implicit midpoint rule ---- */

enum { ROUNDS = 3 };

/* Most change of the middle in the last round, relative to the states: the next is of the order of
   its square. */
static const double last_change = 1e-5;

/* Of Newton's method for m = x + dt/2 f(m); its matrix is no part of derivatives, which are exact
   where m is. */
static ad_var correction(const struct hnn_step *s, ad_var x, ad_var m)
{
    ad_var rest = ad_sub(ad_sub(m, x), ad_mul(ad_mul(0.5, s->dt), field(s, m, 0.5)));
    ad_var row[2 * HNN_MIDPOINT_MOST], by = m;
    size_t n = ad_rows(x);
    for (size_t k = 0; k < n; k++) {
        ad_var part = ad_row(rest, k);
        ad_grad(part, 1, &m, &by);
        row[k] = by;
    }
    return ad_solve(ad_detach(ad_concat_rows(n, row)), rest, AD_LU);
}

/* 2 m - x. m is iterated apart from derivatives, and NaN where that does not converge; then one
   step is recorded with them. */
static ad_var midpoint(const struct hnn_step *s, ad_var x)
{
    ad_var half = ad_mul(0.5, s->dt), step = x;
    ad_var m = ad_detach(
        ad_add(x, ad_mul(half, field(s, ad_add(x, ad_mul(half, field(s, x, 0.5))), 0.5))));
    for (size_t k = 0; k < ROUNDS; k++) {
        step = correction(s, x, m);
        m = ad_detach(ad_sub(m, step));
    }
    ad_var size = ad_add(ad_sum_rows(ad_square(m)), ad_sum_rows(ad_square(x)));
    ad_var left = ad_sub(ad_mul(last_change * last_change, size), ad_sum_rows(ad_square(step)));
    m = ad_detach(ad_add(m, ad_mul((double)FLT_MIN, ad_sqrt(left))));
    m = ad_sub(m, correction(s, x, m));
    return ad_sub(ad_mul(2.0, m), x);
}

ad_var hnn_record_step(const struct hnn_step *step, enum hnn_stepping stepping, ad_var x)
{
    if (step->model->settings.kind == HNN_SYMPNET)
        return hnn_record_map(step->model, step->parameters, x, step->dt, false);
    static ad_var (*const method[])(const struct hnn_step *, ad_var) = {runge_kutta, leapfrog,
                                                                        midpoint};
    return method[stepping](step, x);
}

enum ad_status hnn_stepping_check(const hnn_model *model, const struct hnn_training *training,
                                  struct ad_error *error)
{
    const struct hnn_settings *s = &model->settings;
    const enum hnn_stepping stepping = training->stepping;
    if (s->kind == HNN_SYMPNET && (!training->rollout || training->loss || stepping))
        return ad_fail(error, AD_E_ARGUMENT,
                       "a sympnet learns from the states that follow: expected a loss on rollouts, "
                       "and no stepping");
    if (stepping > HNN_MIDPOINT)
        return ad_fail(error, AD_E_ARGUMENT, "stepping: expected 0 to %d, got %d", HNN_MIDPOINT,
                       (int)stepping);
    if (stepping != HNN_RUNGE_KUTTA && (!training->rollout || training->loss))
        return ad_fail(error, AD_E_ARGUMENT, "stepping %s needs a loss on rollouts",
                       hnn_steppings[stepping]);
    if (stepping == HNN_LEAPFROG && (!s->separable || s->dissipation))
        return ad_fail(error, AD_E_ARGUMENT,
                       "stepping leapfrog needs a separable H without dissipation; try midpoint");
    if (stepping == HNN_MIDPOINT && s->dof > HNN_MIDPOINT_MOST)
        return ad_fail(error, AD_E_ARGUMENT,
                       "stepping midpoint: expected at most %d coordinates, got %zu",
                       HNN_MIDPOINT_MOST, s->dof);
    return AD_OK;
}
