/* Constraints that depend on each other or contradict each other, starts that do not satisfy them,
   and what knows nothing of them. */
#include "constrained.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>

static ad_var circle(ad_var q, double square) { return ad_sub(ad_sum_rows(ad_square(q)), square); }

static ad_var rod(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return circle(q, 1);
}

/* A rod twice, and a third constraint that is independent of them; then two rods of two lengths;
   two walls that meet the body and part; one whose gradient is 0 there. */
static ad_var twice(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_concat_rows(
        3, (ad_var[]){circle(q, 1), ad_sub(ad_row(q, 2), 0.5), ad_mul(3.0, circle(q, 1))});
}

static ad_var lengths(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_concat_rows(2, (ad_var[]){circle(q, 1), circle(q, 1.5)});
}

static ad_var walls(ad_var q, ad_var t, const void *params)
{
    (void)params;
    return ad_concat_rows(
        2, (ad_var[]){ad_sub(ad_row(q, 2), 0.5), ad_sub(ad_row(q, 2), ad_add(t, 0.5))});
}

static ad_var flat(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_square(ad_sub(ad_row(q, 2), 0.5));
}

static ad_var without_end(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_add(ad_exp(ad_row(q, 0)), 1.0);
}

static ad_var two_of_one(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_concat_rows(2, (ad_var[]){ad_row(q, 0), ad_row(q, 1)});
}

/* Two bars of length 1 from (0, 0) to (u, 0): folded and stretched their gradients are parallel. */
static ad_var slider(ad_var q, ad_var t, const void *params)
{
    ad_var x = ad_row(q, 0), y = ad_row(q, 1), u = ad_row(q, 2);
    (void)t, (void)params;
    return ad_concat_rows(3, (ad_var[]){ad_sub(ad_add(ad_square(x), ad_square(y)), 1.0),
                                        ad_sub(ad_add(ad_square(ad_sub(u, x)), ad_square(y)), 1.0),
                                        ad_sub(u, ad_add(1.2, t))});
}

static enum ad_status start_slider(const void *params, uint64_t seed, double *q, double *v,
                                   struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.6;
    q[1] = 0.8;
    q[2] = 1.2;
    v[0] = 0.5;
    v[1] = -0.375;
    v[2] = 1;
    return AD_OK;
}

/* The axes: where they cross there is no gradient, and no state of a motion is there. */
static ad_var axes(ad_var q, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_mul(ad_row(q, 0), ad_row(q, 1));
}

static double shift, speed;

static enum ad_status start(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = sqrt(0.75) + shift;
    q[1] = 0;
    q[2] = 0.5;
    v[0] = speed;
    v[1] = 0.3;
    v[2] = 0;
    return AD_OK;
}

static const char *const names[] = {"first", "second", "third"};

static struct phys_scene scene_with(phys_constraint *g, size_t n)
{
    return constrained_scene("bound", 3, constrained_coasts, start, g, n, names);
}

