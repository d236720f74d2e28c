/* Training: each step runs one program (forward, gradient in the graph, loss, backward) over the
   blocks of a batch, then one step of an optimiser on the flat parameters. */
#include "train.h"
#include "autodiff/sized.h"
#include "autodiff/free.h"
#include "train_speed.h"
#include "autodiff/clock.h"
#include "autodiff/hash.h"
#include "physics/io/grow.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- making ---- */

/* The model has seen the states of the training, all ranks' together. */
static enum ad_status see_states(hnn_trainer *t, struct ad_error *error)
{
    const struct hnn_data *d = &t->train;
    size_t states = hnn_rows(t->model);
    if (hnn_range_states(t->model, d->held, t->settings.rollout, d->samples.x, error) != AD_OK ||
        !d->samples.end)
        return error->status;
    double *low = t->model->range, *high = low + states + 1;
    for (size_t k = 0; k < states; k++) {
        double ends[2] = {low[k], -high[k]};
        ad_ranks_least(d->ranks, 2, ends, error);
        low[k] = ends[0];
        high[k] = -ends[1];
    }
    return error->status;
}

/* ... and their energies, of some of them. */
static enum ad_status see_energies(hnn_trainer *t, struct ad_error *error)
{
    struct hnn_data *d = &t->train;
    if (!d->samples.end)
        return hnn_range_energy(t->model, d->n, d->samples.x, error);
    size_t few = d->n < HNN_RANGE_ENERGIES ? d->n : HNN_RANGE_ENERGIES;
    uint32_t *picked = malloc(few * sizeof *picked);
    if (!picked)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; picked && k < few; k++)
        picked[k] = (uint32_t)(k * (d->n / few));
    if (ad_ranks_agree(d->ranks, error) == AD_OK && hnn_data_take(d, few, picked, error) == AD_OK)
        hnn_range_energy(t->model, few, d->taken, error);
    free(picked);
    return error->status;
}

static enum ad_status prepare_data(hnn_trainer *t, const struct hnn_samples *train,
                                   const struct hnn_samples *test, struct ad_error *error)
{
    enum ad_type type = t->model->settings.precision;
    size_t x_rows = hnn_x_rows(t->learner, &t->settings),
           rows = hnn_target_rows(t->learner, &t->settings);
    if (hnn_data_new(&t->train, type, &t->settings, train, &t->lit, x_rows, rows, error) != AD_OK ||
        hnn_data_new(&t->test, type, &t->settings, test, &t->lit, x_rows, rows, error) != AD_OK ||
        (!t->model->settings.pixels && see_states(t, error) != AD_OK))
        return error->status;
    if (t->settings.batch)
        hnn_data_shuffle(&t->train, t->settings.seed, error);
    return error->status;
}

