/* Every Lagrangian against differences, slice locality and known energies. */
#include "systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdlib.h>
#include <string.h>

static void lagrangians_pass_the_checks(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system = system_opened(phys_scenes[s]->name);
        if (strcmp(system.scene->name, "gas") == 0)
            system_set(&system, "bodies", 6); /* the same law, sooner checked */
        system_check(&system);
        phys_system_close(&system);
    }
}

static void kepler_has_its_known_energy_and_momentum(void **state)
{
    (void)state;
    struct phys_system system = system_opened("kepler");
    double q[2], v[2], T, V;
    system_start(&system, 0, q, v);
    system_energies(&system, q, v, &T, &V);
    assert_close(T + V, -0.5, 1e-15, 0);
    assert_close(q[0] * v[1] - q[1] * v[0], 0.8, 1e-15, 0);
    phys_system_close(&system);
}

static void double_pendulum_has_the_energy_of_its_bobs(void **state)
{
    (void)state;
    struct phys_system system = system_opened("dblpend");
    system_set(&system, "m1", 1.3);
    system_set(&system, "m2", 0.7);
    system_set(&system, "l1", 0.9);
    system_set(&system, "l2", 1.2);
    system_set(&system, "g", 9.81);
    const double q[] = {0.83, -1.27}, v[] = {1.9, -0.6};
    /* positions and velocities of the bobs in the plane */
    double y1 = -0.9 * cos(q[0]), y2 = y1 - 1.2 * cos(q[1]);
    double vx1 = 0.9 * cos(q[0]) * v[0], vy1 = 0.9 * sin(q[0]) * v[0];
    double vx2 = vx1 + 1.2 * cos(q[1]) * v[1], vy2 = vy1 + 1.2 * sin(q[1]) * v[1];
    double T, V;
    system_energies(&system, q, v, &T, &V);
    assert_close(T, 0.65 * (vx1 * vx1 + vy1 * vy1) + 0.35 * (vx2 * vx2 + vy2 * vy2), 1e-14, 0);
    assert_close(V, 9.81 * (1.3 * y1 + 0.7 * y2), 1e-14, 0);
    phys_system_close(&system);
}

static void energies_of_an_unsplit_lagrangian_follow_from_legendre(void **state)
{
    (void)state;
    struct phys_system split = system_opened("dblpend"), whole = split;
    struct phys_scene scene = *split.scene;
    struct phys_system reference = split;
    scene.kinetic =
        NULL; /* of a potential alone, -V is L: E = V, taken apart as (E-V)/2, (E+V)/2 */
    scene.lagrangian = scene.potential;
    scene.potential = NULL;
    whole.scene = &scene;
    const double q[] = {0.4, 1.1}, v[] = {0.3, -0.8};
    double T, V, T0, V0;
    system_energies(&reference, q, v, &T0, &V0);
    system_energies(&whole, q, v, &T, &V);
    assert_close(T, 0, 0, 1e-15);
    assert_close(V, -V0, 1e-14, 0);
    scene.lagrangian = split.scene->kinetic; /* of a kinetic energy alone: T whole, V none */
    system_energies(&whole, q, v, &T, &V);
    assert_close(T, T0, 1e-14, 0);
    assert_close(V, 0, 0, 1e-15);
    phys_system_close(&split);
}

/* L = -sqrt(1 - v^2): Newton's method from rest leaves the speeds below that of light. */
static ad_var relativistic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_neg(ad_sqrt(ad_sub(1.0, ad_square(v))));
}

static void velocities_stay_where_L_is_defined(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct phys_system system = system_opened("freebody");
    struct phys_scene scene = *system.scene;
    scene.lagrangian = relativistic;
    scene.kinetic = scene.potential = NULL;
    system.scene = &scene;
    phys_legendre *legendre;
    assert_int_equal(phys_legendre_new(&system, &legendre, &error), AD_OK);
    for (double p = -1e3; p < 1e3; p = p < -1e-3 ? p / 3 : p < 0 ? -p : 3 * p) {
        double q = 0, v;
        assert_int_equal(phys_legendre_velocity(legendre, &q, &p, 0, &v, &error), AD_OK);
        assert_close(v, p / sqrt(1 + p * p), 1e-12, 0);
    }
    phys_legendre_free(legendre);
    phys_system_close(&system);
}

static ad_var two_rows(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)t, (void)params;
    return ad_concat_rows(2, (ad_var[]){q, q});
}

static void a_lagrangian_of_the_wrong_shape_is_refused(void **state)
{
    (void)state;
    struct phys_system system = system_opened("freebody");
    struct phys_scene scene = *system.scene;
    scene.lagrangian = two_rows;
    system.scene = &scene;
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var q = ad_input(tape, 1, 4, "q");
    phys_system_lagrangian(&system, q, q, q);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_SHAPE);
    assert_mentions(ad_tape_error(tape)->message, "2 x 4 1");
    ad_tape_free(tape);
    phys_system_close(&system);
}

static void pairs_are_in_lexicographic_order(void **state)
{
    (void)state;
    ad_tape *tape = ad_tape_new(AD_F64);
    const double q[] = {1, 10, 2, 40, 5, 90}; /* three bodies in the plane, one slice */
    ad_var x = ad_input(tape, 6, 1, "q"), d[2];
    phys_pair_differences(x, 3, 2, d);
    ad_var out[] = {d[0], d[1], phys_pair_squares(x, 3, 2, 0.5)};
    ad_program *program;
    assert_int_equal(ad_compile(tape, 3, out, &program), AD_OK);
    ad_set(program, x, q);
    ad_run(program);
    const double expected[3][3] = {{-1, -4, -3}, {-30, -80, -50}, {901.5, 6416.5, 2509.5}};
    for (size_t k = 0; k < 3; k++) {
        double y[3];
        ad_get(program, out[k], y);
        for (size_t p = 0; p < 3; p++)
            assert_true(y[p] == expected[k][p]);
    }
    ad_program_free(program);
    phys_pair_differences(x, 1, 2, d);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lagrangians_pass_the_checks),
        cmocka_unit_test(kepler_has_its_known_energy_and_momentum),
        cmocka_unit_test(double_pendulum_has_the_energy_of_its_bobs),
        cmocka_unit_test(energies_of_an_unsplit_lagrangian_follow_from_legendre),
        cmocka_unit_test(velocities_stay_where_L_is_defined),
        cmocka_unit_test(a_lagrangian_of_the_wrong_shape_is_refused),
        cmocka_unit_test(pairs_are_in_lexicographic_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
