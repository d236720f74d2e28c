/* Forces outside of L: dissipation functions and generalised forces against closed forms; the
   energy balance. */
#include "systems.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <math.h>
#include <stddef.h>

struct damped {
    double k, c, F, w;
};

static const struct phys_param parameters[] = {
    {"k", "", "stiffness", 4, offsetof(struct damped, k)},
    {"c", "", "damping", 0.3, offsetof(struct damped, c)},
    {"F", "", "drive", 0.5, offsetof(struct damped, F)},
    {"w", "", "its frequency", 1.5, offsetof(struct damped, w)},
};

static ad_var spring(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)t;
    return ad_mul(0.5, ad_sub(ad_square(v), ad_mul(PHYS_PARAM(p, k), ad_square(q))));
}

static ad_var friction(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)t;
    return ad_mul(ad_mul(0.5, PHYS_PARAM(p, c)), ad_square(v));
}

static ad_var drive(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)v;
    return ad_mul(PHYS_PARAM(p, F), ad_cos(ad_mul(PHYS_PARAM(p, w), t)));
}

static ad_var plain_drive(ad_var q, ad_var v, ad_var t, const void *params)
{
    const struct damped *p = params;
    (void)q, (void)v;
    return ad_mul(p->F, ad_cos(ad_mul(p->w, t)));
}

static enum ad_status at_one(const void *params, uint64_t seed, double *q, double *v,
                             struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 1;
    v[0] = 0;
    return AD_OK;
}

static struct phys_scene damped_scene(void)
{
    struct phys_scene s = scene_of("damped", 1, spring, 100, 0.05, at_one);
    s.params = parameters;
    s.n_params = LENGTH(parameters);
    s.params_bytes = sizeof(struct damped);
    s.dissipation = friction;
    s.forces = drive;
    return s;
}

/* x and its velocity of x'' + c x' + k x = F cos w t from 1 at rest. */
static double damped_at(double c, double t, double *v)
{
    const double k = 4, F = 0.5, w = 1.5, g = c / 2, W = sqrt(k - g * g);
    const double d = pow(k - w * w, 2) + pow(c * w, 2), a = F * (k - w * w) / d, b = F * c * w / d;
    const double A = 1 - a, B = (g * A - b * w) / W, e = exp(-g * t);
    *v = e * ((B * W - g * A) * cos(W * t) - (A * W + g * B) * sin(W * t)) +
         w * (b * cos(w * t) - a * sin(w * t));
    return e * (A * cos(W * t) + B * sin(W * t)) + a * cos(w * t) + b * sin(w * t);
}

static struct phys_motion_solution moved(const struct phys_system *system, const char *integrator,
                                         double dt, double error, double time)
{
    struct phys_motion_solution m;
    struct ad_error e = {0};
    const struct phys_motion_settings how = {
        .size = sizeof how,
        .time = time,
        .dt = dt,
        .error = error,
        .n_samples = 50,
        .integrator = integrator ? phys_integrator_find(integrator, &e) : NULL};
    phys_motion_solve(system, &how, &m, &e);
    assert_string_equal(e.message, "");
    return m;
}

static struct phys_system made(const struct phys_scene *scene)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_make(scene, &system, &error);
    assert_string_equal(error.message, "");
    return system;
}