static enum ad_status prepare_method(hnn_trainer *t, struct ad_error *error)
{
    t->method = t->settings.optimiser->create(&t->settings, t->problem.type, t->problem.n);
    t->size_bytes = t->problem.n * hnn_type_bytes(t->problem.type);
    if (t->settings.patience)
        t->best = malloc(t->size_bytes);
    if (!t->method || (t->settings.patience && !t->best) ||
        (t->settings.average > 0 && !t->settings.optimiser->full_batch && !hnn_average_new(t)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(hnn_problem_point(&t->problem), hnn_learner_point(t), t->size_bytes);
    return AD_OK;
}

enum ad_status hnn_trainer_new(hnn_model *model, const struct hnn_training *training,
                               const struct hnn_samples *train, const struct hnn_samples *test,
                               hnn_trainer **out, struct ad_error *error)
{
    static const struct hnn_samples none = {0};
    if (out)
        *out = NULL;
    if (AD_LACKS(error, model, training, train, out))
        return error->status;
    AD_OWN(hnn_training, training, loss_context, error);
    test = test ? test : &none;
    if (AD_LACKS(error, training->optimiser, training->schedule) ||
        hnn_training_check(model, training, train, test, error) != AD_OK)
        return error->status;
    hnn_trainer *t = calloc(1, sizeof *t);
    if (!t)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    t->model = model;
    t->settings = *training;
    t->settings.batch = training->batch == train->n ? 0 : training->batch;
    t->settings.every = training->every ? training->every : 10;
    t->best_loss = INFINITY;
    t->delivered = true;
    t->rate = training->learning_rate;
    t->version = model->version;
    t->normalised = model->normalised;
    if (hnn_learner_new(t, train, error) != AD_OK || prepare_data(t, train, test, error) != AD_OK ||
        hnn_own_loss_check(t->learner, &t->settings, &t->train, error) != AD_OK ||
        hnn_problem_new(&t->problem, t->learner, &t->settings, &t->train, &t->failed, error) !=
            AD_OK ||
        hnn_loss_evaluator_new(&t->train_loss, t->learner, &t->settings, &t->train, &t->failed,
                               error) != AD_OK ||
        hnn_loss_evaluator_new(&t->test_loss, t->learner, &t->settings, &t->test, &t->failed,
                               error) != AD_OK ||
        prepare_method(t, error) != AD_OK) {
        hnn_trainer_free(t);
        return error->status;
    }
    *out = t;
    return AD_OK;
}

void hnn_trainer_free(hnn_trainer *t)
{
    if (!t)
        return;
    if (t->method)
        t->settings.optimiser->destroy(t->method);
    hnn_loss_evaluator_free(&t->train_loss);
    hnn_loss_evaluator_free(&t->test_loss);
    hnn_problem_free(&t->problem);
    hnn_data_free(&t->train);
    hnn_data_free(&t->test);
    hnn_learner_free(t);
    AD_FREE(t->history, t->best, t->average, t->rounded, t);
}

/* ---- results ---- */

size_t hnn_trainer_step(const hnn_trainer *trainer) { return trainer ? trainer->step : 0; }
size_t hnn_trainer_steps_now(const hnn_trainer *trainer)
{
    return trainer ? trainer->steps_now : 0;
}

enum ad_status hnn_trainer_set_rate(hnn_trainer *t, double rate, struct ad_error *error)
{
    if (AD_LACKS(error, t))
        return error->status;
    if (t->settings.optimiser == &hnn_lbfgs)
        return ad_fail(error, AD_E_ARGUMENT, "learning rate: lbfgs searches for its own");
    if (!(rate > 0) || !isfinite(rate))
        return ad_fail(error, AD_E_ARGUMENT,
                       "learning rate: expected more than 0, such as 1e-3, got %g", rate);
    t->rate = rate;
    return AD_OK;
}

double hnn_trainer_rate(const hnn_trainer *t)
{
    return t ? t->rate * t->settings.schedule->factor(t->step, t->settings.steps) : (double)NAN;
}

double hnn_trainer_seconds(const hnn_trainer *trainer) { return trainer ? trainer->seconds : 0; }

const struct hnn_row *hnn_trainer_history(const hnn_trainer *trainer, size_t *rows)
{
    if (rows)
        *rows = trainer ? trainer->rows : 0;
    return trainer ? trainer->history : NULL;
}

/* The model's parameters if it has the result; during training, those it would get. */
static const void *present_point(hnn_trainer *t)
{
    return t->delivered ? hnn_learner_point(t) : hnn_trainer_outcome(t);
}

double hnn_trainer_train_loss(hnn_trainer *t)
{
    return t ? hnn_evaluate_loss(&t->train_loss, present_point(t), t->size_bytes) : (double)NAN;
}

double hnn_trainer_test_loss(hnn_trainer *t)
{
    return t ? hnn_evaluate_loss(&t->test_loss, present_point(t), t->size_bytes) : (double)NAN;
}

double hnn_trainer_product_share(hnn_trainer *t)
{
    if (!t)
        return NAN;
    double began = ad_now(), products = hnn_problem_products(&t->problem);
    return products / (ad_now() - began);
}

static bool is_finite(const struct hnn_problem *p, const void *point)
{
    bool finite = true;
    for (size_t k = 0; k < p->n; k++)
        finite &= p->type == AD_F32 ? isfinite(((const float *)point)[k]) != 0
                                    : isfinite(((const double *)point)[k]) != 0;
    return finite;
}

enum ad_status hnn_trainer_deliver(hnn_trainer *t, struct ad_error *error)
{
    bool best = t->best && isfinite(t->best_loss);
    const void *point = best ? t->best : hnn_trainer_outcome(t);
    if (!is_finite(&t->problem, point))
        return ad_fail(error, AD_E_NONFINITE,
                       "parameters are not finite after step %zu; try a smaller learning rate",
                       t->step);
    hnn_learner_deliver(t, point);
    t->version = t->model->version;
    if (t->model->settings.pixels)
        return hnn_range_latents(t, error);
    return see_energies(t, error);
}

/* ---- running ---- */

enum ad_status hnn_history_add(hnn_trainer *t, const struct hnn_row *row, struct ad_error *error)
{
    if (!phys_grow(&t->history, t->rows, sizeof *t->history))
        return ad_fail(error, AD_E_MEMORY, "out of memory for the history");
    t->history[t->rows++] = *row;
    return AD_OK;
}

/* What to try where a number is not finite. The learning rate has no part in the first loss. */
static const char *remedy(const hnn_trainer *t)
{
    if (t->settings.rollout && t->settings.stepping == HNN_MIDPOINT)
        return "shorter time steps, for which the midpoint rule has a solution, or runge-kutta";
    return t->step <= 1 ? "normalised states" : "a smaller learning rate";
}

/* The error of an evaluation; the next one begins without. */
static enum ad_status take_failure(hnn_trainer *t, struct ad_error *error)
{
    struct ad_error failed = t->failed;
    t->failed = (struct ad_error){0};
    if (failed.status == AD_E_NONFINITE)
        ad_fail(error, failed.status, "%s at step %zu; try %s", failed.message, t->step, remedy(t));
    else if (failed.status != AD_OK)
        ad_fail(error, failed.status, "%s", failed.message);
    return error->status;
}

/* Closes a row of the history: the test loss, and whether it is the least so far. */
static enum ad_status evaluate_losses(hnn_trainer *t, struct ad_error *error)
{
    const void *point = hnn_trainer_outcome(t);
    struct hnn_row row = {.step = t->step,
                          .train_loss = t->loss_sum / (double)t->loss_count,
                          .test_loss = hnn_evaluate_loss(&t->test_loss, point, t->size_bytes),
                          .seconds = t->seconds};
    if (take_failure(t, error) != AD_OK)
        return error->status;
    t->loss_sum = 0;
    t->loss_count = 0;
    if (row.test_loss < t->best_loss) {
        t->best_loss = row.test_loss;
        t->best_step = t->step;
        if (t->best)
            memcpy(t->best, point, t->size_bytes);
    }
    return hnn_history_add(t, &row, error);
}

static bool out_of_patience(const hnn_trainer *t)
{
    return t->settings.patience && isfinite(t->best_loss) &&
           t->step - t->best_step >= t->settings.patience;
}

enum ad_status hnn_trainer_idle(const hnn_trainer *t, struct ad_error *error)
{
    if (t->running)
        return ad_fail(error, AD_E_ARGUMENT, "a training cannot go on inside its own progress");
    if (t->normalised != t->model->normalised)
        return ad_fail(error, AD_E_ARGUMENT,
                       "the model was normalised after its trainer was made; expected before");
    return AD_OK;
}

/* The model got other parameters than the trainer's. */
static void take_parameters(hnn_trainer *t)
{
    memcpy(hnn_problem_point(&t->problem), hnn_learner_point(t), t->size_bytes);
    hnn_average_restart(t);
    t->version = t->model->version;
    t->stalled = false;
}

static enum ad_status take_step(hnn_trainer *t, struct ad_error *error)
{
    const struct hnn_training *s = &t->settings;
    struct hnn_problem *p = &t->problem;
    double rate = hnn_trainer_rate(t), loss;
    if (t->version != t->model->version)
        take_parameters(t);
    if (s->batch)
        hnn_data_draw(&t->train, s->batch, p->drawn);
    if (s->batch && t->train.samples.end &&
        hnn_data_take(&t->train, s->batch, p->drawn, error) != AD_OK)
        return error->status;
    t->delivered = false;
    t->stalled = !s->optimiser->step(t->method, p, rate, &loss);
    t->step++;
    t->steps_now++;
    t->loss_sum += loss;
    t->loss_count++;
    if (take_failure(t, error) != AD_OK)
        return error->status;
    if (!isfinite(loss))
        return ad_fail(error, AD_E_NONFINITE, "the loss is not finite at step %zu; try %s", t->step,
                       remedy(t));
    if (t->average)
        hnn_average_step(t);
    return AD_OK;
}

enum ad_status hnn_trainer_take_step(hnn_trainer *t, struct ad_error *error)
{
    return AD_LACKS(error, t) ? error->status : take_step(t, error);
}

/* Why no step can follow; 0: one can. */
static enum hnn_stop reason(const hnn_trainer *t)
{
    return t->step >= t->settings.steps ? HNN_STOP_STEPS
           : out_of_patience(t)         ? HNN_STOP_PATIENCE
           : t->stalled                 ? HNN_STOP_STALLED
                                        : (enum hnn_stop)0;
}

/* Ranks that read another file, or an older checkpoint, or whose processors round differently,
   would train towards something else. */
static enum ad_status compare_ranks(hnn_trainer *t, struct ad_error *error)
{
    char text[128];
    if (!t->settings.ranks)
        return AD_OK;
    uint64_t point = ad_hash(AD_HASH_BEGIN, hnn_problem_point(&t->problem), t->size_bytes);
    snprintf(text, sizeof text,
             "step %zu, parameters %016" PRIx64 ", data %016" PRIx64 " %016" PRIx64, t->step, point,
             t->train.hash, t->test.hash);
    return ad_ranks_same(t->settings.ranks, "training", text, error);
}

static enum ad_status take_steps(hnn_trainer *t, size_t n, enum hnn_stop *stop,
                                 struct ad_error *error)
{
    for (size_t k = 0; k < n && !reason(t); k++) {
        double began = ad_now();
        if (take_step(t, error) != AD_OK)
            return error->status;
        t->seconds += ad_now() - began;
        bool last = t->stalled || t->step >= t->settings.steps;
        if ((last || t->step % t->settings.every == 0) &&
            (evaluate_losses(t, error) != AD_OK || compare_ranks(t, error) != AD_OK))
            return error->status;
        if (t->settings.progress && !t->settings.progress(t->settings.context, t)) {
            *stop = HNN_STOP_INTERRUPTED;
            return AD_OK;
        }
    }
    *stop = reason(t);
    return AD_OK;
}

enum ad_status hnn_trainer_advance(hnn_trainer *t, size_t n, enum hnn_stop *stop,
                                   struct ad_error *error)
{
    enum hnn_stop unused = 0;
    stop = stop ? stop : &unused;
    *stop = 0;
    if (AD_LACKS(error, t) || hnn_trainer_idle(t, error) != AD_OK)
        return error->status;
    t->running = true;
    if (compare_ranks(t, error) == AD_OK && take_steps(t, n, stop, error) == AD_OK)
        hnn_trainer_deliver(t, error);
    t->running = false;
    t->delivered = true; /* or as it was */
    return error->status;
}

enum ad_status hnn_trainer_run(hnn_trainer *t, enum hnn_stop *stop, struct ad_error *error)
{
    return hnn_trainer_advance(t, SIZE_MAX, stop, error);
}
