/* Columns of text: every accepted form, and the position of every reported error. */
#include "hnn/data/data.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- shapes of text ---- */

/* In all of them the state is (0.25, -3), (1.5, 7e-3) and the rates are (4, -0.5), (2, 11). */
static const struct {
    const char *what, *text, *state, *rate;
} shapes[] = {
    {"names", "q,p,dqdt,dpdt\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", NULL, NULL},
    {"no end of the last line", "q,p,dqdt,dpdt\n.25,-3,4,-.5\n1.5,7e-3,2,11", NULL, NULL},
    {"numbers of columns", ".25,-3,4,-.5\n1.5,7e-3,2,11\n", "1,2", "3,4"},
    {"numbers although there are names", "q,p,a,b\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", "1,p", "a,4"},
    {"another order", "dpdt,p,q,dqdt\n-.5,-3,.25,4\n11,7e-3,1.5,2\n", "q,p", NULL},
    {"blanks around a list", "q,p,a,b\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", " q , p", "a ,b "},
    {"CRLF", "q,p,dqdt,dpdt\r\n.25,-3,4,-.5\r\n1.5,7e-3,2,11\r\n", NULL, NULL},
    {"byte order mark", "\xef\xbb\xbfq,p,dqdt,dpdt\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", NULL, NULL},
    {"mark before a quote", "\xef\xbb\xbf\"q\",p,dqdt,dpdt\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", NULL,
     NULL},
    {"mark without names", "\xef\xbb\xbf.25,-3,4,-.5\n1.5,7e-3,2,11\n", "1,2", "3,4"},
    {"semicolons", "q;p;dqdt;dpdt\n.25;-3;4;-.5\n1.5;7e-3;2;11\n", NULL, NULL},
    {"blanks", "q p dqdt dpdt\n  .25   -3 4\t-.5 \n1.5 7e-3 2 11\n", NULL, NULL},
    {"blanks about commas", " q , p ,dqdt, dpdt \n .25 ,\t-3, 4,-.5\n1.5, 7e-3 ,2 , 11 \n", NULL,
     NULL},
    {"tabs", "the q\tp\trate q\trate p\n.25\t-3\t4\t-.5\n1.5\t7e-3\t2\t11\n", "the q,p",
     "rate q,rate p"},
    {"tabs without names", "\t.25\t\t-3 4\t-.5\n1.5\t7e-3\t2\t11\n", "1,2", "3,4"},
    {"an empty field among tabs", "q\tx\tp\tdqdt\tdpdt\n.25\t\t-3\t4\t-.5\n1.5\t\t7e-3\t2\t11\n",
     NULL, NULL},
    {"an empty first field among tabs",
     "x\tq\tp\tdqdt\tdpdt\n\t.25\t-3\t4\t-.5\n\t1.5\t7e-3\t2\t"
     "11\n",
     NULL, NULL},
    {"quoted names",
     "\"q\",\"p, kg m/s\",\"a # b\",\"say \"\"b\"\"\"\n.25,-3,4,-.5\n1.5,7e-3,2,11\n",
     "q,\"p, kg m/s\"", "\"a # b\",\"say \"\"b\"\"\""},
    {"quoted names among blanks", "q \"momentum p\" a b\n.25 -3 4 -.5\n1.5 7e-3 2 11\n",
     "q,momentum p", "a,b"},
    {"quoted numbers", "q,p,dqdt,dpdt\n\".25\",\"-3\",4,\"-.5\"\n1.5,7e-3,\"2\",11\n", NULL, NULL},
    {"comments",
     "# made by hand\n\nq,p,dqdt,dpdt\n.25,-3,4,-.5 # first\n% half\n#\n\n1.5,7e-3,2,"
     "11% 2nd\n# end\n",
     NULL, NULL},
    {"names in a comment", "# made by hand, twice\n# q p dqdt dpdt\n.25 -3 4 -.5\n1.5 7e-3 2 11\n",
     NULL, NULL},
    {"names in a comment, commas", "#q,p,dqdt,dpdt\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", NULL, NULL},
    {"comment with commas, blanks below", "# q, p, dqdt, dpdt\n.25 -3 4 -.5\n1.5 7e-3 2 11\n", NULL,
     NULL},
    {"a comment is no name", "# some words\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", "1,2", "3,4"},
    {"a number in a comment", "# 2009\n.25,-3,4,-.5\n1.5,7e-3,2,11\n", "1,2", "3,4"},
    {"text in other columns", "run,q,p,dqdt,dpdt,note\na,.25,-3,4,-.5,\nb,1.5,7e-3,2,11,\"x, y\"\n",
     NULL, NULL},
    {"not a number in other columns", "x,q,p,dqdt,dpdt\nnan,.25,-3,4,-.5\ninf,1.5,7e-3,2,11\n",
     NULL, NULL},
    {"text first, no names", "a,.25,-3,4,-.5\nb,1.5,7e-3,2,11\n", "2,3", "4,5"},
    {"a column without a name", ",q,p,dqdt,dpdt\n0,.25,-3,4,-.5\n1,1.5,7e-3,2,11\n", NULL, NULL},
    {"a name that is a number", "q;\"2 \";2a;p;dqdt;dpdt\n.25;9;9;-3;4;-.5\n1.5;9;9;7e-3;2;11\n",
     "1,4", NULL},
    {"Fortran's exponents", "q p dqdt dpdt\n.25D0 -3d0 0.4D+1 -5.D-1\n15d-1 7e-3 2. +11\n", NULL,
     NULL},
};

