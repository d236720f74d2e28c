/* Families that cross others, at closed forms and at Henon and Heiles' pitchfork. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

struct well {
    double mu;
};

static const struct phys_param params[] = {{"mu", "1", "depth", -0.05, offsetof(struct well, mu)}};

/* x swings in x^2/2 + x^4/4, z may rest where z = 0 or z^2 = mu. */
static ad_var well(ad_var q, ad_var v, ad_var t, const void *p)
{
    const struct well *w = p;
    (void)t;
    ad_var x2 = ad_square(ad_row(q, 0)), z2 = ad_square(ad_row(q, 1));
    ad_var V =
        ad_add(ad_add(ad_mul(0.5, x2), ad_mul(0.25, ad_square(x2))),
               ad_sub(ad_mul(0.25, ad_square(z2)), ad_mul(ad_mul(0.5, PHYS_PARAM(w, mu)), z2)));
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), V);
}

static ad_var henon_heiles(ad_var q, ad_var v, ad_var t, const void *p)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), cubic = ad_mul(ad_square(x), y);
    (void)t, (void)p;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_sub(ad_square(v), ad_square(q)))),
                  ad_sub(cubic, ad_div(ad_mul(y, ad_square(y)), 3.0)));
}

/* y is a parametric oscillator beside x = A cos t: b_1(q) = 4 w^2 with q = A, w^2 = 0.2. */
static ad_var parametric(ad_var q, ad_var v, ad_var t, const void *p)
{
    ad_var x = ad_row(q, 0), y2 = ad_square(ad_row(q, 1));
    ad_var V =
        ad_add(ad_mul(0.5, ad_square(x)), ad_mul(0.5, ad_mul(ad_add(0.2, ad_mul(0.5, x)), y2)));
    (void)t, (void)p;
    return ad_sub(ad_mul(0.5, ad_sum_rows(ad_square(v))), V);
}

static enum ad_status rest(const void *p, uint64_t seed, double *q, double *v,
                           struct ad_error *error)
{
    (void)p, (void)seed, (void)error;
    memset(q, 0, 2 * sizeof *q);
    memset(v, 0, 2 * sizeof *v);
    return AD_OK;
}

static struct phys_family family_of(const struct phys_scene *scene, struct phys_family_settings how,
                                    enum phys_family_end end)
{
    struct phys_system system;
    struct phys_family family;
    struct ad_error error = {0};
    assert_int_equal(phys_system_make(scene, &system, &error), AD_OK);
    how.size = sizeof how;
    phys_family_follow(&system, &how, &family, &error);
    assert_string_equal(error.message, "");
    print_message("%s\n", family.lost);
    assert_int_equal(family.end, end);
    phys_system_close(&system);
    return family;
}

static void to_either_side_of_a_pitchfork(void **state)
{
    struct phys_scene scene = scene_of("well", 2, well, 100, 0.1, rest);
    const double x[] = {0.8, 0, 0, 0};
    double side[2];
    (void)state;
    scene.params = params;
    scene.n_params = 1;
    scene.params_bytes = sizeof(struct well);
    for (int k = 0; k < 2; k++) {
        const struct phys_family_settings how = {.x = x,
                                                 .period = 5.2,
                                                 .along = "mu",
                                                 .to = 0.3,
                                                 .hold = PHYS_HOLD_ENERGY,
                                                 .cross = k ? -1 : 1};
        struct phys_family f = family_of(&scene, how, PHYS_FAMILY_REACHED);
        size_t branch = 0;
        while (f.member[branch].mark != PHYS_MARK_BRANCH)
            branch++;
        assert_close(f.member[branch].value, 0, 0, f.member[branch].uncertainty);
        for (size_t i = 0; i < f.n; i++) {
            const struct phys_family_member *m = &f.member[i];
            assert_close(m->energy, 0.5 * 0.8 * 0.8 + 0.25 * pow(0.8, 4), 1e-9, 0);
            assert_close(pow(m->motion.x[1], 2), i > branch ? m->value : 0, 1e-8, 1e-9);
        }
        assert_close(f.member[f.n - 1].value, 0.3, 1e-12, 0);
        side[k] = f.member[f.n - 1].motion.x[1];
        phys_family_free(&f);
    }
    assert_true(side[0] * side[1] < 0);
}

/* Beyond it the orbit of the axis of y is left: known by its closure and energy, and by its mirror
   image. */
