/* States of a Lagrangian model are (q, v): whether the columns for v are the rates of those for q.
   Momenta, or rates in another unit, would be learnt from without an error. */
#include "train.h"

#include <math.h>

/* <v r> against <r r> and <v v>: 1 whichever of the two is noisy, and not where v = m r. */
static const double most = 0.1;

static enum ad_status judge(const hnn_model *model, size_t k, double vr, double rr, double vv,
                            struct ad_error *error)
{
    char q[32], v[32];
    if (rr == 0 && vv == 0)
        return AD_OK;
    if (fabs(vr - rr) <= most * rr || fabs(vr - vv) <= most * vv)
        return AD_OK;
    hnn_model_component(model, k, q, sizeof q);
    hnn_model_component(model, k + model->settings.dof, v, sizeof v);
    return ad_fail(error, AD_E_ARGUMENT,
                   "state: %s is %.3g times the rate of %s; expected velocities, as a Lagrangian "
                   "model needs them, not momenta",
                   v, vr / rr, q);
}

enum ad_status hnn_velocities_check(const hnn_model *model, const struct hnn_training *training,
                                    const struct hnn_samples *s, struct ad_error *error)
{
    size_t dof = model->settings.dof, n = s->n;
    if (model->settings.kind != HNN_LAGRANGIAN || training->loss)
        return AD_OK;
    for (size_t k = 0; k < dof && error->status == AD_OK; k++) {
        double vr = 0, rr = 0, vv = 0;
        for (size_t i = 0; i < n; i++) {
            size_t q = k * n + i, p = (dof + k) * n + i;
            double v = s->x[p], r = s->target[q];
            if (training->rollout) { /* the first step, and the mean of its velocities */
                r = (r - s->x[q]) / (s->steps ? s->steps[i] : training->dt);
                v = 0.5 * (v + s->target[p]);
            }
            vr += v * r;
            rr += r * r;
            vv += v * v;
        }
        judge(model, k, vr, rr, vv, error);
    }
    return error->status;
}
