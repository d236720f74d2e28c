/* Parameters as variables of the tape: PHYS_PARAM in a scene's callbacks. */
#include "systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 3, MOST = 80 };

/* Places about a scene's start. */
struct place {
    double q[MOST * COLUMNS], v[MOST * COLUMNS], t[COLUMNS];
};

static struct place place_of(const struct phys_system *system)
{
    struct place at = {.t = {0.1, 0.45, 0.83}};
    double q[MOST], v[MOST];
    assert_true(system->dof <= MOST);
    system_start(system, 1, q, v);
    for (size_t k = 0; k < system->dof; k++)
        for (size_t c = 0; c < COLUMNS; c++) {
            at.q[k * COLUMNS + c] = q[k] * (1 + 0.01 * sin((double)(c + 2 * k)));
            at.v[k * COLUMNS + c] = v[k] * (1 + 0.1 * cos((double)(3 * c + k)));
        }
    return at;
}

/* The sum of L over columns; by parameter `name` as a variable of value p, unless NULL, and then
   its slope. */
static double value_of(const struct phys_system *system, const struct place *at, const char *name,
                       double p, double *slope, struct ad_error *error)
{
    double value = NAN;
    ad_tape *tape = ad_tape_new(AD_F64);
    const ad_var x[] = {ad_input(tape, system->dof, COLUMNS, "q"),
                        ad_input(tape, system->dof, COLUMNS, "v"), ad_input(tape, 1, COLUMNS, "t"),
                        ad_input(tape, 1, 1, "parameter")};
    const ad_var L =
        ad_sum(name ? phys_system_lagrangian_of(system, x[0], x[1], x[2], 1, &name, &x[3])
                    : phys_system_lagrangian(system, x[0], x[1], x[2]));
    if (ad_tape_error(tape)->status != AD_OK)
        *error = *ad_tape_error(tape);
    else
        assert_int_equal(ad_gradient(4, x, (const double *[]){at->q, at->v, at->t, &p}, L, &value,
                                     (double *[]){NULL, NULL, NULL, slope}, error),
                         AD_OK);
    ad_tape_free(tape);
    return value;
}

/* Parameters of built-in scenes that are no variables: they choose what L is. */
static bool chooses(const char *scene, const char *name)
{
    static const char *const those[] = {"gas bodies",
                                        "gas friction",
                                        "gas walls",
                                        "gas cutoff",
                                        "gas clamp",
                                        "gas cap_radius",
                                        "gas random_start",
                                        "ephemeris dims",
                                        "ephemeris relativity",
                                        "ephemeris mass_",
                                        "threebody cap_radius",
                                        "brachistochrone x0",
                                        "sine-gordon sites",
                                        "sine-gordon frequency",
                                        "sine-gordon ring"};
    char both[80];
    snprintf(both, sizeof both, "%s %s", scene, name);
    for (size_t k = 0; k < LENGTH(those); k++)
        if (strncmp(both, those[k], strlen(those[k])) == 0)
            return true;
    return false;
}

/* The derivative is that by differences of constants. */
static void check_parameter(struct phys_system *system, const struct place *at, const char *name)
{
    struct ad_error error = {0};
    const double p = phys_system_get(system, name), h = 1e-4 * (p == 0 ? 1 : fabs(p));
    double slope = NAN, unused, up, down;
    const double value = value_of(system, at, name, p, &slope, &error);
    assert_string_equal(error.message, "");
    assert_close(value_of(system, at, NULL, 0, &unused, &error), value, 1e-14, 0);
    system_set(system, name, p + h);
    up = value_of(system, at, NULL, 0, &unused, &error);
    system_set(system, name, p - h);
    down = value_of(system, at, NULL, 0, &unused, &error);
    system_set(system, name, p);
    assert_close(slope, (up - down) / (2 * h), 3e-6, 1e-10 * fabs(value) / h);
}

