/* Paths with constraints whose ends are free: closed forms, and the same in other coordinates. */
#include "constrained_path.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>

static const char *const one[] = {"surface"}, *const two[] = {"upper", "lower"};
static const bool all[4] = {true, true, true, true};

static void set_free(struct constrained_path *r, struct phys_ends *ends, const bool *start,
                     const bool *end)
{
    *ends = (struct phys_ends){.size = sizeof *ends, .free = {start, end}};
    r->settings.ends = ends;
}

/* On a wire that turns, L = (r'^2 + 4 r^2)/2: with a free end r = cosh 2(1 - t) / cosh 2. */
static void a_bead_on_a_turning_wire(void **state)
{
    enum { SLICES = 21 };
    const struct phys_scene scene = constrained_scene("wire", 2, constrained_coasts,
                                                      constrained_tilted, constrained_wire, 1, one);
    const double q0[] = {1, 0}, q1[] = {-0.3, 0.7}; /* a guess, beside the wire */
    struct constrained_path r = constrained_path(&scene, "gauss4", SLICES, 1, q0, q1);
    struct phys_ends ends;
    (void)state;
    set_free(&r, &ends, NULL, all);
    constrained_path_found(&r);
    for (size_t i = 0; i < SLICES; i++) {
        const double t = (double)i / (SLICES - 1), at = cosh(2 * (1 - t)) / cosh(2);
        assert_close(r.path[i], at * cos(2 * t), 0, 1e-12);
        assert_close(r.path[SLICES + i], at * sin(2 * t), 0, 1e-12);
    }
    assert_true(r.found.free_momentum < 1e-9 && r.found.true_distance < 1e-9);
    assert_int_equal(r.found.spectrum.index, 0);
    constrained_path_end(&r);
}

/* By a meridian to a circle of latitude, whose normals meet at the poles: past one the path is a
   saddle. */
static void meridians_to_a_circle(void **state)
{
    enum { SLICES = 41 };
    static const bool along[] = {true, true, false};
    static const struct {
        double from, to;
        size_t index;
    } cases[] = {{0.4, 0, 0}, {0.4, M_PI, 1}, {-1.2, 1, 0}, {-1.2, M_PI - 1, 1}};
    const struct phys_scene scene = constrained_scene(
        "globe", 3, constrained_coasts, constrained_tilted, constrained_sphere, 1, one);
    (void)state;
    for (size_t c = 0; c < LENGTH(cases); c++) {
        const double from = cases[c].from, way = cases[c].to - from, to = cases[c].to;
        const double q0[] = {cos(from), 0, sin(from)}, q1[] = {1.1 * cos(to), 0.1, sin(to)};
        struct constrained_path r = constrained_path(&scene, "gauss5", SLICES, 1, q0, q1);
        struct phys_ends ends;
        set_free(&r, &ends, NULL, along);
        for (size_t i = 1; i + 1 < SLICES; i++) { /* a guess */
            const double a = from + way * (double)i / (SLICES - 1);
            r.path[i] = cos(a);
            r.path[SLICES + i] = 0.1 * sin(a - from);
            r.path[2 * SLICES + i] = sin(a);
        }
        constrained_path_found(&r);
        for (size_t i = 0; i < SLICES; i++) {
            const double a = from + way * (double)i / (SLICES - 1);
            assert_close(r.path[i], cos(a), 0, 1e-9);
            assert_close(r.path[SLICES + i], 0, 0, 1e-8);
            assert_close(r.path[2 * SLICES + i], sin(a), 0, 1e-9);
        }
        assert_close(r.found.info.action, way * way / 2, 1e-10, 0);
        assert_int_equal(r.found.spectrum.index, cases[c].index);
        assert_true(r.found.free_momentum < 1e-7);
        constrained_path_end(&r);
    }
}

/* ---- two rods, in x, y and in angles ---- */

static ad_var rods(ad_var q, ad_var t, const void *params)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), u = ad_sub(ad_row(q, 2), x),
           w = ad_sub(ad_row(q, 3), y);
    (void)t, (void)params;
    return ad_concat_rows(2, (ad_var[]){ad_sub(ad_add(ad_square(x), ad_square(y)), 1),
                                        ad_sub(ad_add(ad_square(u), ad_square(w)), 1)});
}

