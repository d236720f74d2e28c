/* Horizons tables of several bodies from one folder. */
#include "physics/ephemeris/horizons.h"
#include "tests/close.h"
#include "tests/files.h"
#include "horizons_text.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

/* A folder with these tables; the names of the files tell nothing. */
static struct path make_folder(const char *name, size_t n, const char *const targets[])
{
    struct path folder = files_temporary(name);
    assert_int_equal(mkdir(folder.text, 0700), 0);
    for (size_t k = 0; k < n; k++) {
        char file[PATH_ROOM];
        struct states states = random_states(targets[k], (unsigned)k);
        char *text = print_table(&states, &plain_layout);
        snprintf(file, sizeof file, "%s/t%zu.txt", name, k);
        files_write_text(file, text);
        free(text);
    }
    return folder;
}

static void edit(const char *file, const char *from, const char *to)
{
    size_t size;
    char *text = files_read(files_temporary(file).text, &size), *new = replaced(text, from, to);
    files_write_text(file, new);
    free(new);
    free(text);
}

static void assert_folder(const char *folder, const char *bodies, enum ad_status status,
                          const char *expected)
{
    struct phys_horizons *tables = NULL;
    struct ad_error error = {0};
    size_t n = 0;
    assert_int_equal(phys_horizons_folder(folder, bodies, &n, &tables, &error), status);
    assert_null(tables);
    assert_mentions(error.message, expected);
}

static const char *const planets[] = {"Sun (10)",   "Mercury (199)",     "Earth (399)",
                                      "Mars (499)", "1 Ceres (A801 AA)", "Jupiter Barycenter (5)"};

static void test_folder_by_name_and_id(void **state)
{
    (void)state;
    struct path folder = make_folder("bodies", LENGTH(planets), planets);
    files_write_text("bodies/README", "Tables of the planets.\n");
    files_write_text("bodies/broken.txt", "Target body name: Vulcan (1)\nno table\n");
    assert_int_equal(mkdir(files_temporary("bodies/sub").text, 0700), 0);
    static const int expected[] = {3, 0, 2, 4, 5, 1};
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t n;
    if (phys_horizons_folder(folder.text, " MARS,10, earth ,ceres,jupiter,199", &n, &tables,
                             &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(n, LENGTH(expected));
    for (size_t k = 0; k < n; k++) {
        struct states states = random_states(planets[expected[k]], (unsigned)expected[k]);
        assert_states(&tables[k], &states, 3);
    }
    free_tables(tables, n);
}

static void test_folder_prefers_the_exact_name(void **state)
{
    (void)state;
    static const char *const both[] = {"Mars Barycenter (4)", "Mars (499)", "4 Vesta (A807 FA)"};
    struct path folder = make_folder("both", 3, both);
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t n;
    assert_int_equal(phys_horizons_folder(folder.text, "mars,4", &n, &tables, &error), AD_OK);
    assert_int_equal(tables[0].id, 499);
    assert_int_equal(tables[1].id, 4);
    free_tables(tables, n);
}

static void test_folder_refusals(void **state)
{
    (void)state;
    struct path folder = make_folder("refused", LENGTH(planets), planets);
    const char *name = folder.text;
    assert_folder(name, "sun,vulcan", AD_E_INPUT, "'vulcan' Sun Mercury Earth Mars Ceres");
    assert_folder(name, "sun,10", AD_E_ARGUMENT, "'sun' '10'");
    assert_folder(name, "", AD_E_ARGUMENT, "ids");
    assert_folder(name, "sun,,mars", AD_E_ARGUMENT, "ids");
    assert_int_equal(mkdir(files_temporary("empty").text, 0700), 0);
    assert_folder(files_temporary("empty").text, "sun", AD_E_INPUT, "empty tables");
    assert_folder(files_temporary("nowhere").text, "sun", AD_E_IO, "nowhere");
    files_write_text("refused/venus.txt", "Target body name: Venus (299)\n");
    assert_folder(name, "sun,venus", AD_E_INPUT, "venus.txt:1:");
    files_write_text("refused/venus.txt", "");
    assert_folder(name, "sun,venus", AD_E_INPUT, "venus.txt:0:");
    char *text =
        print_table(&(struct states){.target = "Mars (499)", .first = 1, .step = 1}, &plain_layout);
    files_write_text("refused/again.txt", text);
    free(text);
    assert_folder(name, "mars", AD_E_INPUT, "again.txt t3.txt");
}

/* Whatever differs, both files are named. */
static void test_folder_disagreements(void **state)
{
    (void)state;
    static const struct {
        const char *from, *to, *expected;
    } cases[] = {
        {"Solar System Barycenter (0)", "Sun (10)",
         "t0.txt t3.txt centre Solar System Barycenter (0) Sun (10)"},
        {"Ecliptic of J2000.0", "ICRF", "t0.txt t3.txt frame Ecliptic J2000.0 'ICRF'"},
        {"$$EOE", "2459775.500000000 =\n1 2 3\n4 5 6\n7 8 9\n$$EOE", "t0.txt t3.txt epochs 4 5"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        char name[32], file[64];
        snprintf(name, sizeof name, "differ%zu", k);
        snprintf(file, sizeof file, "%s/t3.txt", name);
        struct path folder = make_folder(name, LENGTH(planets), planets);
        edit(file, cases[k].from, cases[k].to);
        assert_folder(folder.text, "sun,earth,mars", AD_E_INPUT, cases[k].expected);
    }
    struct path folder = make_folder("shifted", LENGTH(planets), planets);
    struct states states = random_states("Mars (499)", 3);
    states.first += 0.5;
    char *text = print_table(&states, &plain_layout);
    files_write_text("shifted/t3.txt", text);
    free(text);
    assert_folder(folder.text, "sun,mars", AD_E_INPUT,
                  "t0.txt t3.txt epochs 0 2459774.500000000 2459775.000000000");
}

/* A damaged table matters only to whom it concerns. */
static void test_folder_reads_only_what_is_wanted(void **state)
{
    (void)state;
    struct path folder = make_folder("partly", LENGTH(planets), planets);
    edit("partly/t3.txt", " VX=", " VX= fast");
    assert_folder(folder.text, "sun,mars", AD_E_INPUT, "t3.txt:25:6: VX");
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t n;
    assert_int_equal(phys_horizons_folder(folder.text, "sun,earth", &n, &tables, &error), AD_OK);
    free_tables(tables, n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_folder_by_name_and_id),
        cmocka_unit_test(test_folder_prefers_the_exact_name),
        cmocka_unit_test(test_folder_refusals),
        cmocka_unit_test(test_folder_disagreements),
        cmocka_unit_test(test_folder_reads_only_what_is_wanted),
    };
    return cmocka_run_group_tests_name("horizons_folder", tests, files_setup, files_teardown);
}
