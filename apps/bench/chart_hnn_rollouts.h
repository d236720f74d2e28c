/* How exactly integrators follow a network. */
#ifndef APPS_CHART_HNN_ROLLOUTS_H
#define APPS_CHART_HNN_ROLLOUTS_H

#include "chart_hnn.h"
#include "work_precision.h"

enum { ROLLOUT_TYPES = 2, ROLLOUT_METHODS = 16 };

struct rollouts {
    hnn_model *model;
    struct phys_ode ode;
    double time, end[2]; /* where the reference is */
    double model_error;  /* its distance from the true motion: finer than this is of no use */
    size_t n;
    struct work_curve curve[ROLLOUT_TYPES][ROLLOUT_METHODS];
    double least[ROLLOUT_TYPES]; /* error that any method comes to */
};
/* Of the field, in the order of the curves: f64, f32. */
extern const enum ad_type rollout_types[ROLLOUT_TYPES];

/* The fastest methods at some errors, in either precision. */
void rollouts_print(const struct rollouts *rollouts, FILE *out);
/* Error against evaluations, the precisions side by side. */
void rollouts_draw(const struct rollouts *rollouts, struct plot *plot);

#endif
