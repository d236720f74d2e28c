/* Rollouts from a data set: targets some steps ahead, of the same trajectory. */
#include "datasets.h"
#include "tests/close.h"
#include "tests/files.h"

static void test_rollouts(void **state)
{
    (void)state;
    struct path file = dataset_rows("rollout.csv", 60, 15);
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .time = "t", .rollout = 3, .test_fraction = 0.25};
    struct hnn_dataset d = dataset_of(&s);
    assert_close(d.dt, 0.25, 0, 0);
    assert_true(d.rate[0] == 4 && d.rate[1] == 4); /* a row on, in .25 */
    const struct hnn_samples *parts[] = {&d.train, &d.test};
    for (size_t part = 0; part < 2; part++)
        for (size_t i = 0; i < parts[part]->n; i++) {
            size_t n = parts[part]->n;
            double q = parts[part]->x[i];
            assert_true((size_t)q / 15 == (size_t)(q + 3) / 15);
            for (size_t k = 1; k <= 3; k++) {
                assert_true(parts[part]->target[(k - 1) * 2 * n + i] == q + (double)k);
                assert_true(parts[part]->target[((k - 1) * 2 + 1) * n + i] == -q - (double)k);
            }
        }
    assert_int_equal(d.test.n, 12); /* of 4 (15 - 3), all in the last trajectory */
    assert_true(d.test.x[0] == 45);
    assert_int_equal(d.train.n, 36);
    hnn_dataset_free(&d);
}

/* No target of the training is a state of the test. */
static void test_rollouts_do_not_see_the_test(void **state)
{
    (void)state;
    struct path file = dataset_rows("rollout.csv", 60, 60);
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .rollout = 3, .dt = 0.1, .test_fraction = 0.25};
    struct hnn_dataset d = dataset_of(&s);
    assert_close(d.dt, 0.1, 0, 0);
    assert_true(d.train.x[d.train.n - 1] + 3 < d.test.x[0]);
    assert_true(d.train.x[d.train.n - 1] + 4 == d.test.x[0]);
    hnn_dataset_free(&d);
    s.split = HNN_SPLIT_RANDOM;
    dataset_refused(&s, AD_E_ARGUMENT, "rollouts share states");
    s.dt = 0;
    dataset_refused(&s, AD_E_ARGUMENT, "rollouts time column step");
}

/* C5: every pair has a time step of its own; gaps end a rollout, a wrong --dt is told. */
static void test_uneven_steps(void **state)
{
    (void)state;
    struct path file = files_write_text(
        "uneven.csv", "t,q,p\n0,1,2\n1,2,3\n2.5,1,1\n4,1,4\n9,1,1\n10,2,2\n11,0,0\n");
    struct hnn_dataset d = dataset_of(&(struct hnn_dataset_settings){
        .size = sizeof(struct hnn_dataset_settings), .file = file.text, .time = "t", .rollout = 2});
    assert_int_equal(d.train.n, 3); /* from 0, 1 and 9: 2.5 to 9 crosses the gap of 5 */
    static const double steps[] = {1, 1.5, 1, 1.5, 1.5, 1};
    for (size_t k = 0; k < 6; k++)
        assert_close(d.train.steps[k], steps[k], 1e-15, 0);
    assert_int_equal(d.gaps, 1);
    hnn_dataset_free(&d);
    file = dataset_rows("even.csv", 9, 9);
    dataset_refused(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                   .file = file.text,
                                                   .time = "t",
                                                   .rollout = 1,
                                                   .dt = 0.5},
                    AD_E_ARGUMENT, "0.25 0.5");
}

/* A model is normalised by means, deviations and the rates of first steps, here by hand. */
static void test_normalised_by_rollouts(void **state)
{
    (void)state;
    struct path file = files_write_text("steps.csv", "t,q,p\n0,1,2\n1,2,5\n3,1,1\n");
    struct hnn_dataset d = dataset_of(&(struct hnn_dataset_settings){
        .size = sizeof(struct hnn_dataset_settings), .file = file.text, .time = "t", .rollout = 1});
    struct hnn_settings settings = hnn_defaults(HNN_BASELINE, 1);
    settings.hidden[0] = settings.hidden[1] = 4;
    double rate[2][2];
    for (int k = 0; k < 2; k++) {
        struct ad_error error = {0};
        hnn_model *model;
        assert_int_equal(hnn_model_new(&settings, &model, &error), AD_OK);
        if (k == 0)
            hnn_dataset_normalise(&d, model, &error);
        else
            hnn_model_normalise(model, (double[]){1.5, 3.5}, (double[]){0.5, 1.5},
                                (double[]){sqrt((1 + 0.25) / 2), sqrt((9 + 4) / 2.0)}, &error);
        assert_int_equal(error.status, AD_OK);
        assert_int_equal(hnn_model_field(model, (double[]){0.3, -0.7}, rate[k]), AD_OK);
        hnn_model_free(model);
    }
    assert_close(rate[0][0], rate[1][0], 1e-12, 0);
    assert_close(rate[0][1], rate[1][1], 1e-12, 0);
    hnn_dataset_free(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rollouts),
        cmocka_unit_test(test_rollouts_do_not_see_the_test),
        cmocka_unit_test(test_uneven_steps),
        cmocka_unit_test(test_normalised_by_rollouts),
    };
    return cmocka_run_group_tests_name("data sets", tests, files_setup, files_teardown);
}
