/* Models of pixels: the loss against plain loops, its gradient by differences, training from frames
   that halves it and resumes to the last bit, and refusals. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/train/train.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 4, FRAME = SIDE * SIDE, PIXELS = 2 * FRAME, FRAMES = 60, SAMPLES = FRAMES - 2 };

static struct hnn_settings settings_of(enum hnn_kind kind, size_t dof)
{
    struct hnn_settings s = hnn_pixel_defaults(kind, PIXELS);
    s.dof = dof;
    s.hidden[0] = 6;
    s.hidden[1] = 5;
    s.autoencoder = 9;
    s.precision = AD_F64;
    s.seed = 4;
    return s;
}

/* A blob that swings to and fro beside a margin, and every pair of it that has a next one. */
struct video {
    float pixels[FRAMES * FRAME];
    size_t first[SAMPLES];
    struct hnn_samples samples;
};

static void shoot_with(struct video *video, float margin)
{
    for (int t = 0; t < FRAMES; t++)
        for (int k = 0; k < FRAME; k++) {
            double x = k % SIDE - 1.5 - 1.2 * cos(0.3 * t), y = k / SIDE - 1.5;
            video->pixels[t * FRAME + k] =
                k % SIDE == 0 ? margin : (float)(0.5 * exp(-x * x - 0.4 * y * y));
        }
    for (size_t k = 0; k < SAMPLES; k++)
        video->first[k] = SAMPLES - 1 - k;
    video->samples = (struct hnn_samples){
        .n = SAMPLES, .frames = video->pixels, .first = video->first, .frame = FRAME};
}

static void shoot(struct video *video) { shoot_with(video, 0.01f); }

/* ---- the oracle ---- */

/* out = W in + b of the named map, added to what is there. */
static void map(const hnn_model *model, const char *name, const double *in, double *out)
{
    size_t n, found = 0;
    const struct hnn_block *block = hnn_model_blocks(model, &n);
    const double *values = hnn_model_parameters(model);
    for (size_t k = 0; k < n; k++) {
        const struct hnn_block *b = &block[k];
        if (strncmp(b->name, name, strlen(name)) != 0 || b->name[strlen(name)] != '.')
            continue;
        found++;
        for (size_t r = 0; r < b->rows; r++)
            for (size_t c = 0; c < b->cols; c++)
                out[r] += values[b->offset + r * b->cols + c] * (b->bias ? 1 : in[c]);
    }
    assert_int_equal(found, 2);
}

/* Half of the autoencoder, maps `first` ... first+3, one sample. */
static void code(const hnn_model *model, int first, const double *in, double *out, size_t n_out)
{
    double h[9] = {0}, z[9];
    for (int layer = 0; layer < 4; layer++) {
        char name[40];
        snprintf(name, sizeof name, "autoencoder.linear%d", first + layer);
        if (layer == 3) {
            memset(out, 0, n_out * sizeof *out);
            map(model, name, h, out);
            return;
        }
        memset(z, 0, sizeof z);
        map(model, name, layer ? h : in, z);
        for (int k = 0; k < 9; k++)
            h[k] = (layer ? h[k] : 0) + (z[k] > 0 ? z[k] : 0);
    }
}

/* The published loss of the pair that begins at frame `first`. */
static double loss_of(hnn_model *model, const float *frames)
{
    size_t n = hnn_model_settings(model)->dof;
    double x[PIXELS], next[PIXELS], back[PIXELS], z[4], z_next[4], field[4];
    double seen = 0, canonical = 0, moved = 0;
    for (int k = 0; k < PIXELS; k++) {
        x[k] = (double)frames[k];
        next[k] = (double)frames[FRAME + k];
    }
    code(model, 1, x, z, 2 * n);
    code(model, 1, next, z_next, 2 * n);
    code(model, 5, z, back, PIXELS);
    assert_int_equal(hnn_model_field(model, z, field), AD_OK);
    for (int k = 0; k < PIXELS; k++)
        seen += (x[k] - back[k]) * (x[k] - back[k]);
    for (size_t k = 0; k < n; k++)
        canonical += pow(z[n + k] - (z_next[k] - z[k]), 2);
    for (size_t k = 0; k < 2 * n; k++)
        moved += pow(z_next[k] - (z[k] + field[k]), 2);
    return seen / PIXELS + canonical / (double)n + 0.1 * moved / (2 * (double)n);
}