static void all_samples_meet_the_closed_form(void **state)
{
    (void)state;
    const struct phys_scene scene = damped_scene();
    struct phys_system system = made(&scene);
    struct phys_motion_solution m = moved(&system, NULL, 0, 1e-11, 20);
    assert_false(m.keeps_energy);
    assert_true(m.error < 1e-11);
    for (size_t i = 0; i < m.n; i++) {
        double v, x = damped_at(0.3, m.t[i], &v);
        assert_close(m.x[2 * i], x, 0, 1e-11);
        assert_close(m.x[2 * i + 1], v, 0, 3e-11);
    }
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* Discrete d'Alembert keeps the order of the rule; p' = L_q + Q that of the collocation methods. */
static void methods_keep_their_orders(void **state)
{
    static const struct {
        const char *name;
        double dt, order;
    } methods[] = {{"variational-left", 0.02, 1},
                   {"variational-midpoint", 0.05, 2},
                   {"variational-trapezoid", 0.05, 2},
                   {"variational-gauss2", 0.1, 4},
                   {"variational-gauss3", 0.25, 6},
                   {"implicit-midpoint", 0.05, 2},
                   {"gauss2", 0.1, 4},
                   {"rk4", 0.1, 4}};
    (void)state;
    const struct phys_scene scene = damped_scene();
    struct phys_system system = made(&scene);
    double v, x = damped_at(0.3, 5, &v);
    for (size_t k = 0; k < LENGTH(methods); k++) {
        double off[2];
        for (int half = 0; half < 2; half++) {
            struct phys_motion_solution m =
                moved(&system, methods[k].name, methods[k].dt / (half + 1), 0, 5);
            off[half] = hypot(m.x[2 * m.n - 2] - x, m.x[2 * m.n - 1] - v);
            phys_motion_solution_free(&m);
        }
        assert_close(log2(off[0] / off[1]), methods[k].order, 0, 0.25);
    }
    phys_system_close(&system);
}

/* E less the work is E of the start to the method's error, and the work is known without it. */
static void the_energy_balance_closes(void **state)
{
    static const char *const methods[] = {"rk4", "variational-gauss2"};
    (void)state;
    const struct phys_scene scene = damped_scene();
    struct phys_system system = made(&scene);
    struct ad_error error = {0};
    for (size_t k = 0; k < LENGTH(methods); k++) {
        double off[2] = {0, 0}, work[51], unknown;
        for (int half = 0; half < 2; half++) {
            struct phys_motion_solution m = moved(&system, methods[k], 0.05 / (half + 1), 0, 5);
            assert_int_equal(m.n, 51);
            assert_int_equal(phys_motion_work(&m, work, &unknown, &error), AD_OK);
            assert_true(unknown < 1e-12 && work[0] == 0);
            for (size_t i = 0; i < m.n; i++)
                off[half] = fmax(off[half], fabs(m.energy[i] - m.energy[0] - work[i]));
            phys_motion_solution_free(&m);
        }
        assert_true(off[1] > 1e-11);
        assert_close(log2(off[0] / off[1]), 4, 0, 0.3);
    }
    phys_system_close(&system);
}

static ad_var growing(ad_var q, ad_var v, ad_var t, const void *params)
{
    return ad_mul(ad_exp(ad_mul(0.3, t)), spring(q, v, t, params));
}

/* E changes by what L itself does with time, too. */
static void the_balance_counts_time_in_L(void **state)
{
    (void)state;
    struct phys_scene scene = damped_scene();
    scene.lagrangian = growing;
    struct phys_system system = made(&scene);
    struct ad_error error = {0};
    struct phys_motion_solution m = moved(&system, NULL, 0, 1e-9, 5);
    double work[51], unknown;
    assert_int_equal(m.n, 51);
    assert_int_equal(phys_motion_work(&m, work, &unknown, &error), AD_OK);
    assert_true(unknown < 1e-11 && fabs(work[50]) > 0.1);
    for (size_t i = 0; i < m.n; i++)
        assert_close(m.energy[i] - m.energy[0], work[i], 0, 1e-8);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

static ad_var dry(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(1.0, ad_abs(v));
}

/* Dry friction stops the body: an adaptive method would step there without end. */
static void work_of_a_body_that_sticks_is_unknown(void **state)
{
    (void)state;
    struct phys_scene scene = damped_scene();
    scene.dissipation = dry;
    scene.forces = NULL;
    struct phys_system system = made(&scene);
    struct ad_error error = {0};
    struct phys_motion_solution m = moved(&system, "rk4", 0.05, 0, 5);
    double work[51], unknown;
    assert_int_equal(m.n, 51);
    assert_int_equal(phys_motion_work(&m, work, &unknown, &error), AD_E_ACCURACY);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* ---- two coordinates, varying masses ---- */

static ad_var polar(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    ad_var round = ad_mul(ad_row(q, 0), ad_row(v, 1));
    return ad_mul(0.5, ad_add(ad_square(ad_row(v, 0)), ad_square(round)));
}

static ad_var polar_friction(ad_var q, ad_var v, ad_var t, const void *params)
{
    return ad_mul(0.4, polar(q, v, t, params));
}

static ad_var torque(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)t, (void)params;
    return ad_mul(q, ad_const(q.tape, 2, 1, (double[]){0, 0.25}));
}

static enum ad_status aside(const void *params, uint64_t seed, double *q, double *v,
                            struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 2;
    q[1] = 0.5;
    v[0] = -0.6;
    v[1] = 0.7;
    return AD_OK;
}

/* A free particle in r and phi that friction stops: straight on, x + v (1 - exp(-c t)) / c. */
static void friction_in_polar_coordinates(void **state)
{
    static const char *const methods[] = {NULL, "gauss5", "variational-gauss4", "dop853"};
    (void)state;
    struct phys_scene scene = scene_of("polar", 2, polar, 100, 0.05, aside);
    scene.dissipation = polar_friction;
    struct phys_system system = made(&scene);
    const double x[] = {2 * cos(0.5), 2 * sin(0.5)},
                 v[] = {-0.6 * cos(0.5) - 1.4 * sin(0.5), -0.6 * sin(0.5) + 1.4 * cos(0.5)},
                 time = 3, along = (1 - exp(-0.4 * time)) / 0.4;
    for (size_t k = 0; k < LENGTH(methods); k++) {
        struct phys_motion_solution m = moved(&system, methods[k], 0, 1e-10, time);
        const double *q = m.x + 4 * (m.n - 1);
        assert_close(q[0] * cos(q[1]), x[0] + v[0] * along, 0, 2e-10);
        assert_close(q[0] * sin(q[1]), x[1] + v[1] * along, 0, 2e-10);
        phys_motion_solution_free(&m);
    }
    phys_system_close(&system);
}

/* phi is not in L, but a force acts on it. */
static void a_coordinate_that_is_pushed_is_not_cyclic(void **state)
{
    bool cyclic[2];
    double value[2], change[2], x[4], t = 0;
    struct ad_error error = {0};
    (void)state;
    struct phys_scene scene = scene_of("polar", 2, polar, 100, 0.05, aside);
    aside(NULL, 0, x, x + 2, &error);
    for (int pushed = 0; pushed < 2; pushed++) {
        scene.forces = pushed ? torque : NULL;
        struct phys_system system = made(&scene);
        assert_int_equal(phys_cyclic(&system, 1, x, &t, cyclic, value, change, &error), AD_OK);
        assert_int_equal(cyclic[1], !pushed);
        assert_int_equal(phys_keeps_energy(&system, &error), !pushed);
        phys_system_close(&system);
    }
}

/* ---- kinks ---- */

static ad_var falling(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)t, (void)params;
    return ad_sub(ad_mul(0.5, ad_square(v)), ad_mul(9.81, q));
}

/* Of D = c |v|^3 / 3, a force c |v| v; its second derivative has a kink at rest. */
static ad_var drag(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(0.2 / 3, ad_mul(ad_abs(v), ad_square(v)));
}

static void a_body_falls_through_air(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("air", 1, falling, 100, 0.05, at_one);
    scene.dissipation = drag;
    struct phys_system system = made(&scene);
    struct phys_motion_solution m = moved(&system, NULL, 0, 1e-10, 3);
    const double most = sqrt(9.81 / 0.2);
    assert_non_null(phys_check_kinks(&system));
    assert_close(m.x[2 * m.n - 1], -most * tanh(9.81 * 3 / most), 1e-10, 0);
    assert_close(m.x[2 * m.n - 2], 1 - log(cosh(9.81 * 3 / most)) / 0.2, 0, 1e-10);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
}

/* ---- parameters ---- */

static void parameters_of_forces_have_derivatives(void **state)
{
    static const char *const names[] = {"c"};
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 4};
    double by[4], v, h = 1e-5;
    struct ad_error error = {0};
    (void)state;
    struct phys_scene scene = damped_scene();
    struct phys_system system = made(&scene);
    assert_int_equal(phys_sensitivity(&system, NULL, 1, &how, 1, names, by, by + 2, &error), AD_OK);
    assert_close(by[0], (damped_at(0.3 + h, 4, &v) - damped_at(0.3 - h, 4, &v)) / (2 * h), 1e-8, 0);
    assert_int_equal(phys_param_use(&system, "F", &error), PHYS_PARAM_VARIABLE);
    phys_system_close(&system);
    scene.forces = plain_drive;
    system = made(&scene);
    assert_int_equal(phys_param_use(&system, "F", &error), PHYS_PARAM_PLAIN);
    phys_system_close(&system);
}