static void test_shapes(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(shapes); k++) {
        struct path file = files_write_text("shape.txt", shapes[k].text);
        struct hnn_dataset_settings s = {
            .size = sizeof s, .file = file.text, .state = shapes[k].state, .rate = shapes[k].rate};
        struct hnn_dataset d;
        struct ad_error error = {0};
        if (hnn_dataset_read(&s, &d, &error) != AD_OK)
            fail_msg("%s: %s", shapes[k].what, error.message);
        static const double x[] = {.25, 1.5, -3, 7e-3}, rate[] = {4, 2, -.5, 11};
        if (d.dof != 1 || d.train.n != 2 || d.test.n != 0 || memcmp(d.train.x, x, sizeof x) ||
            memcmp(d.train.target, rate, sizeof rate))
            fail_msg("%s: not read as it stands", shapes[k].what);
        hnn_dataset_free(&d);
    }
}

/* ---- what is refused, and where ---- */

#define NAMES "q,p,dqdt,dpdt\n1,2,3,4\n"

static const struct {
    const char *text, *state, *rate, *time, *says;
} wrong[] = {
    {NAMES "1,2,x,4\n", NULL, NULL, NULL, ":3:5: 'dqdt' 'x'"},
    {NAMES "1,2,nan,4\n", NULL, NULL, NULL, ":3:5: 'dqdt' 'nan'"},
    {NAMES "1,-inf,3,4\n", NULL, NULL, NULL, ":3:3: 'p' '-inf'"},
    {NAMES "1,2,3,1e999\n", NULL, NULL, NULL, ":3:7: 'dpdt' '1e999'"},
    {NAMES "1,,3,4\n", NULL, NULL, NULL, ":3:3: 'p' empty"},
    {NAMES "1,2,3,\n", NULL, NULL, NULL, ":3:7: 'dpdt' empty"},
    {NAMES "1,2 5,3,4\n", NULL, NULL, NULL, ":3:3: 'p' '2' '5'"},
    {NAMES "1,2.5.1,3,4\n", NULL, NULL, NULL, ":3:3: 'p'"},
    {NAMES "1,\"2,3,4\n", NULL, NULL, NULL, ":3:4: 'p'"},
    {NAMES "\n# x\n1,2,3\n", NULL, NULL, NULL, ":5:6: 4 1 3"},
    {NAMES "1,2,3,4,5\n", NULL, NULL, NULL, ":3:10: 4 1 5"},
    {"q,p,dqdt,dpdt\n1 2 3 4\n", NULL, NULL, NULL, ":2:8: 4 1"},
    {"1 2 3 4\n1 2 3\n", "1,2", "3,4", NULL, ":2:6: 4 3"},
    {"q;p;dqdt;dpdt\n1;2,5;3;4\n", NULL, NULL, NULL, ":2:3: 'p' '2' '5'"},
    {"q;p;dqdt;dpdt\n1;2,5;3;4\n", NULL, NULL, NULL, "decimal comma"},
    {"1,2\nq,p\n", "1,2", "1,2", NULL, ":2:1: 1 'q'"},
    {"", NULL, NULL, NULL, ":0: rows"},
    {"q,p,dqdt,dpdt\n# none\n", NULL, NULL, NULL, ":2: rows"},
    {NAMES, "q,pp", NULL, NULL, "state 'pp' 'p'"},
    {NAMES, "q,p", "dqdt,dpt", NULL, "rate 'dpt' 'dpdt'"},
    {NAMES, "q,momentum", NULL, NULL, "'momentum' q p dqdt dpdt"},
    {NAMES, "q,5", NULL, NULL, "state '5'"},
    {NAMES, "0,1", NULL, NULL, "state '0'"},
    {NAMES, "q,", NULL, NULL, "state ''"},
    {"1,2\n", "1,3", "1,2", NULL, "'3' names 1 2"},
    {"q,q,a,b\n1,2,3,4\n", "q,a", "3,4", NULL, "2 'q'"},
    {NAMES, "q,p,dqdt", NULL, NULL, "momenta 3"},
    {NAMES, "q,q", NULL, NULL, "state column 1 twice"},
    {NAMES, "q,p", "dqdt", NULL, "rate 2 state 1"},
    {"a,b\n1,2\n", NULL, NULL, NULL, "state"},
    {"a,b\n1,2\n", "a,b", NULL, NULL, "rates"},
    {"t,q,p\n0,1,2\n1,2,3\n\n1,2,3\n", NULL, NULL, "t", ":5: time 1"},
    {"t,q,p\n0,1,2\n1,2,3\n1,2,3\n", NULL, NULL, "t", ":4: time 1"},
    {"t,q,p\n0,-1e308,2\n1,1e308,3\n", NULL, NULL, "t", "differences finite"},
    {"t,q,p\n0,1,2\n", NULL, NULL, "t", "1 rows samples"},
    {"trial,t,q,p\n1,0,1,2\n1,1,2,3\n2,0,2,3\n1,2,1,1\n", NULL, NULL, "t", "rows trial 1"},
    {"q,q,dqdt,dpdt\n1,2,3,4\n", NULL, NULL, NULL, ":1: 'q'"},
    {"q,q,dqdt,dpdt\n1,2,3,4\n", "1,2", NULL, NULL, "'q'"},
    {"q,p,dqdt,dqdt\n1,2,3,4\n", NULL, NULL, NULL, "'dqdt'"},
    {"q,2,dqdt,4\n1,2,3,4\n", NULL, NULL, NULL, ":1: names numbers"},
    {"q,2,dqdt,4\n1,2,3,4\n", "1,2", "3,4", NULL, "names numbers"},
    {"q,p,dqdt\n1,2,3\n", NULL, NULL, NULL, "'q' 'p' dXdt"},
    {"q,,dqdt,\n1,2,3,4\n", NULL, NULL, NULL, "'q' dXdt 2 4"},
    {"t,q,p\n0,1,2\n1,2,2\n", "t,q", NULL, "t", "column 1 time"},
    {"q,p,dqdt,dpdt\n1,2,3,4\n", "+1,2", "3,4", NULL, "'+1'"}, /* no number */
    {"q,p,dqdt,dpdt\n1,2,3,4\n", "1,2", "3,5", NULL, "'5'"},
};