static void dependent_constraints_are_named(void **state)
{
    static const struct {
        phys_constraint *g;
        size_t n;
        const char *says, *not ;
    } cases[] = {{twice, 3, "first, third redundant", "second"},
                 {lengths, 2, "first, second inconsistent", "redundant"},
                 {walls, 2, "first, second inconsistent", "redundant"},
                 {flat, 1, "first gradient", "second"}};
    struct ad_error error;
    (void)state;
    for (size_t k = 0; k < LENGTH(cases); k++) {
        const struct phys_scene scene = scene_with(cases[k].g, cases[k].n);
        assert_int_equal(constrained_refused(&scene, NULL, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, cases[k].says);
        assert_null(strstr(error.message, cases[k].not ));
        assert_int_equal(constrained_refused(&scene, "rattle", &error), AD_E_ARGUMENT);
    }
    struct phys_scene scene =
        constrained_scene("slider", 3, constrained_coasts, start_slider, slider, 3, names);
    assert_int_not_equal(constrained_refused(&scene, NULL, &error), AD_OK); /* t = 0.8 */
    assert_mentions(error.message, "0.79*");
    assert_int_not_equal(constrained_refused(&scene, "rattle", &error), AD_OK);
}

static void starts_beside_constraints_say_what_would_do(void **state)
{
    struct ad_error error;
    struct phys_scene scene = scene_with(rod, 1);
    (void)state;
    shift = 0.1;
    assert_int_equal(constrained_refused(&scene, NULL, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "first g 0.183 x1 = 0.888* z1 = 0.459*");
    shift = 1e-8;
    assert_int_equal(constrained_refused(&scene, NULL, &error), AD_E_ARGUMENT);
    shift = 0;
    speed = 0.2;
    assert_int_equal(constrained_refused(&scene, "rk4", &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "first dg/dt v_x1 = 0.05* v_y1 = 0.3");
    double q[3], v[3], path[30];
    struct phys_system system = constrained_system(&scene);
    start(NULL, 1, q, v, NULL);
    error = (struct ad_error){0};
    assert_int_equal(phys_motion_path(&system, NULL, q, v, 10, 0.1, path, &error), AD_E_ARGUMENT);
    phys_system_close(&system);
    speed = 0;
    assert_int_equal(constrained_refused(&scene, NULL, &error), AD_OK);
    scene.constraint = without_end;
    assert_int_equal(constrained_refused(&scene, NULL, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "first no start");
}

static void what_knows_no_constraints_says_so(void **state)
{
    const struct phys_scene scene = scene_with(rod, 1);
    static const char *const methods[] = {"taylor", "verlet", "variational-gauss2"};
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 1};
    struct phys_lyapunov chaos;
    struct phys_equilibria found;
    struct phys_normal_modes modes;
    struct phys_action action;
    struct phys_ode ode;
    struct ad_error error;
    double x[6], matrix[72], t = 0;
    (void)state;
    for (size_t k = 0; k < LENGTH(methods); k++) {
        assert_int_equal(constrained_refused(&scene, methods[k], &error), AD_E_ARGUMENT);
        assert_mentions(error.message, "bound");
    }
    struct phys_system system = constrained_system(&scene);
    start(NULL, 1, x, x + 3, NULL);
#define REFUSED(call)                                                                              \
    do {                                                                                           \
        error = (struct ad_error){0};                                                              \
        assert_int_equal((call), AD_E_ARGUMENT);                                                   \
        assert_mentions(error.message, "bound constraints");                                       \
    } while (0)
    REFUSED(phys_transition(&system, x, &how, matrix, matrix + 36, &error));
    REFUSED(phys_sensitivity(&system, NULL, 1, &how, 0, names, matrix, matrix + 36, &error));
    REFUSED(phys_lyapunov_spectrum(&system, x, &how, 1, matrix, matrix + 1, &error));
    REFUSED(phys_normal_modes(&system, 1, x, &t, &modes, &error));
    REFUSED(phys_equilibria_find(&system, NULL, &found, &error));
    REFUSED(phys_ode_variations(&system, 1, &ode, &error));
    phys_ode_free(&ode);
    REFUSED(phys_ode_canonical(&system, &ode, &error));
    phys_ode_free(&ode);
    REFUSED(phys_ode_lagrangian(&system, &ode, &error) == AD_OK
                ? phys_lyapunov(&ode, x, &how, &chaos, &error)
                : AD_OK);
    phys_ode_free(&ode);
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var q = ad_input(tape, 3, 1, "q"), v = ad_input(tape, 3, 1, "v");
    phys_record_accelerations(&system, q, v, ad_scalar(tape, 0));
    assert_int_equal(ad_tape_error(tape)->status, AD_E_ARGUMENT);
    ad_tape_free(tape);
    tape = ad_tape_new(AD_F64);
    assert_int_equal(
        phys_action_record(tape, &system, phys_rule_find("gauss2", &error), 10, 0.1, 0, &action),
        AD_E_ARGUMENT);
    ad_tape_free(tape);
    phys_system_close(&system);
}

static void wrong_constraints_are_named(void **state)
{
    struct phys_scene scene = scene_with(two_of_one, 1);
    struct phys_system system;
    struct ad_error error;
    (void)state;
    assert_int_equal(constrained_refused(&scene, NULL, &error), AD_E_SHAPE);
    assert_mentions(error.message, "constraint 2 x 1");
    scene.constraints = NULL;
    error = (struct ad_error){0};
    assert_int_equal(phys_system_make(&scene, &system, &error), AD_E_INPUT);
    phys_system_close(&system);
}

static enum ad_status on_an_axis(const void *params, uint64_t seed, double *q, double *v,
                                 struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.603;
    q[1] = q[2] = v[1] = v[2] = 0;
    v[0] = -1;
    return AD_OK;
}

static enum ad_status spins(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    q[1] = q[2] = v[0] = v[2] = 0;
    v[1] = 20;
    return AD_OK;
}

/* Steps of 2 rad about a centre turn the gradient by more than a right angle, and lose nothing. */
static void steps_over_singular_places_are_refused(void **state)
{
    static const char *const methods[] = {NULL, "rk4", "rattle"};
    struct phys_scene scene =
        constrained_scene("axes", 3, constrained_coasts, on_an_axis, axes, 1, names);
    struct ad_error error;
    (void)state;
    for (size_t k = 0; k < LENGTH(methods); k++) {
        assert_int_not_equal(constrained_refused(&scene, methods[k], &error), AD_OK);
        assert_mentions(error.message, "axes independent first");
    }
    const struct phys_scene wheel =
        constrained_scene("wheel", 3, constrained_coasts, spins, rod, 1, names);
    struct phys_system system = constrained_system(&wheel);
    error = (struct ad_error){0};
    const struct phys_motion_settings how = {.size = sizeof how,
                                             .time = 2,
                                             .dt = 0.1,
                                             .every = 1,
                                             .integrator = phys_integrator_find("rk4", &error),
                                             .no_reference = true};
    struct phys_motion_solution m;
    phys_motion_solve(&system, &how, &m, &error);
    assert_string_equal(error.message, "");
    assert_int_equal(m.info.steps, 20);
    assert_true(m.x[6] < 0);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* Each would give two columns of one name. */
static void names_of_observables_are_their_own(void **state)
{
    static const struct phys_param params[] = {{"g", "", "gravity", 1, 0}};
    static const struct {
        const char *name;
        enum ad_status status;
    } cases[] = {{"x1", AD_E_INPUT},  {"v_y1", AD_E_INPUT}, {"reaction_z1", AD_E_INPUT},
                 {"t", AD_E_INPUT},   {"g", AD_E_INPUT},    {"energy", AD_E_INPUT},
                 {"L_z", AD_E_INPUT}, {"a,b", AD_E_INPUT},  {"", AD_E_INPUT},
                 {"a=b", AD_E_INPUT}, {"v_", AD_OK},        {"x11", AD_OK}};
    struct phys_scene scene = scene_with(rod, 1);
    (void)state;
    scene.params = params;
    scene.n_params = 1;
    scene.params_bytes = sizeof(double);
    for (size_t k = 0; k < LENGTH(cases); k++) {
        const struct phys_observable table[] = {{"L_z", "", constrained_coasts},
                                                {cases[k].name, "", constrained_coasts}};
        struct phys_system system;
        struct ad_error error = {0};
        scene.observables = table;
        scene.n_observables = 2;
        assert_int_equal(phys_system_make(&scene, &system, &error), cases[k].status);
        if (cases[k].status != AD_OK)
            assert_mentions(error.message, "bound observable");
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dependent_constraints_are_named),
        cmocka_unit_test(starts_beside_constraints_say_what_would_do),
        cmocka_unit_test(what_knows_no_constraints_says_so),
        cmocka_unit_test(wrong_constraints_are_named),
        cmocka_unit_test(names_of_observables_are_their_own),
        cmocka_unit_test(steps_over_singular_places_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
