/* The contract of the headers under wrong use: an error, never a crash. */
#include "small.h"
#include "hnn/data/data.h"
#include "hnn/pixels/latent.h"
#include "hnn/pixels/pixel_energy.h"
#include "hnn/pixels/pixels.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/train/train_speed.h"

/* ---- G2: NULL, and names that there are not ---- */

#define REFUSED(call)                                                                              \
    do {                                                                                           \
        struct ad_error error = {0};                                                               \
        if ((call) != AD_E_ARGUMENT || error.status != AD_E_ARGUMENT)                              \
            fail_msg("%s: %d '%s'", #call, error.status, error.message);                           \
    } while (0)

static void test_null(void **state)
{
    (void)state;
    hnn_model *model = small_model(&(struct hnn_settings){.size = sizeof(struct hnn_settings),
                                                          .kind = HNN_HAMILTONIAN,
                                                          .dof = 1,
                                                          .layers = 2,
                                                          .hidden = {4},
                                                          .activation = "tanh"});
    struct hnn_settings settings = *hnn_model_settings(model);
    struct hnn_samples samples = small_pendulum(1, 8, 0);
    struct hnn_training training = hnn_training_defaults();
    struct hnn_dataset data;
    struct hnn_path path, none = {0};
    struct phys_ode ode;
    struct hnn_rod rod = hnn_rod_published();
    struct hnn_frames frames = {0};
    struct hnn_rollout_settings rollout = {.size = sizeof rollout, .n = 2, .t = (double[]){0, 1}};
    struct hnn_observations o;
    struct hnn_score score;
    hnn_model *made;
    hnn_trainer *trainer;
    double x[2] = {0.5, 0}, y[2];
    float pixels[16] = {0};
    size_t n = 7;

    settings.activation = NULL;
    REFUSED(hnn_model_new(&settings, &made, &error));
    settings.activation = "tahn";
    REFUSED(hnn_model_new(&settings, &made, &error));
    REFUSED(hnn_model_new(NULL, &made, &error));
    struct ad_error why = {0};
    assert_int_equal(hnn_model_new(NULL, &made, &why), AD_E_ARGUMENT);
    assert_mentions(why.message, "hnn_model_new");
    REFUSED(hnn_model_new(&settings, NULL, &error));
    REFUSED(hnn_model_normalise(model, NULL, x, x, &error));
    REFUSED(hnn_model_normalise(NULL, x, x, x, &error));
    REFUSED(hnn_model_see(model, 1, NULL, &error));
    REFUSED(hnn_model_see(model, 0, x, &error));
    REFUSED(hnn_model_see(NULL, 1, x, &error));
    REFUSED(hnn_model_note(model, NULL, "a", &error));
    REFUSED(hnn_model_note(NULL, "a", "a", &error));
    REFUSED(hnn_model_evaluate(model, 1, NULL, x, NULL, &error));
    REFUSED(hnn_model_evaluate(NULL, 1, x, x, NULL, &error));
    REFUSED(hnn_model_ode(NULL, &ode, &error));
    REFUSED(hnn_model_ode(model, NULL, &error));
    REFUSED(hnn_model_encode(NULL, 1, x, y, &error));
    REFUSED(hnn_model_encode(model, 1, x, y, &error));
    REFUSED(hnn_model_decode(model, 1, NULL, y, &error));
    REFUSED(hnn_model_save(NULL, "x.h5", NULL, &error));
    REFUSED(hnn_model_save(model, NULL, NULL, &error));
    REFUSED(hnn_model_load(NULL, &made, &error));
    REFUSED(hnn_model_load("x.h5", NULL, &error));
    assert_int_equal(hnn_model_field(NULL, x, y), AD_E_ARGUMENT);
    assert_int_equal(hnn_model_field(model, x, NULL), AD_E_ARGUMENT);
    assert_true(isnan(hnn_model_energy(NULL, x)) && isnan(hnn_model_energy(model, NULL)));
    assert_null(hnn_model_settings(NULL));
    assert_null(hnn_model_parameters(NULL));
    assert_null(hnn_model_blocks(NULL, &n));
    assert_true(n == 0 && hnn_model_size(NULL) == 0 && !hnn_model_noted(NULL, "a") &&
                !hnn_model_noted(model, NULL) && !hnn_model_range(NULL).low);
    assert_non_null(hnn_model_blocks(model, NULL));
    hnn_rod_step(NULL, x, y);
    hnn_rod_step(&rod, x, NULL);
    hnn_times(0, 1, 2, NULL);
    hnn_model_set_parameters(NULL, x);
    hnn_model_set_parameters(model, NULL);
    hnn_model_evaluate_in(NULL, AD_F32);
    hnn_model_free(NULL);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var v = ad_input(tape, 2, 1, "x");
    hnn_model_record(NULL, v, v);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    ad_tape_free(tape);
    tape = ad_tape_new(AD_F64);
    v = ad_input(tape, 2, 1, "x");
    hnn_record_encode(model, v, v);
    hnn_record_decode(NULL, v, v);
    assert_int_not_equal(ad_tape_error(tape)->status, AD_OK);
    ad_tape_free(tape);

    REFUSED(hnn_trainer_new(NULL, &training, &samples, NULL, &trainer, &error));
    REFUSED(hnn_trainer_new(model, NULL, &samples, NULL, &trainer, &error));
    REFUSED(hnn_trainer_new(model, &training, NULL, NULL, &trainer, &error));
    REFUSED(hnn_trainer_new(model, &training, &samples, NULL, NULL, &error));
    struct hnn_samples lacks[] = {samples, samples};
    lacks[0].x = lacks[1].target = NULL;
    for (size_t k = 0; k < 2; k++) {
        REFUSED(hnn_trainer_new(model, &training, &lacks[k], NULL, &trainer, &error));
        REFUSED(hnn_trainer_new(model, &training, &samples, &lacks[k], &trainer, &error));
    }
    struct hnn_settings of_pixels = hnn_pixel_defaults(HNN_HAMILTONIAN, 32);
    of_pixels.hidden[0] = of_pixels.hidden[1] = of_pixels.autoencoder = 4;
    hnn_model *watcher = NULL;
    struct ad_error fine = {0};
    assert_int_equal(hnn_model_new(&of_pixels, &watcher, &fine), AD_OK);
    const float video[64] = {0};
    const struct hnn_samples nothing = {.n = 1, .frames = video, .first = (size_t[]){0}};
    REFUSED(hnn_trainer_new(watcher, &training, &nothing, NULL, &trainer, &error));
    hnn_model_free(watcher);
    hnn_model_component(model, 0, NULL, 9);
    REFUSED(hnn_video_motion(NULL, NULL, NULL, NULL, &error));
    REFUSED(hnn_rod_video(NULL, 0, NULL, &error));
    assert_null(hnn_trainer_history(NULL, NULL));
    training.schedule = NULL;
    REFUSED(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error));
    training = hnn_training_defaults();
    training.optimiser = NULL;
    REFUSED(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error));
    REFUSED(hnn_trainer_run(NULL, NULL, &error));
    REFUSED(hnn_trainer_take_step(NULL, &error));
    REFUSED(hnn_trainer_save(NULL, "x.h5", NULL, &error));
    REFUSED(hnn_trainer_resume(NULL, "x.h5", &error));
    assert_true(hnn_trainer_step(NULL) == 0 && hnn_trainer_steps_now(NULL) == 0);
    assert_true(isnan(hnn_trainer_test_loss(NULL)) && isnan(hnn_trainer_train_loss(NULL)));
    assert_true(isnan(hnn_trainer_product_share(NULL)) && hnn_trainer_seconds(NULL) == 0);
    assert_null(hnn_trainer_history(NULL, &n));
    hnn_trainer_free(NULL);
    assert_null(hnn_optimiser_name(NULL));

    REFUSED(hnn_dataset_read(NULL, &data, &error));
    REFUSED(hnn_dataset_read(
        &(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings)}, &data,
        &error));
    REFUSED(hnn_dataset_read(
        &(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings), .file = "x"},
        NULL, &error));
    REFUSED(hnn_dataset_read(
        &(struct hnn_dataset_settings){
            .size = sizeof(struct hnn_dataset_settings), .file = "x", .split = 7},
        &data, &error));
    REFUSED(hnn_dataset_read(
        &(struct hnn_dataset_settings){
            .size = sizeof(struct hnn_dataset_settings), .file = "x", .differences = 7},
        &data, &error));
    hnn_dataset_free(NULL);
    REFUSED(hnn_task_ode(NULL, 0, &ode, &error));
    REFUSED(hnn_task_observe(NULL, &hnn_tasks[0]->published, 0, &o, &error));
    REFUSED(hnn_task_observe(hnn_tasks[0], NULL, 0, &o, &error));
    hnn_task_start(NULL, 0, 0, x);
    hnn_task_start(hnn_tasks[0], 0, 0, NULL);
    hnn_observations_free(NULL);

    struct ad_error good = {0};
    assert_int_equal(hnn_model_ode(model, &ode, &good), AD_OK);
    assert_int_equal(hnn_rollout(&ode, &rollout, x, &path, NULL, &good), AD_OK);
    REFUSED(hnn_rollout(NULL, &rollout, x, &none, NULL, &error));
    REFUSED(hnn_rollout(&ode, NULL, x, &none, NULL, &error));
    REFUSED(hnn_rollout(&ode, &rollout, NULL, &none, NULL, &error));
    REFUSED(hnn_rollout(&ode, &rollout, x, NULL, NULL, &error));
    REFUSED(hnn_rollout(
        &ode, &(struct hnn_rollout_settings){.size = sizeof(struct hnn_rollout_settings), .n = 2},
        x, &none, NULL, &error));
    REFUSED(hnn_path_read(NULL, 0, 1, &none, &error));
    REFUSED(hnn_path_read(
        &(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings), .time = "t"}, 0,
        1, &none, &error));
    REFUSED(hnn_path_read(
        &(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings), .file = "x"}, 0,
        1, &none, &error));
    REFUSED(hnn_task_trials(NULL, hnn_tasks[0],
                            &(struct hnn_trials){.size = sizeof(struct hnn_trials)}, &score,
                            &error));
    REFUSED(hnn_task_trials(&ode, NULL, &(struct hnn_trials){.size = sizeof(struct hnn_trials)},
                            &score, &error));
    REFUSED(hnn_task_trials(&ode, hnn_tasks[0], NULL, &score, &error));
    REFUSED(hnn_task_published_mse(NULL, 0, &ode, &rollout, &path, &path, x, &error));
    /* G10: other shapes are no distance of 0 */
    struct hnn_path shorter = path;
    shorter.n = 1;
    assert_true(isnan(hnn_path_mse(&path, &shorter)) && isnan(hnn_path_mse(&path, NULL)));
    assert_true(isnan(hnn_path_mse(&path, &none)) && hnn_path_mse(&path, &path) == 0);
    assert_true(isnan(hnn_path_square(&path, &path, 2)) &&
                isnan(hnn_energy_mse(&ode, &path, &none)));
    assert_true(isnan(hnn_path_energy(&ode, &path, 2)) && isnan(hnn_path_energy(NULL, &path, 0)));
    assert_true(isnan(hnn_energy_drift(&ode, NULL, &rollout)));
    assert_int_equal(hnn_path_outside(NULL, &path, (char[8]){""}, 8), 0);
    hnn_path_free(&path);
    hnn_path_free(NULL);

    enum hnn_filter filter;
    REFUSED(hnn_filter_find(NULL, &filter, &error));
    REFUSED(hnn_filter_find("area", NULL, &error));
    REFUSED(hnn_rod_check(NULL, &error));
    REFUSED(hnn_frames_read(NULL, &frames, &error));
    REFUSED(hnn_frames_read("x", NULL, &error));
    REFUSED(hnn_frames_split(NULL, 0.2, 0, &(struct hnn_split_pairs){0}, &error));
    REFUSED(hnn_frames_split(&frames, 0.2, 0, NULL, &error));
    REFUSED(hnn_rod_video(NULL, 0, &frames, &error));
    const struct hnn_task *two = hnn_task_find("twobody", &good);
    REFUSED(hnn_bodies_video(NULL, NULL, 4, 4, HNN_AREA, 0, &frames, &error));
    REFUSED(hnn_bodies_video(two, &two->published, 4, 4, (enum hnn_filter)7, 0, &frames, &error));
    REFUSED(hnn_bodies_video(two, &two->published, 0, 4, HNN_AREA, 0, &frames, &error));
    REFUSED(hnn_rod_angles(NULL, 4, 4, 1, pixels, x, &error));
    rod.filter = (enum hnn_filter)7;
    hnn_rod_draw(&rod, 0, 4, 4, pixels);
    REFUSED(hnn_rod_angles(&rod, 4, 4, 1, pixels, x, &error));
    REFUSED(hnn_pixels_predict(NULL, pixels, &rollout, 4, &none, pixels, NULL, &error));
    REFUSED(hnn_observe(model, NULL, x, &error));
    REFUSED(hnn_show(model, NULL, 4, pixels, &error));
    assert_true(isnan(hnn_rod_energy(NULL, 0, 0)));
    hnn_rod_energies(NULL, 3, x, x);
    REFUSED(hnn_video_energies(NULL, 3, pixels, x, &error));
    REFUSED(hnn_video_energies(&frames, 3, NULL, x, &error));
    assert_int_equal(hnn_video_begin(NULL, 0, 3, pixels, x), 0);
    assert_true(isnan(hnn_video_energy_mean(3, NULL, 0, 3, 0, 1)));
    assert_true(isnan(hnn_video_mse(1, 4, NULL, pixels)));
    REFUSED(hnn_frames_save(NULL, "x.h5", &error));
    REFUSED(hnn_frames_save(&frames, "x.h5", &error));
    hnn_frames_free(NULL);
    hnn_split_pairs_free(NULL);
    phys_ode_free(&ode);
    small_samples_free(&samples);
    hnn_model_free(model);
}

