/* Trajectories and gaps of real files, published names, and files that are not plain text. */
#include "datasets.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* ---- A22: trajectories and gaps ---- */

/* Steps of 0.1; a step of 0.3 stays, 0.31 is a gap; time goes back once. */
static const char times[] = "t,q,p\n0,0,5\n.1,1,5\n.2,2,5\n.5,5,5\n.6,6,5\n.91,9,5\n1.01,10,5\n"
                            "0,20,5\n.1,21,5\n.2,22,5\n";

static void test_gaps(void **state)
{
    (void)state;
    struct path file = files_write_text("gaps.csv", times);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text, .time = "t"};
    struct hnn_dataset d = dataset_of(&s);
    assert_int_equal(d.trials, 2);
    assert_true(d.trials_by_time);
    assert_int_equal(d.gaps, 1);
    assert_close(d.longest, 0.3, 1e-3, 0);
    assert_int_equal(d.train.n, 7); /* of 9 steps not the gap, not the way back */
    for (size_t k = 0; k < d.train.n; k++)
        assert_close(d.train.target[k], 10, 1e-12, 0);
    hnn_dataset_free(&d);
    s.differences = HNN_CENTRAL;
    d = dataset_of(&s);
    assert_int_equal(d.train.n, 4);
    hnn_dataset_free(&d);
    s.split = HNN_SPLIT_TRIAL;
    s.test_fraction = 0.5;
    d = dataset_of(&s);
    assert_true(d.train.n + d.test.n == 4 && d.test.n > 0);
    hnn_dataset_free(&d);
    s = (struct hnn_dataset_settings){
        .size = sizeof(struct hnn_dataset_settings), .file = file.text, .time = "t", .trial = ""};
    dataset_refused(&s, AD_E_INPUT, "trial");
}

/* A trial column tells trajectories apart where time goes on; gaps within one count. */
static void test_trials_without_a_way_back(void **state)
{
    (void)state;
    static const char *const heads[] = {"% q p\n", ""};
    for (size_t k = 0; k < 2; k++) {
        char text[400];
        size_t n = (size_t)sprintf(text, "%s", heads[k]);
        for (int i = 0; i < 8; i++) /* 10 ms, 190 ms once, 14 s between the trials */
            n += (size_t)sprintf(text + n, "%d %.3f %d 1\n", i / 4,
                                 8 + 0.01 * i + 0.18 * (i > 1) + 14 * (i > 3), i);
        struct path file = files_write_text("two.txt", text);
        struct hnn_dataset d =
            dataset_of(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                      .file = file.text,
                                                      .state = "3,4",
                                                      .time = "2"});
        assert_int_equal(d.trials, k == 0 ? 2 : 1);
        assert_int_equal(d.gaps, k == 0 ? 1 : 2);
        assert_int_equal(d.train.n, 5);
        for (size_t i = 0; i < d.train.n; i++)
            assert_close(d.train.target[i], 100, 1e-9, 0);
        hnn_dataset_free(&d);
    }
}

/* ---- C6: names as in the published files ---- */

static void test_published_names(void **state)
{
    (void)state;
    struct path file = files_write_text(
        "six.txt", "% o v\n0 0.0 1 2 3 4\n0 0.1 5 6 7 8\n1 0.0 2 2 2 3\n1 0.1 5 1 3 4\n");
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
    struct hnn_dataset d = dataset_of(&s);
    assert_string_equal(d.state_names, "o,v");
    assert_string_equal(d.rate_names, "dodt,dvdt");
    assert_int_equal(d.train.n, 4);
    assert_close(d.train.x[1], 5, 0, 0);
    assert_close(d.train.target[4], 4, 0, 0);
    assert_int_equal(d.trials, 2);
    hnn_dataset_free(&d);
    file = files_write_text("four.txt", "%o v\n0 0.0 1 2\n0 0.1 5 6\n1 0.0 2 2\n1 0.1 5 1\n");
    s.time = "t";
    d = dataset_of(&s);
    assert_string_equal(d.state_names, "o,v");
    assert_int_equal(d.train.n, 2);
    hnn_dataset_free(&d);
}

/* ---- C8: what is given for text ---- */

#define ROWS "q,p,dqdt,dpdt\n1,2,3,4\n2,3,5,6\n"

/* All of them read as ROWS. */
static void test_read(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        size_t skip;
    } cases[] = {
        {ROWS, 0},
        {"\xef\xbb\xbf" ROWS, 0},
        {"q,p,dqdt,dpdt\r1,2,3,4\r2,3,5,6\r", 0},
        {"q,p,dqdt,dpdt\r\n1,2,3,4\r\n2,3,5,6\r\n", 0},
        {"// by hand\n" ROWS "// end\n", 0},
        {"q,p,dqdt,dpdt\nm,kg m/s,m/s,N\n1,2,3,4\n2,3,5,6\n", 0},
        {"Run 3, 2009\nat 11:30\n" ROWS, 2},
        {"q p dqdt dpdt\n(m) (kg) (1) (2/s)\n1 2 3 4\n2 3 5 6\n", 0},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct path file = files_write_text("rows.csv", cases[k].text);
        struct hnn_dataset d =
            dataset_of(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                      .file = file.text,
                                                      .skip_rows = cases[k].skip});
        static const double x[] = {1, 2, 2, 3}, rate[] = {3, 5, 4, 6};
        assert_int_equal(d.train.n, 2);
        assert_memory_equal(d.train.x, x, sizeof x);
        assert_memory_equal(d.train.target, rate, sizeof rate);
        assert_int_equal(d.units_line, strstr(cases[k].text, "kg") ? 2 : 0);
        hnn_dataset_free(&d);
    }
}

