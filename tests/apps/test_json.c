/* JSON output: one line, all digits, all bytes escaped that must be. */
#include "tests/close.h"
#include "apps/output/json.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

static char *text;
static size_t length;

static void begin(struct json *json) { json_open(json, open_memstream(&text, &length)); }

static void expect(struct json *json, const char *expected)
{
    json_close(json);
    fclose(json->out);
    assert_string_equal(text, expected);
    free(text);
}

static void test_empty(void **state)
{
    (void)state;
    struct json json;
    begin(&json);
    expect(&json, "{}\n");
}

static void test_members(void **state)
{
    (void)state;
    struct json json;
    begin(&json);
    json_text(&json, "scene", "gas");
    json_text(&json, "none", NULL);
    json_count(&json, "slices", SIZE_MAX);
    json_bool(&json, "passed", true);
    json_bool(&json, "failed", false);
    json_null(&json, "morse_index");
    expect(&json, "{\"scene\": \"gas\", \"none\": null, \"slices\": 18446744073709551615, "
                  "\"passed\": true, \"failed\": false, \"morse_index\": null}\n");
}

static void test_nesting(void **state)
{
    (void)state;
    struct json json;
    begin(&json);
    json_array(&json, "rows");
    json_object(&json, NULL);
    json_count(&json, "a", 1);
    json_end_object(&json);
    json_object(&json, NULL);
    json_end_object(&json);
    json_number(&json, NULL, 0.5);
    json_end_array(&json);
    json_object(&json, "unit");
    json_text(&json, "x", "m");
    json_end_object(&json);
    json_count(&json, "n", 2);
    expect(&json, "{\"rows\": [{\"a\": 1}, {}, 0.5], \"unit\": {\"x\": \"m\"}, \"n\": 2}\n");
}

/* Every double comes back as it was. */
static void test_digits(void **state)
{
    (void)state;
    const double values[] = {
        0.1 + 0.2, 1.0 / 3, DBL_MIN, DBL_MAX, 5e-324, -0.0, 3.7499271032097485e33};
    for (size_t k = 0; k < sizeof values / sizeof *values; k++) {
        struct json json;
        begin(&json);
        json_number(&json, "x", values[k]);
        json_close(&json);
        fclose(json.out);
        double back = strtod(strchr(text, ':') + 1, NULL);
        assert_memory_equal(&back, &values[k], sizeof back);
        free(text);
    }
}

static void test_not_finite(void **state)
{
    (void)state;
    struct json json;
    begin(&json);
    json_number(&json, "a", NAN);
    json_number(&json, "b", INFINITY);
    json_number(&json, "c", -INFINITY);
    expect(&json, "{\"a\": null, \"b\": null, \"c\": null}\n");
}

static void test_escapes(void **state)
{
    (void)state;
    struct json json;
    begin(&json);
    json_text(&json, "a", "say \"\\\" \n\t\x01\x7f/");
    json_text(&json, "b",
              "\xc3\xa9 \xe2\x99\x83 \xf0\x9f\x9a\x80"); /* e acute, Jupiter, a rocket */
    expect(&json, "{\"a\": \"say \\\"\\\\\\\" \\u000a\\u0009\\u0001\\u007f/\", "
                  "\"b\": \"\xc3\xa9 \xe2\x99\x83 \xf0\x9f\x9a\x80\"}\n");
    begin(&json); /* right to left, a mark of Arabic, a tag */
    json_text(&json, "a", "\xe2\x80\xae \xd8\x9c \xf3\xa0\x81\x81");
    expect(&json, "{\"a\": \"\\u202e \\u061c \\udb40\\udc41\"}\n");
}

/* Stray continuation, truncated sequence, overlong slash, surrogate, beyond U+10FFFF. */
static void test_bytes_that_are_not_utf8(void **state)
{
    (void)state;
    const char *const bad[] = {"\x80", "\xe2\x99", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"};
    const size_t bytes[] = {1, 2, 2, 3, 4};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char expected[64] = "{\"x\": \"";
        struct json json;
        begin(&json);
        json_text(&json, "x", bad[k]);
        for (size_t b = 0; b < bytes[k]; b++)
            strcat(expected, "\\ufffd");
        expect(&json, strcat(expected, "\"}\n"));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_members),
        cmocka_unit_test(test_nesting),
        cmocka_unit_test(test_digits),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_escapes),
        cmocka_unit_test(test_bytes_that_are_not_utf8),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
