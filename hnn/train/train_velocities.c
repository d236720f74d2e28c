/* States of a Lagrangian model are (q, v): whether the columns for v are the rates of those for q.
   Momenta, rates in another unit, from another frame or with an offset would be learnt from without
   an error. */
#include "train.h"
#include "hnn/data/data.h"

#include <math.h>
#include <stdio.h>

/* <v r> against <r r> and <v v>: 1 whichever of the two is noisy, and not where v = m r. */
static const double most = 0.1;

/* v - r is noise, or in proportion to a coordinate, or constant, for this share of its square. */
static const double share = 0.5;
static const double least = 0.05; /* of the size of r */
enum { FEW = 20 };                /* samples that are in proportion by chance */

/* The samples of coordinate k, beside coordinate j, or, at dof, beside a constant. */
struct rates {
    const hnn_model *model;
    const struct hnn_training *training;
    const struct hnn_samples *s;
    size_t k, j;
    double rest, beside; /* means of v - r, and of that coordinate */
};

/* v of a sample that this rank holds, and in *r the rate of its coordinate. */
static double velocity(const struct rates *of, size_t i, double *r)
{
    const struct hnn_samples *s = of->s;
    const size_t held = hnn_samples_held(s), q = of->k * held + i,
                 p = of->model->settings.dof * held + q;
    *r = s->target[q];
    if (!of->training->rollout) /* of a forward difference the mean over its step */
        return s->x[p] + (s->steps ? 0.5 * s->steps[i] * s->target[p] : 0);
    /* the first step, and the mean of its velocities */
    *r = (*r - s->x[q]) / (s->steps ? s->steps[i] : of->training->dt);
    return 0.5 * (s->x[p] + s->target[p]);
}

/* Sums over all samples, those of other ranks as well. */
static enum ad_status sum_all(struct rates *of, size_t n, hnn_samples_add *add, double *sum,
                              struct ad_error *error)
{
    return hnn_samples_sum(of->training->ranks, of->s, n, add, of, sum, error);
}

static void add_scale(void *context, size_t i, double *sum)
{
    double r, v = velocity(context, i, &r);
    sum[0] += v * r;
    sum[1] += v * v;
    sum[2] += r * r;
}

static double beside(const struct rates *of, size_t i)
{
    return of->j == of->model->settings.dof ? 1 : of->s->x[of->j * hnn_samples_held(of->s) + i];
}

static void add_means(void *context, size_t i, double *sum)
{
    double r, v = velocity(context, i, &r);
    sum[0] += v - r;
    sum[1] += beside(context, i);
}

static void add_part(void *context, size_t i, double *sum)
{
    const struct rates *of = context;
    double r, v = velocity(of, i, &r), rest = v - r - of->rest, part = beside(of, i) - of->beside;
    sum[0] += rest * rest;
    sum[1] += rest * part;
    sum[2] += part * part;
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

/* Whether v is r, but for noise; *mean: that of r^2. */
static enum ad_status check_scale(struct rates *of, double *mean, struct ad_error *error)
{
    double sum[3];
    char is[80], q[32];
    if (sum_all(of, 3, add_scale, sum, error) != AD_OK)
        return error->status;
    const double vr = sum[0], vv = sum[1], rr = sum[2];
    hnn_model_component(of->model, of->k, q, sizeof q);
    const bool one_rests = (vv == 0) != (rr == 0);
    if (one_rests)
        snprintf(is, sizeof is, vv == 0 ? "0 while %s changes" : "not 0 while %s stays", q);
    else
        snprintf(is, sizeof is, "%.3g times the rate of %s", vr / rr, q);
    if (one_rests || (!(fabs(vr - rr) <= most * rr) && !(fabs(vr - vv) <= most * vv)))
        refuse(of, is, error);
    *mean = rr / (double)of->s->n;
    return error->status;
}

/* Whether v - r is a constant, or in proportion to how coordinate j differs from its mean. */
static enum ad_status check_part(struct rates *of, double rr, struct ad_error *error)
{
    const double n = (double)of->s->n;
    const size_t j = of->j;
    const bool constant = j == of->model->settings.dof;
    double mean[2], sum[3];
    if (sum_all(of, 2, add_means, mean, error) != AD_OK)
        return error->status;
    of->rest = constant ? 0 : mean[0] / n;
    of->beside = constant ? 0 : mean[1] / n;
    if (sum_all(of, 3, add_part, sum, error) != AD_OK)
        return error->status;
    const double slope = sum[1] / sum[2], explained = slope * sum[1] / n;
    if (!(explained > share * sum[0] / n && explained > least * least * rr))
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
    struct rates of = {.model = model, .training = training, .s = s};
    const size_t dof = model->settings.dof;
    if (model->settings.kind != HNN_LAGRANGIAN || training->loss)
        return AD_OK;
    for (; of.k < dof && error->status == AD_OK; of.k++) {
        double rr = 0;
        if (check_scale(&of, &rr, error) != AD_OK || s->n < FEW)
            continue;
        for (of.j = 0; of.j <= dof && error->status == AD_OK; of.j++)
            check_part(&of, rr, error);
    }
    return error->status;
}
