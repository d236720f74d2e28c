/* CSV: every accepted form of text, every reported damage, and reading back what was written. */
#include "physics/io/csv.h"
#include "tests/autodiff/support.h"
#include "tests/files.h"
#include "tests/mentions.h"

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- tables that are fine ---- */

static void assert_table(const char *text, size_t rows, size_t cols, const double *expected)
{
    struct ad_error error = {0};
    size_t r = 0, c = 0;
    double *values = NULL;
    struct path file = files_write_text("table.csv", text);
    if (phys_table_read(file.text, &r, &c, &values, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(r, rows);
    assert_int_equal(c, cols);
    for (size_t k = 0; k < rows * cols; k++)
        assert_true(values[k] == expected[k]);
    free(values);
}

static void test_every_shape_of_text(void **state)
{
    (void)state;
    static const double expected[] = {0.125, -3.7e5, 41.0625, 9.81, 6.022e23, -1e-3};
    static const char *const texts[] = {
        "0.125,-3.7e5,41.0625\n9.81,6.022e23,-1e-3\n",
        "0.125,-3.7e5,41.0625\n9.81,6.022e23,-1e-3",         /* no newline at the end */
        "0.125, -3.7e5 ,41.0625\r\n9.81,6.022e23,-1e-3\r\n", /* CRLF */
        "0.125;-3.7e5;41.0625\n9.81;6.022e23;-1e-3\n",
        "  0.125 -3.7e5\t41.0625  \n9.81\t\t6.022E+23 -1.e-3\t\n",
        "x1,y1,x2\n0.125,-3.7e5,41.0625\n9.81,6.022e23,-1e-3\n",
        "\xef\xbb\xbfx1 [m],\"y1\",1st\n0.125,-3.7e5,41.0625\n9.81,6.022e23,-1e-3\n",
        "\xef\xbb\xbf+.125,-3.7e5,41.0625\n9.81,6.022e23,-1e-3\n",
        "# a, b\n\n%trial time\n0.125 -3.7e5 41.0625 # first\n \t\n9.81 6.022e23 -1e-3%\n\n#end",
        "+.125,-37e4,4.10625D1\n 9.81,6.022e23,-.001\n",
    };
    for (size_t k = 0; k < LENGTH(texts); k++)
        assert_table(texts[k], 2, 3, expected);
    assert_table("7.25", 1, 1, (double[]){7.25});
    assert_table("1 2,3", 1, 3, (double[]){1, 2, 3});
    assert_table("\"1\",\"2\"\n\"3\",\"4\"\n", 2, 2, (double[]){1, 2, 3, 4});
    assert_table("q\tp\r0.5\t\t1.5\r", 1, 2, (double[]){0.5, 1.5}); /* CR, tabs for looks */
}

static void test_pipe(void **state)
{
    (void)state;
    struct path fifo = files_temporary("fifo");
    assert_int_equal(mkfifo(fifo.text, 0600), 0);
    enum { ROWS = 30000 };
    pid_t writer = fork();
    if (writer == 0) {
        FILE *stream = fopen(fifo.text, "w");
        for (int i = 0; stream && i < ROWS; i++)
            fprintf(stream, "%d,%d.25\n", i, 2 * i);
        _exit(!stream || fclose(stream) != 0);
    }
    size_t rows, cols;
    double *values;
    struct ad_error error = {0};
    assert_int_equal(phys_table_read(fifo.text, &rows, &cols, &values, &error), AD_OK);
    assert_int_equal(rows, ROWS);
    assert_int_equal(cols, 2);
    for (int i = 0; i < ROWS; i++)
        assert_true(values[2 * i] == i && values[2 * i + 1] == 2 * i + 0.25);
    free(values);
    assert_int_equal(waitpid(writer, NULL, 0), writer);
}

static void test_gzip(void **state)
{
    (void)state;
    struct path file = files_temporary("matrix.csv.gz");
    gzFile stream = gzopen(file.text, "wb");
    enum { ROWS = 9000 }; /* more than one read */
    for (int i = 0; stream && i < ROWS; i++)
        gzprintf(stream, "%d;%d.25\n", i, 2 * i);
    assert_int_equal(gzclose(stream), Z_OK);
    size_t rows, cols;
    double *values;
    struct ad_error error = {0};
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &values, &error), AD_OK);
    assert_true(rows == ROWS && cols == 2);
    for (int i = 0; i < ROWS; i++)
        assert_true(values[2 * i] == i && values[2 * i + 1] == 2 * i + 0.25);
    free(values);
}

