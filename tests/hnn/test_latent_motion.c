/* A26: the range of training of a model of pixels, and whether it moves as the data do. */
#include "small.h"
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixels.h"
#include "tests/close.h"

#include <math.h>
#include <string.h>

enum { SIDE = 6, AREA = SIDE * SIDE, FRAMES = 12 };

static struct hnn_frames video(struct hnn_split_pairs *pairs)
{
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames frames;
    struct ad_error error = {0};
    settings.trajectories = 5;
    settings.frames = FRAMES;
    settings.height = settings.width = SIDE;
    assert_int_equal(hnn_rod_video(&settings, 1, &frames, &error), AD_OK);
    assert_int_equal(hnn_frames_split(&frames, 0.2, 1, pairs, &error), AD_OK);
    return frames;
}

static hnn_model *trained(enum ad_type precision, const struct hnn_frames *frames,
                          const struct hnn_split_pairs *pairs)
{
    struct hnn_settings settings = hnn_pixel_defaults(HNN_HAMILTONIAN, 2 * AREA);
    settings.hidden[0] = settings.hidden[1] = settings.autoencoder = 8;
    settings.precision = precision;
    hnn_model *model = small_model(&settings);
    struct hnn_training training = hnn_pixel_training_defaults();
    training.steps = 40;
    training.batch = 0;
    struct hnn_samples samples = {
        .n = pairs->n_train, .frames = frames->pixels, .first = pairs->train, .frame = AREA};
    hnn_trainer *trainer = small_trainer(model, &training, &samples, NULL);
    small_run(trainer);
    hnn_trainer_free(trainer);
    return model;
}

/* Every training observation, encoded by itself, is within; each end is one of them. */
static void test_range(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct hnn_split_pairs pairs;
        struct hnn_frames frames = video(&pairs);
        hnn_model *model = trained(k ? AD_F32 : AD_F64, &frames, &pairs);
        struct hnn_range range = hnn_model_range(model);
        struct ad_error error = {0};
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, x[2];
        assert_non_null(range.low);
        for (size_t i = 0; i < pairs.n_train; i++) {
            assert_int_equal(
                hnn_observe(model, hnn_frames_pair(&frames, pairs.train[i]), x, &error), AD_OK);
            for (size_t c = 0; c < 2; c++) {
                low[c] = fmin(low[c], x[c]);
                high[c] = fmax(high[c], x[c]);
            }
        }
        for (size_t c = 0; c < 2; c++) {
            assert_close(range.low[c], low[c], 1e-5, 1e-6);
            assert_close(range.high[c], high[c], 1e-5, 1e-6);
        }
        assert_true(isfinite(range.low[2]) && range.low[2] < range.high[2]);
        hnn_model_free(model);
        hnn_split_pairs_free(&pairs);
        hnn_frames_free(&frames);
    }
}

/* The latent states of the data themselves, still, ten times as large, and shifted; and frames that
   do not move. */
static void test_verdicts(void **state)
{
    (void)state;
    static const struct {
        double scale, shift; /* shift: in widths of the range */
        bool still;
        enum hnn_motion_kind kind;
    } cases[] = {{1, 0, false, HNN_MOTION_AS_DATA},     {0, 0, false, HNN_MOTION_STANDS},
                 {0.1, 0, false, HNN_MOTION_STANDS},    {0.3, 0, false, HNN_MOTION_AS_DATA},
                 {1, 0, true, HNN_MOTION_STANDS},       {10, 0, false, HNN_MOTION_RUNS_AWAY},
                 {1, 2.5, false, HNN_MOTION_RUNS_AWAY}, {NAN, 0, false, HNN_MOTION_RUNS_AWAY}};
    struct hnn_split_pairs pairs;
    struct hnn_frames frames = video(&pairs);
    hnn_model *model = trained(AD_F64, &frames, &pairs);
    struct hnn_range range = hnn_model_range(model);
    struct ad_error error = {0};
    const float *shown = hnn_frames_pair(&frames, pairs.train[0]);
    double t[FRAMES - 1], x[2 * (FRAMES - 1)], z[2 * (FRAMES - 1)], mean[2] = {0};
    float still[FRAMES * AREA];
    for (size_t i = 0; i < FRAMES; i++)
        memcpy(still + i * AREA, shown, AREA * sizeof *still);
    for (size_t i = 0; i < FRAMES - 1; i++) {
        assert_int_equal(hnn_observe(model, shown + i * AREA, x + 2 * i, &error), AD_OK);
        mean[0] += x[2 * i] / (FRAMES - 1);
        mean[1] += x[2 * i + 1] / (FRAMES - 1);
    }
    struct hnn_path path = {.states = 2, .n = FRAMES - 1, .t = t, .x = z};
    struct hnn_latent_motion m;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        for (size_t i = 0; i < 2 * (FRAMES - 1); i++)
            z[i] = mean[i % 2] + cases[k].scale * (x[i] - mean[i % 2]) +
                   cases[k].shift * (range.high[i % 2] - range.low[i % 2]);
        assert_int_equal(hnn_latent_motion(model, FRAMES, AREA, shown, &path,
                                           cases[k].still ? still : shown, &m, &error),
                         AD_OK);
        if (m.kind != cases[k].kind)
            fail_msg("case %zu: %s", k, hnn_motion_names[m.kind]);
        if (isfinite(cases[k].scale))
            assert_close(m.latent, cases[k].scale * m.latent_data, 1e-9, 1e-12);
        assert_true(m.frames_data > 0.01);
        assert_close(m.frames, cases[k].still ? 0 : m.frames_data, 1e-12, 1e-7);
    }
    path.n = FRAMES - 2;
    assert_int_equal(hnn_latent_motion(model, FRAMES, AREA, shown, &path, shown, &m, &error),
                     AD_E_ARGUMENT);
    hnn_model_free(model);
    hnn_split_pairs_free(&pairs);
    hnn_frames_free(&frames);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_range),
                                       cmocka_unit_test(test_verdicts)};
    return cmocka_run_group_tests_name("motion of models of pixels", tests, NULL, NULL);
}