/* Longer than all buffers, and cut short. */
static void test_gzip(void **state)
{
    (void)state;
    enum { MANY = 100000 };
    struct path path = files_temporary("rows.csv.gz");
    gzFile out = gzopen(path.text, "wb");
    gzputs(out, "q,p,dqdt,dpdt\n");
    for (int i = 0; i < MANY; i++)
        gzprintf(out, "%d,%d,%d,1.25\n", i, -i, 3 * i % 7);
    assert_int_equal(gzclose(out), Z_OK);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = path.text};
    struct hnn_dataset d = dataset_of(&s);
    assert_int_equal(d.train.n, MANY);
    for (size_t i = 0; i < MANY; i++)
        assert_true(d.train.x[i] == (double)i && d.train.target[i] == (double)(3 * i % 7));
    hnn_dataset_free(&d);
    size_t size;
    char *bytes = files_read(path.text, &size);
    struct path cut = files_write("cut.csv.gz", bytes, size / 2);
    s.file = cut.text;
    dataset_refused(&s, AD_E_INPUT, "gzip");
    bytes[size / 2] ^= 0x55;
    struct path damaged = files_write("damaged.csv.gz", bytes, size);
    s.file = damaged.text;
    dataset_refused(&s, AD_E_INPUT, damaged.text);
    free(bytes);
}

static void test_named(void **state)
{
    (void)state;
#define TEXT(text) text, sizeof text - 1
    static const struct {
        const char *bytes;
        size_t n;
        const char *says;
    } cases[] = {
        {TEXT("\xff\xfeq\0,\0p\0\n\0"), "UTF-16"},
        {TEXT("\xfe\xff\0q\0,\0p\0\n"), "UTF-16"},
        {TEXT("q\0,\0p\0\n\0"), "UTF-16"},
        {TEXT("\x93NUMPY\1\0v\0{'descr'"), "NumPy"},
        {TEXT("PK\3\4 and more"), "zip"},
        {TEXT("BZh91AY&SY"), "bzip2"},
        {TEXT("q,p,dqdt,dpdt\n1,NA,3,4\n"), ":2:3: 'p' 'NA'"},
        {TEXT("q;p;dqdt;dpdt\n1,5;2;3;4\n"), "decimal comma"},
        {TEXT("q,p,dqdt,dpdt\nm,m,m,m\ns,s,s,s\n1,2,3,4\n"), ":3:1:"},
        {TEXT("q,p,dqdt,dpdt\nNA,NA,NA,NA\n1,2,3,4\n"), ":2:1:"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct path file = files_write("kind.csv", cases[k].bytes, cases[k].n);
        dataset_refused(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                       .file = file.text},
                        AD_E_INPUT, cases[k].says);
    }
    struct path file = files_write_text("short.csv", ROWS);
    dataset_refused(&(struct hnn_dataset_settings){.size = sizeof(struct hnn_dataset_settings),
                                                   .file = file.text,
                                                   .skip_rows = 4},
                    AD_E_INPUT, "has 3 lines");
}

/* Only what the chosen columns lack counts; a row left out leaves a longer step, or a gap. */
static void test_missing(void **state)
{
    (void)state;
    struct path file = files_write_text("missing.csv", "t,q,p,note\n0,0,1,x\n1,NA,1,\n2,2,1,NaN\n"
                                                       "3,3,,\n4,nan,1,\n5,5,null,\n6,6,1,z\n"
                                                       "7,7,1,\n8,8,1,\n9,9,1,\n10,10,1,\n");
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .state = "q,p", .time = "t"};
    dataset_refused(&s, AD_E_INPUT, ":3:3: 'q' 'NA'");
    s.skip_missing = true;
    struct hnn_dataset d = dataset_of(&s);
    assert_int_equal(d.missing, 4);
    assert_int_equal(d.gaps, 1); /* from 2 to 6 */
    assert_int_equal(d.train.n, 5);
    for (size_t k = 0; k < d.train.n; k++)
        assert_close(d.train.target[k], 1, 1e-15, 0);
    hnn_dataset_free(&d);
    file = files_write_text("late.csv", "t,q,p\n0,0,1\n1,NA,1\n2,2,1\n2,2,1\n");
    s.file = file.text;
    dataset_refused(&s, AD_E_INPUT, ":5: time 2");
    s.time = NULL;
    s.rollout = 1;
    s.dt = 1;
    dataset_refused(&s, AD_E_ARGUMENT, "time column");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gaps),
        cmocka_unit_test(test_trials_without_a_way_back),
        cmocka_unit_test(test_published_names),
        cmocka_unit_test(test_read),
        cmocka_unit_test(test_gzip),
        cmocka_unit_test(test_named),
        cmocka_unit_test(test_missing),
    };
    return cmocka_run_group_tests_name("kinds of files", tests, files_setup, files_teardown);
}