static void built_in_scenes_have_derivatives_by_their_parameters(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system = system_opened(phys_scenes[s]->name);
        if (strcmp(system.scene->name, "gas") == 0)
            system_set(&system, "bodies", 6);
        const struct place at = place_of(&system);
        for (size_t k = 0; k < system.scene->n_params; k++) {
            struct ad_error error = {0};
            const char *name = system.scene->params[k].name;
            const enum phys_param_use use = phys_param_use(&system, name, &error);
            assert_string_equal(error.message, "");
            if (chooses(system.scene->name, name))
                continue;
            if (use != PHYS_PARAM_VARIABLE)
                print_error("%s %s\n", system.scene->name, name);
            assert_int_equal(use, PHYS_PARAM_VARIABLE);
            check_parameter(&system, &at, name);
        }
        phys_system_close(&system);
    }
}

/* Switched on, they are variables, too. */
static void terms_that_are_on_have_derivatives(void **state)
{
    static const struct {
        const char *scene, *name;
        double value;
    } on[] = {{"gas", "friction", 0.3},
              {"gas", "cutoff", 2.6},
              {"gas", "walls", 7},
              {"gas", "clamp", 3e-5},
              {"gas", "cap_radius", 0.2},
              {"threebody", "cap_radius", 0.5},
              {"ephemeris", "mass_venus", 5e24}};
    (void)state;
    for (size_t k = 0; k < LENGTH(on); k++) {
        struct phys_system system = system_opened(on[k].scene);
        if (strcmp(on[k].scene, "gas") == 0)
            system_set(&system, "bodies", 6);
        system_set(&system, on[k].name, on[k].value);
        const struct place at = place_of(&system);
        check_parameter(&system, &at, on[k].name);
        phys_system_close(&system);
    }
    struct phys_system system = system_opened("ephemeris");
    system_set(&system, "relativity", 1);
    const struct place at = place_of(&system);
    check_parameter(&system, &at, "G");
    phys_system_close(&system);
}

/* ---- a user's scene ---- */

struct mine {
    double good, plain, mixed, branch, copied, unused, list[2], whole;
};

static ad_var mine(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct mine *p = params;
    struct mine copy = *p;
    (void)t;
    ad_var T = ad_mul(ad_mul(PHYS_PARAM(p, good), PHYS_PARAM(p, list[1])), ad_square(v));
    ad_var V = ad_mul(ad_mul(p->plain + p->mixed, PHYS_PARAM(p, mixed)), ad_square(q));
    if (p->branch > 0)
        V = ad_add(V, ad_mul(PHYS_PARAM(p, branch), q));
    if (p->copied != 3)
        V = ad_add(V, ad_mul(PHYS_PARAM(&copy, copied), ad_cos(q)));
    return ad_sub(T, V);
}

static size_t mine_dof(const void *params)
{
    const struct mine *p = params;
    return p->whole == floor(p->whole);
}

#define MINE(name, value)                                                                          \
    {                                                                                              \
#name, "1", "a number", value, offsetof(struct mine, name)                                 \
    }
static const struct phys_param mine_params[] = {
    MINE(good, 1.5), MINE(plain, 0.7), MINE(mixed, 2),   MINE(branch, 0),
    MINE(copied, 3), MINE(unused, 1),  MINE(list[1], 4), MINE(whole, 2),
};

static struct phys_scene mine_scene(void)
{
    struct phys_scene scene = scene_of("mine", 0, mine, 11, 0.1, NULL);
    scene.dof_of = mine_dof;
    scene.dims = 1;
    scene.params = mine_params;
    scene.n_params = LENGTH(mine_params);
    scene.params_bytes = sizeof(struct mine);
    return scene;
}

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.8;
    v[0] = 0.3;
    return AD_OK;
}

