/* Columns that are inputs: the time, parameters, controls. */
#include "hnn/data/data.h"
#include "tests/close.h"
#include "tests/mentions.h"

static const double columns[][6] = {
    {1, 2, 3, 4, 5, 6},       /* q */
    {7, 8, 9, 10, 11, 12},    /* p */
    {0, 1, 2, 0, 1, 2},       /* t */
    {5, 5, 5, 6, 6, 6},       /* g */
    {.1, .2, .3, .4, .5, .6}, /* u */
};
static const char *const names[] = {"q", "p", "t", "g", "u"};

static enum ad_status read(const struct hnn_dataset_settings *s, struct hnn_dataset *data,
                           struct ad_error *error)
{
    const double *column[5];
    for (size_t k = 0; k < 5; k++)
        column[k] = columns[k];
    struct hnn_columns all = {5, 6, column, names};
    struct hnn_dataset_settings with = *s;
    with.size = sizeof with;
    with.columns = &all;
    *error = (struct ad_error){0};
    return hnn_dataset_read(&with, data, error);
}

static void test_data(void **state)
{
    (void)state;
    struct hnn_dataset data;
    struct ad_error error;
    struct hnn_dataset_settings s = {
        .state = "q,p", .time = "t", .rollout = 1, .inputs = "g,t", .controls = "u"};
    assert_int_equal(read(&s, &data, &error), AD_OK);
    assert_true(data.inputs == 3 && data.controls == 1 && data.timed && !data.varied);
    assert_string_equal(data.input_names, "t,g,u");
    assert_int_equal(data.train.n, 4);
    static const double rows[] = {0, 1, 0, 1, 5, 5, 6, 6, .1, .2, .4, .5,
                                  1, 2, 1, 2, 5, 5, 6, 6, .2, .3, .5, .6};
    assert_memory_equal(data.train.x + 2 * 4, rows, sizeof rows);
    assert_true(data.train.target[0] == 2 && data.train.steps[0] == 1);
    assert_close(data.centre[3], 5.5, 1e-15, 0);
    hnn_dataset_free(&data);
    static const struct {
        const char *state, *inputs, *controls, *says;
    } wrong[] = {
        {NULL, "g", NULL, "state"},     {"q,p", "h", NULL, "'h'"},      {"q,p", "g", "g", "twice"},
        {"q,p", "p", NULL, "column 2"}, {"q,p", NULL, "t", "column 3"},
    };
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct hnn_dataset_settings w = {.state = wrong[k].state,
                                         .time = "t",
                                         .inputs = wrong[k].inputs,
                                         .controls = wrong[k].controls};
        assert_true(read(&w, &data, &error) != AD_OK);
        assert_mentions(error.message, wrong[k].says);
        hnn_dataset_free(&data);
    }
    for (int timed = 0; timed < 2; timed++) { /* without a time rows may be of any motions */
        s = (struct hnn_dataset_settings){.state = "q,p",
                                          .rate = timed ? NULL : "t,g",
                                          .time = timed ? "t" : NULL,
                                          .inputs = "u"};
        assert_int_equal(read(&s, &data, &error), AD_OK);
        assert_true(data.varied == timed);
        hnn_dataset_free(&data);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_data)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
