/* Times trainer steps alternating with the floor on arrays of the same size (training_speed.h). */
#include "training_speed.h"
#include "apps/bench/hand/hand_training.h"
#include "autodiff/blas.h"
#include "hnn/train/train_speed.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

enum { STEP, GRADIENT, PRODUCTS, ACTIVATION, HAND, JOBS };

struct subject {
    const struct hnn_settings *settings;
    size_t batch, threads, widest;
    hnn_model *model;
    hnn_trainer *trainer;
    double *data;          /* states and rates, [4*dof x batch] */
    double shares, shared; /* sum and number of the shares of products */
    void *matrix[4];       /* of the type: each has room for [widest x batch or widest] */
    ad_tape *tape;
    ad_program *activation;
    struct hand_training hand;
    float *samples; /* of it: states and rates, [4 x batch] */
    bool by_hand;
    struct ad_error *error;
};

static void run_step(void *context)
{
    struct subject *s = context;
    hnn_trainer_take_step(s->trainer, s->error);
}

static void run_gradient(void *context)
{
    struct subject *s = context;
    s->shares += hnn_trainer_product_share(s->trainer);
    s->shared++;
}

/* The products of one inner matrix [m x k]: W h and the two adjoints; of an HNN all of it twice. */
static void run_products(void *context)
{
    struct subject *s = context;
    const struct hnn_settings *settings = s->settings;
    enum ad_type type = settings->precision;
    void *w = s->matrix[0], *a = s->matrix[1], *b = s->matrix[2], *out = s->matrix[3];
    if (s->threads == 1)
        ad_blas_single_thread();
    for (size_t layer = 1; layer + 1 < settings->layers; layer++) {
        size_t k = settings->hidden[layer - 1], m = settings->hidden[layer], n = s->batch;
        for (int pass = settings->kind == HNN_BASELINE; pass < 2; pass++) {
            ad_blas_gemm(type, false, false, m, n, k, w, k, a, n, false, out, n);
            ad_blas_gemm(type, true, false, k, n, m, w, k, a, n, false, out, n);
            ad_blas_gemm(type, false, true, m, k, n, a, n, b, n, false, out, k);
        }
    }
    if (s->threads == 1)
        ad_blas_threads();
}

static void run_hand(void *context)
{
    struct subject *s = context;
    hand_training_step(&s->hand);
}

static void fill(enum ad_type type, size_t n, void *to)
{
    for (size_t k = 0; k < n; k++)
        if (type == AD_F32)
            ((float *)to)[k] = (float)sin(0.7 * (double)k);
        else
            ((double *)to)[k] = sin(0.7 * (double)k);
}

static enum ad_status open_floor(struct subject *s)
{
    enum ad_type type = s->settings->precision;
    const struct hnn_activation *kind = hnn_activations;
    size_t bytes = type == AD_F32 ? sizeof(float) : sizeof(double), units = 0;
    for (size_t k = 0; k + 1 < s->settings->layers; k++) {
        units += s->settings->hidden[k];
        s->widest = s->settings->hidden[k] > s->widest ? s->settings->hidden[k] : s->widest;
    }
    size_t size = s->widest * (s->batch > s->widest ? s->batch : s->widest);
    for (size_t k = 0; k < LENGTH(s->matrix); k++) {
        s->matrix[k] = malloc(size * bytes);
        if (!s->matrix[k])
            return ad_fail(s->error, AD_E_MEMORY, "out of memory for products of %zu", s->widest);
        fill(type, size, s->matrix[k]);
    }
    s->tape = ad_tape_new(type);
    if (!s->tape)
        return ad_fail(s->error, AD_E_MEMORY, "out of memory");
    while (strcmp(kind->name, s->settings->activation) != 0)
        kind++;
    ad_var z = ad_input(s->tape, units ? units : 1, s->batch, "z"), h = kind->record(z);
    if (ad_compile(s->tape, 1, &h, &s->activation) != AD_OK)
        return ad_fail(s->error, ad_tape_error(s->tape)->status, "%s",
                       ad_tape_error(s->tape)->message);
    fill(type, units * s->batch, ad_data(s->activation, z));
    ad_set_threads(s->activation, s->threads);
    return AD_OK;
}

