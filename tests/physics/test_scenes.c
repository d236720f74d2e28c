/* Scenes: names, parameters, presets, sizes and starts. */
#include "published.h"
#include "systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>

/* ---- names and parameters ---- */

static void unknown_names_suggest_the_nearest(void **state)
{
    (void)state;
    struct phys_system system;
    struct ad_error error = {0};
    assert_int_equal(phys_system_open("pendlum", &system, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "'pendulum'");
    phys_system_close(&system);

    error = (struct ad_error){0};
    assert_int_equal(phys_system_open("wave equation", &system, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "freebody pendulum dblpend");
    phys_system_close(&system);

    system = system_opened("gas");
    error = (struct ad_error){0};
    assert_int_equal(phys_system_set(&system, "sofening", 1, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "gas");
    assert_mentions(error.message, "'softening'");
    assert_true(isnan(phys_system_get(&system, "sofening")));
    phys_system_close(&system);

    error = (struct ad_error){0};
    assert_null(phys_rule_find("left-repeat", &error));
    assert_mentions(error.message, "'left+repeat'");
    error = (struct ad_error){0};
    assert_null(phys_solver_find("adma", &error));
    assert_mentions(error.message, "'adam'");
}

static void parameters_are_set_by_name(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system = system_opened(phys_scenes[s]->name);
        for (size_t k = 0; k < system.scene->n_params; k++) {
            const struct phys_param *p = &system.scene->params[k];
            assert_true(phys_system_get(&system, p->name) == p->value);
            struct ad_error error = {0};
            double other = p->value == 0 ? 0.37 : p->value * 0.75;
            if (phys_system_set(&system, p->name, other, &error) == AD_OK)
                assert_true(phys_system_get(&system, p->name) == other);
            else /* whole numbers: refused whole */
                assert_true(phys_system_get(&system, p->name) == p->value);
            error = (struct ad_error){0};
            assert_int_equal(phys_system_set(&system, p->name, NAN, &error), AD_E_ARGUMENT);
            assert_mentions(error.message, p->name);
        }
        phys_system_close(&system);
    }
}

static void presets_name_parameters_that_exist(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_PUBLISHED; k++) {
        struct phys_system system = published_system(published[k].scene);
        const struct phys_preset *paper = system.scene->paper;
        for (size_t i = 0; i < paper->n_set; i++)
            assert_true(phys_system_get(&system, paper->set[i].name) == paper->set[i].value);
        phys_system_close(&system);
    }
}

static void sizes_follow_the_parameters(void **state)
{
    (void)state;
    struct phys_system system = system_opened("gas");
    assert_int_equal(system.dof, 100);
    system_set(&system, "bodies", 7);
    assert_int_equal(system.dof, 14);
    assert_int_equal(system.bodies, 7);
    const double bad[] = {1, 2.5, -3, 1e9};
    for (size_t k = 0; k < 4; k++) {
        struct ad_error error = {0};
        assert_int_equal(phys_system_set(&system, "bodies", bad[k], &error), AD_E_ARGUMENT);
        assert_int_equal(system.dof, 14);
        assert_true(phys_system_get(&system, "bodies") == 7);
    }
    phys_system_close(&system);
    system = system_opened("kepler");
    struct ad_error error = {0};
    assert_int_equal(phys_system_set(&system, "e", 1, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

static void coordinates_have_names(void **state)
{
    (void)state;
    const struct {
        const char *scene;
        size_t k;
        const char *name;
    } table[] = {{"freebody", 0, "x"},   {"pendulum", 0, "theta"},      {"dblpend", 1, "b"},
                 {"threebody", 3, "y2"}, {"ephemeris", 5, "z_mercury"}, {"gas", 98, "x50"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        struct phys_system system = system_opened(table[i].scene);
        char name[32];
        phys_coordinate_name(&system, table[i].k, name, sizeof name);
        assert_string_equal(name, table[i].name);
        phys_system_close(&system);
    }
}

/* ---- the gas ---- */

static double closest(const struct phys_system *system, const double *q)
{
    double least = INFINITY;
    for (size_t i = 0; i < system->bodies; i++)
        for (size_t j = i + 1; j < system->bodies; j++)
            least = fmin(least, hypot(q[2 * i] - q[2 * j], q[2 * i + 1] - q[2 * j + 1]));
    return least;
}

static void the_gas_starts_without_overlap(void **state)
{
    (void)state;
    struct phys_system system = system_opened("gas");
    double a[100], b[100], v[100];
    for (uint64_t seed = 0; seed < 20; seed++) {
        system_start(&system, seed, a, v);
        assert_true(closest(&system, a) > 0.85 * phys_system_get(&system, "spacing"));
    }
    system_start(&system, 19, b, v);
    assert_memory_equal(a, b, sizeof a);
    system_start(&system, 20, b, v);
    assert_memory_not_equal(a, b, sizeof a);
    phys_system_close(&system);

    system = published_system("gas"); /* at random in the box, at rest */
    system_start(&system, 1, a, v);
    for (size_t k = 0; k < 100; k++) {
        assert_true(a[k] >= 0.4 && a[k] < 0.6);
        assert_true(v[k] == 0);
    }
    phys_system_close(&system);
}

/* Two columns of one name would be read as one. */
static void names_of_coordinates_are_their_own(void **state)
{
    (void)state;
    static const struct {
        const char *names[2], *time; /* NULL: refused */
    } cases[] = {{{"a", "b"}, "t"},      {{"t", "r"}, "time"},        {{"time", "r"}, "t"},
                 {{"v", "v_b"}, "t"},    {{"a", "a"}, NULL},          {{"t", "time"}, NULL},
                 {{"a", "v_a"}, NULL},   {{"reaction_a", "a"}, NULL}, {{"energy", "a"}, NULL},
                 {{"a", "error"}, NULL}, {{"row", "a"}, NULL}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct phys_system built = system_opened("kepler"), system;
        struct phys_scene scene = *built.scene;
        struct ad_error error = {0};
        scene.coordinates = cases[k].names;
        enum ad_status status = phys_system_make(&scene, &system, &error);
        assert_int_equal(status, cases[k].time ? AD_OK : AD_E_INPUT);
        if (cases[k].time)
            assert_string_equal(phys_time_name(&system), cases[k].time);
        else
            assert_mentions(error.message, "kepler: coordinate");
        phys_system_close(&system);
        phys_system_close(&built);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unknown_names_suggest_the_nearest),
        cmocka_unit_test(parameters_are_set_by_name),
        cmocka_unit_test(presets_name_parameters_that_exist),
        cmocka_unit_test(sizes_follow_the_parameters),
        cmocka_unit_test(coordinates_have_names),
        cmocka_unit_test(names_of_coordinates_are_their_own),
        cmocka_unit_test(the_gas_starts_without_overlap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
