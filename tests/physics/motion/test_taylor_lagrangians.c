/* Taylor series of motions of Lagrangians that depend on time, whose masses vary, whose
   coefficients vanish; and of those that have kinks, which are refused. */
#include "own.h"
#include "tests/close.h"

static const char *const taylor = "taylor";

static ad_var driven(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    return ad_add(ad_mul(0.5, ad_square(v)),
                  ad_sub(ad_mul(q, ad_cos(ad_mul(2.0, t))), ad_mul(0.5, ad_square(q))));
}
/* a bead whose mass depends on where it is and when: L = (1 + q^2 + t) v^2 / 2 */
static ad_var heavy(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params;
    return ad_mul(ad_mul(0.5, ad_square(v)), ad_add(t, ad_add(1.0, ad_square(q))));
}
/* q'' + q = cos 2t: q = (q0 + 1/3) cos t + v0 sin t - cos(2t) / 3. */
static void test_time_in_the_lagrangian(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, driven, 11, 0.1, begin_own);
    double y[2], t = 20;
    assert_int_equal(follow_own(&scene, taylor, t, y), AD_OK);
    assert_close(y[0], (0.5 + 1.0 / 3) * cos(t) + 0.25 * sin(t) - cos(2 * t) / 3, 0, 1e-13);
}

static void test_masses_that_vary(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, heavy, 11, 0.1, begin_own);
    double y[2], other[2];
    assert_int_equal(follow_own(&scene, taylor, 5, y), AD_OK);
    assert_int_equal(follow_own(&scene, "dop853", 5, other), AD_OK);
    assert_close(y[0], other[0], 1e-13, 0);
    assert_close(y[1], other[1], 1e-13, 0);
}

enum { BEADS = 12 };

/* Masses that depend on their places, neighbours' velocities coupled: M has three diagonals. */
static ad_var beads(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    const ad_var first = ad_slice_rows(v, 0, BEADS - 1), next = ad_slice_rows(v, 1, BEADS - 1);
    const ad_var apart = ad_sub(ad_slice_rows(q, 1, BEADS - 1), ad_slice_rows(q, 0, BEADS - 1));
    const ad_var coupled = ad_mul(ad_mul(0.3, ad_cos(apart)), ad_mul(first, next));
    const ad_var own = ad_mul(ad_add(1.0, ad_square(q)), ad_square(v));
    return ad_sub(ad_add(ad_mul(0.5, ad_sum_rows(own)), ad_sum_rows(coupled)),
                  ad_mul(0.5, ad_sum_rows(ad_square(apart))));
}

static enum ad_status begin_beads(const void *params, uint64_t seed, double *q, double *v,
                                  struct ad_error *e)
{
    (void)params, (void)seed, (void)e;
    for (size_t k = 0; k < BEADS; k++) {
        q[k] = 0.4 * sin(1.7 * (double)k);
        v[k] = 0.5 * cos(2.3 * (double)k);
    }
    return AD_OK;
}

/* Accelerations by the pattern of M, against those with all of it; and series against steps. */
static void test_masses_that_couple_neighbours(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("beads", BEADS, beads, 11, 0.1, begin_beads);
    struct phys_system system;
    struct ad_error error = {0};
    phys_motion *motion;
    double x[2 * BEADS], y[2 * BEADS], a[BEADS], all[BEADS];
    ad_tape *tape = ad_tape_new(AD_F64);
    const ad_var in[] = {ad_input(tape, BEADS, 1, "q"), ad_input(tape, BEADS, 1, "v"),
                         ad_input(tape, 1, 1, "t")};
    begin_beads(NULL, 0, x, x + BEADS, &error);
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_motion_new(&system, &motion, &error), AD_OK);
    assert_int_equal(phys_motion_acceleration(motion, x, x + BEADS, 0, a, &error), AD_OK);
    const double *const at[] = {x, x + BEADS, (double[]){0}};
    assert_int_equal(ad_evaluate(3, in, at, phys_record_accelerations(&system, in[0], in[1], in[2]),
                                 all, &error),
                     AD_OK);
    for (size_t k = 0; k < BEADS; k++)
        assert_close(a[k], all[k], 1e-12, 1e-12);
    phys_motion_free(motion);
    phys_system_close(&system);
    ad_tape_free(tape);
    memcpy(y, x, sizeof y);
    assert_int_equal(follow_own(&scene, taylor, 2, x), AD_OK);
    assert_int_equal(follow_own(&scene, "dop853", 2, y), AD_OK);
    for (size_t k = 0; k < 2 * BEADS; k++)
        assert_close(x[k], y[k], 1e-11, 1e-11);
}

