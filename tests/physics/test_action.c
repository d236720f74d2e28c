/* The discretised action: published figures, closed forms, order, gradient, stationarity;
   and how often L is recorded for one. */
#include "published.h"
#include "systems.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

static const struct phys_rule *rule(const char *name)
{
    struct ad_error error = {0};
    const struct phys_rule *found = phys_rule_find(name, &error);
    assert_no_error(&error);
    return found;
}

struct figures {
    double kinetic_mean, potential_mean, action_mean, action, objective, first_energy;
};

/* The action of `path` with E0 = start_energy. */
static struct figures evaluate(const struct phys_system *system, const char *rule_name,
                               size_t slices, double dt, double energy_weight, double start_energy,
                               const double *path)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    struct phys_action a;
    assert_int_equal(
        phys_action_record(tape, system, rule(rule_name), slices, dt, energy_weight, &a), AD_OK);
    ad_var out[] = {a.kinetic_mean, a.potential_mean, a.action_mean,
                    a.action,       a.objective,      a.first_energy};
    double value[6];
    ad_program *program;
    assert_int_equal(ad_compile(tape, 6, out, &program), AD_OK);
    ad_set(program, a.path, path);
    ad_set(program, a.start_energy, &start_energy);
    ad_run(program);
    for (size_t k = 0; k < 6; k++)
        ad_get(program, out[k], &value[k]);
    ad_program_free(program);
    ad_tape_free(tape);
    return (struct figures){value[0], value[1], value[2], value[3], value[4], value[5]};
}

/* F7: the mean of n - 1 elements is over n slices, as published. */
static void published_means_come_out_to_rounding(void **state)
{
    (void)state;
    for (size_t k = 0; k < N_PUBLISHED; k++) {
        const struct published *p = &published[k];
        struct phys_system system = published_system(p->scene);
        const struct phys_preset *paper = system.scene->paper;
        double *path = published_path(&system, "ode");
        struct figures f = evaluate(&system, "left+repeat", paper->slices, paper->dt, 0, 0, path);
        assert_close(f.kinetic_mean, p->kinetic_ode, 1e-12, 0);
        assert_close(f.potential_mean, p->potential_ode, 1e-12, 0);
        assert_close(f.action_mean, p->action_ode, 1e-12, 0);
        free(path);
        phys_system_close(&system);
    }
}

/* x(t) = sin(1 - t)/sin(1) on `slices` points of [0, 1]: S = cot(1)/2. */
static double oscillator_action(const char *rule_name, size_t slices)
{
    struct ad_error error = {0};
    struct phys_system system;
    phys_system_open("spring", &system, &error);
    assert_no_error(&error);
    double dt = 1 / (double)(slices - 1), *path = malloc(slices * sizeof *path);
    for (size_t i = 0; i < slices; i++)
        path[i] = sin(1 - (double)i * dt) / sin(1);
    struct figures f = evaluate(&system, rule_name, slices, dt, 0, 0, path);
    free(path);
    phys_system_close(&system);
    return f.action;
}

static void oscillator_errors_are_those_of_first_order(void **state)
{
    (void)state;
    double exact = 0.3210463080;
    assert_close(0.5 / tan(1), exact, 1e-9, 0);
    /* 160 intervals, and the digits that are known */
    assert_close(oscillator_action("left", 161) - exact, -1.6e-3, 0, 5e-5);
    assert_close(oscillator_action("left+repeat", 161) - exact, 2.8e-3, 0, 5e-5);
    const char *const rules[] = {"left", "left+repeat"};
    for (size_t k = 0; k < 2; k++) {
        double coarse = oscillator_action(rules[k], 401) - exact;
        double fine = oscillator_action(rules[k], 801) - exact;
        assert_close(coarse / fine, 2, 0.01, 0);
    }
}

