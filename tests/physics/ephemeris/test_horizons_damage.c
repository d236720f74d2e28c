/* Damaged Horizons tables are refused, naming file, line, column and what was expected there. */
#include "physics/ephemeris/horizons.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "horizons_text.h"

#include <stdlib.h>
#include <string.h>

static void assert_refused(const char *text, size_t size, const char *expected)
{
    struct phys_horizons table;
    struct ad_error error = {0};
    struct path file = files_write("bad.txt", text, size);
    assert_int_equal(phys_horizons_read(file.text, &table, &error), AD_E_INPUT);
    assert_int_equal(error.status, AD_E_INPUT);
    assert_null(table.jd);
    assert_null(table.position);
    assert_memory_equal(error.message, file.text, strlen(file.text));
    assert_int_equal(error.message[strlen(file.text)], ':');
    if (expected) {
        assert_memory_equal(error.message + strlen(file.text) + 1, expected,
                            strcspn(expected, " "));
        assert_mentions(error.message, expected);
    }
}

/* Wherever a table stops short of $$EOE it is refused, never a crash or a shorter table. */
static void test_every_truncation(void **state)
{
    (void)state;
    static const struct layout layouts[] = {{.form = FORM_LABELLED, .type = 3, .units = "KM-S"},
                                            {.form = FORM_CSV, .type = 2, .units = "AU-D"},
                                            {.form = FORM_BARE, .type = 1, .units = "KM-D"}};
    struct states states = random_states("Mars (499)", 11);
    for (size_t k = 0; k < LENGTH(layouts); k++) {
        char *text = print_table(&states, &layouts[k]);
        size_t whole = (size_t)(strstr(text, "$$EOE") - text) + 5;
        for (size_t size = 0; size < whole; size++)
            assert_refused(text, size, NULL);
        struct phys_horizons table = read_fine(files_write("whole.txt", text, whole).text);
        assert_states(&table, &states, layouts[k].type);
        phys_horizons_free(&table);
        free(text);
    }
}

struct damage {
    const char *from, *to, *expected;
};

static void assert_damage(const struct layout *layout, const struct damage *damage, size_t n)
{
    struct states states = random_states("Mars (499)", 23);
    char *text = print_table(&states, layout);
    for (size_t k = 0; k < n; k++) {
        char *bad = replaced(text, damage[k].from, damage[k].to);
        assert_refused(bad, strlen(bad), damage[k].expected);
        free(bad);
    }
    free(text);
}

static void test_damaged_headers(void **state)
{
    (void)state;
    static const struct damage damage[] = {
        {"$$SOE", "$$", "44: $$SOE"},
        {"Target body", "Tar", "22: Target"},
        {"Center body name:", "Center body name ", "22: Center"},
        {"Output units", "", "22: Output units"},
        {"Reference frame", "", "22: Reference frame"},
        {"KM-S", "PC-Y", "22: KM-S KM-D AU-D 'PC-Y'"},
        {"GEOMETRIC cartesian states", "GEOMETRIC osculating elements",
         "22: GEOMETRIC cartesian states GEOMETRIC osculating elements"},
        {"JDTDB", "JDUT", "22: TDB JDTDB JDUT"},
        {"JDTDB", "", "22: column JDTDB X Y Z"},
        {"   X     Y     Z\n", "", "21: columns X Y Z"},
    };
    assert_damage(&plain_layout, damage, LENGTH(damage));
}

