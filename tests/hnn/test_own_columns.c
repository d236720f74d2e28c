/* Data sets from columns in memory. */
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/data/data.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>

enum { ROWS = 40 };
struct motion {
    double trial[ROWS], t[ROWS], q[ROWS], p[ROWS];
};

static void put_motion(struct motion *m)
{
    for (int i = 0; i < ROWS; i++) {
        m->trial[i] = i / 10;
        m->t[i] = 0.1 * (i % 10) + 0.003 * sin(i);
        m->q[i] = sin(m->t[i] + i / 10);
        m->p[i] = cos(m->t[i] + i / 10);
    }
}

/* Columns give the samples that a file of the same numbers gives, however they are made. */
static void test_columns(void **state)
{
    (void)state;
    struct motion m;
    put_motion(&m);
    static char text[ROWS * 100];
    size_t end = (size_t)sprintf(text, "trial,t,q,p\n");
    for (int i = 0; i < ROWS; i++)
        end += (size_t)sprintf(text + end, "%.17g,%.17g,%.17g,%.17g\n", m.trial[i], m.t[i], m.q[i],
                               m.p[i]);
    struct path file = files_write_text("m.csv", text);
    const char *names[] = {"trial", "t", "q", "p"};
    struct hnn_columns columns = {4, ROWS, (const double *[]){m.trial, m.t, m.q, m.p}, names};
    const struct hnn_dataset_settings cases[] = {
        {.time = "t", .differences = HNN_CENTRAL, .test_fraction = 0.25, .split = HNN_SPLIT_TRIAL},
        {.time = "t", .rollout = 3, .test_fraction = 0.3, .seed = 4},
        {.time = "2", .state = "3,4", .test_fraction = 0.3, .split = HNN_SPLIT_RANDOM},
        {.state = "q,p", .rate = "t,trial"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct hnn_dataset_settings s = cases[k];
        s.size = sizeof s;
        struct hnn_dataset a, b;
        struct ad_error error = {0};
        s.file = file.text;
        assert_int_equal(hnn_dataset_read(&s, &a, &error), AD_OK);
        s.file = NULL;
        s.columns = &columns;
        if (hnn_dataset_read(&s, &b, &error) != AD_OK)
            fail_msg("%s", error.message);
        assert_true(a.train.n == b.train.n && a.test.n == b.test.n && a.trials == b.trials);
        assert_string_equal(a.state_names, b.state_names);
        assert_memory_equal(a.train.x, b.train.x, 2 * a.train.n * sizeof(double));
        assert_memory_equal(a.train.target, b.train.target, 2 * a.train.n * sizeof(double));
        assert_memory_equal(a.centre, b.centre, 2 * sizeof(double));
        if (a.test.n)
            assert_memory_equal(a.test.x, b.test.x, 2 * a.test.n * sizeof(double));
        hnn_dataset_free(&a);
        hnn_dataset_free(&b);
    }
}

static void test_refused_columns(void **state)
{
    (void)state;
    struct motion m;
    put_motion(&m);
    const double *all[] = {m.q, m.p, m.t}, *lacks[] = {m.q, NULL, m.t};
    struct hnn_columns columns = {3, ROWS, all, NULL}, none = columns, empty = columns;
    none.column = lacks;
    empty.rows = 0;
    const struct hnn_dataset_settings wrong[] = {
        {sizeof(struct hnn_dataset_settings), .columns = &none, .state = "1,2", .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &empty, .state = "1,2", .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .file = "x.csv", .state = "1,2",
         .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .skip_rows = 1, .state = "1,2",
         .rate = "2,3"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .test_file = "x",
         .test_columns = &columns, .state = "1,2"},
        {sizeof(struct hnn_dataset_settings), .columns = &columns, .test_columns = &columns,
         .test_fraction = 0.5, .state = "1,2"},
        {sizeof(struct hnn_dataset_settings), .state = "1,2"},
    };
    struct hnn_dataset data;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        struct ad_error error = {0};
        if (hnn_dataset_read(&wrong[k], &data, &error) != AD_E_ARGUMENT)
            fail_msg("%zu: %d %s", k, error.status, error.message);
        hnn_dataset_free(&data);
    }
    struct hnn_dataset_settings s = {
        .size = sizeof s, .columns = &columns, .state = "1,4", .rate = "2,3"};
    struct ad_error error = {0}, nan = {0}, back = {0};
    assert_int_equal(hnn_dataset_read(&s, &data, &error), AD_E_INPUT);
    s.state = "1,2";
    m.t[7] = NAN;
    assert_int_equal(hnn_dataset_read(&s, &data, &nan), AD_E_INPUT);
    assert_mentions(nan.message, "8");
    put_motion(&m); /* time goes back where a trial begins, and no column says so */
    s.rate = NULL;
    s.time = "3";
    s.trial = "";
    assert_int_equal(hnn_dataset_read(&s, &data, &back), AD_E_INPUT);
    assert_mentions(back.message, "11");
    hnn_dataset_free(&data);
}

/* Arrays [4 x 10] of two coordinates: the samples are theirs, the last three are kept for the test.
 */
static void test_arrays(void **state)
{
    enum { N = 10, TEST = 3 };
    double x[4][N], rate[4][N];
    struct hnn_dataset data;
    struct ad_error error = {0}, nan = {0}, few = {0};
    (void)state;
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < N; i++)
            x[c][i] = sin(1.3 * i + c), rate[c][i] = cos(0.7 * i - c);
    if (hnn_dataset_arrays(2, N, *x, *rate, 0.3, &data, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_true(data.dof == 2 && data.train.n == N - TEST && data.test.n == TEST);
    for (int c = 0; c < 4; c++) {
        double mean = 0;
        assert_memory_equal(data.train.x + c * (N - TEST), x[c], (N - TEST) * sizeof(double));
        assert_memory_equal(data.train.target + c * (N - TEST), rate[c],
                            (N - TEST) * sizeof(double));
        assert_memory_equal(data.test.x + c * TEST, x[c] + N - TEST, TEST * sizeof(double));
        assert_memory_equal(data.test.target + c * TEST, rate[c] + N - TEST, TEST * sizeof(double));
        for (int i = 0; i < N - TEST; i++)
            mean += x[c][i] / (N - TEST);
        assert_close(data.centre[c], mean, 0, 1e-15);
    }
    hnn_dataset_free(&data);
    rate[1][6] = NAN;
    assert_int_equal(hnn_dataset_arrays(2, N, *x, *rate, 0, &data, &nan), AD_E_INPUT);
    assert_mentions(nan.message, "row 7 of column 6");
    const size_t dofs[] = {0, SIZE_MAX / 2 + 2, 1, 1}, samples[] = {N, N, 0, SIZE_MAX / 4};
    for (size_t k = 0; k < 4; k++) {
        few.status = AD_OK;
        assert_int_equal(hnn_dataset_arrays(dofs[k], samples[k], *x, *rate, 0, &data, &few),
                         AD_E_ARGUMENT);
        assert_null(data.values);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_columns),
        cmocka_unit_test(test_refused_columns),
        cmocka_unit_test(test_arrays),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
