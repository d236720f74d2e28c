/* Pages of runs: what they are made of is in the file, to the digits shown. The browser's part is
   scripts/test-page. */
#include "tests/close.h"
#include "apps/output/page.h"
#include "shell.h"
#include "tests/mentions.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- numbers ---- */

/* The bytes of base64 text up to its quote. */
static size_t decode(const char *text, unsigned char *bytes)
{
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t n = 0;
    unsigned bits = 0, held = 0;
    for (; *text != '"' && *text != '='; text++) {
        bits = bits << 6 | (unsigned)(strchr(digit, *text) - digit);
        held += 6;
        if (held >= 8) {
            held -= 8;
            bytes[n++] = (unsigned char)(bits >> held);
        }
    }
    return n;
}

static double number_of(const char *json, const char *key)
{
    const char *at = strstr(json, key);
    assert_non_null(at);
    return strtod(at + strlen(key), NULL);
}

/* What a page gives back of n numbers, through its JSON. */
static void carried(size_t n, const double value[], double back[])
{
    struct json json;
    char *text;
    size_t length;
    unsigned char bytes[4096];
    FILE *out = open_memstream(&text, &length);
    json_open(&json, out);
    struct ad_error error = {0};
    page_floats(&json, "curve", n, value, &error);
    assert_int_equal(error.status, AD_OK);
    json_close(&json);
    fclose(out);
    const char *at = strstr(text, "\"values\": \"");
    assert_non_null(at);
    assert_int_equal(decode(at + 11, bytes), 4 * n);
    for (size_t i = 0; i < n; i++) {
        float f;
        memcpy(&f, bytes + 4 * i, sizeof f);
        back[i] = number_of(text, "\"offset\": ") + number_of(text, "\"scale\": ") * (double)f;
    }
    free(text);
}

/* Large and tiny numbers, small changes of large ones, and small ones among large ones keep seven
   digits; what is no number is none. */
static void test_floats(void **state)
{
    (void)state;
    static const double cases[][5] = {
        {1.0529748583009728e41, -3e40, 1, 2.5e-3, 0},
        {3e-60, -1.23456789e-61, 4e-62, 0, 1e-63},
        {0.123456789, -1.23456789e-9, 1, 2, 3},
        {1.79e308, -1.7e308, 1e300, 1e290, 1},
        {5e-324, 1e-323, 0, 2e-323, 0},
        {7, 7, 7, 7, 7},
        {-1.5e11, -1.4e11, -1.45e11, -1.499e11, -1.41e11},
    };
    double back[5];
    for (size_t k = 0; k < LENGTH(cases); k++) {
        carried(5, cases[k], back);
        for (size_t i = 0; i < 5; i++)
            assert_close(back[i], cases[k][i], 1.2e-7, k == 3 ? 1e270 : 0);
    }
    const double drift[] = {-0.5, -0.5 + 1.25e-12, -0.5 - 3.75e-13, -0.5 + 1e-13, -0.5};
    carried(5, drift, back); /* the change, not only the number */
    for (size_t i = 0; i < 5; i++)
        assert_close(back[i] - drift[0], drift[i] - drift[0], 0, 1.2e-16);
    const double broken[] = {1, NAN, INFINITY, -INFINITY, 2};
    carried(5, broken, back);
    assert_true(back[0] == 1 && isnan(back[1]) && isnan(back[2]) && isnan(back[3]) && back[4] == 2);
}

/* Times are as they are, whatever their size. */
static void test_doubles(void **state)
{
    (void)state;
    const double t[] = {9007199254740991, 1e17 + 16, 0.1, -5e-324};
    struct json json;
    char *text;
    size_t length;
    unsigned char bytes[64];
    FILE *out = open_memstream(&text, &length);
    json_open(&json, out);
    struct ad_error error = {0};
    page_doubles(&json, "t", 4, t, &error);
    assert_int_equal(error.status, AD_OK);
    json_close(&json);
    fclose(out);
    assert_int_equal(decode(strstr(text, ": \"") + 3, bytes), 32);
    assert_memory_equal(bytes, t, sizeof t);
    free(text);
}