static void test_loss(void **state)
{
    (void)state;
    struct video video;
    shoot(&video);
    for (int which = 0; which < 4; which++) {
        struct hnn_settings s =
            settings_of(which % 2 ? HNN_HAMILTONIAN : HNN_BASELINE, which < 2 ? 1 : 2);
        hnn_model *model = small_model(&s);
        struct hnn_training training = hnn_pixel_training_defaults();
        assert_true(training.batch == 200 && training.steps == 10000); /* published */
        training.batch = 7;
        hnn_trainer *trainer = small_trainer(model, &training, &video.samples, &video.samples);
        double expected = 0;
        for (int k = 0; k < SAMPLES; k++)
            expected += loss_of(model, video.pixels + k * FRAME) / SAMPLES;
        assert_close(hnn_trainer_train_loss(trainer), expected, 1e-13, 0);
        assert_close(hnn_trainer_test_loss(trainer), expected, 1e-13, 0);
        hnn_trainer_free(trainer);
        hnn_model_free(model);
    }
}

/* ---- the gradient ---- */

static void test_gradient(void **state)
{
    (void)state;
    enum { N = 3 };
    struct video video;
    struct hnn_training training = hnn_pixel_training_defaults();
    double seen[(PIXELS + FRAME) * N], pixels[PIXELS * N];
    shoot(&video);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < PIXELS + FRAME; k++) {
            seen[i * (PIXELS + FRAME) + k] = (double)video.pixels[7 * i * FRAME + k];
            if (k < PIXELS)
                pixels[i * PIXELS + k] = (double)video.pixels[7 * i * FRAME + k];
        }
    for (int which = 0; which < 4; which++) {
        struct hnn_settings s =
            settings_of(which % 2 ? HNN_HAMILTONIAN : HNN_BASELINE, which < 2 ? 1 : 2);
        hnn_model *model = small_model(&s);
        ad_tape *tape = ad_tape_new(AD_F64);
        ad_var p = ad_input(tape, 1, hnn_model_size(model), "parameters");
        ad_var both = ad_const(tape, N, PIXELS + FRAME, seen);
        ad_var x = ad_const(tape, N, PIXELS, pixels);
        ad_var loss = ad_mean(hnn_record_losses(model, &training, p, both, x));
        struct ad_check report = {0};
        const double *at = hnn_model_parameters(model);
        enum ad_status status = ad_check_gradient(loss, 1, &p, &at, 2e-7, 0, &report);
        if (status != AD_OK || !report.passed)
            fail_msg("%s; entry %zu: %.12g on the tape, %.12g by differences",
                     ad_tape_error(tape)->message, report.col, report.tape, report.difference);
        assert_int_equal(report.entries, hnn_model_size(model));
        ad_tape_free(tape);
        hnn_model_free(model);
    }
}

/* ---- training ---- */

static struct hnn_training short_training(size_t steps)
{
    struct hnn_training training = hnn_pixel_training_defaults();
    training.steps = steps;
    training.batch = 16;
    training.every = 10;
    training.learning_rate = 3e-3;
    return training;
}

/* A dark margin takes no part: as if it were lit, but by next to nothing. Its weights are 0 then,
   where they would have decayed. */