static void test_damaged_records(void **state)
{
    (void)state;
    static const struct damage damage[] = {
        {"$$EOE\n", "", "39:1: epoch '**************************...'"},
        {"$$EOE", "$$SOE", "39:1: epoch '$$SOE'"},
        {"Barycentric Dynamical", "\n$$SOE\n", "45: $$SOE"},
        {"2459774.500000000", "today", "23:1: epoch 'today'"},
        {"2459774.500000000", "1e300", "23:1: 1e+300"},
        {"2459774.500000000 =", "2459774.500000000", "23:19: '=' epoch 'A.D.'"},
        {"2459774.750000000", "2459774.500000000", "27:1: epoch 2459774.500000000"},
        {"2459775.250000000", "2459774.250000000",
         "35:1: epoch 2459775.000000000 2459774.250000000"},
        {"2459775.250000000", "2459775.500000000", "35:1: step 0.25 0.5"},
        {" X =", " X = NaN ", "24:6: X 'NaN'"},
        {" X =", " X = 1e999 ", "24:6: X '1e999'"},
        {"-2.239185595350279E+08", "1e308", "26: 1e308"},
        {" X =", " X  ", "24:5: expected '=' after X, found '-2.239185595350279E+08'"},
        {" X =", " Q =", "24:2: expected X, found 'Q'"},
        {"\n VX=", " 7\n VX=", "24:80: Z"},
        {" VX=", " V=", "25:2: expected VX, found 'V='"},
        {" VX=", " VX=fast", "25:5: VX 'fast'"},
        {" VX=", "\n VX=", "25:1: VX"},
        {" VX=", "$$EOE\n", "25:1: VX '$$EOE'"},
        {" RR=", " RR= x", "26:58: RR 'x'"},
    };
    assert_damage(&plain_layout, damage, LENGTH(damage));
}

static void test_damaged_csv(void **state)
{
    (void)state;
    static const struct layout csv = {.form = FORM_CSV, .type = 1, .units = "KM-S"};
    static const struct damage damage[] = {
        {"2459774.500000000,", "2459774.500000000", "20:19: ',' epoch 'A.D.'"},
        {"00.0000, ", "00.0000, -,", "20:52: X '-'"},
        {"00.0000, ", "00.0000, nan,", "20:52: X 'nan'"},
        {"00.0000, ", "00.0000, ,", "20:52: X ','"},
        {"00.0000, ", "00.0000, 1,", NULL},
        {"$$EOE", "2459775.5, A.D., 1, 2\n$$EOE", "24:22: ',' Y"},
        {"$$EOE", "", "25:1: epoch '**************************...'"},
    };
    assert_damage(&csv, damage, LENGTH(damage));
}

static void test_no_records(void **state)
{
    (void)state;
    struct states states = random_states("Mars (499)", 1);
    char *text = print_table(&states, &plain_layout),
         *bad = replaced(text, "$$SOE\n", "$$SOE\n$$EOE\n");
    assert_refused(bad, strlen(bad), "23: $$SOE $$EOE");
    free(bad);
    free(text);
}

static void test_not_text(void **state)
{
    (void)state;
    static const char zero[] = "Target body name\n\0\n$$SOE\n";
    assert_refused(zero, sizeof zero - 1, "2: zero byte");
    static char wide[10000];
    memset(wide, '1', sizeof wide);
    assert_refused(wide, sizeof wide, "1: $$SOE");
    struct states states = random_states("Mars (499)", 1);
    char *text = print_table(&states, &plain_layout), *at = strstr(text, "$$SOE\n") + 6;
    char *bad = calloc(1, sizeof wide + strlen(text));
    assert_non_null(bad);
    memcpy(bad, text, (size_t)(at - text));
    memcpy(bad + (at - text), wide, sizeof wide);
    assert_refused(bad, strlen(bad), "23: 4095 characters");
    free(bad);
    free(text);
}

static void test_files_that_cannot_be_read(void **state)
{
    (void)state;
    struct phys_horizons table;
    struct ad_error error = {0};
    assert_int_equal(phys_horizons_read(files_temporary("absent").text, &table, &error), AD_E_IO);
    assert_mentions(error.message, "absent");
    error = (struct ad_error){0};
    assert_int_equal(phys_horizons_read(files_temporary("").text, &table, &error), AD_E_IO);
    phys_horizons_free(&table);
    phys_horizons_free(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_truncation),
        cmocka_unit_test(test_damaged_headers),
        cmocka_unit_test(test_damaged_records),
        cmocka_unit_test(test_damaged_csv),
        cmocka_unit_test(test_no_records),
        cmocka_unit_test(test_not_text),
        cmocka_unit_test(test_files_that_cannot_be_read),
    };
    return cmocka_run_group_tests_name("horizons_damage", tests, files_setup, files_teardown);
}
