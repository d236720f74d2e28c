/* Machine code against the interpreter on the action of every scene and its gradient. */
#include "physics/physics.h"
#include "tests/native.h"

#include <math.h>
#include <stdlib.h>

enum { SLICES = 37 }; /* no multiple of any vector */

/* The start, drifting, and irregular enough that every slice counts. */
static void draw_path(const struct phys_system *s, double dt, double *path)
{
    double *q = malloc(2 * s->dof * sizeof *q), *v = q + s->dof;
    struct ad_error error = {0};
    assert_non_null(q);
    assert_int_equal(s->scene->start(s->params, 1, q, v, &error), AD_OK);
    for (size_t k = 0; k < s->dof; k++)
        for (size_t i = 0; i < SLICES; i++)
            path[k * SLICES + i] =
                q[k] + dt * (double)i * v[k] +
                0.01 * (fabs(q[k]) + dt * fabs(v[k])) * sin(0.7 * (double)i + 1.3 * (double)k);
    free(q);
}

static void compare(const char *name, enum ad_type type, const char *rule, double tolerance)
{
    struct phys_system system;
    struct phys_action action;
    struct ad_error error = {0};
    ad_program *interpreted, *compiled;
    ad_var g;
    assert_int_equal(phys_system_open(name, &system, &error), AD_OK);
    double dt = system.scene->dt, *path = malloc(system.dof * SLICES * sizeof *path);
    assert_non_null(path);
    draw_path(&system, dt, path);
    ad_tape *tape = ad_tape_new(type);
    phys_action_record(tape, &system, phys_rule_find(rule, &error), SLICES, dt, 0, &action);
    assert_int_equal(ad_grad(action.objective, 1, &action.path, &g), AD_OK);
    ad_var out[] = {action.objective, g};
    assert_int_equal(ad_compile(tape, 2, out, &interpreted), AD_OK);
    assert_int_equal(ad_compile(tape, 2, out, &compiled), AD_OK);
    native_make(compiled);
    ad_set(interpreted, action.path, path);
    ad_set(compiled, action.path, path);
    ad_run(interpreted);
    ad_run(compiled);
    assert_same_values(interpreted, compiled, out[0], tolerance, name);
    assert_same_values(interpreted, compiled, out[1], tolerance, name);
    ad_program_free(interpreted);
    ad_program_free(compiled);
    ad_tape_free(tape);
    free(path);
    phys_system_close(&system);
}

static void test_every_scene(void **state)
{
    (void)state;
    native_need_compiler();
    for (size_t k = 0; phys_scenes[k]; k++) {
        compare(phys_scenes[k]->name, AD_F64, "left+repeat", 1e-13);
        if (k % 3 == 0)
            compare(phys_scenes[k]->name, AD_F32, "midpoint", 1e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_scene)};
    return cmocka_run_group_tests(tests, native_share_cache, native_remove_cache);
}
