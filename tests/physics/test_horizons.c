/* The Horizons reader: the real tables, every form of one table, every damage, streams, folders,
   dates. */
#include "../../physics/horizons.h"
#include "../../physics/scenes/ephemeris_states.h"
#include "../../physics/table.h"
#include "../close.h"
#include "../files.h"
#include "horizons_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define LENGTH(a) (sizeof(a) / sizeof(a)[0])

static const struct layout plain = {.form = FORM_LABELLED, .type = 3, .units = "KM-S"};

static struct phys_horizons read_fine(const char *file)
{
    struct phys_horizons table;
    struct ad_error error = {0};
    if (phys_horizons_read(file, &table, &error) != AD_OK)
        fail_msg("%s", error.message);
    return table;
}

/* ---- the real tables ---- */

static const char *const all = "sun,mercury,venus,earth,mars";

static void read_real(struct phys_horizons **tables)
{
    struct ad_error error = {0};
    struct path folder = files_shared("data/horizons");
    size_t n;
    if (phys_horizons_folder(folder.text, all, &n, tables, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(n, 5);
}

static void free_tables(struct phys_horizons *tables, size_t n)
{
    for (size_t k = 0; k < n; k++)
        phys_horizons_free(&tables[k]);
    free(tables);
}

static void test_real_header(void **state)
{
    (void)state;
    struct phys_horizons table = read_fine(files_shared("data/horizons/mars.txt").text);
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
    struct path file = files_shared("reference/ncf/ephemeris_init.csv");
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

static void assert_states(const struct phys_horizons *table, const struct states *states, int type)
{
    assert_int_equal(table->n, STATES);
    assert_true((table->velocity == NULL) == (type == 1));
    for (size_t i = 0; i < STATES; i++) {
        assert_true(table->jd[i] == states->first + (double)i * states->step);
        for (size_t d = 0; d < 3; d++) {
            assert_close(table->position[3 * i + d], states->state[i][d], 2e-15, 0);
            if (table->velocity)
                assert_close(table->velocity[3 * i + d], states->state[i][3 + d], 2e-15, 0);
        }
    }
}

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
        {"  GM (km^3/s^2)          = 5959.9155+-0.004\n", 5959.9155e9},
        {"  GM (km^3/s^2)         =  7.087546066894452E-04\n", 7.087546066894452e5},
        {"   GM= n.a.                RAD= 1.506\n", 0},
        {"  GM 1-sigma (km^3/s^2) =                 Mass ratio (Sun/plnt) = 6023682\n", 0},
        {"Keplerian GM    : 8.8876924451256332E-10 au^3/d^2 = 1\n", 0},
        {"  PROGRAM = 7, GMT = 8, GM ratio = 9\n", 0},
    };
    struct states states = random_states("Body (1)", 7);
    char *text = print_table(&states, &plain);
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
        char *text = print_table(&states, &plain);
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
    char *text = print_table(&states, &plain), *there = replaced(text, "BODY CENTER", "Palomar");
    struct phys_horizons table = read_fine(files_write_text("site.txt", there).text);
    assert_string_equal(table.center, "Solar System Barycenter (0), Palomar");
    phys_horizons_free(&table);
    free(there);
    free(text);
}

/* ---- damage ---- */

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
    if (expected)
        assert_string_equal(error.message + strlen(file.text) + 1, expected);
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
        {"$$SOE", "$$", "44: expected a Horizons vector table ($$SOE), found the end of the file"},
        {"Target body", "Tar", "22: expected a line 'Target body name:' before $$SOE"},
        {"Center body name:", "Center body name ",
         "22: expected a line 'Center body name:' before $$SOE"},
        {"Output units", "", "22: expected a line 'Output units:' before $$SOE"},
        {"Reference frame", "", "22: expected a line 'Reference frame:' before $$SOE"},
        {"KM-S", "PC-Y", "22: expected output units KM-S, KM-D or AU-D, found 'PC-Y'"},
        {"GEOMETRIC cartesian states", "GEOMETRIC osculating elements",
         "22: expected output type 'GEOMETRIC cartesian states', found 'GEOMETRIC osculating "
         "elements'"},
        {"JDTDB", "JDUT", "22: expected epochs in TDB (column JDTDB), found JDUT"},
        {"JDTDB", "", "22: expected column names (JDTDB, X, Y, Z) before $$SOE"},
        {"   X     Y     Z\n", "", "21: expected columns X, Y, Z (output formats 1 to 3)"},
    };
    assert_damage(&plain, damage, LENGTH(damage));
}

