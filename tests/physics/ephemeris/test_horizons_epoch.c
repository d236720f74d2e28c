/* Dates of a Horizons table: known days, and every day there and back. */
#include "physics/ephemeris/horizons.h"
#include "tests/close.h"
#include "tests/mentions.h"

static void test_dates(void **state)
{
    (void)state;
    static const struct {
        double jd;
        const char *date;
    } cases[] = {
        {2451545, "2000-01-01"},     {2459774.5, "2022-07-14"},
        {2299160.5, "1582-10-15"},   {2299159.5, "1582-10-04"},
        {1842713, "0333-01-27"},     {2436116.31, "1957-10-04"},
        {0, "-4712-01-01"},          {1721423.5, "0001-01-01"},
        {1721422.5, "0000-12-31"},   {2415079.4999999, "1900-03-01"},
        {-1931076.5, "-9999-01-01"}, {INFINITY, "unknown"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        char date[32];
        phys_horizons_date(cases[k].jd, date, sizeof date);
        assert_string_equal(date, cases[k].date);
    }
}

/* Every day from 10000 BC to AD 10000 has a date, and the date leads back to the day. */
static void test_dates_there_and_back(void **state)
{
    (void)state;
    enum { DAYS = 400 };
    double jd[DAYS];
    struct phys_horizons table = {.target = "Mars", .n = DAYS, .jd = jd};
    for (double first = -1931500.5; first < 5373800; first += 36000) {
        for (int i = 0; i < DAYS; i++)
            jd[i] = first + i;
        for (size_t i = 0; i < DAYS; i++) {
            char date[32];
            size_t index = DAYS;
            struct ad_error error = {0};
            phys_horizons_date(jd[i], date, sizeof date);
            if (phys_horizons_epoch(&table, date, &index, &error) != AD_OK)
                fail_msg("%s", error.message);
            assert_int_equal(index, i);
        }
    }
}

static void test_epochs(void **state)
{
    (void)state;
    double jd[] = {2459773.5, 2459774.5, 2459775.5};
    const struct phys_horizons table = {
        .target = "Mars", .start_date = "2022-07-13", .n = 3, .jd = jd};
    static const struct {
        const char *from, *expected; /* NULL: index 1 */
    } cases[] = {
        {"1", NULL},
        {"2022-07-14", NULL},
        {"3", "3 Mars 0 2"},
        {"99999999999999999999999", "99999999999999999999999 Mars 0 2"},
        {"2022-07-16", "2022-07-16 Mars 2459773.5 2022-07-13 2022-07-15 1"},
        {"", "'' YYYY-MM-DD"},
        {"-1", "'-1' YYYY-MM-DD"},
        {"2022-07", "'2022-07' YYYY-MM-DD"},
        {"2022-02-30", "'2022-02-30' YYYY-MM-DD"},
        {"2022-13-01", "'2022-13-01' YYYY-MM-DD"},
        {"1582-10-10", "'1582-10-10' YYYY-MM-DD"},
        {"2022-07-14x", "'2022-07-14x' YYYY-MM-DD"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct ad_error error = {0};
        size_t index = 17;
        enum ad_status status = phys_horizons_epoch(&table, cases[k].from, &index, &error);
        assert_int_equal(status, cases[k].expected ? AD_E_ARGUMENT : AD_OK);
        assert_int_equal(index, cases[k].expected ? 17 : 1);
        assert_mentions(error.message, cases[k].expected ? cases[k].expected : "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dates),
        cmocka_unit_test(test_dates_there_and_back),
        cmocka_unit_test(test_epochs),
    };
    return cmocka_run_group_tests_name("horizons_epoch", tests, NULL, NULL);
}