/* The documented idiom: what a find says is what the call says. */
static void test_held_errors(void **state)
{
    (void)state;
    struct hnn_settings settings = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_samples samples = small_pendulum(1, 8, 0);
    hnn_model *model = small_model(&settings);
    hnn_trainer *trainer;
    struct phys_ode ode;
    struct hnn_path path;
    double x[2] = {0.5, 0};
    for (int k = 0; k < 4; k++) {
        struct ad_error error = {0};
        struct hnn_training training = hnn_training_defaults();
        if (k == 0)
            training.schedule = hnn_schedule_find("cosin", &error);
        if (k == 1)
            training.optimiser = hnn_optimiser_find("adm", &error);
        if (k < 2)
            assert_int_equal(hnn_trainer_new(model, &training, &samples, NULL, &trainer, &error),
                             AD_E_ARGUMENT);
        if (k == 2)
            assert_int_equal(hnn_task_ode(hnn_task_find("sprin", &error), 0, &ode, &error),
                             AD_E_ARGUMENT);
        if (k == 3) {
            assert_int_equal(hnn_model_ode(model, &ode, &error), AD_OK);
            struct hnn_rollout_settings s = {.size = sizeof s,
                                             .integrator = phys_integrator_find("dop85", &error),
                                             .n = 2,
                                             .t = (double[]){0, 1}};
            assert_int_equal(hnn_rollout(&ode, &s, x, &path, NULL, &error), AD_E_ARGUMENT);
            phys_ode_free(&ode);
        }
        assert_mentions(error.message, "did you mean");
    }
    small_samples_free(&samples);
    hnn_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_null),
        cmocka_unit_test(test_held_errors),
    };
    return cmocka_run_group_tests_name("the contract of hnn.h", tests, files_setup, files_teardown);
}