static void henon_heiles_orbit_beside_the_axis(void **state)
{
    const struct phys_scene scene = scene_of("heiles", 2, henon_heiles, 100, 0.1, rest);
    const double x[] = {0, 0.88, 0, 0};
    struct phys_family f[2];
    (void)state;
    for (int k = 0; k < 2; k++) {
        const struct phys_family_settings how = {
            .x = x, .period = 9.4, .along = "energy", .to = 0.166, .cross = k ? -1 : 1};
        f[k] = family_of(&scene, how, PHYS_FAMILY_REACHED);
    }
    const struct phys_family_member *a = &f[0].member[f[0].n - 1], *b = &f[1].member[f[1].n - 1];
    assert_close(a->energy, 0.166, 1e-12, 0);
    assert_true(a->motion.closure < 1e-9 && fabs(a->motion.x[0]) + fabs(a->motion.x[2]) > 0.05);
    assert_close(a->motion.period, b->motion.period, 1e-9, 0);
    phys_family_free(&f[0]);
    phys_family_free(&f[1]);
}

/* Halo orbits of Earth and Moon at L1: SciPy's DOP853 at 1e-13, by shooting from y = 0. */
static void halo_orbits(void **state)
{
    static const double x[] = {0.84230, 0.05278, 0, 0.03453, -0.00248, 0};
    struct phys_system system = system_opened("cr3bp");
    const struct phys_family_settings how = {
        .size = sizeof how, .x = x, .period = 2.737, .along = "energy", .to = -1.57, .cross = 1};
    struct phys_family f;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_family_follow(&system, &how, &f, &error), AD_OK);
    assert_int_equal(f.end, PHYS_FAMILY_REACHED);
    assert_close(f.member[f.n - 1].motion.period, 2.7681708180964617, 1e-13, 0);
    assert_true(hypot(f.member[f.n - 1].motion.x[2], f.member[f.n - 1].motion.x[5]) > 0.01);
    phys_family_free(&f);
    phys_system_close(&system);
}

/* Where a multiplier passes -1, by scipy.special.mathieu_b; motions that close after two turns, by
   SciPy's DOP853 at 1e-13 and fsolve from rest to rest in half a period. */
static void to_motions_of_twice_the_period(void **state)
{
    const struct phys_scene scene = scene_of("parametric", 2, parametric, 100, 0.1, rest);
    const double x[] = {0.1, 0, 0, 0}, E = 0.024803902850285477;
    (void)state;
    for (int cross = -1; cross <= 1; cross += 2) {
        struct phys_family f =
            family_of(&scene,
                      (struct phys_family_settings){
                          .x = x, .period = 6.2832, .along = "energy", .to = E, .cross = cross},
                      PHYS_FAMILY_REACHED);
        const struct phys_family_member *last = &f.member[f.n - 1];
        size_t k = 0;
        while (k < f.n && f.member[k].mark != PHYS_MARK_DOUBLING)
            k++;
        assert_true(k + 1 < f.n);
        assert_close(f.member[k].energy, 0.019079925269450366, 1e-9, 0);
        assert_close(f.member[k].motion.period, 2 * M_PI, 1e-9, 0);
        assert_close(last->motion.period, 12.493367452660786, 1e-11, 0);
        assert_close(last->energy, E, 1e-12, 0);
        phys_family_free(&f);
    }
}

/* Along the period there is no such step. */
static void a_doubling_along_the_period(void **state)
{
    static const double x[] = {0.84230, 0.05278, 0, 0.03453, -0.00248, 0};
    const struct phys_family_settings how = {
        .size = sizeof how, .x = x, .period = 2.737, .along = "period", .to = 5.8, .cross = 3};
    struct phys_system system = system_opened("cr3bp");
    struct phys_family f;
    struct ad_error error = {0};
    (void)state;
    assert_int_equal(phys_family_follow(&system, &how, &f, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "doubling");
    phys_family_free(&f);
    phys_system_close(&system);
}

static void a_branch_point_that_is_not_met(void **state)
{
    const struct phys_scene scene = scene_of("heiles", 2, henon_heiles, 100, 0.1, rest);
    const double x[] = {0, 0.88, 0, 0};
    const struct phys_family_settings how = {
        .x = x, .period = 9.4, .along = "energy", .to = 0.163, .cross = 2};
    (void)state;
    struct phys_family f = family_of(&scene, how, PHYS_FAMILY_LOST);
    assert_mentions(f.lost, "2 branch");
    phys_family_free(&f);
    struct phys_system system;
    struct phys_family_settings many = how;
    struct ad_error error = {0};
    many.size = sizeof many;
    many.cross = PHYS_BRANCHES_MOST + 1;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    assert_int_equal(phys_family_follow(&system, &many, &f, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "cross 1001");
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(to_either_side_of_a_pitchfork),
        cmocka_unit_test(henon_heiles_orbit_beside_the_axis),
        cmocka_unit_test(halo_orbits),
        cmocka_unit_test(to_motions_of_twice_the_period),
        cmocka_unit_test(a_doubling_along_the_period),
        cmocka_unit_test(a_branch_point_that_is_not_met),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