static void test_refused(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(wrong); k++) {
        struct path file = files_write_text("wrong.csv", wrong[k].text);
        struct hnn_dataset_settings s = {.size = sizeof s,
                                         .file = file.text,
                                         .state = wrong[k].state,
                                         .rate = wrong[k].rate,
                                         .time = wrong[k].time};
        struct hnn_dataset d;
        struct ad_error error = {0};
        enum ad_status status = hnn_dataset_read(&s, &d, &error);
        hnn_dataset_free(&d);
        if ((status != AD_E_INPUT && status != AD_E_ARGUMENT) ||
            strncmp(error.message, file.text, strlen(file.text)) != 0)
            fail_msg("case %zu: status %d, '%s'", k, status, error.message);
        assert_mentions(error.message, wrong[k].says);
    }
}

static void test_cannot_be_read(void **state)
{
    (void)state;
    static const char *const names[] = {"/nowhere/at.csv", "/"};
    for (size_t k = 0; k < LENGTH(names); k++) {
        struct hnn_dataset d;
        struct ad_error error = {0};
        struct hnn_dataset_settings s = {.size = sizeof s, .file = names[k]};
        assert_int_equal(hnn_dataset_read(&s, &d, &error), AD_E_IO);
        assert_mentions(error.message, names[k]);
        hnn_dataset_free(&d);
    }
}

