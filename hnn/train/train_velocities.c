/* States of a Lagrangian model are (q, v): whether the columns for v are the rates of those for q.
   Momenta, rates in another unit, from another frame or with an offset would be learnt from without
   an error. */
#include "train.h"

#include <math.h>
#include <stdio.h>

/* <v r> against <r r> and <v v>: 1 whichever of the two is noisy, and not where v = m r. */
static const double most = 0.1;

/* v - r is noise, or in proportion to a coordinate, or constant, for this share of its square. */
static const double share = 0.5;
static const double least = 0.05; /* of the size of r */
enum { FEW = 20 };                /* samples that are in proportion by chance */

/* The samples of one coordinate. */
struct rates {
    const hnn_model *model;
    const struct hnn_training *training;
    const struct hnn_samples *s;
    size_t k;
};

/* v of sample i, and in *r the rate of its coordinate. */
static double velocity(const struct rates *of, size_t i, double *r)
{
    const struct hnn_samples *s = of->s;
    const size_t q = of->k * s->n + i, p = of->model->settings.dof * s->n + q;
    *r = s->target[q];
    if (!of->training->rollout) /* of a forward difference the mean over its step */
        return s->x[p] + (s->steps ? 0.5 * s->steps[i] * s->target[p] : 0);
    /* the first step, and the mean of its velocities */
    *r = (*r - s->x[q]) / (s->steps ? s->steps[i] : of->training->dt);
    return 0.5 * (s->x[p] + s->target[p]);
}

static enum ad_status refuse(const struct rates *of, const char *is, struct ad_error *error)
{
    char v[32];
    hnn_model_component(of->model, of->k + of->model->settings.dof, v, sizeof v);
    return ad_fail(error, AD_E_ARGUMENT,
                   "state: %s is %s; expected velocities, as a Lagrangian model needs them, not "
                   "momenta",
                   v, is);
}

/* Whether v is r, but for noise; *rr: the mean of r^2. */
static enum ad_status check_scale(const struct rates *of, double *rr, struct ad_error *error)
{
    double vr = 0, vv = 0, r;
    char is[80], q[32];
    *rr = 0;
    for (size_t i = 0; i < of->s->n; i++) {
        double v = velocity(of, i, &r);
        vr += v * r;
        vv += v * v;
        *rr += r * r;
    }
    hnn_model_component(of->model, of->k, q, sizeof q);
    const bool one_rests = (vv == 0) != (*rr == 0);
    if (one_rests)
        snprintf(is, sizeof is, vv == 0 ? "0 while %s changes" : "not 0 while %s stays", q);
    else
        snprintf(is, sizeof is, "%.3g times the rate of %s", vr / *rr, q);
    if (one_rests || (!(fabs(vr - *rr) <= most * *rr) && !(fabs(vr - vv) <= most * vv)))
        refuse(of, is, error);
    *rr /= (double)of->s->n;
    return error->status;
}

/* Whether v - r is a constant (j = dof), or in proportion to how coordinate j differs from its
 * mean. */
static enum ad_status check_part(const struct rates *of, size_t j, double rr,
                                 struct ad_error *error)
{
    const size_t n = of->s->n;
    const bool constant = j == of->model->settings.dof;
    double e = 0, u = 0, ee = 0, eu = 0, uu = 0, r;
    for (size_t i = 0; i < n; i++) {
        e += (velocity(of, i, &r) - r) / (double)n;
        u += constant ? 0 : of->s->x[j * n + i] / (double)n;
    }
    for (size_t i = 0; i < n; i++) {
        double part = constant ? 1 : of->s->x[j * n + i] - u;
        double rest = velocity(of, i, &r) - r - (constant ? 0 : e);
        ee += rest * rest / (double)n;
        eu += rest * part / (double)n;
        uu += part * part / (double)n;
    }
    double slope = eu / uu, explained = slope * eu;
    if (!(explained > share * ee && explained > least * least * rr))
        return AD_OK;
    char is[120], q[32], other[32] = "";
    hnn_model_component(of->model, of->k, q, sizeof q);
    if (!constant)
        hnn_model_component(of->model, j, other, sizeof other);
    snprintf(is, sizeof is, "the rate of %s, and %.3g%s%s besides", q, slope,
             constant ? "" : " times ", other);
    return refuse(of, is, error);
}

enum ad_status hnn_velocities_check(const hnn_model *model, const struct hnn_training *training,
                                    const struct hnn_samples *s, struct ad_error *error)
{
    struct rates of = {model, training, s, 0};
    const size_t dof = model->settings.dof;
    if (model->settings.kind != HNN_LAGRANGIAN || training->loss)
        return AD_OK;
    for (; of.k < dof && error->status == AD_OK; of.k++) {
        double rr;
        if (check_scale(&of, &rr, error) != AD_OK || s->n < FEW)
            continue;
        for (size_t j = 0; j <= dof && error->status == AD_OK; j++)
            check_part(&of, j, rr, error);
    }
    return error->status;
}
