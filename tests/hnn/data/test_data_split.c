/* Division of a data set into training and test. */
#include "datasets.h"
#include "tests/close.h"
#include "tests/files.h"

#include <string.h>

enum { ROWS = 1000, EACH = 20 };

/* Every row is in one part, once, with its own rate, in the order of the file. */
static void assert_partition(const struct hnn_dataset *d, bool is_test[ROWS])
{
    const struct hnn_samples *parts[] = {&d->train, &d->test};
    bool seen[ROWS] = {0};
    assert_int_equal(d->train.n + d->test.n, ROWS);
    for (size_t part = 0; part < 2; part++) {
        double last = -1;
        for (size_t i = 0, n = parts[part]->n; i < n; i++) {
            double q = parts[part]->x[i];
            assert_true(q > last && !seen[(size_t)q]);
            assert_true(parts[part]->x[n + i] == -q && parts[part]->target[i] == 3 * q);
            seen[(size_t)q] = true;
            is_test[(size_t)q] = part == 1;
            last = q;
        }
    }
}

static void test_splits(void **state)
{
    (void)state;
    struct path file = dataset_rows("split.csv", ROWS, EACH);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text, .test_fraction = 0.3};
    static const enum hnn_split kinds[] = {HNN_SPLIT_TAIL, HNN_SPLIT_RANDOM, HNN_SPLIT_TRIAL};
    for (size_t k = 0; k < LENGTH(kinds); k++) {
        bool first[ROWS] = {0}, again[ROWS] = {0}, other[ROWS] = {0};
        bool *results[] = {first, again, other};
        s.split = kinds[k];
        for (size_t run = 0; run < 3; run++) {
            s.seed = run == 2 ? 8 : 7;
            struct hnn_dataset d = dataset_of(&s);
            assert_int_equal(d.test.n, 300);
            assert_partition(&d, results[run]);
            hnn_dataset_free(&d);
        }
        assert_memory_equal(first, again, sizeof first);
        assert_true((memcmp(first, other, sizeof first) != 0) == (kinds[k] != HNN_SPLIT_TAIL));
        for (size_t i = 0; i < ROWS; i++) {
            if (kinds[k] == HNN_SPLIT_TAIL)
                assert_int_equal(first[i], i >= 700);
            if (kinds[k] == HNN_SPLIT_TRIAL)
                assert_int_equal(first[i], first[i - i % EACH]);
        }
    }
}

/* Over many seeds every row is chosen equally often: chi-squared of 1000 rows, 400 draws. */
static void test_random_is_fair(void **state)
{
    (void)state;
    enum { DRAWS = 400 };
    struct path file = dataset_rows("fair.csv", ROWS, EACH);
    static size_t times[ROWS];
    memset(times, 0, sizeof times);
    for (uint64_t seed = 0; seed < DRAWS; seed++) {
        struct hnn_dataset d =
            dataset_of(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                      .file = file.text,
                                                      .split = HNN_SPLIT_RANDOM,
                                                      .test_fraction = 0.3,
                                                      .seed = seed});
        for (size_t i = 0; i < d.test.n; i++)
            times[(size_t)d.test.x[i]]++;
        hnn_dataset_free(&d);
    }
    double chi2 = 0;
    for (size_t i = 0; i < ROWS; i++)
        chi2 += pow((double)times[i] - 0.3 * DRAWS, 2) / (0.3 * 0.7 * DRAWS);
    assert_close(chi2, ROWS, 0, 5 * sqrt(2.0 * ROWS));
}

static void test_splits_that_leave_nothing(void **state)
{
    (void)state;
    struct path file = dataset_rows("tiny.csv", 4, 2);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text, .test_fraction = 0.1};
    dataset_refused(&s, AD_E_ARGUMENT, "0.1 4 test");
    s.test_fraction = 0.9;
    dataset_refused(&s, AD_E_ARGUMENT, "train");
    s.test_fraction = 0.5;
    s.split = HNN_SPLIT_TRIAL;
    s.trial = "";
    dataset_refused(&s, AD_E_ARGUMENT, "split trial column");
    s.trial = NULL;
    s.test_fraction = 0.2;
    dataset_refused(&s, AD_E_ARGUMENT, "0.2 2 trials test");
    s.test_fraction = 1;
    dataset_refused(&s, AD_E_ARGUMENT, "1");
    s.test_fraction = (double)NAN;
    dataset_refused(&s, AD_E_ARGUMENT, "0");
    s.test_fraction = 0.5;
    s.test_file = file.text;
    dataset_refused(&s, AD_E_ARGUMENT, "got both");
}

static void test_test_file(void **state)
{
    (void)state;
    struct path file = dataset_rows("train.csv", 50, 50);
    struct path other = files_write_text("test.txt", "dpdt dqdt p q\n1 2 3 4\n5 6 7 8\n");
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = file.text,
                                     .state = "q,p",
                                     .rate = "dqdt,dpdt",
                                     .test_file = other.text};
    struct hnn_dataset d = dataset_of(&s);
    static const double x[] = {4, 8, 3, 7}, rate[] = {2, 6, 1, 5};
    assert_int_equal(d.train.n, 50);
    assert_int_equal(d.test.n, 2);
    assert_memory_equal(d.test.x, x, sizeof x);
    assert_memory_equal(d.test.target, rate, sizeof rate);
    assert_true(d.train.x[49] == 49 && d.train.target[49] == 147);
    hnn_dataset_free(&d);
    other = files_write_text("test.txt", "q p dqdt\n1 2 3\n");
    dataset_refused(&s, AD_E_INPUT, "test.txt rate 'dpdt' 'dqdt'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_splits),
        cmocka_unit_test(test_random_is_fair),
        cmocka_unit_test(test_splits_that_leave_nothing),
        cmocka_unit_test(test_test_file),
    };
    return cmocka_run_group_tests_name("data sets", tests, files_setup, files_teardown);
}