static void test_dark_pixels(void **state)
{
    (void)state;
    struct video video[2];
    hnn_model *model[2];
    struct hnn_settings s = settings_of(HNN_HAMILTONIAN, 1);
    struct hnn_training training = short_training(12);
    double loss[2];
    for (int lit = 0; lit < 2; lit++) {
        shoot_with(&video[lit], lit ? 1e-37f : 0);
        model[lit] = small_model(&s);
        hnn_trainer *trainer =
            small_trainer(model[lit], &training, &video[lit].samples, &video[lit].samples);
        small_run(trainer);
        loss[lit] = 0;
        for (int k = 0; k < SAMPLES; k++)
            loss[lit] += loss_of(model[lit], video[lit].pixels + k * FRAME) / SAMPLES;
        assert_close(hnn_trainer_train_loss(trainer), loss[lit], 1e-13, 0);
        hnn_trainer_free(trainer);
    }
    assert_close(loss[0], loss[1], 1e-10, 0);
    const double *dark = hnn_model_parameters(model[0]), *lit = hnn_model_parameters(model[1]);
    for (size_t k = 0; k < hnn_model_size(model[0]); k++) {
        bool margin = k < 9 * PIXELS && k % SIDE == 0;
        assert_close(dark[k], margin ? 0 : lit[k], 1e-9, margin ? 0 : 1e-11);
        assert_true(!margin || fabs(lit[k]) > 0);
    }
    hnn_model_free(model[0]);
    hnn_model_free(model[1]);
}

/* Where all is dark nothing is left out; nor where an observation is not made of whole frames. */
static void test_nothing_to_see(void **state)
{
    (void)state;
    static float frames[FRAMES * FRAME];
    static size_t first[4] = {0, 1, 2, 3};
    for (size_t frame = FRAME; frame >= FRAME - 1; frame--) {
        struct hnn_samples samples = {.n = 4, .frames = frames, .first = first, .frame = frame};
        struct hnn_settings s = settings_of(HNN_BASELINE, 1);
        struct hnn_training training = short_training(3);
        training.batch = 2;
        hnn_model *model = small_model(&s);
        hnn_trainer *trainer = small_trainer(model, &training, &samples, &small_none);
        double before = hnn_trainer_train_loss(trainer);
        assert_close(before, loss_of(model, frames), 1e-13, 0);
        small_run(trainer);
        assert_true(hnn_trainer_train_loss(trainer) < before);
        hnn_trainer_free(trainer);
        hnn_model_free(model);
    }
}

static void test_training_halves_the_loss(void **state)
{
    (void)state;
    struct video video;
    shoot(&video);
    for (int type = AD_F32; type <= AD_F64; type++)
        for (int kind = HNN_BASELINE; kind <= HNN_HAMILTONIAN; kind++) {
            struct hnn_settings s = settings_of((enum hnn_kind)kind, 1);
            s.precision = (enum ad_type)type;
            hnn_model *model = small_model(&s);
            struct hnn_training training = short_training(150);
            hnn_trainer *trainer = small_trainer(model, &training, &video.samples, &video.samples);
            double before = hnn_trainer_train_loss(trainer);
            small_run(trainer);
            double after = hnn_trainer_train_loss(trainer);
            if (!(after < 0.5 * before))
                fail_msg("%s, %s: %g after %g", hnn_precisions[type], hnn_kinds[kind], after,
                         before);
            hnn_trainer_free(trainer);
            hnn_model_free(model);
        }
}

static struct path saved(hnn_trainer *trainer, const char *name)
{
    struct path file = files_temporary(name);
    struct ad_error error = {0};
    if (hnn_trainer_save(trainer, file.text, "leastaction train pixels.h5", &error) != AD_OK)
        fail_msg("%s", error.message);
    return file;
}

/* 10 steps and 7 more are 17, to the last bit of the file. */
static void test_resumes_bitwise(void **state)
{
    (void)state;
    struct video video;
    shoot_with(&video, 0);
    struct hnn_settings s = settings_of(HNN_HAMILTONIAN, 1);
    s.precision = AD_F32;
    struct hnn_training whole = short_training(17), part = short_training(10);
    hnn_model *model[2] = {small_model(&s), small_model(&s)};
    hnn_trainer *trainer = small_trainer(model[0], &whole, &video.samples, &video.samples);
    small_run(trainer);
    struct path expected = saved(trainer, "whole.h5");
    hnn_trainer_free(trainer);

    trainer = small_trainer(model[1], &part, &video.samples, &video.samples);
    small_run(trainer);
    struct path half = saved(trainer, "half.h5");
    hnn_trainer_free(trainer);
    trainer = small_trainer(model[1], &whole, &video.samples, &video.samples);
    struct ad_error error = {0};
    assert_int_equal(hnn_trainer_resume(trainer, half.text, &error), AD_OK);
    assert_int_equal(hnn_trainer_step(trainer), 10);
    small_run(trainer);
    struct path found = saved(trainer, "resumed.h5");
    hnn_trainer_free(trainer);

    files_are_same(expected.text, found.text);
    hnn_model_free(model[0]);
    hnn_model_free(model[1]);
}