/* Uniform gravity by hand: the sum of a discrete free fall. */
static void free_fall_sums_as_by_hand(void **state)
{
    (void)state;
    struct phys_system system = published_system("freebody");
    struct ad_error error = {0};
    phys_system_set(&system, "m", 1.7, &error);
    phys_system_set(&system, "g", 9.81, &error);
    const double x[] = {0.3, 0.9, 1.1, 0.4, -0.2}, dt = 0.05;
    double T = 0, V = 0, repeat = 0.5 * 1.7 * pow(-0.6 / dt, 2);
    for (size_t i = 0; i < 4; i++) {
        T += 0.5 * 1.7 * pow((x[i + 1] - x[i]) / dt, 2);
        V += 1.7 * 9.81 * x[i];
    }
    struct figures f = evaluate(&system, "left", 5, dt, 0, 0, x);
    assert_close(f.kinetic_mean, T / 5, 1e-13, 0);
    assert_close(f.potential_mean, V / 5, 1e-13, 0);
    assert_close(f.action, dt * (T - V), 1e-13, 0);
    f = evaluate(&system, "left+repeat", 5, dt, 0, 0, x);
    assert_close(f.kinetic_mean, (T + repeat) / 5, 1e-13, 0);
    assert_close(f.potential_mean, (V + 1.7 * 9.81 * x[4]) / 5, 1e-13, 0);
    phys_system_close(&system);
}

static void the_energy_penalty_is_as_published(void **state)
{
    (void)state;
    struct phys_system system = published_system("pendulum");
    const double x[] = {1.2, 1.25, 1.1, 0.7}, dt = 0.8;
    double energy[4], penalty = 0;
    for (size_t i = 0; i < 4; i++) {
        double v = (i < 3 ? x[i + 1] - x[i] : x[3] - x[2]) / dt;
        energy[i] = (0.5 * 180 * 180 * v * v + 180 * (1 - cos(x[i]))) / 4;
    }
    for (size_t i = 0; i < 4; i++)
        penalty += 100 * (17 - energy[i]) * (17 - energy[i]) / 4;
    struct figures f = evaluate(&system, "left+repeat", 4, dt, 100, 17, x);
    assert_close(f.first_energy, energy[0], 1e-13, 0);
    assert_close(f.objective, f.action_mean + penalty, 1e-13, 0);
    f = evaluate(&system, "left+repeat", 4, dt, 0, 17, x);
    assert_true(f.objective == f.action_mean);
    phys_system_close(&system);
}

static void gradients_agree_with_differences(void **state)
{
    (void)state;
    const char *const rules[] = {"left", "left+repeat"};
    for (size_t s = 0; phys_scenes[s]; s++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_system_open(phys_scenes[s]->name, &system, &error);
        assert_no_error(&error);
        enum { SLICES = 6 };
        size_t dof = system.dof;
        double *path = malloc(dof * SLICES * sizeof *path);
        double *q = malloc(2 * dof * sizeof *q), *v = q + dof, dt = system.scene->dt;
        system.scene->start(system.params, 3, q, v, &error);
        for (size_t k = 0; k < dof; k++)
            for (size_t i = 0; i < SLICES; i++)
                path[k * SLICES + i] = q[k] + (v[k] + 1e-3 * q[k]) * dt * sin((double)(k + 3 * i));
        for (size_t r = 0; r < 2; r++) {
            ad_tape *tape = ad_tape_new(AD_F64);
            struct phys_action a;
            struct ad_check report;
            phys_action_record(tape, &system, rule(rules[r]), SLICES, dt, 0.3, &a);
            ad_check_gradient(a.objective, 1, &a.path, (const double *const[]){path}, 1e-6, 50,
                              &report);
            assert_no_error(ad_tape_error(tape));
            if (!report.passed)
                fail_msg("%s, %s: error %g", system.scene->name, rules[r], report.worst);
            ad_tape_free(tape);
        }
        free(path);
        free(q);
        phys_system_close(&system);
    }
}

/* Largest entry of the gradient of the action at inner slices, against its largest partial sum. */
static void assert_stationary(const struct phys_system *system, size_t slices, double dt,
                              const double *path, double scale)
{
    size_t n = system->dof * slices;
    ad_tape *tape = ad_tape_new(AD_F64);
    struct phys_action a;
    ad_var g;
    double *gradient = malloc(n * sizeof *gradient);
    ad_program *program;
    phys_action_record(tape, system, rule("left"), slices, dt, 0, &a);
    ad_grad(a.action, 1, &a.path, &g);
    assert_int_equal(ad_compile(tape, 1, &g, &program), AD_OK);
    ad_set(program, a.path, path);
    ad_run(program);
    ad_get(program, g, gradient);
    for (size_t k = 0; k < system->dof; k++)
        for (size_t i = 1; i + 1 < slices; i++)
            assert_close(gradient[k * slices + i], 0, 0, scale);
    free(gradient);
    ad_program_free(program);
    ad_tape_free(tape);
}

