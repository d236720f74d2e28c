/* One call gives a path, its kind and its distances: the swings of a pendulum, g = l = 1, from 0
   back to 0 in 10. */
#include "physics/motion/motion.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLICES = 101, DEGREE = 4 };

static struct phys_system unit_pendulum_opened(void)
{
    struct phys_system pendulum = system_opened("pendulum");
    system_set(&pendulum, "l", 1);
    return pendulum;
}

static struct phys_path_settings settings_of(const char *rule)
{
    struct ad_error error = {0};
    return (struct phys_path_settings){.size = sizeof(struct phys_path_settings),
                                       .rule = phys_rule_find(rule, &error),
                                       .slices = SLICES,
                                       .steps = 50,
                                       .dt = 10. / (SLICES - 1),
                                       .learning_rate = 1e-3};
}

/* The swing of energy E begins with v = sqrt(2 E). */
static void swing(const struct phys_system *pendulum, double E, double path[DEGREE * SLICES])
{
    struct ad_error error = {0};
    double q = 0, v = sqrt(2 * E);
    phys_motion_path(pendulum, NULL, &q, &v, SLICES, 10. / (SLICES - 1), path, &error);
    path[SLICES - 1] = 0;
    phys_rule_interpolate(phys_rule_find("gauss4", &error), 1, SLICES, path);
    assert_no_error(&error);
}

static void a_path_comes_with_kind_and_distances(void **state)
{
    (void)state;
    struct phys_system pendulum = unit_pendulum_opened();
    struct phys_path_settings settings = settings_of("gauss4");
    struct phys_path_found found;
    struct phys_spectrum alone;
    struct ad_error error = {0};
    double path[DEGREE * SLICES], momentum;
    settings.start_momentum = &momentum;
    swing(&pendulum, 1.76375516, path);
    assert_int_equal(phys_path_find(phys_solver_find("newton", &error), &pendulum, &settings, path,
                                    &found, &error),
                     AD_OK);
    assert_true(found.stationary && found.keeps_energy && !found.another);
    assert_true(isnan(found.reference_distance)); /* nothing to compare with was given */
    assert_close(found.info.energy_mean, 1.76375516, 0, 6e-9);
    assert_close(momentum, sqrt(2 * found.info.energy_mean), 1e-7, 0);
    assert_close(found.true_distance, 0, 0, 1e-7);
    assert_close(found.discretisation, 0, 0, 1e-7);
    assert_close(found.true_known, 0, 0, 1e-9);
    phys_path_spectrum(&pendulum, &settings, path, &alone, &error);
    assert_int_equal(found.spectrum.index, 1);
    assert_close(found.spectrum.smallest, alone.smallest, 0, 1e-13); /* of entries to 60 */
    assert_true(found.spectrum.of_motion);
    phys_spectrum_free(&alone);
    phys_path_found_free(&found);
    phys_system_close(&pendulum);
}

/* An ode that motions share gives the bits of one for each, and is the one that is taken. */
static void motions_share_an_ode(void **state)
{
    (void)state;
    struct phys_system pendulum = unit_pendulum_opened(), longer = unit_pendulum_opened();
    const struct phys_system *const of[] = {NULL, &pendulum, &longer};
    double motion[3][SLICES], distance[3];
    struct ad_error error = {0};
    system_set(&longer, "l", 1.5);
    for (size_t k = 0; k < 3; k++) {
        struct phys_ode ode = {0};
        struct phys_path_settings settings = settings_of("gauss4");
        struct phys_simulation how = {.size = sizeof how, .rtol = 1e-13};
        struct phys_path_found found;
        double path[DEGREE * SLICES];
        const double q = 0, v = 1.5;
        swing(&pendulum, 1.76375516, path);
        if (of[k])
            phys_ode_for(of[k], phys_integrator_find("dop853", &error), &ode, &error);
        settings.ode = how.ode = of[k] ? &ode : NULL;
        phys_motion_path(&pendulum, &how, &q, &v, SLICES, settings.dt, motion[k], &error);
        phys_path_find(phys_solver_find("newton", &error), &pendulum, &settings, path, &found,
                       &error);
        assert_no_error(&error);
        distance[k] = found.true_distance;
        phys_path_found_free(&found);
        phys_ode_free(&ode);
    }
    assert_memory_equal(motion[1], motion[0], sizeof motion[0]);
    assert_close(distance[1], distance[0], 0, 1e-12);
    assert_true(motion[2][SLICES - 1] != motion[0][SLICES - 1] && distance[2] > 0.1);
    phys_system_close(&pendulum);
    phys_system_close(&longer);
}