static void plain_numbers_are_found(void **state)
{
    static const struct {
        const char *name;
        enum phys_param_use use;
    } uses[] = {{"good", PHYS_PARAM_VARIABLE},    {"plain", PHYS_PARAM_PLAIN},
                {"mixed", PHYS_PARAM_MIXED},      {"branch", PHYS_PARAM_PLAIN},
                {"list[1]", PHYS_PARAM_VARIABLE}, {"unused", PHYS_PARAM_VARIABLE},
                {"whole", PHYS_PARAM_FIXED}};
    (void)state;
    struct phys_scene scene = mine_scene();
    struct phys_system system;
    struct ad_error error = {0};
    scene.start = start;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    const struct place at = place_of(&system);
    for (size_t k = 0; k < LENGTH(uses); k++) {
        struct ad_error refused = {0};
        double slope;
        assert_int_equal(phys_param_use(&system, uses[k].name, &error), uses[k].use);
        value_of(&system, &at, uses[k].name, phys_system_get(&system, uses[k].name), &slope,
                 &refused);
        assert_int_equal(refused.status,
                         uses[k].use == PHYS_PARAM_VARIABLE ? AD_OK : AD_E_ARGUMENT);
        if (refused.status != AD_OK)
            assert_mentions(refused.message, uses[k].name);
    }
    check_parameter(&system, &at, "good");
    check_parameter(&system, &at, "list[1]");
    phys_param_use(&system, "nobody", &error);
    assert_int_equal(error.status, AD_E_ARGUMENT);
    phys_system_close(&system);
}

/* Where a parameter is a variable, a copy of the parameters would be a constant. */
static void copies_of_the_parameters_are_refused(void **state)
{
    (void)state;
    struct phys_scene scene = mine_scene();
    struct phys_system system;
    struct ad_error error = {0}, refused = {0};
    double slope;
    scene.start = start;
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_OK);
    system_set(&system, "copied", 1);
    const struct place at = place_of(&system);
    value_of(&system, &at, NULL, 0, &slope, &error);
    assert_int_equal(error.status, AD_OK);
    value_of(&system, &at, "copied", 1, &slope, &refused);
    assert_int_equal(refused.status, AD_E_ARGUMENT);
    assert_mentions(refused.message, "copy");
    phys_system_close(&system);
}

/* A row of values: columns with parameters of their own. */
static void parameters_may_differ_between_columns(void **state)
{
    static const char *const names[] = {"m1", "G"};
    static const double m1[COLUMNS] = {1, 1.5, 0.2}, G[COLUMNS] = {2e-4, 1e-3, 0.4};
    double L[COLUMNS];
    (void)state;
    struct phys_system system = system_opened("threebody");
    const struct place at = place_of(&system);
    struct ad_error error = {0};
    ad_tape *tape = ad_tape_new(AD_F64);
    const ad_var x[] = {ad_input(tape, 6, COLUMNS, "q"), ad_input(tape, 6, COLUMNS, "v"),
                        ad_input(tape, 1, COLUMNS, "t"), ad_input(tape, 1, COLUMNS, "m1"),
                        ad_input(tape, 1, COLUMNS, "G")};
    const ad_var y = phys_system_lagrangian_of(&system, x[0], x[1], x[2], 2, names, x + 3);
    assert_int_equal(ad_evaluate(5, x, (const double *[]){at.q, at.v, at.t, m1, G}, y, L, &error),
                     AD_OK);
    for (size_t c = 0; c < COLUMNS; c++) {
        double q[6], v[6], T, V;
        for (size_t k = 0; k < 6; k++) {
            q[k] = at.q[k * COLUMNS + c];
            v[k] = at.v[k * COLUMNS + c];
        }
        system_set(&system, "m1", m1[c]);
        system_set(&system, "G", G[c]);
        system_energies(&system, q, v, &T, &V);
        assert_close(L[c], T - V, 1e-13, 0);
    }
    ad_tape_free(tape);
    phys_system_close(&system);
}

/* Outside of a recording there is no tape. */
static void nothing_is_recorded_outside(void **state)
{
    (void)state;
    const struct mine values = {.good = 2};
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, 1, 1, "x"), none = PHYS_PARAM(&values, good);
    assert_null(none.tape);
    ad_mul(none, x);
    assert_int_equal(ad_tape_error(tape)->status, AD_E_TAPE);
    ad_mul(0.5, none);
    ad_tape_free(tape);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(built_in_scenes_have_derivatives_by_their_parameters),
        cmocka_unit_test(terms_that_are_on_have_derivatives),
        cmocka_unit_test(plain_numbers_are_found),
        cmocka_unit_test(copies_of_the_parameters_are_refused),
        cmocka_unit_test(parameters_may_differ_between_columns),
        cmocka_unit_test(nothing_is_recorded_outside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
