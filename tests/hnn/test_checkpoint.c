/* Model files: what is written is read back; damaged and foreign files are refused. */
#include "small.h"
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/train/train.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

static struct path written(hnn_model *model, const char *name)
{
    struct path file = files_temporary(name);
    struct ad_error error = {0};
    if (hnn_model_save(model, file.text, "leastaction train x.csv", &error) != AD_OK)
        fail_msg("%s", error.message);
    return file;
}

static hnn_model *loaded(const char *file)
{
    struct ad_error error = {0};
    hnn_model *model;
    if (hnn_model_load(file, &model, &error) != AD_OK)
        fail_msg("%s", error.message);
    return model;
}

static void test_round_trip(void **state)
{
    (void)state;
    static const double centre[4] = {0.1, -2, 3, 1e-5}, scale[4] = {1, 2, 3, 4},
                        rate[4] = {5, 6, 7, 1e-9}, x[4] = {0.3, -0.4, 0.5, 0.6};
    for (int type = AD_F32; type <= AD_F64; type++)
        for (size_t k = 0; k < small_n_kinds; k++) {
            struct ad_error error = {0};
            struct hnn_settings s = small_settings(&small_kinds[k], 2, k + 1);
            s.precision = (enum ad_type)type;
            s.seed = UINT64_MAX - k;
            s.activation = hnn_activations[k % 6 == 1 ? 0 : k % 6].name; /* relu is not for lnn */
            s.start = (enum hnn_start)(k % 3);
            hnn_model *model = small_model(&s);
            if (k % 2)
                assert_int_equal(hnn_model_normalise(model, centre, scale, rate, &error), AD_OK);
            assert_int_equal(hnn_model_note(model, "state", "q1,q2,p1,p2", &error), AD_OK);
            hnn_model *back = loaded(written(model, "model.h5").text);
            const struct hnn_settings *t = hnn_model_settings(back);
            assert_int_equal(t->seed, s.seed);
            assert_string_equal(t->activation, s.activation);
            assert_true(t->angles == s.angles && t->quadratic == s.quadratic);
            assert_int_equal(t->start, s.start);
            assert_int_equal(hnn_model_size(back), hnn_model_size(model));
            assert_memory_equal(hnn_model_parameters(back), hnn_model_parameters(model),
                                hnn_model_size(model) * hnn_type_bytes(s.precision));
            assert_string_equal(hnn_model_noted(back, "state"), "q1,q2,p1,p2");
            assert_null(hnn_model_noted(back, "rate"));
            double a[4], b[4];
            hnn_model_field(model, x, a);
            hnn_model_field(back, x, b);
            assert_memory_equal(a, b, sizeof a);
            hnn_model_free(model);
            hnn_model_free(back);
        }
}

static void refused(const char *file, const char *why)
{
    struct ad_error error = {0};
    hnn_model *model;
    enum ad_status status = hnn_model_load(file, &model, &error);
    assert_null(model);
    assert_mentions(error.message, file);
    assert_mentions(error.message, why);
    assert_int_equal(status, AD_E_INPUT);
}

static void test_foreign(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct path file = files_temporary("foreign.h5");
    phys_hdf5 *run;
    refused(files_temporary("absent.h5").text, "absent.h5");
    refused(files_write_text("text.h5", "q,p\n1,2\n").text, "HDF5");
    assert_int_equal(phys_hdf5_create(file.text, &run, &error), AD_OK);
    phys_hdf5_text(run, "/", "scene", "pendulum");
    assert_int_equal(phys_hdf5_commit(run, &error), AD_OK);
    refused(file.text, "model");
    assert_int_equal(phys_hdf5_create(file.text, &run, &error), AD_OK);
    phys_hdf5_text(run, "/", "format", "leastaction model");
    phys_hdf5_integer(run, "/", "version", 2, NULL);
    assert_int_equal(phys_hdf5_commit(run, &error), AD_OK);
    refused(file.text, "version");
}

static void test_truncated(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[1], 2, 3);
    hnn_model *model = small_model(&s);
    struct path whole = written(model, "whole.h5");
    size_t size;
    char *bytes = files_read(whole.text, &size);
    for (size_t length = 0; length < size; length += 97)
        refused(files_write("cut.h5", bytes, length).text, "");
    free(bytes);
    hnn_model_free(model);
}

/* No byte of the parameters changes unnoticed. */
static void test_changed_parameters(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[1], 2, 3);
    hnn_model *model = small_model(&s);
    struct path whole = written(model, "whole.h5");
    size_t size, n, changed = 0;
    char *bytes = files_read(whole.text, &size);
    const struct hnn_block *blocks = hnn_model_blocks(model, &n);
    const char *parameters = hnn_model_parameters(model);
    for (size_t k = 0; k < n; k++) {
        size_t length = blocks[k].rows * blocks[k].cols * sizeof(double);
        for (size_t at = 0; at + length <= size; at++)
            if (memcmp(bytes + at, parameters + blocks[k].offset * sizeof(double), length) == 0) {
                bytes[at + length / 2] ^= 1;
                refused(files_write("changed.h5", bytes, size).text, "damaged");
                bytes[at + length / 2] ^= 1;
                changed++;
                break;
            }
    }
    assert_int_equal(changed, n);
    free(bytes);
    hnn_model_free(model);
}

