/* All paths with constraints: turns around a circle and a globe, and a rod against its angle. */
#include "constrained_path.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>

static const char *const one[] = {"surface"};

static struct phys_solutions all_of(const struct constrained_path *r)
{
    struct phys_solutions all;
    struct ad_error error = {0};
    phys_rule_interpolate(r->settings.rule, r->system.dof, r->settings.slices, r->path);
    phys_path_all(&r->system, &r->settings, r->path, 200, 1, &all, &error);
    assert_string_equal(error.message, "");
    return all;
}

/* From 0 to 1 in a time of 1 with any number of turns: of energy (1 + 2 pi k)^2 / 2. */
static void turns_around_a_circle(void **state)
{
    const struct phys_scene scene = constrained_scene(
        "circle", 2, constrained_coasts, constrained_tilted, constrained_sphere, 1, one);
    struct constrained_path r =
        constrained_path(&scene, "gauss4", 41, 1, (double[]){1, 0}, (double[]){cos(1), sin(1)});
    struct phys_solutions all = all_of(&r);
    (void)state;
    assert_in_range(all.n, 9, 12);
    for (size_t k = 0; k < 9; k++) { /* 0, -1, 1, -2, ... turns */
        const double turns = k % 2 ? -(double)((k + 1) / 2) : (double)(k / 2);
        const double way = 1 + 2 * M_PI * turns;
        assert_close(all.solution[k].energy, way * way / 2, 1e-9, 0);
        assert_true(all.solution[k].resolved);
    }
    assert_true(all.fastest > 25);
    phys_solutions_free(&all);
    constrained_path_end(&r);
}

/* Great circles of lengths d and 2 pi - d, and a turn more, with as many conjugate points as times
   they pass pi. */
static void great_circles(void **state)
{
    static const double d = 0.8;
    const struct phys_scene scene = constrained_scene(
        "globe", 3, constrained_coasts, constrained_tilted, constrained_sphere, 1, one);
    struct constrained_path r = constrained_path(&scene, "gauss4", 31, 1, (double[]){0.6, 0, 0.8},
                                                 (double[]){0.6 * cos(d), sin(d), 0.8 * cos(d)});
    struct phys_solutions all = all_of(&r);
    (void)state;
    assert_true(all.n >= 3);
    for (size_t k = 0; k < 3; k++) {
        const double way = k % 2 ? 2 * M_PI - d : d + M_PI * (double)k;
        assert_close(all.solution[k].energy, way * way / 2, 1e-8, 0);
        assert_int_equal(all.solution[k].spectrum.index, k);
        assert_true(all.solution[k].resolved);
    }
    phys_solutions_free(&all);
    constrained_path_end(&r);
}

/* The paths of a pendulum to the end and to whole turns from there. */
static void a_rod_is_an_angle(void **state)
{
    enum { SLICES = 41 };
    static const double theta[] = {2, 1};
    const struct phys_scene scene = constrained_scene(
        "rod", 2, constrained_falls, constrained_tilted, constrained_sphere, 1, one);
    struct phys_system opened = system_opened("pendulum");
    const struct phys_scene pendulum = *opened.scene;
    const double q0[] = {sin(theta[0]), -cos(theta[0])}, q1[] = {sin(theta[1]), -cos(theta[1])};
    struct constrained_path rod = constrained_path(&scene, "gauss4", SLICES, 1.5, q0, q1);
    struct phys_solutions of_rod = all_of(&rod);
    size_t known = 0, within = 0;
    (void)state;
    for (int turns = -2; turns <= 2; turns++) {
        struct constrained_path p = constrained_path(&pendulum, "gauss4", SLICES, 1.5, theta,
                                                     (double[]){theta[1] + 2 * M_PI * turns});
        system_set(&p.system, "l", 1);
        system_set(&p.system, "g", constrained_g);
        struct phys_solutions of_angle = all_of(&p);
        for (size_t k = 0; k < of_angle.n; k++)
            for (size_t i = 0; i < of_rod.n; i++)
                if (is_close(of_rod.solution[i].energy + constrained_g, of_angle.solution[k].energy,
                             1e-7, 0)) {
                    assert_int_equal(of_rod.solution[i].spectrum.index,
                                     of_angle.solution[k].spectrum.index);
                    known++;
                }
        within += of_angle.n;
        phys_solutions_free(&of_angle);
        constrained_path_end(&p);
    }
    assert_true(within >= 5);
    assert_int_equal(known, within);
    phys_solutions_free(&of_rod);
    constrained_path_end(&rod);
    phys_system_close(&opened);
}

static void ends_beside_the_surface_are_refused(void **state)
{
    const struct phys_scene scene = constrained_scene(
        "globe", 3, constrained_coasts, constrained_tilted, constrained_sphere, 1, one);
    struct constrained_path r =
        constrained_path(&scene, "gauss2", 9, 1, (double[]){0.6, 0, 0.8}, (double[]){0, 1.3, 0});
    struct phys_solutions all;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_path_all(&r.system, &r.settings, r.path, 200, 1, &all, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "globe end surface");
    constrained_path_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turns_around_a_circle),
        cmocka_unit_test(great_circles),
        cmocka_unit_test(a_rod_is_an_angle),
        cmocka_unit_test(ends_beside_the_surface_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