static ad_var weights(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))),
                  ad_mul(9.81, ad_add(ad_row(q, 1), ad_row(q, 3))));
}

static void place(const double *theta, double *q)
{
    q[0] = sin(theta[0]);
    q[1] = -cos(theta[0]);
    q[2] = q[0] + sin(theta[1]);
    q[3] = q[1] - cos(theta[1]);
}

static void two_rods_are_two_angles(void **state)
{
    enum { SLICES = 31 };
    static const struct {
        bool joints[4], angles[2];
        size_t start; /* the upper one is given there, too */
    } cases[] = {{{true, true, true, true}, {true, true}, 0},
                 {{false, false, true, true}, {false, true}, 0},
                 {{false, false, true, true}, {false, true}, 1}};
    const struct phys_scene scene =
        constrained_scene("rods", 4, weights, constrained_cranked, rods, 2, two);
    struct phys_system opened = system_opened("dblpend");
    const struct phys_scene angles = *opened.scene;
    const double theta0[] = {0.5, -0.4}, theta1[] = {1.1, -0.9};
    double q0[4], q1[4];
    (void)state;
    place(theta0, q0);
    place(theta1, q1);
    for (size_t c = 0; c < LENGTH(cases); c++) {
        struct constrained_path a = constrained_path(&scene, "gauss4", SLICES, 0.4, q0, q1),
                                b = constrained_path(&angles, "gauss4", SLICES, 0.4, theta0,
                                                     theta1);
        struct phys_ends of_a, of_b;
        double q[4], theta[2];
        for (size_t k = 0; k < 4; k++)
            system_set(&b.system, ((const char *[]){"m1", "m2", "l1", "l2"})[k], 1);
        system_set(&b.system, "g", 9.81);
        set_free(&a, &of_a, cases[c].start ? cases[c].joints : NULL, cases[c].joints);
        set_free(&b, &of_b, cases[c].start ? cases[c].angles : NULL, cases[c].angles);
        for (size_t i = 0; i < SLICES; i++) {
            for (size_t k = 0; k < 2; k++)
                theta[k] = b.path[k * SLICES + i];
            place(theta, q);
            for (size_t k = 0; k < 4; k++)
                a.path[k * SLICES + i] = q[k];
        }
        constrained_path_found(&b);
        constrained_path_found(&a);
        for (size_t i = 0; i < SLICES; i++) {
            for (size_t k = 0; k < 2; k++)
                theta[k] = b.path[k * SLICES + i];
            place(theta, q);
            for (size_t k = 0; k < 4; k++)
                assert_close(a.path[k * SLICES + i], q[k], 0, 1e-9);
        }
        assert_int_equal(a.found.spectrum.index, b.found.spectrum.index);
        assert_true(a.found.free_momentum < 1e-7 && a.found.true_distance < 1e-7);
        constrained_path_end(&a);
        constrained_path_end(&b);
    }
    phys_system_close(&opened);
}

/* ---- what cannot be ---- */

static void given_coordinates_that_no_free_one_helps(void **state)
{
    static const bool x[] = {true, false};
    const struct phys_scene scene = constrained_scene(
        "rod", 2, constrained_falls, constrained_tilted, constrained_sphere, 1, one);
    const double q0[] = {1, 0}, q1[] = {0.5, -1.2}, q2[] = {0.9, -0.6};
    struct phys_ends ends;
    struct ad_error error;
    (void)state;
    struct constrained_path r = constrained_path(&scene, "gauss4", 21, 0.5, q0, q1);
    set_free(&r, &ends, NULL, x);
    assert_int_equal(constrained_path_find(&r, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "rod end constraints given");
    constrained_path_end(&r);
    r = constrained_path(&scene, "gauss4", 21, 0.5, q0, q2); /* one place is left */
    set_free(&r, &ends, NULL, x);
    constrained_path_found(&r);
    assert_close(r.path[20], 0.8, 1e-12, 0);
    assert_true(r.path[41] == -0.6);
    constrained_path_end(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bead_on_a_turning_wire),
        cmocka_unit_test(meridians_to_a_circle),
        cmocka_unit_test(two_rods_are_two_angles),
        cmocka_unit_test(given_coordinates_that_no_free_one_helps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