static void test_damaged_records(void **state)
{
    (void)state;
    static const struct damage damage[] = {
        {"$$EOE\n", "",
         "39:1: expected a number for the epoch, found '**************************...'"},
        {"$$EOE", "$$SOE", "39:1: expected a number for the epoch, found '$$SOE'"},
        {"Barycentric Dynamical", "\n$$SOE\n",
         "45: expected one table a file, found a second $$SOE"},
        {"2459774.500000000", "today", "23:1: expected a number for the epoch, found 'today'"},
        {"2459774.500000000", "1e300", "23:1: expected a Julian date, found 1e+300"},
        {"2459774.500000000 =", "2459774.500000000",
         "23:19: expected '=' after the epoch, found 'A.D.'"},
        {"2459774.750000000", "2459774.500000000",
         "27:1: expected an epoch after 2459774.500000000, found 2459774.500000000"},
        {"2459775.250000000", "2459774.250000000",
         "35:1: expected an epoch after 2459775.000000000, found 2459774.250000000"},
        {"2459775.250000000", "2459775.500000000",
         "35:1: expected a step of 0.25 days as before, found 0.5"},
        {" X =", " X = NaN ", "24:6: expected a number for X, found 'NaN'"},
        {" X =", " X = 1e999 ", "24:6: expected a finite number for X, found '1e999'"},
        {"-2.239185595350279E+08", "1e308", "26: expected coordinates below 1e308 m"},
        {" X =", " X  ", "24:5: expected '=' after X, found '-2.239185595350279E+08'"},
        {" X =", " Q =", "24:2: expected X, found 'Q'"},
        {" VX=", " V=", "25:2: expected VX, found 'V='"},
        {" VX=", " VX=fast", "25:5: expected a number for VX, found 'fast'"},
        {" VX=", "\n VX=", "25:1: expected a number for VX, found the end of the line"},
        {" VX=", "$$EOE\n", "25:1: expected a number for VX, found '$$EOE'"},
        {" RR=", " RR= x", "26:58: expected a number for RR, found 'x'"},
    };
    assert_damage(&plain, damage, LENGTH(damage));
}

static void test_damaged_csv(void **state)
{
    (void)state;
    static const struct layout csv = {.form = FORM_CSV, .type = 1, .units = "KM-S"};
    static const struct damage damage[] = {
        {"2459774.500000000,", "2459774.500000000",
         "20:19: expected ',' after the epoch, found 'A.D.'"},
        {"00.0000, ", "00.0000, -,", "20:52: expected a number for X, found '-'"},
        {"00.0000, ", "00.0000, nan,", "20:52: expected a number for X, found 'nan'"},
        {"00.0000, ", "00.0000, ,", "20:52: expected a number for X, found ','"},
        {"00.0000, ", "00.0000, 1,", NULL},
        {"$$EOE", "2459775.5, A.D., 1, 2\n$$EOE",
         "24:22: expected ',' after Y, found the end of the line"},
        {"$$EOE", "",
         "25:1: expected a number for the epoch, found '**************************...'"},
    };
    assert_damage(&csv, damage, LENGTH(damage));
}