/* A small swing differs from the large one, and a rule of first order from the motion. */
static void other_paths_and_coarse_rules_are_told_apart(void **state)
{
    (void)state;
    struct phys_system pendulum = unit_pendulum_opened();
    struct phys_path_found found;
    struct ad_error error = {0};
    double large[DEGREE * SLICES], small[DEGREE * SLICES], path[DEGREE * SLICES];
    const struct phys_solver *newton = phys_solver_find("newton", &error);
    swing(&pendulum, 1.76375516, large);
    swing(&pendulum, 0.42766904, small);
    struct phys_path_settings settings = settings_of("gauss4");
    for (int same = 0; same < 2; same++) {
        settings.compare = same ? large : small;
        memcpy(path, large, sizeof path);
        assert_int_equal(phys_path_find(newton, &pendulum, &settings, path, &found, &error), AD_OK);
        assert_int_equal(found.another, !same);
        assert_true(same == (found.reference_distance < 1e-6));
        phys_path_found_free(&found);
    }
    settings = settings_of("left");
    memcpy(path, small, sizeof path);
    assert_int_equal(phys_path_find(newton, &pendulum, &settings, path, &found, &error), AD_OK);
    assert_in_range((long)(1e3 * found.discretisation), 1, 500); /* dt is 0.1 */
    phys_path_found_free(&found);
    phys_system_close(&pendulum);
}

/* A7: what a descent leaves is no stationary path: it has figures and a motion, and no verdict. */
static void a_descent_has_no_verdict(void **state)
{
    (void)state;
    struct phys_system pendulum = unit_pendulum_opened();
    struct phys_path_settings settings = settings_of("left");
    struct phys_path_found found;
    struct ad_error error = {0};
    double path[DEGREE * SLICES];
    swing(&pendulum, 0.42766904, path);
    assert_int_equal(phys_path_find(phys_solver_find("adam", &error), &pendulum, &settings, path,
                                    &found, &error),
                     AD_OK);
    assert_int_equal(found.info.steps, 50);
    assert_false(found.stationary);
    assert_true(isnan(found.discretisation) && isfinite(found.true_distance));
    phys_path_found_free(&found);
    settings.slices = 2; /* a refusal leaves nothing to free, and freeing it does no harm */
    assert_int_equal(phys_path_find(phys_solver_find("newton", &error), &pendulum, &settings, path,
                                    &found, &error),
                     AD_E_ARGUMENT);
    phys_path_found_free(&found);
    phys_system_close(&pendulum);
}

/* x = sin t of a spring, from a guess at four slices. */
static void the_coarsest_setting_that_meets_an_error(void **state)
{
    (void)state;
    struct phys_system spring = system_opened("spring");
    struct ad_error error = {0};
    const double guess[] = {0, 0.4, 0.8, sin(1.5)};
    for (double tolerance = 1e-3; tolerance > 1e-11; tolerance /= 100) {
        struct phys_path_settings settings = {
            .size = sizeof settings, .slices = 4, .dt = 0.5, .steps = 50};
        struct phys_refined refined;
        struct phys_path_found found;
        assert_int_equal(
            phys_path_refine(&spring, &settings, guess, 0, tolerance, &refined, &error), AD_OK);
        const struct phys_level *last = &refined.level[refined.n - 1];
        size_t slices = refined.settings->slices;
        assert_int_equal(last->elements, slices - 1);
        assert_true(last->estimate < tolerance);
        double worst = 0;
        for (size_t i = 0; i < slices; i++)
            worst =
                fmax(worst, fabs(refined.path[i] - sin(1.5 * (double)i / (double)(slices - 1))));
        assert_true(worst < last->estimate);
        assert_true(refined.path[0] == 0 && refined.path[slices - 1] == guess[3]);
        assert_int_equal(phys_path_find(phys_solver_find("newton", &error), &spring,
                                        refined.settings, refined.path, &found, &error),
                         AD_OK);
        assert_true(found.stationary && found.discretisation < tolerance);
        phys_path_found_free(&found);
        phys_refined_free(&refined);
    }
    phys_system_close(&spring);
}

static bool refuse(void *context)
{
    (void)context;
    return false;
}

