/* The checks of a Lagrangian find its defects and name their position. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/motion/checks.h"
#include "physics/physics.h"

#include <string.h>

enum { N = 7, DOF = 2 };

static double q[DOF * N], v[DOF * N], t[N];
static const struct phys_points at = {.size = sizeof at, N, q, v, t};

static int fill(void **state)
{
    (void)state;
    for (size_t k = 0; k < DOF * N; k++) {
        q[k] = 0.7 + 0.31 * sin(1.3 * (double)k);
        v[k] = -0.4 + 0.57 * cos(2.1 * (double)k);
    }
    for (size_t i = 0; i < N; i++)
        t[i] = 0.23 * (double)i;
    return 0;
}

static ad_var free_motion(ad_var u) { return ad_mul(0.5, ad_sum_rows(ad_square(u))); }

static ad_var local(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)params;
    ad_var force = ad_mul(ad_row(x, 0), ad_sin(ad_row(x, 1)));
    return ad_sub(free_motion(u), ad_mul(force, ad_cos(s)));
}

/* Column i takes column i - 1 of a row: the last slice alone does not move any other. */
static ad_var before(ad_var row)
{
    return ad_concat_cols(2, (ad_var[]){ad_slice_cols(row, 0, 1), ad_slice_cols(row, 0, N - 1)});
}

static ad_var reacts_to_q(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_mul(1e-9, before(ad_row(x, 1))));
}

static ad_var reacts_to_v(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_mul(1e-9, before(ad_row(u, 0))));
}

static ad_var reacts_to_t(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_mul(1e-9, before(s)));
}

/* The mean over the path hides in every slice. */
static ad_var reacts_to_all(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_mul(1e-9, ad_mean(ad_row(x, 0))));
}

static ad_var jumps(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_gt(ad_row(x, 1), q[N + 3]));
}

static ad_var overflows(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(local(x, u, s, params), ad_label(ad_exp(ad_mul(1e4, ad_row(x, 0))), "huge"));
}

/* A system with nothing but a Lagrangian: all that the checks look at. */
#define SYSTEM(callback)                                                                           \
    const struct phys_scene scene = {.name = "try", .dof = DOF, .lagrangian = (callback)};         \
    const struct phys_system system = {.scene = &scene, .dof = DOF, .bodies = 1, .dims = DOF};     \
    struct ad_error error = {0}

static void expect_reaction(phys_lagrangian *callback, size_t slice, size_t moved, size_t row)
{
    SYSTEM(callback);
    struct phys_locality report;
    assert_int_equal(phys_check_locality(&system, &at, &report, &error), AD_OK);
    assert_false(report.passed);
    assert_int_equal(report.slice, slice);
    assert_int_equal(report.moved, moved);
    assert_int_equal(report.row, row);
}

static void test_locality(void **state)
{
    (void)state;
    SYSTEM(local);
    struct phys_locality report;
    assert_int_equal(phys_check_locality(&system, &at, &report, &error), AD_OK);
    assert_true(report.passed);
    expect_reaction(reacts_to_q, 1, 0, 1);
    expect_reaction(reacts_to_v, 1, 0, DOF + 0);
    expect_reaction(reacts_to_t, 1, 0, 2 * DOF);
    expect_reaction(reacts_to_all, 1, 0, 0);
}

static void test_gradient(void **state)
{
    (void)state;
    SYSTEM(local);
    struct ad_check report;
    for (int order = 1; order <= 2; order++) {
        assert_int_equal(phys_check_gradient(&system, &at, order, 1e-8, 0, &report, &error), AD_OK);
        assert_true(report.passed);
        assert_int_equal(report.entries, (2 * DOF + 1) * N);
    }
}