/* For separable L the stationary path of `left` is the semi-implicit Euler path: m (x[i+1] - 2 x[i]
   + x[i-1])/dt = -dt V'(x[i]) are the same equations. */
static void the_ode_path_is_stationary_for_left(void **state)
{
    (void)state;
    const char *const scenes[] = {"freebody", "pendulum", "threebody", "gas", "spring", "kepler"};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        struct phys_system system;
        struct ad_error error = {0};
        phys_system_open(scenes[s], &system, &error);
        size_t dof = system.dof, slices = 40;
        double *path = malloc(dof * slices * sizeof *path), dt = system.scene->dt;
        double *q = malloc(2 * dof * sizeof *q), *v = q + dof, size = 0;
        phys_motion *motion;
        system.scene->start(system.params, 2, q, v, &error);
        phys_motion_new(&system, &motion, &error);
        phys_first_slices(motion, q, v, slices, dt, false, path, &error);
        phys_ode_path(motion, slices, dt, 1, path, &error);
        assert_no_error(&error);
        for (size_t k = 0; k < dof * slices; k++)
            size = fmax(size, fabs(path[k]));
        double mass = strcmp(scenes[s], "pendulum") == 0 ? 180. * 180 : 1;
        assert_stationary(&system, slices, dt, path, 1e-14 * size * mass / dt);
        phys_motion_free(motion);
        free(path);
        free(q);
        phys_system_close(&system);
    }
}

/* ---- recording ---- */

enum { COUNTED_SLICES = 101 };

/* How often T and V of a pendulum are recorded at all points of a path at once. */
static size_t recorded_T, recorded_V;

static ad_var counted_T(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)t, (void)p;
    recorded_T += ad_cols(q) == COUNTED_SLICES - 1;
    return ad_mul(0.5, ad_square(v));
}

static ad_var counted_V(ad_var q, ad_var v, ad_var t, const void *p)
{
    (void)v, (void)t, (void)p;
    recorded_V += ad_cols(q) == COUNTED_SLICES - 1;
    return ad_neg(ad_cos(q));
}

static enum ad_status at_rest(const void *p, uint64_t seed, double *q, double *v,
                              struct ad_error *error)
{
    (void)p, (void)seed;
    *q = *v = 0;
    return error->status;
}

/* For the action, its gradient, the Hessian, the kind of path and its distances. */
static void the_lagrangian_of_a_path_is_recorded_once(void **state)
{
    (void)state;
    struct phys_scene scene = scene_of("counted", 1, NULL, COUNTED_SLICES, 0.1, at_rest);
    struct phys_path_settings settings = {.size = sizeof settings,
                                          .rule = rule("midpoint"),
                                          .slices = COUNTED_SLICES,
                                          .steps = 50,
                                          .dt = 0.01,
                                          .learning_rate = 1};
    struct phys_system system;
    struct phys_path_found found;
    struct ad_error error = {0};
    double path[COUNTED_SLICES], ends[COUNTED_SLICES] = {[COUNTED_SLICES - 1] = 1};
    scene.kinetic = counted_T;
    scene.potential = counted_V;
    phys_system_make(&scene, &system, &error);
    recorded_T = recorded_V = 0;
    phys_path_line(1, COUNTED_SLICES, ends, path);
    phys_path_find(phys_solver_find("newton", &error), &system, &settings, path, &found, &error);
    assert_no_error(&error);
    assert_true(found.stationary && isfinite(found.true_distance));
    assert_int_equal(recorded_T, 1);
    assert_int_equal(recorded_V, 1);
    phys_path_found_free(&found);
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_means_come_out_to_rounding),
        cmocka_unit_test(oscillator_errors_are_those_of_first_order),
        cmocka_unit_test(free_fall_sums_as_by_hand),
        cmocka_unit_test(the_energy_penalty_is_as_published),
        cmocka_unit_test(gradients_agree_with_differences),
        cmocka_unit_test(the_ode_path_is_stationary_for_left),
        cmocka_unit_test(the_lagrangian_of_a_path_is_recorded_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
