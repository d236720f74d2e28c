/* Numbers in text, against strtod. */
#include "physics/io/numbers.h"
#include "tests/autodiff/support.h"

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void assert_reads_as_strtod(const char *text)
{
    double value = 0, expected = strtod(text, NULL);
    const char *end = phys_text_number(text, text + strlen(text), &value);
    if (!end || *end || memcmp(&value, &expected, sizeof value) != 0)
        fail_msg("%s reads as %.17g, expected %.17g", text, value, expected);
}

/* Doubles of all magnitudes with fewer, enough and more digits than they need. */
static void test_numbers_of_all_sizes(void **state)
{
    (void)state;
    uint64_t seed = 41;
    static const char *const formats[] = {"%.17g", "%.18e", "%.15E", "%.3f",
                                          "%.6g",  "%.40e", "%.0f"};
    for (int i = 0; i < 200000; i++) {
        uint64_t bits = random_bits(&seed);
        double value;
        char text[512];
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value))
            continue;
        if (i % 2) /* every other one of ordinary size */
            value = (double)(int64_t)bits * pow(10, (double)(bits % 40) - 30);
        snprintf(text, sizeof text, formats[bits % LENGTH(formats)], value);
        assert_reads_as_strtod(text);
    }
}

/* As many digits as 64 bits hold, with every exponent for which integers do it, and some beyond;
   half with -27, where the remainder of the division decides the rounding most often. */
static void test_numbers_of_19_digits(void **state)
{
    (void)state;
    uint64_t seed = 42;
    for (int i = 0; i < 200000; i++) {
        char text[64];
        snprintf(text, sizeof text, "%llue%d",
                 (unsigned long long)(random_bits(&seed) % 10000000000000000000u),
                 i % 2 ? -27 : i / 2 % 61 - 30);
        assert_reads_as_strtod(text);
    }
}

/* Numbers halfway between two doubles go to the even one, and a hair above goes up. */
static void test_numbers_halfway(void **state)
{
    (void)state;
    uint64_t seed = 43;
    static const char *const tails[] = {".5", ".500", ".50000001", ".4999999", "5e-1", "50001e-4"};
    for (int i = 0; i < 20000; i++) {
        uint64_t whole = (UINT64_C(1) << 52) + (random_bits(&seed) >> 12);
        char text[64];
        snprintf(text, sizeof text, "%llu%s", (unsigned long long)whole, tails[i % 6]);
        assert_reads_as_strtod(text);
    }
}

static void test_numbers_at_the_edges(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "0",
        "-0",
        "+.5",
        "5.",
        "0e0",
        "00012.500e+00",
        "1e22",
        "1e23",
        "9007199254740993",
        "9007199254740992.99999999999999999999",
        "18446744073709551616",
        "1e-400",
        "-1e400",
        "4.9406564584124654e-324",
        "2.4703282292062328e-324",
        "1.7976931348623157e308",
        "2.2250738585072011e-308",
        "0.000000000000000000000000000000000000000001234567890123456789",
        "123456789012345678901234567890",
        "1e99999999999999999999",
        "1e-99999999999999999999",
        "0.1e1000000000000",
        "9999999999999999999e27",
        "9999999999999999999e-27",
    };
    for (size_t k = 0; k < LENGTH(texts); k++)
        assert_reads_as_strtod(texts[k]);
}

/* 1 + 2^-53 is halfway to the next double: 1 followed by 900 zeros decides. */
static void test_numbers_of_many_digits(void **state)
{
    (void)state;
    char text[1200] = "1.00000000000000011102230246251565404236316680908203125";
    assert_reads_as_strtod(text);
    size_t n = strlen(text);
    memset(text + n, '0', 900);
    assert_reads_as_strtod(text);
    strcpy(text + n + 900, "1e0");
    assert_reads_as_strtod(text);
    double value;
    assert_non_null(phys_text_number(text, text + strlen(text), &value));
    assert_true(value == 1 + 2 * 0x1p-53);
}

static void test_numbers_end_where_they_end(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int length; /* 0: none */
        double value;
    } cases[] = {
        {"1.5abc", 3, 1.5}, {"2e", 1, 2},  {"2e+", 1, 2}, {"1.2.3", 3, 1.2}, {"1d2", 3, 100},
        {"1D-2,", 4, 0.01}, {"-", 0, 0},   {".", 0, 0},   {"", 0, 0},        {"e5", 0, 0},
        {"nan", 0, 0},      {"inf", 0, 0}, {"+-1", 0, 0}, {"0x10", 1, 0},    {" 1", 0, 0},
        {"-.e1", 0, 0},     {"1,5", 1, 1},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        double value = 0;
        const char *text = cases[k].text,
                   *end = phys_text_number(text, text + strlen(text), &value);
        assert_int_equal(end ? end - text : 0, cases[k].length);
        assert_true(value == cases[k].value);
    }
    double value;
    const char *text = "12345"; /* nothing is read beyond the end it is given */
    assert_ptr_equal(phys_text_number(text, text + 2, &value), text + 2);
    assert_true(value == 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers_of_all_sizes),
        cmocka_unit_test(test_numbers_of_19_digits),
        cmocka_unit_test(test_numbers_halfway),
        cmocka_unit_test(test_numbers_at_the_edges),
        cmocka_unit_test(test_numbers_of_many_digits),
        cmocka_unit_test(test_numbers_end_where_they_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
