/* training.c: a training loop of one's own. H = a p^2 + b (1 - cos q), a and b being the parameters
   of a network, from arrays in memory; the loss minds outliers less than squares would. */
#include "hnn/data/data.h"
#include <math.h>
#include <stdio.h>
static ad_var energy(void *context, ad_var w, ad_var x)
{
    ad_var p2 = ad_square(ad_row(x, 1)), height = ad_sub(1.0, ad_cos(ad_row(x, 0)));
    return (void)context, ad_matmul(w, false, ad_concat_rows(2, (ad_var[]){p2, height}), false);
}
static ad_var loss(void *context, const hnn_model *model, ad_var w, ad_var x, ad_var rate)
{
    ad_var off = ad_sub(hnn_model_record(model, w, x).field, rate);
    return (void)context, ad_sum_rows(ad_log(ad_cosh(off)));
}
int main(void)
{
    double x[2][200], f[2][200], last = INFINITY, now; /* f: of a = 0.25 and b = 3 */
    for (int i = 0; i < 200; i++)
        x[0][i] = sin(i), x[1][i] = cos(i * i), f[0][i] = x[1][i] / 2, f[1][i] = -3 * sin(x[0][i]);
    struct hnn_network own = {.name = "ab", .size = 2, .start = (double[]){1, 1}, .record = energy};
    struct hnn_training how = hnn_training_defaults();
    struct hnn_dataset data;
    struct ad_error error = {0}; /* while it holds one, functions do nothing */
    hnn_model *model;
    hnn_trainer *trainer;
    how.learning_rate = .1, how.weight_decay = how.average = 0, how.loss = loss;
    hnn_dataset_arrays(1, 200, *x, *f, .2, &data, &error);
    hnn_model_new_network(&own, HNN_HAMILTONIAN, 1, &model, &error);
    hnn_trainer_new(model, &how, &data.train, &data.test, &trainer, &error);
    for (; hnn_trainer_rate(trainer) > 1e-6 && !hnn_trainer_advance(trainer, 10, NULL, &error);
         last = now)
        if ((now = hnn_trainer_test_loss(trainer)) >= last)
            hnn_trainer_set_rate(trainer, hnn_trainer_rate(trainer) / 2, &error);
    const double *w = hnn_model_parameters(model);
    if (hnn_model_save(model, "pendulum.h5", NULL, &error) == AD_OK)
        printf("H = %.6f p^2 + %.6f (1 - cos q)\n", w[0], w[1]);
    hnn_trainer_free(trainer), hnn_model_free(model), hnn_dataset_free(&data);
    return error.status != AD_OK && fprintf(stderr, "%s\n", error.message);
}