/* G6 */
static void test_wrong_use(void **state)
{
    (void)state;
    SYSTEM(local);
    static const int orders[] = {0, 3, -1};
    for (size_t k = 0; k < 3; k++) {
        error = (struct ad_error){0};
        struct ad_check report = {.passed = true};
        assert_int_equal(phys_check_gradient(&system, &at, orders[k], 1e-8, 0, &report, &error),
                         AD_E_ARGUMENT);
        assert_false(report.passed);
    }
    for (size_t n = 0; n < 2; n++) {
        error = (struct ad_error){0};
        struct phys_points few = {.size = sizeof few, n, at.q, at.v, at.t};
        struct phys_locality report = {.passed = true};
        assert_int_equal(phys_check_locality(&system, &few, &report, &error), AD_E_ARGUMENT);
        assert_false(report.passed);
    }
    struct phys_points two = {.size = sizeof two, 2, at.q, at.v, at.t};
    struct phys_locality report = {0};
    error = (struct ad_error){0};
    assert_int_equal(phys_check_locality(&system, &two, &report, &error), AD_OK);
    assert_true(report.passed);
}

/* A jump right at slice 3 of coordinate 1: no derivative on the tape can tell of it. */
static void test_wrong_gradient(void **state)
{
    (void)state;
    SYSTEM(jumps);
    struct ad_check report;
    assert_int_equal(phys_check_gradient(&system, &at, 1, 1e-6, 0, &report, &error), AD_OK);
    assert_false(report.passed);
    assert_int_equal(report.input, 0);
    assert_int_equal(report.row, 1);
    assert_int_equal(report.col, 3);
}

static void test_finite(void **state)
{
    (void)state;
    SYSTEM(local);
    assert_int_equal(phys_check_finite(&system, &at, &error), AD_OK);
}

static void test_not_finite(void **state)
{
    (void)state;
    SYSTEM(overflows);
    assert_int_equal(phys_check_finite(&system, &at, &error), AD_E_NONFINITE);
    assert_mentions(error.message, "huge");
}

/* ---- T and V beside L (F6) ---- */

static ad_var quadratic(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)x, (void)s, (void)params;
    return free_motion(u);
}

/* As seen from a frame that turns: not quadratic in u alone. */
static ad_var turning(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)s, (void)params;
    return ad_add(free_motion(u), ad_mul(ad_row(x, 0), ad_row(u, 1)));
}

static ad_var well(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)u, (void)params;
    return ad_mul(ad_cos(s), ad_sum_rows(ad_square(x)));
}

/* Of degree 0 in u: T + V is the energy all the same. */
static ad_var direction(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_add(well(x, u, s, params), ad_div(ad_row(u, 0), ad_row(u, 1)));
}

static ad_var sum_of_both(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_sub(quadratic(x, u, s, params), well(x, u, s, params));
}

static void test_energies(void **state)
{
    (void)state;
    static const struct {
        phys_lagrangian *T, *V, *L;
        const char *says; /* NULL: nothing is wrong */
    } cases[] = {
        {quadratic, well, NULL, NULL},        {quadratic, well, sum_of_both, NULL},
        {quadratic, direction, NULL, "by v"}, {turning, well, NULL, "quadratic"},
        {quadratic, well, local, "differs"},  {NULL, NULL, local, NULL},
        {quadratic, NULL, local, NULL},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct phys_scene scene = {.name = "try", .dof = DOF, .lagrangian = cases[k].L};
        scene.kinetic = cases[k].T;
        scene.potential = cases[k].V;
        const struct phys_system system = {.scene = &scene, .dof = DOF, .bodies = 1, .dims = DOF};
        struct ad_error error = {0};
        assert_int_equal(phys_check_energies(&system, &at, &error),
                         cases[k].says ? AD_E_ARGUMENT : AD_OK);
        if (cases[k].says)
            assert_mentions(error.message, cases[k].says);
    }
}

