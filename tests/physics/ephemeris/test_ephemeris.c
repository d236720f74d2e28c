/* The ephemeris: the choice of bodies, and what it takes from tables of Horizons. */
#include "physics/ephemeris/horizons.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>

static void bodies_are_chosen_by_name_or_id(void **state)
{
    (void)state;
    struct phys_system system = system_opened("ephemeris");
    struct ad_error error = {0};
    assert_int_equal(system.dof, 15);
    phys_ephemeris_choose(&system, "Sun,399,venus", 2, &error);
    assert_no_error(&error);
    assert_int_equal(system.dof, 6);
    assert_int_equal(system.dims, 2);
    double q[6], v[6];
    system_start(&system, 0, q, v);
    assert_true(q[2] == 5.379184128556358E+07 * 1e3); /* Earth's x */
    char name[32];
    phys_coordinate_name(&system, 5, name, sizeof name);
    assert_string_equal(name, "y_venus");
    system_check(&system);

    const struct {
        const char *bodies;
        size_t dims;
        const char *message;
    } bad[] = {{"sun,erth", 2, "'earth'"},
               {"sun", 2, "1 bodies"},
               {"sun,10", 3, "twice"},
               {"sun,,mars", 3, "expected one of"},
               {"sun,earth", 4, "4 dimensions"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        error = (struct ad_error){0};
        assert_int_equal(phys_ephemeris_choose(&system, bad[k].bodies, bad[k].dims, &error),
                         AD_E_ARGUMENT);
        assert_mentions(error.message, bad[k].message);
        assert_int_equal(system.dof, 6);
    }
    phys_system_close(&system);
    system = system_opened("kepler");
    error = (struct ad_error){0};
    assert_int_equal(phys_ephemeris_choose(&system, "sun,earth", 2, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

enum { EPOCHS = 6 };

/* Two tables of bodies in uniform acceleration, without velocities. */
static void make_tables(struct phys_horizons tables[2], double jd[EPOCHS],
                        double position[2][3 * EPOCHS])
{
    for (size_t i = 0; i < EPOCHS; i++)
        jd[i] = 2459774.5 + (double)i;
    for (size_t b = 0; b < 2; b++)
        for (size_t i = 0; i < EPOCHS; i++)
            for (size_t k = 0; k < 3; k++) {
                double s = 86400 * (double)i, c = (double)(b + k + 1);
                position[b][3 * i + k] = 1e9 * c + 1e3 * c * s + 1e-3 * c * s * s;
            }
    tables[0] = (struct phys_horizons){
        .target = "Sun", .id = 10, .n = EPOCHS, .jd = jd, .position = position[0], .gm = 1e20};
    tables[1] = (struct phys_horizons){
        .target = "Ceres", .id = 1, .n = EPOCHS, .jd = jd, .position = position[1], .gm = 6e10};
}

static void tables_give_bodies_start_and_reference(void **state)
{
    (void)state;
    struct phys_system system = system_opened("ephemeris");
    struct phys_horizons tables[2];
    struct ad_error error = {0};
    double jd[EPOCHS], position[2][3 * EPOCHS], reference[4 * 4], q[4], v[4];
    make_tables(tables, jd, position);
    phys_ephemeris_use(&system, 2, tables, 2, 4, 2, reference, &error);
    assert_no_error(&error);
    assert_int_equal(system.dof, 4);
    system_start(&system, 0, q, v);
    for (size_t k = 0; k < 4; k++) {
        double c = (double)(k / 2 + k % 2 + 1);
        assert_true(q[k] == position[k / 2][3 * 2 + k % 2]);
        /* differences of second order are exact for a parabola */
        assert_close(v[k], 1e3 * c + 2e-3 * c * 2 * 86400, 1e-9, 0);
        for (size_t i = 0; i < 4; i++)
            assert_true(reference[k * 4 + i] == position[k / 2][3 * (2 + i) + k % 2]);
    }
    char name[32];
    phys_coordinate_name(&system, 2, name, sizeof name);
    assert_string_equal(name, "x_ceres");

    double zero[4] = {0}, T, V; /* masses are GM / G ... */
    double G = phys_system_get(&system, "G"), r = hypot(q[0] - q[2], q[1] - q[3]);
    system_energies(&system, q, zero, &T, &V);
    assert_close(V, -1e20 * 6e10 / G / r, 1e-14, 0);
    system_set(&system, "mass_sun", 3e28); /* ... unless set by name */
    system_energies(&system, q, zero, &T, &V);
    assert_close(V, -3e28 * 6e10 / r, 1e-14, 0);
    phys_system_close(&system);
}

static void unusable_tables_are_refused(void **state)
{
    (void)state;
    struct phys_system system = system_opened("ephemeris");
    struct phys_horizons tables[2];
    struct ad_error error = {0};
    double jd[EPOCHS], position[2][3 * EPOCHS];
    make_tables(tables, jd, position);
    assert_int_equal(phys_ephemeris_use(&system, 2, tables, 3, 4, 2, NULL, &error), AD_E_INPUT);
    assert_mentions(error.message, "4 3");
    error = (struct ad_error){0};
    tables[1].gm = 0;
    assert_int_equal(phys_ephemeris_use(&system, 2, tables, 0, 4, 2, NULL, &error), AD_E_INPUT);
    assert_mentions(error.message, "Ceres");
    assert_int_equal(system.dof, 15); /* untouched */
    error = (struct ad_error){0};
    system_set(&system, "mass_sun", 2e30);
    tables[0].gm = 0; /* a mass set by name does without */
    tables[1].gm = 6e10;
    phys_ephemeris_use(&system, 2, tables, 0, 4, 2, NULL, &error);
    assert_no_error(&error);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bodies_are_chosen_by_name_or_id),
        cmocka_unit_test(tables_give_bodies_start_and_reference),
        cmocka_unit_test(unusable_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