/* Every prefix of a good file is read, or refused with a reason: no crash, no silence. */
static void test_truncated(void **state)
{
    (void)state;
    static const char text[] = "\xef\xbb\xbf# x\n\"q\",p,dqdt,dpdt\r\n.25,-3e0,4,-.5\n1.5,7,2,11\n";
    for (size_t n = 0; n < sizeof text - 1; n++) {
        struct path file = files_write("short.csv", text, n);
        struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
        struct hnn_dataset d;
        struct ad_error error = {0};
        enum ad_status status = hnn_dataset_read(&s, &d, &error);
        if (status == AD_OK)
            assert_true(d.train.n == 1 || d.train.n == 2);
        else
            assert_mentions(error.message, file.text);
        hnn_dataset_free(&d);
    }
}

/* ---- streams ---- */

/* Rows that cross the ends of all buffers and blocks, from a pipe, with lines of all lengths. */
static void test_long_stream(void **state)
{
    (void)state;
    enum { ROWS = 100003 };
    struct path pipe = files_temporary("pipe");
    assert_int_equal(mkfifo(pipe.text, 0600), 0);
    pid_t child = fork();
    if (child == 0) {
        FILE *out = fopen(pipe.text, "w");
        fputs("q;note;p;dqdt;dpdt\n", out);
        for (int i = 0; i < ROWS; i++)
            fprintf(out, "%.17g;%*s;%d;%d;%.6g\n", i / 7.0, i % 97, "", -i, i % 11, i * 0.5);
        _exit(fclose(out) != 0);
    }
    struct hnn_dataset_settings s = {.size = sizeof s, .file = pipe.text};
    struct hnn_dataset d;
    struct ad_error error = {0};
    if (hnn_dataset_read(&s, &d, &error) != AD_OK)
        fail_msg("%s", error.message);
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
    assert_int_equal(d.train.n, ROWS);
    for (size_t i = 0; i < ROWS; i++)
        if (d.train.x[i] != (double)i / 7.0 || d.train.x[ROWS + i] != -(double)i ||
            d.train.target[i] != (double)(i % 11) || d.train.target[ROWS + i] != (double)i * 0.5)
            fail_msg("row %zu is not as it was written", i);
    hnn_dataset_free(&d);
}

/* A last line longer than the first buffer is read; one without an end in sight is refused. */
static void test_long_lines(void **state)
{
    (void)state;
    static const size_t lengths[] = {3 << 20, 17 << 20};
    for (size_t k = 0; k < LENGTH(lengths); k++) {
        char *text = malloc(lengths[k] + 64);
        assert_non_null(text);
        size_t n = (size_t)sprintf(text, "q,note,p,dqdt,dpdt\n1,");
        memset(text + n, 'x', lengths[k]);
        n += lengths[k];
        n += (size_t)sprintf(text + n, ",2,3,4\n");
        struct path file = files_write("long.csv", text, n);
        struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
        struct hnn_dataset d;
        struct ad_error error = {0};
        enum ad_status status = hnn_dataset_read(&s, &d, &error);
        assert_int_equal(status, k == 0 ? AD_OK : AD_E_INPUT);
        if (k == 0)
            assert_true(d.train.x[0] == 1 && d.train.target[1] == 4);
        else
            assert_mentions(error.message, ":2: lines");
        hnn_dataset_free(&d);
        free(text);
    }
}

/* Bytes that no text has do no harm. */
static void test_zero_bytes(void **state)
{
    (void)state;
    static const char text[] = "q,p,dqdt,dpdt\n1,2\0,3,4\n";
    struct path file = files_write("zero.csv", text, sizeof text - 1);
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file.text};
    struct hnn_dataset d;
    struct ad_error error = {0};
    assert_int_equal(hnn_dataset_read(&s, &d, &error), AD_E_INPUT);
    assert_mentions(error.message, ":2:3: 'p' '2?'");
    hnn_dataset_free(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shapes),         cmocka_unit_test(test_refused),
        cmocka_unit_test(test_cannot_be_read), cmocka_unit_test(test_truncated),
        cmocka_unit_test(test_long_stream),    cmocka_unit_test(test_long_lines),
        cmocka_unit_test(test_zero_bytes),
    };
    return cmocka_run_group_tests_name("columns of text", tests, files_setup, files_teardown);
}
