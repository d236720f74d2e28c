/* Prediction in the latent space: the first frame is the decoded observation, the path that of the
   field, energy can be added on the way. */
#include "small.h"
#include "tests/close.h"
#include "hnn/pixels/latent.h"
#include "tests/mentions.h"

enum { FRAME = 6, PIXELS = 2 * FRAME, N = 21 };

static hnn_model *model_of(enum hnn_kind kind, enum ad_type precision)
{
    struct hnn_settings s = hnn_pixel_defaults(kind, PIXELS);
    s.hidden[0] = s.hidden[1] = 12;
    s.autoencoder = 9;
    s.precision = precision;
    s.seed = 5;
    return small_model(&s);
}

static void observation(float pixels[PIXELS])
{
    for (int k = 0; k < PIXELS; k++)
        pixels[k] = (float)(0.5 + 0.4 * sin(1.3 * k));
}

static void test_foresee(void **state)
{
    (void)state;
    for (int which = 0; which < 4; which++) {
        hnn_model *model =
            model_of(which % 2 ? HNN_HAMILTONIAN : HNN_BASELINE, which < 2 ? AD_F32 : AD_F64);
        struct ad_error error = {0};
        struct hnn_path path, plain;
        struct hnn_rollout_info info;
        struct phys_ode ode;
        float pixels[PIXELS], frames[N * FRAME];
        double t[N], pair[PIXELS], z[2], seen[PIXELS];
        observation(pixels);
        hnn_times(0, N - 1, N, t);
        struct hnn_rollout_settings s = {.size = sizeof s, .n = N, .t = t};
        assert_int_equal(hnn_pixels_predict(model, pixels, &s, FRAME, &path, frames, &info, &error),
                         AD_OK);
        assert_true(path.n == N && path.states == 2 && info.evaluations > 0);

        for (int k = 0; k < PIXELS; k++)
            pair[k] = (double)pixels[k];
        assert_int_equal(hnn_model_encode(model, 1, pair, z, &error), AD_OK);
        assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
        assert_int_equal(hnn_rollout(&ode, &s, z, &plain, &info, &error), AD_OK);
        assert_memory_equal(path.x, plain.x, 2 * N * sizeof(double));
        for (int i = 0; i < N; i += N - 1) {
            assert_int_equal(hnn_model_decode(model, 1, path.x + 2 * i, seen, &error), AD_OK);
            for (int k = 0; k < FRAME; k++)
                assert_close((double)frames[i * FRAME + k], seen[k], 1e-5, 1e-6);
        }
        hnn_path_free(&path);
        hnn_path_free(&plain);
        phys_ode_free(&ode);
        hnn_model_free(model);
    }
}

static void test_added_energy(void **state)
{
    (void)state;
    hnn_model *model = model_of(HNN_HAMILTONIAN, AD_F64);
    struct ad_error error = {0};
    struct hnn_path path;
    struct hnn_rollout_info info;
    float pixels[PIXELS], frames[N * FRAME];
    double t[N];
    observation(pixels);
    hnn_times(0, N - 1, N, t);
    struct hnn_rollout_settings s = {.size = sizeof s, .n = N, .t = t, .add = 0.05, .add_at = 10};
    if (hnn_pixels_predict(model, pixels, &s, FRAME, &path, frames, &info, &error) != AD_OK)
        fail_msg("%s", error.message);
    double H = hnn_model_energy(model, path.x);
    for (int i = 0; i < N; i++)
        assert_close(hnn_model_energy(model, path.x + 2 * i) - H, i <= 10 ? 0 : 0.05, 0, 1e-8);
    hnn_path_free(&path);
    hnn_model_free(model);
}

static void test_refusals(void **state)
{
    (void)state;
    struct hnn_settings states = hnn_defaults(HNN_HAMILTONIAN, 1);
    hnn_model *model = model_of(HNN_HAMILTONIAN, AD_F64), *of_states = small_model(&states);
    struct ad_error error = {0};
    struct hnn_path path;
    struct hnn_rollout_info info;
    float pixels[PIXELS], frames[2 * FRAME];
    double t[2] = {0, 1};
    observation(pixels);
    struct hnn_rollout_settings s = {.size = sizeof s, .n = 2, .t = t};
    assert_int_equal(hnn_pixels_predict(of_states, pixels, &s, FRAME, &path, frames, &info, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "autoencoder");
    error = (struct ad_error){0};
    assert_int_equal(
        hnn_pixels_predict(model, pixels, &s, PIXELS + 1, &path, frames, &info, &error),
        AD_E_ARGUMENT);
    assert_null(path.x);
    error = (struct ad_error){0};
    double x[2] = {0.1, 0.2};
    float shown[PIXELS + 1];
    const struct hnn_path one = {.n = 1, .states = 2, .x = x};
    assert_int_equal(hnn_show(model, &one, PIXELS, shown, &error), AD_OK);
    assert_int_equal(hnn_show(model, &one, PIXELS + 1, shown, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "12 13");
    hnn_model_free(model);
    hnn_model_free(of_states);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_foresee),
        cmocka_unit_test(test_added_energy),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