/* All of them along the motion of a scene, and what is no scene to check. */
static void a_scene_is_checked_along_its_motion(void **state)
{
    (void)state;
    struct phys_system pendulum, closed = {0};
    struct phys_checks c;
    struct ad_error error = {0}, none = {0};
    phys_system_open("pendulum", &pendulum, &error);
    assert_int_equal(phys_check_scene(&pendulum, 1, 20, 0.1, 1e-6, 0, &c, &error), AD_OK);
    assert_true(c.passed && c.gradient.passed && c.second.passed && c.locality.passed);
    assert_int_equal(c.gradient.entries, 3 * 19); /* q, v and t at all slices but the last */
    assert_close(c.mass_condition, 1, 1e-12, 0);
    assert_int_equal(phys_check_scene(&pendulum, 1, 20, 0.1, 1e-300, 0, &c, &error), AD_OK);
    assert_false(c.passed || c.gradient.passed);
    assert_true(c.locality.passed && c.energies.status == AD_OK);
    assert_int_equal(phys_check_scene(&pendulum, 1, 2, 0.1, 1e-6, 0, &c, &error), AD_E_ARGUMENT);
    assert_int_equal(phys_check_scene(&closed, 1, 20, 0.1, 1e-6, 0, &c, &none), AD_E_ARGUMENT);
    phys_system_close(&pendulum);
}

/* ---- all checks, and their report ---- */

static ad_var signs(ad_var x, ad_var u, ad_var s, const void *params)
{
    ad_var kinetic = ad_mul(0.5, ad_sub(ad_square(ad_row(u, 0)), ad_square(ad_row(u, 1))));
    (void)s, (void)params;
    return ad_sub(kinetic, ad_sum_rows(ad_square(x)));
}

static ad_var negative(ad_var x, ad_var u, ad_var s, const void *params)
{
    return ad_neg(local(x, u, s, params));
}

static ad_var degenerate(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)s, (void)params;
    return ad_sub(ad_square(ad_sum_rows(u)), ad_sum_rows(ad_square(x)));
}

static void all_checks_at_points_of_the_caller(void **state)
{
    static const struct {
        phys_lagrangian *L;
        bool passed;
        size_t least, most; /* negative eigenvalues */
        const char *says;
    } cases[] = {
        {local, true, 0, 0, "positive definite"},
        {negative, true, DOF, DOF, "negative definite"},
        {signs, true, 1, 1, "indefinite"},
        {degenerate, true, SIZE_MAX, SIZE_MAX, "singular"},
        {reacts_to_v, false, SIZE_MAX, SIZE_MAX, "reacts to v"},
        {jumps, false, 0, 0, "FAILED"},
    };
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        char text[2000], part[10];
        struct phys_scene scene = {.name = "try", .dof = DOF, .lagrangian = cases[k].L};
        const struct phys_system system = {.scene = &scene, .dof = DOF, .bodies = 1, .dims = DOF};
        struct phys_checks c;
        struct ad_error error = {0};
        assert_int_equal(phys_check_all(&system, &at, 0, &c, &error), AD_OK);
        assert_int_equal(c.passed, cases[k].passed);
        assert_int_equal(c.negative_least, cases[k].least);
        assert_int_equal(c.negative_most, cases[k].most);
        size_t length = phys_checks_text(&system, &c, text, sizeof text);
        assert_int_equal(length, strlen(text));
        assert_mentions(text, cases[k].says);
        assert_int_equal(phys_checks_text(&system, &c, part, sizeof part), length);
        assert_int_equal(strlen(part), sizeof part - 1);
        assert_int_equal(phys_checks_text(&system, &c, NULL, 0), length);
    }
}

