/* training.c: a training loop of one's own. H = a p^2 + b (1 - cos q), a and b being the parameters
   of a network, from arrays in memory; the loss minds outliers less than squares would. */
#include "hnn/data/data.h"
#include <math.h>
#include <stdio.h>
static ad_var energy(void *context, ad_var w, ad_var x)
{
    ad_var T = ad_mul(ad_slice_cols(w, 0, 1), ad_square(ad_row(x, 1)));
    ad_var V = ad_mul(ad_slice_cols(w, 1, 1), ad_sub(1.0, ad_cos(ad_row(x, 0))));
    return (void)context, ad_add(T, V);
}
static ad_var loss(void *context, const hnn_model *model, ad_var w, ad_var x, ad_var rate)
{
    ad_var off = ad_sub(hnn_model_record(model, w, x).field, rate);
    return (void)context, ad_sum_rows(ad_sub(ad_sqrt(ad_add(1.0, ad_square(off))), 1.0));
}
int main(void)
{
    double q[200], p[200], dq[200], dp[200], last = INFINITY, now; /* the truth: 0.25 and 3 */
    for (int i = 0; i < 200; i++)
        q[i] = 2 * sin(i), p[i] = cos(1.7 * i), dq[i] = p[i] / 2, dp[i] = -3 * sin(q[i]);
    struct hnn_columns arrays = {4, 200, (const double *[]){q, p, dq, dp}, NULL};
    struct hnn_dataset_settings from = {.size = sizeof from,
                                        .columns = &arrays,
                                        .state = "1,2",
                                        .rate = "3,4",
                                        .test_fraction = .2};
    struct hnn_network network = {
        .name = "pendulum", .size = 2, .start = (double[]){1, 1}, .record = energy};
    struct hnn_settings kind = {.size = sizeof kind,
                                .kind = HNN_HAMILTONIAN,
                                .dof = 1,
                                .precision = AD_F64,
                                .network = &network};
    struct hnn_training how = hnn_training_defaults();
    struct hnn_dataset data;
    struct ad_error error = {0}; /* while it holds one, functions do nothing */
    hnn_model *model;
    hnn_trainer *trainer;
    how.learning_rate = .1, how.weight_decay = how.average = 0, how.loss = loss;
    hnn_dataset_read(&from, &data, &error);
    hnn_model_new(&kind, &model, &error);
    hnn_trainer_new(model, &how, &data.train, &data.test, &trainer, &error);
    for (; !error.status && hnn_trainer_rate(trainer) > 1e-6; last = now)
        if (hnn_trainer_advance(trainer, 10, NULL, &error),
            (now = hnn_trainer_test_loss(trainer)) >= last)
            hnn_trainer_set_rate(trainer, hnn_trainer_rate(trainer) / 2, &error);
    hnn_model_save(model, "pendulum.h5", NULL, &error);
    const double *w = error.status ? (double[]){NAN, NAN} : hnn_model_parameters(model);
    printf("%sa = %.6f, b = %.6f\n", error.message, w[0], w[1]);
    hnn_trainer_free(trainer), hnn_model_free(model), hnn_dataset_free(&data);
    return error.status;
}
