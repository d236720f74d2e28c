/* The parts of `leastaction chart hnn`. */
#ifndef APPS_BENCH_CHART_HNN_H
#define APPS_BENCH_CHART_HNN_H

#include "chart.h"
#include "hnn/data/data.h"
#include "hnn/hnn.h"

/* The published network: two hidden layers of 200, steps on 750 samples at once; and the width that
   is measured by --quick. */
enum { QUICK_WIDTH = 50, PUBLISHED_WIDTH = 200, PUBLISHED_BATCH = 750 };

/* One network that is measured, and the samples of a step; the published one but for these. */
struct network {
    enum hnn_kind kind;
    enum ad_type type;
    size_t width, batch;
};

/* A wide one: its products take nearly all of a step. */
#define WIDE_NETWORK ((struct network){HNN_HAMILTONIAN, AD_F32, 1000, 1024})

enum { NETWORKS_MOST = 16 + 1 }; /* of networks_of_chart, and the wide one */

/* One width, or with 0 each, as HNN and baseline, in f32 and f64; returns how many. */
size_t networks_of_chart(size_t width, struct network networks[NETWORKS_MOST]);
struct hnn_settings network_settings(const struct network *network);

/* Mean square error of the energy along motions to t = 20 from a few starts; infinite where one is
   lost. */
enum ad_status network_energy_error(hnn_model *model, const struct hnn_task *task, size_t starts,
                                    double *mse, struct ad_error *error);

/* A step of training beside its floor, and one evaluation of the field: hnn-steps.csv. */
enum ad_status chart_steps(struct chart *chart, struct ad_error *error);
/* The losses of the first steps of training, from weights and on samples that others can have, too:
   hnn-losses.csv. */
enum ad_status chart_losses(struct chart *chart, struct ad_error *error);
/* Test loss and energy error against CPU time of training: hnn-learning.csv and its picture. The
   published HNN in f32, as far as it came, goes to `model`: the caller frees it. */
enum ad_status chart_learning(struct chart *chart, hnn_model **model, struct ad_error *error);
/* The model's motion by every integrator that suits it, its field in f64 and in f32, against
   evaluations: hnn-rollouts.csv and its picture. */
enum ad_status chart_rollouts(struct chart *chart, hnn_model *model, struct ad_error *error);

#endif
