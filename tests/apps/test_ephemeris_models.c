/* Models of the inner planets against Horizons tables: their errors agree with independent ones,
   each model is more accurate than the one before, and --tol takes the simplest one that is
   accurate enough. */
#include "tests/close.h"
#include "tests/files.h"
#include "shell.h"
#include "physics/ephemeris/models.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct phys_ephemeris_tables tables;
static double most[PHYS_EPHEMERIS_MODELS][PHYS_EPHEMERIS_PLANETS];

static void measure_all(void)
{
    struct ad_error error = {0};
    if (tables.n)
        return;
    struct path folder = files_data("horizons");
    assert_int_equal(phys_ephemeris_tables_read(folder.text, NULL, 65, &tables, &error), AD_OK);
    for (size_t m = 0; m < PHYS_EPHEMERIS_MODELS; m++) {
        struct phys_ephemeris_track track;
        struct phys_ephemeris_distances off;
        assert_int_equal(
            phys_ephemeris_measure(&phys_ephemeris_models[m], &tables, &track, &off, &error),
            AD_OK);
        memcpy(most[m], off.km, sizeof most[m]);
        phys_ephemeris_track_free(&track);
    }
}

/* Rounded as they were printed. */
static void test_known_errors(void **state)
{
    static const char *const known[][PHYS_EPHEMERIS_PLANETS] = {
        {"1.2e+07", "2.2e+05", "8.5e+04", "5.2e+04"},
        {"1.1e+06", "3.0e+04", "7.3e+04", "4.5e+03"},
        {"1.3e+03", "836", "7.9e+04", "3.5e+03"},
        {"568", "791", "7.9e+04", "3.5e+03"},
    };
    char text[32];
    (void)state;
    measure_all();
    for (size_t m = 0; m < sizeof known / sizeof *known; m++)
        for (size_t k = 0; k < PHYS_EPHEMERIS_PLANETS; k++) {
            const char *format = strchr(known[m][k], 'e') ? "%.1e" : "%.0f";
            snprintf(text, sizeof text, format, most[m][k]);
            assert_string_equal(text, known[m][k]);
        }
}

/* Each step brings the planet down that it is about. */
static void test_what_each_step_brings(void **state)
{
    enum { MERCURY, VENUS, EARTH, MARS };
    static const struct {
        size_t model, planet;
        double below, times; /* km, and of the model before */
    } rows[] = {
        {4, VENUS, 30, 0.05},  {4, MARS, 80, 0.05}, {4, MERCURY, 120, 0.25}, {5, EARTH, 1000, 0.02},
        {6, MERCURY, 10, 0.1}, {7, VENUS, 3, 0.2},  {7, MERCURY, 2.5, 0.4},
    };
    (void)state;
    measure_all();
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const double *now = most[rows[k].model], *before = most[rows[k].model - 1];
        assert_true(now[rows[k].planet] < rows[k].below);
        assert_true(now[rows[k].planet] < rows[k].times * before[rows[k].planet]);
    }
    /* 43 seconds of arc a century: what relativity moves Mercury by in 65 days, and no other */
    assert_true(fabs(most[6][EARTH] - most[5][EARTH]) < 5);
}

static int simulate(const char *options)
{
    struct path folder = files_data("horizons");
    char full[4096];
    const char *name = folder.text;
    if (name[0] != '/' && realpath(name, full))
        name = full;
    return shell("$LA simulate ephemeris --data '%s' --json %s", name, options);
}

static void test_least_model(void **state)
{
    static const struct {
        const char *options, *model;
    } rows[] = {
        {"--tol 2e7", "published (2D, semi-implicit Euler, 1 day)"},
        {"--tol 2e6", "3D Verlet, 1 day, measured GM"},
        {"--tol 1e5", "3D Dormand-Prince 8"}, /* as near as Verlet with an eighth of the forces */
        {"--tol 1000", "and a rough Moon"},
        {"--tol 1000 --days 2", "3D Verlet, 1 hour"},
    };
    char wanted[128];
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        assert_int_equal(simulate(rows[k].options), 0);
        snprintf(wanted, sizeof wanted, "\"model\": \"%s\", \"models_tried\"", rows[k].model);
        if (!strstr(shell_last_line(), wanted))
            print_error("%s: %s\n", rows[k].options, shell_last_line());
        assert_non_null(strstr(shell_last_line(), wanted));
    }
    assert_int_equal(simulate("--tol 1"), 1);
    assert_mentions(shell_err(), "models");
}

/* The same by one call in C: as near with fewer forces is less, and none is a kilometre near. */
static void test_least_in_c(void **state)
{
    struct ad_error error = {0};
    struct phys_ephemeris_choice choice;
    (void)state;
    measure_all();
    assert_int_equal(phys_ephemeris_least(&tables, 1e5, &choice, &error), AD_OK);
    assert_string_equal(phys_ephemeris_models[choice.chosen].name, "3D Dormand-Prince 8");
    assert_true(choice.off[choice.chosen].worst <= 1e5);
    assert_close(choice.off[choice.chosen].km[2], most[choice.chosen][2], 1e-12, 0);
    assert_int_equal(phys_ephemeris_least(&tables, 1, &choice, &error), AD_E_ACCURACY);
    assert_int_equal(choice.n, PHYS_EPHEMERIS_MODELS);
}

/* A17: integration errs by less than a hundredth of the model, planet by planet, at every default:
   spans, dimensions, bodies, methods. */