/* ---- the model itself ---- */

static void test_encode_decode_and_files(void **state)
{
    (void)state;
    enum { N = 5 };
    struct video video;
    struct ad_error error = {0};
    shoot(&video);
    struct hnn_settings s = settings_of(HNN_HAMILTONIAN, 1);
    hnn_model *model = small_model(&s), *loaded;
    struct path file = files_temporary("pixels.h5");
    assert_int_equal(hnn_model_save(model, file.text, NULL, &error), AD_OK);
    assert_int_equal(hnn_model_load(file.text, &loaded, &error), AD_OK);
    double pixels[PIXELS * N], z[2 * N], back[PIXELS * N], one[PIXELS], latent[2], seen[PIXELS];
    for (int k = 0; k < PIXELS; k++)
        for (int i = 0; i < N; i++)
            pixels[i * PIXELS + k] = (double)video.pixels[i * FRAME + k];
    assert_int_equal(hnn_model_encode(loaded, N, pixels, z, &error), AD_OK);
    struct ad_error lost = {0};
    const double pixel = pixels[1];
    pixels[1] = (double)NAN;
    assert_int_equal(hnn_model_encode(loaded, N, pixels, z, &lost), AD_E_NONFINITE);
    assert_non_null(strstr(lost.message, "pixel 1 of sample 0"));
    pixels[1] = pixel;
    assert_int_equal(hnn_model_decode(loaded, N, z, back, &error), AD_OK);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < PIXELS; k++)
            one[k] = pixels[i * PIXELS + k];
        code(model, 1, one, latent, 2);
        code(model, 5, latent, seen, PIXELS);
        assert_close(z[i], latent[0], 1e-13, 1e-14);
        assert_close(z[N + i], latent[1], 1e-13, 1e-14);
        for (int k = 0; k < PIXELS; k++)
            assert_close(back[i * PIXELS + k], seen[k], 1e-13, 1e-14);
    }
    hnn_model_free(model);
    hnn_model_free(loaded);
}

static void test_refusals(void **state)
{
    (void)state;
    struct video video;
    shoot(&video);
    struct hnn_settings s = settings_of(HNN_HAMILTONIAN, 1), plain = hnn_defaults(HNN_BASELINE, 1);
    hnn_model *model = small_model(&s), *of_states = small_model(&plain), *none;
    struct hnn_samples states = small_pendulum(1, 10, 0);
    struct hnn_training training = short_training(1);
    hnn_trainer *trainer;
    struct ad_error error = {0};
    double x[PIXELS] = {0}, z[2] = {0};
    training.batch = 0;
    assert_int_equal(hnn_trainer_new(model, &training, &states, &states, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "pixels frames");
    error = (struct ad_error){0};
    struct hnn_samples other = video.samples;
    other.frame = FRAME / 2;
    assert_int_equal(hnn_trainer_new(model, &training, &video.samples, &other, &trainer, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "16 pixels 8");
    error = (struct ad_error){0};
    assert_int_equal(
        hnn_trainer_new(of_states, &training, &video.samples, &video.samples, &trainer, &error),
        AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_encode(of_states, 1, x, z, &error), AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_normalise(model, z, (double[]){1, 1}, (double[]){1, 1}, &error),
                     AD_E_ARGUMENT);
    s.autoencoder = 0;
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_new(&s, &none, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "autoencoder");
    small_samples_free(&states);
    hnn_model_free(model);
    hnn_model_free(of_states);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_loss),
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_dark_pixels),
        cmocka_unit_test(test_nothing_to_see),
        cmocka_unit_test(test_training_halves_the_loss),
        cmocka_unit_test(test_resumes_bitwise),
        cmocka_unit_test(test_encode_decode_and_files),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