/* One sample of a million that stands out is on the page, high or low, of any row; so are both
   ends, and no sample twice. */
static void test_pick(void **state)
{
    (void)state;
    enum { N = 5000, ROWS = 4, KEEP = 60 };
    double *value = calloc(ROWS * N, sizeof *value);
    size_t *index = calloc(N, sizeof *index), n;
    assert_true(value && index);
    for (size_t r = 0; r < ROWS; r++)
        for (size_t i = 0; i < N; i++)
            value[r * N + i] = sin(0.002 * (double)i + (double)r);
    value[3217] = 40;
    value[3 * N + 77] = -1e5;
    value[2 * N + 4000] = NAN;
    n = page_pick(N, ROWS, value, KEEP, index);
    assert_int_equal(n, KEEP);
    bool high = false, low = false, gap = false;
    for (size_t k = 0; k < n; k++) {
        assert_true(k == 0 || index[k] > index[k - 1]);
        high |= index[k] == 3217;
        low |= index[k] == 77;
        gap |= index[k] == 4000;
    }
    assert_true(high && low && gap);
    assert_int_equal(index[0], 0);
    assert_int_equal(index[n - 1], N - 1);
    assert_int_equal(page_pick(50, ROWS, value, KEEP, index), 50);
    assert_int_equal(page_pick(1, 1, value, 2, index), 1);
    free(value);
    free(index);
}

/* ---- pages ---- */

/* A page of the run and one of its stored file differ in the name of the file alone. */
static void test_view(void **state)
{
    (void)state;
    static const char *const runs[] = {"path kepler --solver adam --steps 20",
                                       "simulate figure8 --time 1", "quantum --no-reference",
                                       "simulate pendulum --scan l=1:2:3"};
    for (size_t k = 0; k < LENGTH(runs); k++) {
        shell_works("$LA %s --out run.h5 --plot both.html --quiet", runs[k]);
        shell_works("$LA view run.h5 --quiet");
        shell_works("sed 's/\"file\": \"[^\"]*\"//' both.html >a; sed 's/\"file\": \"[^\"]*\"//' "
                    "run.html >b; cmp a b && test $(wc -c <a) -gt 40000");
        shell_works("sed -n 's/.*\"series\": .*\"values\": .*/series/p' run.html");
        assert_string_equal(shell_out(), "series\n");
        shell_works("$LA %s --plot alone.html --quiet && ls", runs[k]);
        assert_mentions(shell_out(), "alone.html");
        assert_int_equal(shell_files(), 6); /* no file of the page's own stays */
        shell_clean();
    }
}

/* A scan of two parameters has a map of each number that changes, over them in the order given. */
static void test_map(void **state)
{
    (void)state;
    shell_works("$LA modes spring --scan m=1:4:2 --scan k=1:9:3 --plot map.html --quiet");
    shell_works(
        "grep -c '\"maps\": \\[{\"name\": \"modes.1.frequency\", \"dataset\": "
        "\"results/modes.1.frequency\", \"across\": {\"dataset\": \"scanned/m\", \"of\": 2, "
        "[^{]*\"up\": {\"dataset\": \"scanned/k\", \"of\": 3, ' map.html");
    assert_string_equal(shell_out(), "1\n");
}

/* No request, no script but ours, and names that are markup are data. */
static void test_hostile_names(void **state)
{
    (void)state;
    shell_works(
        "mkdir '<!--<script>' && $LA path pendulum --solver adam --steps 2 --slices 9 --out "
        "'<!--<script>/<>.h5' --plot '<!--<script>/\"><img src=x>.html' --quiet");
    shell_works("cd '<!--<script>' && grep -c '<script' *.html; grep -c '</script>' *.html; "
                "grep -c '<img' *.html; grep -c '<!--' *.html; "
                "grep -cE '(src|href)=\"?(http|//)' *.html; :");
    assert_string_equal(shell_out(), "2\n2\n0\n0\n0\n");
    shell_works("grep -c \"default-src 'none'\" */*.html");
    shell_works("cd '<!--<script>' && $LA report . --quiet && grep -c '<script' index.html");
    assert_string_equal(shell_out(), "2\n");
}