static void all_checks_on_the_motion_of_the_scene(void **state)
{
    struct phys_system pendulum;
    struct phys_checks c;
    struct ad_error error = {0}, none = {0}, few = {0}, not_positive = {0};
    const struct phys_points one = {.size = sizeof one, 1, q, v, t};
    (void)state;
    phys_system_open("pendulum", &pendulum, &error);
    assert_int_equal(phys_check_all(&pendulum, NULL, 0, &c, &error), AD_OK);
    assert_true(c.passed && c.negative_most == 0);
    assert_int_equal(phys_check_all(&pendulum, NULL, 1e-300, &c, &error), AD_OK);
    assert_false(c.passed);
    assert_int_equal(phys_check_all(NULL, NULL, 0, &c, &none), AD_E_ARGUMENT);
    assert_int_equal(phys_check_all(&pendulum, &one, 0, &c, &few), AD_E_ARGUMENT);
    assert_int_equal(phys_check_all(&pendulum, NULL, -1, &c, &not_positive), AD_E_ARGUMENT);
    assert_int_equal(phys_checks_text(NULL, &c, NULL, 0), 0);
    phys_system_close(&pendulum);
}

/* ---- jumps of the forces ---- */

typedef ad_var function(ad_var x);
static function *potential;

static ad_var in_potential(ad_var x, ad_var u, ad_var s, const void *params)
{
    (void)params;
    ad_var from = ad_sub(ad_row(x, 0), 0.7123); /* crossed between slices */
    return ad_sub(ad_sub(free_motion(u), potential(from)), ad_mul(ad_row(x, 1), ad_cos(s)));
}

static ad_var by_acos(ad_var x) { return ad_add(ad_square(x), ad_acos(ad_cos(x))); }
static ad_var by_log(ad_var x) { return ad_exp(ad_mul(0.5, ad_log(ad_square(x)))); }
static ad_var by_cosine(ad_var x) { return ad_sqrt(ad_sub(2.0, ad_mul(2.0, ad_cos(x)))); }
static ad_var by_even_root(ad_var x) { return ad_pow(ad_square(ad_square(x)), 0.25); }
static ad_var by_max(ad_var x) { return ad_max(x, ad_neg(x)); }
static ad_var by_select(ad_var x) { return ad_select(ad_lt(x, 0.0), ad_neg(x), x); }
static ad_var by_hypot(ad_var x) { return ad_hypot(x, ad_mul(2.0, x)); }
static ad_var by_angle(ad_var x) { return ad_mul(x, ad_atan2(x, ad_mul(0.0, x))); }
static ad_var by_sign(ad_var x) { return ad_mul(0.01, ad_mul(x, ad_sign(x))); }

static ad_var wave(ad_var x) { return ad_sin(ad_mul(40.0, x)); }
static ad_var bump(ad_var x) { return ad_exp(ad_mul(-200.0, ad_square(x))); }
static ad_var steep(ad_var x) { return ad_tanh(ad_mul(50.0, x)); }
static ad_var rounded(ad_var x) { return ad_sqrt(ad_add(ad_square(x), 1e-4)); }

static void kinks_by_any_name_jump_and_smooth_forces_do_not(void **state)
{
    (void)state;
    static function *const kinks[] = {by_acos,   by_log,   by_cosine, by_even_root, by_max,
                                      by_select, by_hypot, by_angle,  by_sign};
    static function *const smooth[] = {wave, bump, steep, rounded, ad_square, ad_cosh};
    SYSTEM(in_potential);
    for (size_t k = 0; k < LENGTH(kinks); k++) {
        potential = kinks[k];
        print_message("kink %zu\n", k);
        assert_true(phys_check_jumps(&system, &at));
    }
    for (size_t k = 0; k < LENGTH(smooth); k++) {
        potential = smooth[k];
        print_message("smooth %zu\n", k);
        assert_false(phys_check_jumps(&system, &at));
    }
    (void)error;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_locality),
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_wrong_gradient),
        cmocka_unit_test(test_finite),
        cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_wrong_use),
        cmocka_unit_test(test_energies),
        cmocka_unit_test(kinks_by_any_name_jump_and_smooth_forces_do_not),
        cmocka_unit_test(a_scene_is_checked_along_its_motion),
        cmocka_unit_test(all_checks_at_points_of_the_caller),
        cmocka_unit_test(all_checks_on_the_motion_of_the_scene),
    };
    return cmocka_run_group_tests(tests, fill, NULL);
}
