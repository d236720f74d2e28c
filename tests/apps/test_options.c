/* Options from a table: values, defaults, and the message of every wrong use. */
#include "tests/close.h"
#include "apps/options.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

struct values {
    struct common common;
    bool fast;
    const char *file, *rule;
    double rate, tolerance;
    size_t slices, steps;
    struct settings set;
};

#define AT(member) offsetof(struct values, member)

static const struct option table[] = {
    {"fast", NULL, OPTION_FLAG, NULL, "skip the slow part", AT(fast)},
    {"file", "FILE", OPTION_TEXT, NULL, "where from", AT(file)},
    {"rule", "R", OPTION_TEXT, "left", "how", AT(rule)},
    {"rate", "X", OPTION_NUMBER, "1e-3", "learning rate", AT(rate)},
    {"tol", "E", OPTION_NUMBER, NULL, "stop there", AT(tolerance)},
    {"slices", "N", OPTION_COUNT, NULL, "how many", AT(slices)},
    {"steps", "N", OPTION_COUNT, "500", "how often", AT(steps)},
    {"set", "NAME=VALUE", OPTION_SETTINGS, NULL, "a parameter", AT(set)},
};

static const struct command_line line = {
    .name = "try",
    .what = "what it does",
    .arguments = {"SCENE", "[OTHER]"},
    .outputs = true,
    .options = table,
    .n_options = sizeof table / sizeof *table,
    .more = "The end.",
};

enum { MOST = 32 };

/* Parses words separated by blanks; `text` must outlive the values. */
static enum ad_status parse(char *text, struct values *values, struct ad_error *error)
{
    char *words[MOST];
    int n = 0;
    for (char *word = strtok(text, " "); word && n < MOST; word = strtok(NULL, " "))
        words[n++] = word;
    *values = (struct values){0};
    *error = (struct ad_error){0};
    return options_parse(&line, n, words, values, error);
}

static void test_defaults(void **state)
{
    (void)state;
    char text[] = "pendulum";
    struct values v;
    struct ad_error error;
    assert_int_equal(parse(text, &v, &error), AD_OK);
    assert_string_equal(v.common.argument[0], "pendulum");
    assert_null(v.common.argument[1]);
    assert_false(v.fast || v.common.json || v.common.quiet || v.common.help);
    assert_null(v.file);
    assert_string_equal(v.rule, "left");
    assert_true(v.rate == 1e-3);
    assert_true(isnan(v.tolerance));
    assert_true(v.slices == OPTION_NO_COUNT);
    assert_int_equal(v.steps, 500);
    assert_int_equal(v.set.n, 0);
    assert_int_equal(v.common.seed, 1);
    assert_int_equal(v.common.threads, 1);
    options_free(&line, &v);
}

static void test_values(void **state)
{
    (void)state;
    char text[] = "--fast --file=a=b.csv --rate -2.5e-7 a --set m=2 --slices 64 --set=x.y=-1 "
                  "--seed 18446744073709551615 b --csv - --json --tol=0x1p-3 --threads=2";
    struct values v;
    struct ad_error error;
    assert_int_equal(parse(text, &v, &error), AD_OK);
    assert_true(v.fast && v.common.json);
    assert_string_equal(v.file, "a=b.csv");
    assert_true(v.rate == -2.5e-7);
    assert_true(v.tolerance == 0.125);
    assert_int_equal(v.slices, 64);
    assert_true(v.common.seed == UINT64_MAX);
    assert_string_equal(v.common.csv, "-");
    assert_int_equal(v.common.n_arguments, 2);
    assert_string_equal(v.common.argument[1], "b");
    assert_int_equal(v.set.n, 2);
    assert_string_equal(v.set.setting[0].name, "m");
    assert_string_equal(v.set.setting[1].name, "x.y");
    assert_true(v.set.setting[0].value == 2 && v.set.setting[1].value == -1);
    options_free(&line, &v);
}

/* The last one counts. */
static void test_repeated(void **state)
{
    (void)state;
    char text[] = "a --steps 1 --steps 2";
    struct values v;
    struct ad_error error;
    assert_int_equal(parse(text, &v, &error), AD_OK);
    assert_int_equal(v.steps, 2);
}

static void test_wrong(void **state)
{
    (void)state;
    static const struct {
        const char *words, *message;
    } cases[] = {
        {"", "SCENE"},
        {"a b c", "'c'"},
        {"a --slice 3", "--slice --slices"},
        {"a --stesp=3", "--stesp --steps"},
        {"a --jsno", "--jsno --json"},
        {"a --wavefunction", "--wavefunction --help"},
        {"a -n 3", "-n --"},
        {"a --slices", "--slices N"},
        {"a --slices --fast", "--slices N"},
        {"a --slices ten", "--slices 10 'ten'"},
        {"a --slices -3", "--slices 10 '-3'"},
        {"a --slices 3.5", "--slices 10 '3.5'"},
        {"a --slices 99999999999999999999", "--slices 10 '99999999999999999999'"},
        {"a --rate fast", "--rate 0.5 'fast'"},
        {"a --rate 1e-3s", "--rate 0.5 '1e-3s'"},
        {"a --rate nan", "--rate 0.5 'nan'"},
        {"a --rate inf", "--rate 0.5 'inf'"},
        {"a --rate 1e999", "--rate 0.5 '1e999'"},
        {"a --rate=", "--rate X"},
        {"a --file=", "--file FILE"},
        {"a --fast=yes", "--fast 'yes'"},
        {"a --set mass", "--set NAME=VALUE 'mass'"},
        {"a --set =2", "--set NAME=VALUE '=2'"},
        {"a --set mass=heavy", "--set NAME=VALUE 'mass=heavy'"},
        {"a --threads 0", "--threads 1 0"},
        {"a --seed -1", "--seed 10 '-1'"},
        {"a --out f --csv f", "--out --csv 'f'"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[128];
        struct values v;
        struct ad_error error;
        strcpy(text, cases[k].words);
        assert_int_equal(parse(text, &v, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, cases[k].message);
        options_free(&line, &v);
    }
}

/* Whoever asks for help gets it, whatever else is wrong or missing. */
static void test_help_wins(void **state)
{
    (void)state;
    char text[] = "--help --nonsense", version[] = "--version";
    struct values v;
    struct ad_error error;
    assert_int_equal(parse(text, &v, &error), AD_OK);
    assert_true(v.common.help);
    assert_int_equal(parse(version, &v, &error), AD_OK);
    assert_true(v.common.version);
}

static void test_help_text(void **state)
{
    (void)state;
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    options_help(&line, out);
    fclose(out);
    assert_non_null(strstr(text, "leastaction try SCENE [OTHER] [options]\n\nwhat it does\n"));
    assert_non_null(strstr(text, "  --steps N                 how often [500]\n"));
    assert_non_null(strstr(text, "  --tol E                   stop there\n"));
    assert_non_null(strstr(text, "  --out FILE.h5 "));
    assert_non_null(strstr(text, "\nThe end.\n"));
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),  cmocka_unit_test(test_values),
        cmocka_unit_test(test_repeated),  cmocka_unit_test(test_wrong),
        cmocka_unit_test(test_help_wins), cmocka_unit_test(test_help_text),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