/* A page is whole or not at all, replaces no file of another kind unasked, and is no input. */
static void test_refusals(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --solver adam --steps 2 --slices 9 --out run.h5 --quiet && "
                "mkdir empty bad && head -c 3000 run.h5 >bad/half.h5 && echo mine >run.html && "
                "cp run.html bad/index.html");
    static const struct {
        const char *words, *names;
    } cases[] = {{"view run.h5", "run.html"},
                 {"view bad/half.h5", "half.h5"},
                 {"view none.h5", "none.h5"},
                 {"view run.h5 --plot run.h5", "run.h5"},
                 {"view run.h5 --plot run.svg", "run.svg"},
                 {"view run.h5 --plot no/run.html", "no/run.html"},
                 {"report empty", "empty"},
                 {"report bad", "index.html"},
                 {"report bad --plot all.html", "half.h5"},
                 {"report none", "none"},
                 {"path pendulum --plot run.h5.html --out run.h5.html", "run.h5.html"},
                 {"path nothing --plot new.html", "nothing"}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        assert_int_equal(shell("$LA %s", cases[k].words), 2);
        assert_mentions(shell_err(), cases[k].names);
        assert_int_equal(shell_files(), 4);
    }
    shell_works("cat run.html bad/index.html && ls -A empty");
    assert_string_equal(shell_out(), "mine\nmine\n");
    shell_works(
        "$LA view run.h5 --plot run.html --quiet && $LA view run.h5 --quiet"); /* is ours now */
}

/* A full disk leaves nothing, and the old page. */
static void test_full_disk(void **state)
{
    (void)state;
    shell_works("$LA path pendulum --solver adam --steps 2 --slices 9 --plot run.html --quiet && "
                "cp run.html old");
    assert_int_equal(
        shell("ulimit -f 20; $LA path pendulum --solver adam --steps 90 --plot run.html "
              "--quiet"),
        2);
    assert_mentions(shell_err(), "run.html");
    shell_works("cmp run.html old");
    assert_int_equal(shell_files(), 2);
}

/* The rows of a report are the runs, with their numbers. */
static void test_report(void **state)
{
    (void)state;
    shell_works("mkdir runs && $LA path pendulum --rule gauss2 --init ode --noise .01 --out "
                "runs/a.h5 --plot runs/a.html --json");
    char action[64];
    assert_int_equal(sscanf(strstr(shell_out(), "\"action\": "), "\"action\": %60[^,]", action), 1);
    shell_works("$LA simulate kepler --out runs/b.h5 --quiet && printf x >runs/c.png && "
                "printf x >runs/note.txt && $LA report runs --json");
    assert_close(shell_number("runs"), 2, 0, 0);
    shell_works("sed -n 's/.*id=\"data\">//p' runs/index.html");
    assert_non_null(strstr(shell_out(), "\"page\": \"a.html\""));
    assert_non_null(strstr(shell_out(), "\"name\": \"c.png\", \"type\": \"image/png\", \"data\": "
                                        "\"eA==\""));
    assert_null(strstr(shell_out(), "note.txt"));
    assert_non_null(strstr(shell_out(), "[\"b.h5\", \"kepler\", "));
    assert_non_null(strstr(shell_out(), action));
    shell_works("$LA report runs --quiet && $LA report runs --plot runs/index.html --quiet");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_floats),
        cmocka_unit_test(test_doubles),
        cmocka_unit_test(test_pick),
        cmocka_unit_test_setup(test_view, shell_empty),
        cmocka_unit_test_setup(test_map, shell_empty),
        cmocka_unit_test_setup(test_hostile_names, shell_empty),
        cmocka_unit_test_setup(test_refusals, shell_empty),
        cmocka_unit_test_setup(test_full_disk, shell_empty),
        cmocka_unit_test_setup(test_report, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
