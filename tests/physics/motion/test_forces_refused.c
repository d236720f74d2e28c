/* Forces outside of L: what knows L alone refuses them, and callbacks of another shape are named.
 */
#include "tests/physics/systems.h"
#include "tests/mentions.h"

static ad_var spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(0.5, ad_sub(ad_square(v), ad_square(q)));
}

static ad_var push(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)v, (void)params;
    return ad_cos(t);
}

static enum ad_status at_one(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    v[0] = 0;
    return AD_OK;
}

static struct phys_scene pushed_scene(void)
{
    struct phys_scene s = scene_of("pushed", 1, spring, 100, 0.05, at_one);
    s.forces = push;
    return s;
}

static struct phys_system made(const struct phys_scene *scene)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_make(scene, &system, &error);
    assert_string_equal(error.message, "");
    return system;
}

static ad_var two_rows(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)params;
    return ad_concat_rows(2, (ad_var[]){q, t});
}

static enum ad_status own_ode(const struct phys_system *system, struct phys_ode *ode,
                              struct ad_error *error)
{
    (void)system, (void)ode;
    return error->status;
}

static void what_knows_only_L_says_so(void **state)
{
    (void)state;
    struct phys_scene scene = pushed_scene();
    struct phys_system system = made(&scene);
    struct phys_equilibria found;
    struct phys_action action;
    struct ad_error error = {0};
    assert_int_equal(phys_equilibria_find(&system, NULL, &found, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "not in L");
    phys_equilibria_free(&found);
    ad_tape *tape = ad_tape_new(AD_F64);
    assert_int_equal(
        phys_action_record(tape, &system, phys_rule_find("gauss2", &error), 10, 0.1, 0, &action),
        AD_E_ARGUMENT);
    ad_tape_free(tape);
    double path[10] = {0};
    const struct phys_path_settings how = {
        .size = sizeof how, .rule = phys_rule_find("gauss2", &error), .slices = 10, .dt = 0.1};
    struct phys_refined refined;
    struct phys_spectrum spectrum;
    error = (struct ad_error){0};
    assert_int_equal(phys_path_refine(&system, &how, path, 0, 1e-6, &refined, &error),
                     AD_E_ARGUMENT);
    error = (struct ad_error){0};
    assert_int_equal(phys_path_spectrum(&system, &how, path, &spectrum, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
}

static void wrong_forces_are_named(void **state)
{
    (void)state;
    struct phys_scene scene = pushed_scene();
    struct phys_ode ode;
    struct ad_error error = {0};
    scene.forces = two_rows;
    struct phys_system system = made(&scene);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_E_SHAPE);
    assert_mentions(error.message, "the force is 2 x 1, expected 1 x 1");
    phys_ode_free(&ode);
    phys_system_close(&system);
    scene.ode = own_ode;
    error = (struct ad_error){0};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_E_INPUT);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_knows_only_L_says_so),
        cmocka_unit_test(wrong_forces_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