/* The published starts: their shapes, and a value read by eye. */
static void test_reference_paths(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        size_t rows, cols;
        double first;
    } cases[] = {{"dblpend", 200, 2, 1.346396851538482764e+00},
                 {"ephemeris", 65, 10, -1.351726041276556969e+09},
                 {"freebody", 60, 1, 0},
                 {"gas", 100, 100, 4.834044009405148445e-01},
                 {"pendulum", 100, 1, 1.570796326794896558e+00},
                 {"threebody", 100, 6, 4.000000000000000222e-01}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        char name[64];
        snprintf(name, sizeof name, "ncf/%s_init.csv", cases[k].name);
        struct path file = files_data(name);
        size_t rows, cols;
        double *values;
        struct ad_error error = {0};
        if (phys_table_read(file.text, &rows, &cols, &values, &error) != AD_OK)
            fail_msg("%s", error.message);
        assert_int_equal(rows, cases[k].rows);
        assert_int_equal(cols, cases[k].cols);
        assert_true(values[0] == cases[k].first);
        free(values);
    }
}

/* ---- damage ---- */

static void assert_refused(const char *text, size_t size, const char *expected)
{
    struct ad_error error = {0};
    struct path file = files_write("bad.csv", text, size);
    size_t rows = 17, cols = 19;
    double marker = 0, *values = &marker;
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &values, &error), AD_E_INPUT);
    assert_int_equal(error.status, AD_E_INPUT);
    assert_memory_equal(error.message, file.text, strlen(file.text));
    assert_memory_equal(error.message + strlen(file.text), expected, strcspn(expected, " "));
    assert_mentions(error.message, expected);
    assert_true(rows == 17 && cols == 19 && values == &marker); /* nothing is touched */
}

static void test_damage_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *expected;
    } cases[] = {
        {"", ":0: rows"},
        {"\n# nothing\n\n", ":3: rows"},
        {"x,y\n", ":1: rows"},
        {"1,2\n3,abc\n", ":2:3: column 2 'abc'"},
        {"1,2\n3,4x\n", ":2:3: column 2 '4x'"},
        {"x,y\na,b\n1,2\n", ":2:1: column 'x' 'a'"},
        {"0.5,abc\n", ":1:5: column 2 'abc'"},
        {"abc,0.5\n", ":1:1: column 1 'abc'"},
        {"\xef\xbb\xbf+.5,abc\n", ":1:5: column 2 'abc'"},
        {"1,nan\n", ":1:3: column 2 'nan'"},
        {"nan,-NaN\n1,2\n", ":1:1: column 1 'nan'"},
        {"1 2\n3 -Inf\n", ":2:3: column 2 '-Inf'"},
        {"1 2\n3 1e999\n", ":2:3: column 2 '1e999'"},
        {"1,2,3\n4,5\n", ":2:4: 3 columns 2"},
        {"# c\nx y\n1 2\n3 4 5\n", ":4:6: 2 columns 3"},
        {"one two three\n1 2\n3 4 5\n", ":3:6: 2 columns first row 3"},
        {"1,,2\n", ":1:3: column 2 empty"},
        {",1\n", ":1:1: column 1 empty"},
        {"1,2,\n", ":1:5: column 3 empty"},
        {"1,2;3\n", ":1:1: column 1 '1' '2' decimal comma"},
        {"1;2\n1,5;2\n", ":2:1: column 1 '1' '5' decimal comma"},
        {"1 2\n3 a_word_longer_than_any_message_wants\n",
         ":2:3: column 2 'a_word_longer_than_any_mes...'"},
        {"1 0x10\n", ":1:3: column 2 '0x10'"},
        {"1 2e\n", ":1:3: column 2 '2e'"},
        {"1 \x01\xff\n", ":1:3: column 2 '?\?'"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++)
        assert_refused(cases[k].text, strlen(cases[k].text), cases[k].expected);
    assert_refused("1,2\n3,\0004\n", 9, ":2:3: column 2 '?4'");
}

static void test_files_that_cannot_be_read(void **state)
{
    (void)state;
    size_t rows, cols;
    double *values;
    struct ad_error error = {0};
    struct path file = files_temporary("absent.csv");
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &values, &error), AD_E_IO);
    assert_mentions(error.message, "absent.csv");
    error = (struct ad_error){0};
    file = files_temporary("");
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &values, &error), AD_E_IO);
    assert_mentions(error.message, "directory");
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &values, NULL), AD_E_IO);
}

/* ---- all digits ---- */