static void test_no_records(void **state)
{
    (void)state;
    struct states states = random_states("Mars (499)", 1);
    char *text = print_table(&states, &plain), *bad = replaced(text, "$$SOE\n", "$$SOE\n$$EOE\n");
    assert_refused(bad, strlen(bad), "23: expected records between $$SOE and $$EOE, found none");
    free(bad);
    free(text);
}

static void test_not_text(void **state)
{
    (void)state;
    static const char zero[] = "Target body name\n\0\n$$SOE\n";
    assert_refused(zero, sizeof zero - 1, "2: expected text, found a zero byte");
    static char wide[10000];
    memset(wide, '1', sizeof wide);
    assert_refused(wide, sizeof wide,
                   "1: expected a Horizons vector table ($$SOE), found the end of the file");
    struct states states = random_states("Mars (499)", 1);
    char *text = print_table(&states, &plain), *at = strstr(text, "$$SOE\n") + 6;
    char *bad = calloc(1, sizeof wide + strlen(text));
    assert_non_null(bad);
    memcpy(bad, text, (size_t)(at - text));
    memcpy(bad + (at - text), wide, sizeof wide);
    assert_refused(bad, strlen(bad), "23: expected at most 4095 characters a line");
    free(bad);
    free(text);
}

static void test_files_that_cannot_be_read(void **state)
{
    (void)state;
    struct phys_horizons table;
    struct ad_error error = {0};
    assert_int_equal(phys_horizons_read(files_temporary("absent").text, &table, &error), AD_E_IO);
    assert_non_null(strstr(error.message, "absent: cannot be read: No such file"));
    assert_int_equal(phys_horizons_read(files_temporary("").text, &table, NULL), AD_E_IO);
    phys_horizons_free(&table);
    phys_horizons_free(NULL);
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
    char *text = print_table(&states, &plain);
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

/* ---- folders ---- */

/* A folder with these tables; the names of the files tell nothing. */
static struct path make_folder(const char *name, size_t n, const char *const targets[])
{
    struct path folder = files_temporary(name);
    assert_int_equal(mkdir(folder.text, 0700), 0);
    for (size_t k = 0; k < n; k++) {
        char file[PATH_ROOM];
        struct states states = random_states(targets[k], (unsigned)k);
        char *text = print_table(&states, &plain);
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
    if (!strstr(error.message, expected))
        fail_msg("'%s' does not say '%s'", error.message, expected);
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
    assert_folder(name, "sun,vulcan", AD_E_INPUT, "expected a table of 'vulcan', found none");
    assert_folder(name, "vulcan", AD_E_INPUT, "found only Sun, Mercury, Earth, Mars");
    assert_folder(name, "sun,10", AD_E_ARGUMENT, "bodies 'sun' and '10' are one");
    assert_folder(name, "", AD_E_ARGUMENT, "expected names or ids");
    assert_folder(name, "sun,,mars", AD_E_ARGUMENT, "expected names or ids");
    assert_folder(files_temporary("nowhere").text, "sun", AD_E_IO, "nowhere: cannot be read");
    files_write_text("refused/venus.txt", "Target body name: Venus (299)\n");
    assert_folder(name, "sun,venus", AD_E_INPUT, "venus.txt:1: expected a Horizons vector table");
    files_write_text("refused/venus.txt", "");
    assert_folder(name, "sun,venus", AD_E_INPUT, "venus.txt:0: expected a Horizons vector table");
    char *text =
        print_table(&(struct states){.target = "Mars (499)", .first = 1, .step = 1}, &plain);
    files_write_text("refused/again.txt", text);
    free(text);
    assert_folder(name, "mars", AD_E_INPUT,
                  "expected one table of mars, found again.txt and t3.txt");
}

/* Whatever differs, both files are named. */
static void test_folder_disagreements(void **state)
{
    (void)state;
    static const struct {
        const char *from, *to, *expected;
    } cases[] = {
        {"Solar System Barycenter (0)", "Sun (10)",
         "t0.txt and t3.txt disagree in the centre: 'Solar System Barycenter (0)' and 'Sun (10)'"},
        {"Ecliptic of J2000.0", "ICRF",
         "t0.txt and t3.txt disagree in the frame: 'Ecliptic of J2000.0' and 'ICRF'"},
        {"$$EOE", "2459775.500000000 =\n1 2 3\n4 5 6\n7 8 9\n$$EOE",
         "t0.txt and t3.txt disagree in the epochs: 4 and 5 of them"},
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
    char *text = print_table(&states, &plain);
    files_write_text("shifted/t3.txt", text);
    free(text);
    assert_folder(folder.text, "sun,mars", AD_E_INPUT,
                  "t0.txt and t3.txt disagree in the epochs: number 0 is JD 2459774.500000000 and "
                  "2459775.000000000");
}

/* A damaged table matters only to whom it concerns. */
static void test_folder_reads_only_what_is_wanted(void **state)
{
    (void)state;
    struct path folder = make_folder("partly", LENGTH(planets), planets);
    edit("partly/t3.txt", " VX=", " VX= fast");
    assert_folder(folder.text, "sun,mars", AD_E_INPUT, "t3.txt:25:6: expected a number for VX");
    struct phys_horizons *tables;
    struct ad_error error = {0};
    size_t n;
    assert_int_equal(phys_horizons_folder(folder.text, "sun,earth", &n, &tables, &error), AD_OK);
    free_tables(tables, n);
}

/* ---- dates ---- */

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
        {"3", "epoch 3: the table of Mars has epochs 0 to 2"},
        {"99999999999999999999999",
         "epoch 99999999999999999999999: the table of Mars has epochs 0 to 2"},
        {"2022-07-16", "epoch 2022-07-16: the table of Mars runs from JD 2459773.5, 2022-07-13, to "
                       "2022-07-15 in steps of 1 days"},
        {"", "epoch '': expected an index or a date YYYY-MM-DD"},
        {"-1", "epoch '-1': expected an index or a date YYYY-MM-DD"},
        {"2022-07", "epoch '2022-07': expected an index or a date YYYY-MM-DD"},
        {"2022-02-30", "epoch '2022-02-30': expected an index or a date YYYY-MM-DD"},
        {"2022-13-01", "epoch '2022-13-01': expected an index or a date YYYY-MM-DD"},
        {"1582-10-10", "epoch '1582-10-10': expected an index or a date YYYY-MM-DD"},
        {"2022-07-14x", "epoch '2022-07-14x': expected an index or a date YYYY-MM-DD"},
    };
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct ad_error error = {0};
        size_t index = 17;
        enum ad_status status = phys_horizons_epoch(&table, cases[k].from, &index, &error);
        assert_int_equal(status, cases[k].expected ? AD_E_ARGUMENT : AD_OK);
        assert_int_equal(index, cases[k].expected ? 17 : 1);
        assert_string_equal(error.message, cases[k].expected ? cases[k].expected : "");
    }
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
        cmocka_unit_test(test_every_truncation),
        cmocka_unit_test(test_damaged_headers),
        cmocka_unit_test(test_damaged_records),
        cmocka_unit_test(test_damaged_csv),
        cmocka_unit_test(test_no_records),
        cmocka_unit_test(test_not_text),
        cmocka_unit_test(test_files_that_cannot_be_read),
        cmocka_unit_test(test_fifo_with_a_long_header),
        cmocka_unit_test(test_folder_by_name_and_id),
        cmocka_unit_test(test_folder_prefers_the_exact_name),
        cmocka_unit_test(test_folder_refusals),
        cmocka_unit_test(test_folder_disagreements),
        cmocka_unit_test(test_folder_reads_only_what_is_wanted),
        cmocka_unit_test(test_dates),
        cmocka_unit_test(test_dates_there_and_back),
        cmocka_unit_test(test_epochs),
    };
    return cmocka_run_group_tests_name("horizons", tests, files_setup, files_teardown);
}