static enum ad_status open_step(struct subject *s)
{
    size_t rows = 2 * s->settings->dof, n = rows * s->batch;
    struct hnn_training training = hnn_training_defaults();
    training.threads = s->threads;
    s->data = malloc(2 * n * sizeof *s->data);
    if (!s->data)
        return ad_fail(s->error, AD_E_MEMORY, "out of memory for %zu samples", s->batch);
    fill(AD_F64, 2 * n, s->data);
    const struct hnn_samples train = {.n = s->batch, .x = s->data, .target = s->data + n};
    if (hnn_model_new(s->settings, &s->model, s->error) != AD_OK)
        return s->error->status;
    return hnn_trainer_new(s->model, &training, &train, &(struct hnn_samples){0}, &s->trainer,
                           s->error);
}

static enum ad_status open_hand(struct subject *s)
{
    size_t n = 2 * s->batch;
    s->by_hand = s->threads == 1 && hand_training_suits(s->settings);
    if (!s->by_hand)
        return AD_OK;
    s->samples = malloc(2 * n * sizeof *s->samples);
    if (!s->samples)
        return ad_fail(s->error, AD_E_MEMORY, "out of memory for %zu samples", s->batch);
    fill(AD_F32, 2 * n, s->samples);
    return hand_training_new(&s->hand, s->model, s->batch, s->samples, s->samples + n,
                             hnn_training_defaults().weight_decay, s->error);
}

static void subject_close(struct subject *s)
{
    hand_training_free(&s->hand);
    free(s->samples);
    hnn_trainer_free(s->trainer);
    hnn_model_free(s->model);
    ad_program_free(s->activation);
    ad_tape_free(s->tape);
    for (size_t k = 0; k < LENGTH(s->matrix); k++)
        free(s->matrix[k]);
    free(s->data);
}

/* All in turn; but threads of OpenBLAS spin for some 30 ms after a product, and would take the
   processors from those of the step. */
static void measure(const struct subject *s, struct timed jobs[JOBS], size_t rounds)
{
    if (s->threads == 1) {
        time_in_turn(s->by_hand ? JOBS : HAND, jobs, rounds);
    } else {
        time_in_turn(PRODUCTS, jobs, rounds);
        time_in_turn(HAND - PRODUCTS, jobs + PRODUCTS, rounds);
    }
}

enum ad_status training_speed_measure(const struct hnn_settings *settings, size_t batch,
                                      size_t threads, size_t rounds, struct training_speed *speed,
                                      struct ad_error *error)
{
    static void (*const runs[JOBS])(void *) = {[STEP] = run_step,
                                               [GRADIENT] = run_gradient,
                                               [PRODUCTS] = run_products,
                                               [ACTIVATION] = time_program,
                                               [HAND] = run_hand};
    struct subject s = {.settings = settings, .batch = batch, .threads = threads, .error = error};
    struct timed jobs[JOBS];
    for (size_t j = 0; j < JOBS; j++)
        jobs[j] = (struct timed){.run = runs[j], .context = &s, .processor = threads == 1};
    if (settings->pixels || settings->separable || settings->dissipation)
        return ad_fail(error, AD_E_ARGUMENT, "the floor is that of one network of states");
    if (open_step(&s) == AD_OK && open_floor(&s) == AD_OK && open_hand(&s) == AD_OK) {
        jobs[ACTIVATION].context = s.activation;
        measure(&s, jobs, rounds);
        *speed = (struct training_speed){
            .step_ms = 1e-6 * jobs[STEP].nanoseconds,
            .share = s.shares / s.shared,
            .products_ms = 1e-6 * jobs[PRODUCTS].nanoseconds,
            .activation_ms = 1e-6 * jobs[ACTIVATION].nanoseconds,
            .hand_ms = s.by_hand ? 1e-6 * jobs[HAND].nanoseconds : NAN,
            .hand_ratio = s.by_hand ? time_ratio(&jobs[STEP], &jobs[HAND], rounds) : NAN};
    }
    subject_close(&s);
    return error->status;
}