/* Friction shrinks areas of phase space: the exponents add up to -c. */
static void exponents_add_up_to_the_damping(void **state)
{
    const struct phys_lyapunov_settings how = {.size = sizeof how, .t1 = 50};
    double start[] = {1, 0}, matrix[8];
    struct ad_error error = {0};
    (void)state;
    const struct phys_scene scene = damped_scene();
    struct phys_system system = made(&scene);
    assert_int_equal(phys_transition(&system, start, &how, matrix, matrix + 4, &error), AD_OK);
    assert_close(log(matrix[0] * matrix[3] - matrix[1] * matrix[2]), -0.3 * 50, 1e-10, 0);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_samples_meet_the_closed_form),
        cmocka_unit_test(methods_keep_their_orders),
        cmocka_unit_test(the_energy_balance_closes),
        cmocka_unit_test(the_balance_counts_time_in_L),
        cmocka_unit_test(work_of_a_body_that_sticks_is_unknown),
        cmocka_unit_test(friction_in_polar_coordinates),
        cmocka_unit_test(a_coordinate_that_is_pushed_is_not_cyclic),
        cmocka_unit_test(a_body_falls_through_air),
        cmocka_unit_test(parameters_of_forces_have_derivatives),
        cmocka_unit_test(exponents_add_up_to_the_damping),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
