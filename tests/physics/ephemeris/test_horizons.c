/* The Horizons reader on real tables, on every form of one table, and on a stream. */
#include "physics/ephemeris/horizons.h"
#include "physics/scenes/ephemeris.h"
#include "physics/io/csv.h"
#include "tests/close.h"
#include "tests/files.h"
#include "horizons_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* ---- the real tables ---- */

static const char *const all = "sun,mercury,venus,earth,mars";

static void read_real(struct phys_horizons **tables)
{
    struct ad_error error = {0};
    struct path folder = files_data("horizons");
    size_t n;
    if (phys_horizons_folder(folder.text, all, &n, tables, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(n, 5);
}

static void test_real_header(void **state)
{
    (void)state;
    struct phys_horizons table = read_fine(files_data("horizons/mars.txt").text);
    assert_string_equal(table.target, "Mars");
    assert_int_equal(table.id, 499);
    assert_string_equal(table.center, "Solar System Barycenter (0)");
    assert_string_equal(table.frame, "Ecliptic of J2000.0");
    assert_string_equal(table.units, "KM-S");
    assert_string_equal(table.start_date, "2022-02-16");
    assert_int_equal(table.n, 365);
    assert_true(table.jd[0] == 2459626.5 && table.jd[364] == 2459990.5);
    assert_true(table.position[0] == -3.889389943988803E+07 * 1e3);
    assert_true(table.position[3 * 364 + 2] == 6.763447638391584E+06 * 1e3);
    assert_true(table.velocity[3 * 364 + 1] == -5.980272542184050E+00 * 1e3);
    phys_horizons_free(&table);
}

/* The published start was made from these tables: its first row is their epoch 148, x and y. */
static void test_real_states_are_those_of_the_published_start(void **state)
{
    (void)state;
    struct path file = files_data("ncf/ephemeris_init.csv");
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t rows, cols, index;
    double *start;
    read_real(&tables);
    assert_int_equal(phys_table_read(file.text, &rows, &cols, &start, &error), AD_OK);
    assert_int_equal(phys_horizons_epoch(&tables[1], "148", &index, &error), AD_OK);
    assert_true(index + rows <= tables[1].n);
    for (size_t k = 0; k < 5; k++)
        for (size_t d = 0; d < 2; d++)
            assert_close(tables[k].position[3 * index + d], start[2 * k + d], 2.3e-16, 0);
    free(start);
    free_tables(tables, 5);
}

static void test_real_states_are_the_constants_of_the_scene(void **state)
{
    (void)state;
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t index;
    read_real(&tables);
    assert_int_equal(phys_horizons_epoch(tables, PHYS_EPHEMERIS_DATE, &index, &error), AD_OK);
    assert_int_equal(index, 148);
    assert_true(tables->jd[index] == PHYS_EPHEMERIS_JD);
    for (size_t k = 0; k < PHYS_EPHEMERIS_BODIES; k++) {
        const struct ephemeris_body *body = &phys_ephemeris_bodies[k];
        assert_int_equal(tables[k].id, body->id);
        assert_close(tables[k].gm, body->gm, 2.3e-16, 0);
        for (size_t d = 0; d < 3; d++) {
            assert_true(tables[k].position[3 * index + d] == body->position[d]);
            assert_true(tables[k].velocity[3 * index + d] == body->velocity[d]);
        }
    }
    free_tables(tables, 5);
}

/* Velocities are the rates of positions: central differences agree to their own error, which is
   (w dt)^2/6 of Mercury's 59 km/s at its nearest, where w dt is 0.11. */
static void test_real_velocities_are_rates(void **state)
{
    (void)state;
    struct phys_horizons *tables;
    read_real(&tables);
    for (size_t k = 0; k < 5; k++)
        for (size_t i = 1; i + 1 < tables[k].n; i++)
            for (size_t d = 0; d < 3; d++) {
                const double *x = tables[k].position + 3 * i + d;
                assert_close((x[3] - x[-3]) / (2 * 86400.0), tables[k].velocity[3 * i + d], 0, 150);
            }
    free_tables(tables, 5);
}

/* ---- forms ---- */

static void assert_layout(const struct layout *layout)
{
    struct states states = random_states("Mars (499)", 20220714);
    char *text = print_table(&states, layout);
    struct phys_horizons table = read_fine(files_write_text("form.txt", text).text);
    assert_states(&table, &states, layout->type);
    assert_string_equal(table.target, "Mars");
    assert_string_equal(table.units, layout->units);
    assert_string_equal(table.start_date, "2022-07-14");
    assert_string_equal(table.frame,
                        layout->old ? "ICRF/J2000.0, Ecliptic and Mean Equinox of Reference Epoch"
                                    : "Ecliptic of J2000.0");
    assert_close(table.gm, 42828.375214e9, 1e-15, 0);
    phys_horizons_free(&table);
    free(text);
}

static void test_round_trip_in_every_form(void **state)
{
    (void)state;
    static const char *const units[] = {"KM-S", "KM-D", "AU-D"};
    for (int form = FORM_CSV; form <= FORM_BARE; form++)
        for (int type = 1; type <= 3; type++)
            for (size_t u = 0; u < LENGTH(units); u++)
                for (int bits = 0; bits < 8; bits++)
                    assert_layout(&(struct layout){.form = (enum form)form,
                                                   .type = type,
                                                   .units = units[u],
                                                   .old = bits & 1,
                                                   .delta_t = bits & 2 && form == FORM_CSV,
                                                   .crlf = bits & 4});
}

static void test_last_comma_may_be_missing(void **state)
{
    (void)state;
    struct states states = random_states("Mars (499)", 5);
    struct layout csv = {.form = FORM_CSV, .type = 2, .units = "AU-D"};
    char *text = print_table(&states, &csv);
    for (char *p = text; (p = strstr(p, ",\n"));)
        *p = ' ';
    struct phys_horizons table = read_fine(files_write_text("comma.txt", text).text);
    assert_states(&table, &states, 2);
    phys_horizons_free(&table);
    free(text);
}

/* GM as pages of different bodies print it. */
static void test_gm(void **state)
{
    (void)state;
    static const struct {
        const char *line;
        double gm;
    } cases[] = {
        {"  GM, km^3/s^2          = 132712440041.93938  Mass, 10^24 kg        = ~1988500\n",
         1.3271244004193938e20},
        {"   GM (10^11 km^3/s^2)   = 1.3271244004193938  Mass (10^30 kg)   ~ 1.988544\n",
         1.3271244004193938e20},
        {"  Radius (IAU), km      = 1737.4           GM, km^3/s^2          = 4902.800066\n",
         4902.800066e9},
        {"  GM (planet) km^3/s^2  = 869.326         Density (R=1195 km)   = 1.86 g/cm^3\n",
         869.326e9},
        {"   GM= 62.6284             RAD= 469.7              ROTPER= 9.07417\n", 62.6284e9},
        {"   GM=62.6284              RAD= 469.7              ROTPER= 9.07417\n", 62.6284e9},
        {"  GM (km^3/s^2)          = 5959.9155+-0.004\n", 5959.9155e9},
        {"  GM (km^3/s^2)         =  7.087546066894452E-04\n", 7.087546066894452e5},
        {"  GM (km^3/s^2)         = ~0.0007\n", 0.0007e9},
        {"   GM= n.a.                RAD= 1.506\n", 0},
        {"  GM 1-sigma (km^3/s^2) =                 Mass ratio (Sun/plnt) = 6023682\n", 0},
        {"Keplerian GM    : 8.8876924451256332E-10 au^3/d^2 = 1\n", 0},
        {"  PROGRAM = 7, GMT = 8, GM ratio = 9\n", 0},
    };
    struct states states = random_states("Body (1)", 7);
    char *text = print_table(&states, &plain_layout);
    char *bare = replaced(text, "    GM (km^3/s^2)         = 42828.375214", "");
    for (size_t k = 0; k < LENGTH(cases); k++) {
        char *page = replaced(bare, " Revised:", cases[k].line);
        struct phys_horizons table = read_fine(files_write_text("gm.txt", page).text);
        assert_close(table.gm, cases[k].gm, 5e-16, 0);
        phys_horizons_free(&table);
        free(page);
    }
    free(bare);
    free(text);
}

static void test_names_and_ids(void **state)
{
    (void)state;
    static const struct {
        const char *printed, *target;
        int id;
    } cases[] = {{"Mars (499)", "Mars", 499},
                 {"Earth-Moon Barycenter (3)", "Earth-Moon Barycenter", 3},
                 {"1 Ceres (A801 AA)", "1 Ceres (A801 AA)", PHYS_HORIZONS_NO_ID},
                 {"12345 (1993 FT8)", "12345 (1993 FT8)", PHYS_HORIZONS_NO_ID},
                 {"CAPSTONE (spacecraft) (-1176)", "CAPSTONE (spacecraft)", -1176},
                 {"Odd (99999999999)", "Odd (99999999999)", PHYS_HORIZONS_NO_ID}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct states states = random_states(cases[k].printed, 3);
        char *text = print_table(&states, &plain_layout);
        struct phys_horizons table = read_fine(files_write_text("name.txt", text).text);
        assert_string_equal(table.target, cases[k].target);
        assert_int_equal(table.id, cases[k].id);
        phys_horizons_free(&table);
        free(text);
    }
}

/* An observatory is another centre than the body it stands on. */
static void test_site_belongs_to_the_centre(void **state)
{
    (void)state;
    struct states states = random_states("Mars (499)", 3);
    char *text = print_table(&states, &plain_layout),
         *there = replaced(text, "BODY CENTER", "Palomar");
    struct phys_horizons table = read_fine(files_write_text("site.txt", there).text);
    assert_string_equal(table.center, "Solar System Barycenter (0), Palomar");
    phys_horizons_free(&table);
    free(there);
    free(text);
}

/* ---- streams ---- */

static void write_long_stream(const char *fifo, const char *text)
{
    FILE *stream = fopen(fifo, "w");
    for (int i = 0; stream && i < 100000; i++)
        fprintf(stream, "  Line %d of a long header (km) = %d   GM ratio = %d\n", i, i, i);
    for (int i = 0; stream && i < 100000; i++) /* and one line longer than any buffer */
        fputs("very long ", stream);
    _exit(!stream || fprintf(stream, "\n%s", text) < 0 || fclose(stream) != 0);
}

static void test_fifo_with_a_long_header(void **state)
{
    (void)state;
    struct states states = random_states("Mars (499)", 31);
    char *text = print_table(&states, &plain_layout);
    struct path fifo = files_temporary("fifo");
    int status;
    assert_int_equal(mkfifo(fifo.text, 0600), 0);
    pid_t writer = fork();
    if (writer == 0)
        write_long_stream(fifo.text, text);
    struct phys_horizons table = read_fine(fifo.text);
    assert_states(&table, &states, 3);
    assert_int_equal(waitpid(writer, &status, 0), writer);
    assert_int_equal(status, 0); /* the writer could write all of it */
    phys_horizons_free(&table);
    free(text);
    remove(fifo.text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_real_header),
        cmocka_unit_test(test_real_states_are_those_of_the_published_start),
        cmocka_unit_test(test_real_states_are_the_constants_of_the_scene),
        cmocka_unit_test(test_real_velocities_are_rates),
        cmocka_unit_test(test_round_trip_in_every_form),
        cmocka_unit_test(test_last_comma_may_be_missing),
        cmocka_unit_test(test_gm),
        cmocka_unit_test(test_names_and_ids),
        cmocka_unit_test(test_site_belongs_to_the_centre),
        cmocka_unit_test(test_fifo_with_a_long_header),
    };
    return cmocka_run_group_tests_name("horizons", tests, files_setup, files_teardown);
}