static ad_var falling(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(9.81, q));
}
static ad_var stretching(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_mul(0.5, ad_mul(ad_square(v), ad_exp(ad_mul(-2.0, q))));
}
/* 1e15 metres away, GM = 1e30: what happens to numbers of order 1 in units of AU */
static ad_var far_away(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_add(ad_mul(0.5, ad_square(v)), ad_div(1e30, ad_add(q, 1e15)));
}

/* Coefficients that vanish beyond some order, a mass that varies by itself alone, and magnitudes
   that differ by 30 orders. */
static void test_coefficients_that_vanish_or_differ(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, falling, 11, 0.1, begin_own);
    double y[2], other[2];
    assert_int_equal(follow_own(&scene, taylor, 50, y), AD_OK);
    assert_close(y[0], 0.5 + 0.25 * 50 - 0.5 * 9.81 * 2500, 1e-15, 0);
    assert_close(y[1], 0.25 - 9.81 * 50, 1e-15, 0);
    scene = scene_of("own", 1, stretching, 11, 0.1,
                     begin_own); /* q'' = q'^2: q = q0 - log(1 - v0 t), singular at t = 4 */
    assert_int_equal(follow_own(&scene, taylor, 3.9, y), AD_OK);
    assert_close(y[0], 0.5 - log(1 - 0.25 * 3.9), 1e-12, 0);
    assert_int_not_equal(follow_own(&scene, taylor, 5, y), AD_OK);
    scene = scene_of("own", 1, far_away, 11, 0.1, begin_own);
    assert_int_equal(follow_own(&scene, taylor, 1e5, y), AD_OK);
    assert_int_equal(follow_own(&scene, "dop853", 1e5, other), AD_OK);
    assert_close(y[0], other[0], 1e-12, 0);
    assert_close(y[1], other[1], 1e-12, 0);
}

static ad_var bounce(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_abs(q));
}
/* A series knows one side of a kink alone. */
static void test_kinks_are_refused(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("own", 1, bounce, 11, 0.1, begin_own);
    double y[2];
    assert_int_equal(follow_own(&scene, taylor, 5, y), AD_E_ARGUMENT);
    assert_int_equal(follow_own(&scene, "dop853", 0.1, y), AD_OK);
}

/* |q| by other names, and what only looks like it. */
static ad_var q_squared(ad_var q) { return ad_mul(2.0, ad_square(q)); }
#define KINK(name, V)                                                                              \
    static ad_var name(ad_var q, ad_var v, ad_var t, const void *params)                           \
    {                                                                                              \
        (void)params, (void)t;                                                                     \
        return ad_sub(ad_mul(0.5, ad_square(v)), V);                                               \
    }
KINK(root, ad_sqrt(q_squared(q)))
KINK(product, ad_sqrt(ad_mul(q, q)))
KINK(factor, ad_sqrt(ad_mul(ad_square(q), ad_add(1.0, ad_square(q)))))
KINK(sum, ad_sqrt(ad_add(ad_square(q), ad_mul(3.0, ad_square(q)))))
KINK(power, ad_pow(q_squared(q), 0.5))
KINK(three_halves, ad_pow(q_squared(q), 1.5))
KINK(hypotenuse, ad_hypot(q, ad_mul(2.0, q)))
KINK(one_leg, ad_hypot(q, 0.0))
KINK(triangle, ad_asin(ad_sin(q)))
KINK(softened, ad_sqrt(ad_add(1.0, ad_square(q))))
KINK(powers, ad_pow(ad_add(1.0, q_squared(q)), 1.5))
KINK(of_two, ad_hypot(q, ad_add(1.0, q)))

static void test_kinks_by_other_names(void **state)
{
    (void)state;
    phys_lagrangian *const sharp[] = {root,         product,    factor,  sum,     power,
                                      three_halves, hypotenuse, one_leg, triangle};
    phys_lagrangian *const smooth[] = {softened, powers, of_two};
    double y[2];
    for (size_t k = 0; k < LENGTH(sharp); k++) {
        struct phys_scene scene = scene_of("own", 1, sharp[k], 11, 0.1, begin_own);
        enum ad_status status = follow_own(&scene, taylor, 1, y);
        if (status != AD_E_ARGUMENT)
            print_error("kink %zu is not seen\n", k);
        assert_int_equal(status, AD_E_ARGUMENT);
    }
    for (size_t k = 0; k < LENGTH(smooth); k++) {
        struct phys_scene scene = scene_of("own", 1, smooth[k], 11, 0.1, begin_own);
        assert_int_equal(follow_own(&scene, taylor, 1, y), AD_OK);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_time_in_the_lagrangian),
        cmocka_unit_test(test_masses_that_vary),
        cmocka_unit_test(test_masses_that_couple_neighbours),
        cmocka_unit_test(test_coefficients_that_vanish_or_differ),
        cmocka_unit_test(test_kinks_are_refused),
        cmocka_unit_test(test_kinks_by_other_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