static void test_written_tables_read_the_same(void **state)
{
    (void)state;
    uint64_t seed = 41;
    enum { ROWS = 211, COLS = 7 };
    static double values[ROWS * COLS];
    for (size_t k = 0; k < LENGTH(values); k++) {
        do {
            uint64_t bits = random_bits(&seed);
            memcpy(&values[k], &bits, sizeof bits);
        } while (!isfinite(values[k]));
    }
    struct path file = files_temporary("written.csv");
    for (int named = 0; named < 2; named++) {
        struct ad_error error = {0};
        size_t rows, cols;
        double *back;
        const char *header = named ? "a,b,c,d,e,f,g" : NULL;
        files_write_csv(file.text, header, ROWS, COLS, values);
        assert_int_equal(phys_table_read(file.text, &rows, &cols, &back, &error), AD_OK);
        assert_int_equal(rows, ROWS);
        assert_int_equal(cols, COLS);
        assert_memory_equal(back, values, sizeof values);
        free(back);
    }
}

/* One compiled here, of numbers alone: a whole language takes two seconds. localedef warns of the
   parts that are missing, so that its exit status says nothing. */
static const char *made_locale(void)
{
    char source[512] = "LC_NUMERIC\ndecimal_point \",\"\nthousands_sep \"\"\ngrouping -1\n"
                       "END LC_NUMERIC\n";
    static const char *const others[] = {"CTYPE", "COLLATE", "TIME", "MONETARY", "MESSAGES"};
    char command[3 * PATH_ROOM];
    for (size_t k = 0; k < LENGTH(others); k++) {
        char category[64];
        snprintf(category, sizeof category, "LC_%s\ncopy \"POSIX\"\nEND LC_%s\n", others[k],
                 others[k]);
        strcat(source, category);
    }
    struct path folder = files_temporary(""), written = files_write_text("comma.def", source);
    snprintf(command, sizeof command,
             "localedef -c -i '%s' -f ANSI_X3.4-1968 '%s' >/dev/null 2>&1 || :", written.text,
             files_temporary("comma").text);
    if (system(command) != 0)
        return NULL;
    setenv("LOCPATH", folder.text, 1);
    return setlocale(LC_NUMERIC, "comma");
}

/* A comma for a decimal point, where the machine has such a locale, changes nothing. */
static void test_locale(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "nl_NL.UTF-8"};
    const char *found = NULL;
    for (size_t k = 0; k < LENGTH(names) && !found; k++)
        found = setlocale(LC_NUMERIC, names[k]);
    if (!found)
        found = made_locale();
    if (!found) {
        print_message("skipped: no locale with a decimal comma\n");
        skip();
    }
    double expected[] = {1.5, 3.25e-200};
    struct ad_error error = {0};
    size_t rows, cols;
    double *back = NULL;
    struct path file = files_write_text("locale.csv", "1.5,3.25e-200\n");
    enum ad_status read = phys_table_read(file.text, &rows, &cols, &back, &error);
    setlocale(LC_NUMERIC, "C");
    assert_int_equal(read, AD_OK);
    assert_int_equal(cols, 2);
    assert_memory_equal(back, expected, sizeof expected);
    free(back);
}

/* Rows before the damage are there; its status is what is returned. */
static void test_damage_ends_a_read(void **state)
{
    (void)state;
    struct path file = files_write_text("rows.csv", "a,b\n1,2\n3,4\n5,x\n7,8\n");
    struct ad_error error = {0};
    struct phys_csv csv = {0};
    double a[4] = {0}, b[4] = {0}, *const to[] = {a, b};
    size_t rows;
    assert_int_equal(phys_csv_open(&csv, file.text, 0, &error), AD_OK);
    assert_int_equal(phys_csv_read(&csv, 4, to, 1, &rows, &error), AD_E_INPUT);
    assert_int_equal(error.status, AD_E_INPUT);
    assert_mentions(error.message, "rows.csv:4:3: 'x'");
    assert_true(rows == 2 && a[1] == 3 && b[1] == 4 && a[3] == 0);
    phys_csv_close(&csv);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_damage_ends_a_read),
        cmocka_unit_test(test_every_shape_of_text),
        cmocka_unit_test(test_pipe),
        cmocka_unit_test(test_gzip),
        cmocka_unit_test(test_reference_paths),
        cmocka_unit_test(test_damage_is_named),
        cmocka_unit_test(test_files_that_cannot_be_read),
        cmocka_unit_test(test_written_tables_read_the_same),
        cmocka_unit_test(test_locale),
    };
    return cmocka_run_group_tests_name("table", tests, files_setup, files_teardown);
}