static void errors_out_of_reach_are_told(void **state)
{
    (void)state;
    struct phys_system spring = system_opened("spring");
    const double guess[] = {0, 0.4, 0.8, 1};
    const struct {
        const char *rule;
        double ends_error, tolerance;
        bool stop;
        enum ad_status status;
    } cases[] = {{NULL, 0, 1e-17, false, AD_E_ACCURACY},
                 {NULL, 1e-3, 1e-4, false, AD_E_ACCURACY},
                 {"left", 0, 1e-12, false, AD_E_ACCURACY},
                 {NULL, 0, 1e-3, true, AD_E_ACCURACY},
                 {NULL, 0, 0, false, AD_E_ARGUMENT}};
    for (size_t k = 0; k < LENGTH(cases); k++) {
        struct ad_error error = {0}, none = {0};
        struct phys_refined refined;
        struct phys_path_settings settings = {
            .size = sizeof settings,
            .slices = 4,
            .dt = 0.5,
            .steps = 50,
            .proceed = cases[k].stop ? refuse : NULL,
            .rule = cases[k].rule ? phys_rule_find(cases[k].rule, &none) : NULL};
        assert_int_equal(phys_path_refine(&spring, &settings, guess, cases[k].ends_error,
                                          cases[k].tolerance, &refined, &error),
                         cases[k].status);
        assert_null(refined.path);
        phys_refined_free(&refined);
    }
    phys_system_close(&spring);
}

static void motions_say_what_they_are(void **state)
{
    (void)state;
    static const struct {
        const char *scene, *rule;
        enum phys_motion_of is;
    } cases[] = {{"pendulum", "left", PHYS_PATH_GRID},
                 {"dblpend", "left", PHYS_PATH_PUBLISHED},
                 {"pendulum", "gauss2", PHYS_PATH_TRUE},
                 {"brachistochrone", "left", PHYS_PATH_CLOSED},
                 {"arenstorf", "left", PHYS_PATH_LOST}};
    for (size_t c = 0; c < LENGTH(cases); c++) {
        struct phys_system system = system_opened(cases[c].scene);
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct ad_error error = {0};
        enum phys_motion_of is;
        size_t n = settings.slices, size = system.dof * n;
        double *path = calloc(2 * size, sizeof *path), *other = path + size;
        settings.rule = phys_rule_find(cases[c].rule, &error);
        assert_int_equal(phys_path_motion(&system, &settings, NULL, 1, path, &is, &error), AD_OK);
        assert_int_equal(is, cases[c].is);
        if (is == PHYS_PATH_GRID || is == PHYS_PATH_PUBLISHED) /* from where the path begins, too */
            phys_published_path(&system, 1, n, settings.dt, false, 1, path, other, &error);
        else
            phys_scene_path(&system, 1, NULL, n, settings.dt, other, &error);
        assert_no_error(&error);
        for (size_t k = 0; k < size; k++)
            assert_close(other[k], path[k], 1e-9, 1e-9);
        free(path);
        phys_system_close(&system);
    }
}

static ad_var rotating(ad_var q, ad_var v, ad_var t, const void *params)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), u = ad_row(v, 0), w = ad_row(v, 1);
    (void)t, (void)params;
    return ad_add(ad_mul(0.5, ad_sub(ad_sum_rows(ad_square(v)), ad_sum_rows(ad_square(q)))),
                  ad_mul(0.2, ad_sub(ad_mul(x, w), ad_mul(y, u))));
}

/* A total derivative beside the Lagrangian, (q^3)' / 10, and of time, (t^2 q)' / 2. */
static ad_var gauged(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    ad_var L = ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(0.5, ad_square(q)));
    ad_var more = ad_add(ad_mul(0.3, ad_mul(ad_square(q), v)),
                         ad_add(ad_mul(t, q), ad_mul(0.5, ad_mul(ad_square(t), v))));
    return ad_sum_rows(ad_add(L, more));
}

static ad_var stretched(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sum_rows(ad_sub(ad_mul(0.5, ad_square(ad_mul(ad_add(1, ad_square(q)), v))), q));
}

static ad_var relativistic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sum_rows(ad_sub(ad_neg(ad_sqrt(ad_sub(1, ad_square(v)))), ad_mul(0.5, ad_square(q))));
}

static enum ad_status aside(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1, q[1] = 0.5;
    v[0] = 0.3, v[1] = 0.1;
    return AD_OK;
}