/* Any byte changed: an error or a model, never worse; what loads has the same parameters. */
static void test_changed_bytes(void **state)
{
    (void)state;
    struct hnn_settings s = small_settings(&small_kinds[5], 1, 2);
    hnn_model *model = small_model(&s);
    struct path whole = written(model, "whole.h5");
    size_t size, refusals = 0;
    char *bytes = files_read(whole.text, &size);
    for (size_t at = 0; at < size; at += 13) {
        struct ad_error error = {0};
        hnn_model *back;
        bytes[at] ^= 0x55;
        struct path file = files_write("changed.h5", bytes, size);
        bytes[at] ^= 0x55;
        if (hnn_model_load(file.text, &back, &error) != AD_OK) {
            assert_true(error.message[0] && !back);
            refusals++;
        } else if (hnn_model_size(back) == hnn_model_size(model)) {
            assert_memory_equal(hnn_model_parameters(back), hnn_model_parameters(model),
                                hnn_model_size(model) * sizeof(double));
        }
        hnn_model_free(back);
    }
    assert_true(refusals > 20);
    free(bytes);
    hnn_model_free(model);
}

/* ---- resuming from what does not belong ---- */

struct setting {
    struct hnn_settings model;
    struct hnn_training training;
    uint64_t data;
};

static hnn_trainer *trainer_of(const struct setting *setting, hnn_model **model,
                               struct hnn_samples *train)
{
    const struct hnn_samples none = {.n = 0};
    struct ad_error error = {0};
    hnn_trainer *trainer;
    *train = small_pendulum(setting->data, 40, 0);
    *model = small_model(&setting->model);
    if (hnn_trainer_new(*model, &setting->training, train, &none, &trainer, &error) != AD_OK)
        fail_msg("%s", error.message);
    return trainer;
}

static void resume_refused(const struct setting *setting, const char *file, const char *why)
{
    struct ad_error error = {0};
    struct hnn_samples train;
    hnn_model *model;
    hnn_trainer *trainer = trainer_of(setting, &model, &train);
    enum ad_status status = hnn_trainer_resume(trainer, file, &error);
    assert_mentions(error.message, why);
    assert_int_equal(status, *why ? AD_E_INPUT : AD_OK);
    hnn_trainer_free(trainer);
    small_samples_free(&train);
    hnn_model_free(model);
}

static void test_resume_of_others(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct setting good = {.model = small_settings(&small_kinds[1], 1, 3),
                           .training = hnn_training_defaults(),
                           .data = 1},
                   s;
    struct path file = files_temporary("training.h5");
    enum hnn_stop stop;
    struct hnn_samples train;
    hnn_model *model;
    good.training.steps = 20;
    good.training.batch = 6;
    hnn_trainer *trainer = trainer_of(&good, &model, &train);
    assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_OK);
    assert_int_equal(hnn_trainer_save(trainer, file.text, NULL, &error), AD_OK);
    hnn_trainer_free(trainer);
    small_samples_free(&train);
    resume_refused(&good, file.text, "");
    resume_refused((s = good, s.training.steps = 50, &s), file.text, "");
    resume_refused((s = good, s.model.hidden[1] = 6, &s), file.text, "settings");
    resume_refused((s = good, s.model.seed++, &s), file.text, "settings");
    resume_refused((s = good, s.training.learning_rate *= 2, &s), file.text, "learning_rate");
    resume_refused((s = good, s.training.batch = 0, &s), file.text, "batch");
    resume_refused((s = good, s.data = 2, &s), file.text, "data");
    resume_refused(&good, written(model, "plain.h5").text, "find attribute");
    hnn_model_free(model);
}

/* Nor one of the optimiser's moments. */
static void test_changed_training(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct setting good = {.model = small_settings(&small_kinds[1], 1, 3),
                           .training = hnn_training_defaults(),
                           .data = 1};
    struct path file = files_temporary("training.h5");
    enum hnn_stop stop;
    struct hnn_samples train;
    hnn_model *model;
    good.training.steps = 20;
    hnn_trainer *trainer = trainer_of(&good, &model, &train);
    assert_int_equal(hnn_trainer_run(trainer, &stop, &error), AD_OK);
    assert_int_equal(hnn_trainer_save(trainer, file.text, NULL, &error), AD_OK);
    size_t size, n;
    enum ad_type type = AD_F64;
    const double *moments = good.training.optimiser->state(trainer->method, &n, &type);
    char *bytes = files_read(file.text, &size), *at = bytes;
    while (at + 8 * n <= bytes + size && memcmp(at, moments, 8 * n) != 0)
        at++;
    assert_true(at + 8 * n <= bytes + size);
    at[8 * (n - 1)] ^= 1;
    resume_refused(&good, files_write("changed.h5", bytes, size).text, "damaged");
    free(bytes);
    hnn_trainer_free(trainer);
    small_samples_free(&train);
    hnn_model_free(model);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),       cmocka_unit_test(test_foreign),
        cmocka_unit_test(test_truncated),        cmocka_unit_test(test_changed_parameters),
        cmocka_unit_test(test_changed_bytes),    cmocka_unit_test(test_resume_of_others),
        cmocka_unit_test(test_changed_training),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
