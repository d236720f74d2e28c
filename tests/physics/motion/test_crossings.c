/* Crossings of a motion: found in order, refused where the text names none. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/physics.h"

/* Upwards through zero: at 3/4, 7/4, ... of a period from the turning point. */
static void crossings_are_found_in_their_order(void **state)
{
    (void)state;
    struct phys_system system;
    struct phys_motion_solution motion;
    struct ad_error error = {0};
    struct phys_crossing crossings[2];
    const double one = 1, zero = 0;
    phys_system_open("spring", &system, &error);
    phys_system_set(&system, "m", 1, &error);
    phys_system_set(&system, "k", 1, &error);
    assert_int_equal(phys_crossing_read(&system, "q>0", &crossings[0], &error), AD_OK);
    assert_int_equal(phys_crossing_read(&system, "v_q=0.5", &crossings[1], &error), AD_OK);
    const struct phys_motion_settings settings = {.size = sizeof settings,
                                                  .time = 20,
                                                  .q = &one,
                                                  .v = &zero,
                                                  .tolerance = 1e-12,
                                                  .integrator =
                                                      phys_integrator_find("dop853", &error),
                                                  .n_crossings = 2,
                                                  .crossings = crossings};
    phys_motion_solve(&system, &settings, &motion, &error);
    const struct phys_crossed *c = &motion.crossed;
    const double t[] = {7 * M_PI / 6, 3 * M_PI / 2, 11 * M_PI / 6};
    assert_int_equal(error.status, AD_OK);
    assert_int_equal(c->n, 3 + 6);
    for (size_t k = 0; k < 9; k++) {
        assert_close(c->t[k], t[k % 3] + 2 * M_PI * (double)(k / 3), 0, 1e-9);
        assert_int_equal((int)c->which[k], k % 3 == 1 ? 1 : 2);
        assert_true(c->touch[k] == 0);
    }
    phys_motion_solution_free(&motion);
    crossings[0].last = true;
    phys_motion_solve(&system, &settings, &motion, &error);
    assert_int_equal(motion.info.stop, PHYS_SIMULATION_EVENT);
    assert_close(motion.info.t, 3 * M_PI / 2, 0, 1e-9);
    assert_int_equal(motion.crossed.n, 2);
    phys_motion_solution_free(&motion);
    phys_system_close(&system);
}

static void texts_that_are_no_crossing_are_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {"x",    "x=",           "x=1s",  "y=1",
                                        "v_=1", "distance:1=1", "q=nan", ""};
    struct ad_error error = {0};
    struct phys_system system;
    struct phys_crossing crossing;
    phys_system_open("spring", &system, &error);
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        error = (struct ad_error){0};
        assert_int_equal(phys_crossing_read(&system, texts[k], &crossing, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, "event");
    }
    phys_system_close(&system);
}

static ad_var product(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(q, v);
}

static ad_var twice_energy(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_square(q), ad_square(v));
}

/* q v = -sin(2 t)/2; what is constant crosses nothing, and takes no other's crossings with it. */
static void observables_cross_values(void **state)
{
    static const struct phys_observable table[] = {
        {"half", "", product}, {"qv", "", product}, {"ee", "", twice_energy}};
    struct phys_system spring, system;
    struct phys_motion_solution motion;
    struct phys_crossing crossing[2];
    struct ad_error error = {0};
    const double one = 1, zero = 0;
    (void)state;
    phys_system_open("spring", &spring, &error);
    struct phys_scene scene = *spring.scene;
    scene.observables = table;
    scene.n_observables = LENGTH(table);
    phys_system_make(&scene, &system, &error);
    phys_system_set(&system, "m", 1, &error);
    phys_system_set(&system, "k", 1, &error);
    assert_int_equal(phys_crossing_read(&system, "qv=0.25", &crossing[0], &error), AD_OK);
    assert_int_equal(phys_crossing_read(&system, "ee=1", &crossing[1], &error), AD_OK);
    struct phys_motion_settings settings = {.size = sizeof settings,
                                            .time = 6.2,
                                            .q = &one,
                                            .v = &zero,
                                            .error = 1e-10,
                                            .n_crossings = 2,
                                            .crossings = crossing};
    for (int coarse = 0; coarse < 2; coarse++) {
        assert_int_equal(phys_motion_solve(&system, &settings, &motion, &error), AD_OK);
        const struct phys_crossed *c = &motion.crossed;
        assert_int_equal(c->n, 4);
        assert_true(!c->constant[0] && (coarse || c->constant[1]));
        for (size_t k = 0; k < c->n; k++) {
            const double t = (k % 2 ? 11 : 7) * M_PI / 12 + M_PI * (double)(k / 2);
            assert_close(c->t[k], t, 0, coarse ? 1e-2 : 1e-9);
            assert_true(fabs(c->t[k] - t) <= c->uncertainty[k] + 1e-14);
            assert_true(!coarse || fabs(c->t[k] - t) > 1e-12);
        }
        phys_motion_solution_free(&motion);
        settings.integrator = phys_integrator_find("verlet", &error);
        settings.dt = 0.01;
        settings.error = 0;
        settings.n_crossings = 1; /* the energy is not constant */
    }
    assert_int_equal(phys_crossing_read(&system, "qvv=1", crossing, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "qvv observable");
    phys_system_close(&system);
    phys_system_close(&spring);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(crossings_are_found_in_their_order),
        cmocka_unit_test(texts_that_are_no_crossing_are_refused),
        cmocka_unit_test(observables_cross_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