/* The reference of rule left is stationary for its action, whatever L_v depends on. */
static void the_motion_of_rule_left_is_stationary(void **state)
{
    (void)state;
    phys_lagrangian *const lagrangians[] = {rotating, gauged, stretched, relativistic};
    for (size_t k = 0; k < LENGTH(lagrangians); k++) {
        struct phys_system spring = system_opened("spring");
        struct phys_scene scene = *spring.scene;
        struct phys_system system = {0};
        struct phys_path_info info = {0};
        struct ad_error error = {0};
        enum phys_motion_of is;
        scene.dof = 2;
        scene.coordinates = NULL;
        scene.paper = NULL;
        scene.kinetic = scene.potential = NULL;
        scene.lagrangian = lagrangians[k];
        scene.start = aside;
        assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
        struct phys_path_settings settings = phys_path_defaults(&system);
        settings.rule = phys_rule_find("left", &error);
        settings.slices = 41;
        settings.dt = 0.05;
        double path[2 * 41];
        assert_int_equal(phys_path_motion(&system, &settings, NULL, 1, path, &is, &error), AD_OK);
        assert_int_equal(is, PHYS_PATH_GRID);
        assert_int_equal(
            phys_path_solve(&phys_solver_march, &system, &settings, path, &info, &error), AD_OK);
        assert_true(info.start.grad_norm < 1e-12);
        phys_system_close(&system);
        phys_system_close(&spring);
    }
}

/* A parabola bent to end at 5, and the line between its ends. */
static void lines_and_bent_paths_have_the_ends(void **state)
{
    (void)state;
    const double ends[] = {1, 0, 0, 5};
    double bent[] = {1, 2, 5, 10}, line[4];
    phys_path_line(1, 4, ends, line);
    phys_path_bend(1, 4, ends, bent);
    for (size_t i = 0; i < 4; i++) {
        double t = (double)i;
        assert_close(line[i], 1 + 4 * t / 3, 1e-15, 0);
        assert_close(bent[i], 1 + t * t - 5 * t / 3, 0, 1e-15);
    }
    assert_true(line[3] == 5 && bent[3] == 5);
}

static bool proceed_for(void *context)
{
    size_t *left = context;
    *left -= *left > 0;
    return *left > 0;
}

/* Wherever it is interrupted, no kind is claimed that was not looked at, and none is denied. */
static void an_interrupted_verification_claims_nothing(void **state)
{
    (void)state;
    struct phys_system pendulum = unit_pendulum_opened();
    size_t interrupted = 0, late = 0, complete = 0;
    for (size_t calls = 1; calls < 6000; calls += 1 + calls / 40) {
        struct phys_path_settings settings = settings_of("gauss2");
        struct phys_path_found found;
        struct ad_error error = {0};
        double path[DEGREE * SLICES];
        size_t left = calls;
        settings.proceed = proceed_for;
        settings.context = &left;
        swing(&pendulum, 1.76375516, path);
        phys_rule_interpolate(settings.rule, 1, SLICES, path);
        phys_path_find(phys_solver_find("newton", &error), &pendulum, &settings, path, &found,
                       &error);
        assert_no_error(&error);
        assert_false(found.unknown);
        if (found.info.stop == PHYS_STOP_INTERRUPTED) {
            interrupted++;
            late += isfinite(found.spectrum.second_variation) ? 1 : 0;
            assert_false(found.stationary);
        } else if (found.stationary) {
            assert_false(found.spectrum.undetermined);
            assert_int_equal(found.spectrum.index, 1);
            complete++;
        }
        phys_path_found_free(&found);
    }
    assert_true(interrupted > 0 && late > 0); /* also after the kind was found */
    assert_true(complete > 0);
    phys_system_close(&pendulum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_path_comes_with_kind_and_distances),
        cmocka_unit_test(motions_share_an_ode),
        cmocka_unit_test(other_paths_and_coarse_rules_are_told_apart),
        cmocka_unit_test(a_descent_has_no_verdict),
        cmocka_unit_test(an_interrupted_verification_claims_nothing),
        cmocka_unit_test(the_coarsest_setting_that_meets_an_error),
        cmocka_unit_test(errors_out_of_reach_are_told),
        cmocka_unit_test(motions_say_what_they_are),
        cmocka_unit_test(the_motion_of_rule_left_is_stationary),
        cmocka_unit_test(lines_and_bent_paths_have_the_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