static void test_integration_is_small(void **state)
{
    static const char *const rows[] = {
        "",
        "--days 1",
        "--from 0 --days 364",
        "--set dims=2",
        "--from 2022-05-01 --days 200 --set dims=2 --rough jupiter",
        "--set relativity=1 --rough jupiter,saturn,moon",
        "--set relativity=1 --rough jupiter,saturn,moon --days 1",
        "--set relativity=1 --rough jupiter,saturn,moon --from 3 --days 97",
        "--rough moon,jupiter --integrator dopri5",
        "--integrator verlet",
        "--integrator rk4 --rough jupiter",
        "--integrator gauss4 --set relativity=1",
        "--integrator variational-gauss3 --rough jupiter",
        "--tol 1e5",
        "--tol 1000",
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        assert_int_equal(simulate(rows[k]), 0);
        for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++) {
            const char *planet = phys_ephemeris_planet(p);
            double in_all = shell_number_in("km_from_tables", planet);
            double model = shell_number_in("km_of_model", planet);
            double integration = shell_number_in("km_of_integration", planet);
            if (!(integration < 0.01 * model))
                fail_msg("'%s': %s: %g of %g km", rows[k], planet, integration, model);
            assert_true(model > 0);
            assert_close(in_all, model, 0, integration);
        }
    }
}

/* A17: what a run errs beside the model is measured: by hand it comes to the same. */
static void test_split(void **state)
{
    struct ad_error error = {0};
    struct phys_ephemeris_track rough, tight;
    struct phys_ephemeris_motion motion;
    (void)state;
    measure_all();
    assert_int_equal(
        phys_ephemeris_motion_open(&phys_ephemeris_models[3], &tables, &motion, &error), AD_OK);
    motion.setting = 1e-9;
    assert_int_equal(phys_ephemeris_follow(&motion, tables.days, &rough, &error), AD_OK);
    motion.setting = 1e-13;
    assert_int_equal(phys_ephemeris_follow(&motion, tables.days, &tight, &error), AD_OK);
    struct phys_ephemeris_distances by_hand = phys_ephemeris_compare(&rough, &tight);
    assert_true(tight.n == tables.days + 1);
    phys_ephemeris_track_free(&rough);
    phys_ephemeris_track_free(&tight);
    phys_ephemeris_motion_close(&motion);
    char options[128];
    snprintf(options, sizeof options, "--integrator dop853 --tol 1e-9 --set mass_earth=%.17g",
             (tables.table[3].gm + 4.902800066e12) / 6.67430e-11);
    assert_int_equal(simulate(options), 0);
    for (size_t p = 0; p < PHYS_EPHEMERIS_PLANETS; p++)
        assert_close(shell_number_in("km_of_integration", phys_ephemeris_planet(p)), by_hand.km[p],
                     0.01, 1e-5);
    assert_true(shell_number_in("km_of_integration", "mercury") > 1);
}

/* --tol with a given model or method is what must be kept; missed, it is exit status 1. */
static void test_tolerance_of_a_given_model(void **state)
{
    static const struct {
        const char *options;
        int status;
    } rows[] = {
        {"--tol 1000 --set relativity=1 --rough jupiter,saturn,moon", 0},
        {"--tol 10 --set relativity=1 --rough jupiter,saturn,moon", 1},
        {"--tol 0.1 --integrator euler --days 2", 1},
        {"--tol 1e-12 --integrator dop853", 0}, /* of a step */
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        assert_int_equal(simulate(rows[k].options), rows[k].status);
    assert_int_equal(simulate("--tol 0.1 --integrator rk4"), 0);
    assert_true(shell_number_in("km_of_integration", "mercury") < 0.1);
    /* a run that an event ends within a day is compared at its whole days */
    assert_int_equal(simulate("--until 'x_sun=-1352000000' --csv short.csv"), 0);
    assert_true(shell_number("time") < 1e6);
    assert_true(shell_number_in("km_from_tables", "mercury") < 100);
}

static void test_refusals(void **state)
{
    static const struct {
        const char *options, *says;
    } rows[] = {
        {"--time 10", "give --days"},        {"--integrator verlet --dt 5000", "day"},
        {"--days 400", "--days 400 148"},    {"--rough pluto", "'pluto'"},
        {"--from 1999-01-01", "1999-01-01"},
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        assert_int_equal(simulate(rows[k].options), 2);
        if (!strstr(shell_err(), rows[k].says))
            print_error("%s: %s\n", rows[k].options, shell_err());
        assert_mentions(shell_err(), rows[k].says);
    }
    assert_int_equal(shell("$LA simulate ephemeris --rough moon"), 2);
    assert_int_equal(shell("$LA simulate kepler --data ."), 2);
    assert_int_equal(shell("$LA chart ephemeris"), 2);
}

static void test_chart(void **state)
{
    struct path folder = files_data("horizons");
    char full[4096];
    size_t size, lines = 0;
    (void)state;
    assert_non_null(realpath(folder.text, full));
    assert_int_equal(shell("$LA chart ephemeris --data '%s' --days 5 --out . --json", full), 0);
    char *text = files_read(shell_path("ephemeris.csv"), &size);
    for (const char *c = strstr(text, "model,planet,day,km\n"); c && *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 1 + PHYS_EPHEMERIS_MODELS * PHYS_EPHEMERIS_PLANETS * 6);
    free(text);
}

static int close_all(void **state)
{
    phys_ephemeris_tables_free(&tables);
    return shell_teardown(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_errors), cmocka_unit_test(test_what_each_step_brings),
        cmocka_unit_test(test_least_model),  cmocka_unit_test(test_least_in_c),
        cmocka_unit_test(test_refusals),     cmocka_unit_test(test_integration_is_small),
        cmocka_unit_test(test_split),        cmocka_unit_test(test_tolerance_of_a_given_model),
        cmocka_unit_test(test_chart),
    };
    return cmocka_run_group_tests(tests, shell_setup, close_all);
}
