/* Descents of the action and their remedies: they find minima and lose saddles. */
#include "tests/physics/published.h"
#include "tests/close.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SLICES = 41 };

static struct phys_path_settings settings_of(double time)
{
    struct ad_error error = {0};
    return (struct phys_path_settings){.size = sizeof(struct phys_path_settings),
                                       .rule = phys_rule_find("left", &error),
                                       .slices = SLICES,
                                       .dt = time / (SLICES - 1),
                                       .steps = 4000,
                                       .learning_rate = 0.05};
}

static struct phys_path_info solve(const char *solver, const struct phys_system *system,
                                   const struct phys_path_settings *settings, double *path)
{
    struct phys_path_info info = {0};
    struct ad_error error = {0};
    phys_path_solve(phys_solver_find(solver, &error), system, settings, path, &info, &error);
    assert_no_error(&error);
    return info;
}

/* An oscillator from 1 to 0, and a rough start. */
static struct phys_system oscillator(double *path)
{
    struct phys_system spring;
    struct ad_error error = {0};
    phys_system_open("spring", &spring, &error);
    assert_no_error(&error);
    memset(path, 0, SLICES * sizeof *path);
    path[0] = 1;
    phys_noise_add(&(struct phys_noise){.sigma = 0.1}, &spring, SLICES, 3, path);
    return spring;
}

static void descents_reach_a_minimum(void **state)
{
    static const struct {
        const char *solver;
        double rate, momentum;
        size_t most_steps;
    } cases[] = {{"lbfgs", 0.05, 0, 200}, {"sgd", 0.02, 0.95, 4000}};
    (void)state;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double path[SLICES], exact[SLICES];
        struct phys_system spring = oscillator(path);
        struct phys_path_settings settings = settings_of(1);
        memcpy(exact, path, sizeof path);
        solve("newton", &spring, &settings, exact);
        settings.learning_rate = cases[k].rate;
        settings.momentum = cases[k].momentum;
        settings.steps = cases[k].most_steps;
        settings.tolerance = 1e-6;
        struct phys_path_info info = solve(cases[k].solver, &spring, &settings, path);
        print_message("%s: %zu steps\n", cases[k].solver, info.steps);
        assert_int_equal(info.stop, PHYS_STOP_TOLERANCE);
        assert_true(mean_square_distance(SLICES, path, exact) < 1e-8);
        phys_system_close(&spring);
    }
}

/* Beyond half a period the true path is a saddle: descents leave it, even when they start on it but
   for a little noise, and end where they were nearest if asked to. */
static void descents_leave_a_saddle_unless_stopped(void **state)
{
    double path[SLICES], exact[SLICES], start[SLICES];
    (void)state;
    struct phys_system spring = oscillator(path);
    struct phys_path_settings settings = settings_of(6);
    memcpy(exact, path, sizeof path);
    solve("newton", &spring, &settings, exact);
    memcpy(start, exact, sizeof exact);
    phys_noise_add(&(struct phys_noise){.sigma = 0.05}, &spring, SLICES, 9, start);
    double before = mean_square_distance(SLICES, start, exact);

    memcpy(path, start, sizeof path);
    settings.learning_rate = 0.2;
    settings.momentum = 0.5;
    solve("sgd", &spring, &settings, path);
    assert_true(mean_square_distance(SLICES, path, exact) > 100 * before);

    memcpy(path, start, sizeof path);
    settings.reference = exact;
    assert_int_equal(solve("sgd", &spring, &settings, path).stop, PHYS_STOP_REFERENCE);
    assert_true(mean_square_distance(SLICES, path, exact) < before);
    phys_system_close(&spring);
}

/* Held slices stay, inner nodes between them too. */
static void held_slices_do_not_move(void **state)
{
    static const char *const solvers[] = {"newton", "lbfgs", "adam"};
    enum { HOLD = 7, DEGREE = 3 };
    (void)state;
    struct ad_error error = {0};
    double first[SLICES];
    struct phys_system spring = oscillator(first);
    for (size_t s = 0; s < 3; s++) {
        struct phys_path_settings settings = settings_of(1);
        settings.rule = phys_rule_find("gauss3", &error);
        settings.hold = HOLD;
        settings.steps = 20;
        double start[DEGREE * SLICES], path[DEGREE * SLICES];
        memcpy(start, first, sizeof first);
        phys_rule_interpolate(settings.rule, 1, SLICES, start);
        memcpy(path, start, sizeof path);
        solve(solvers[s], &spring, &settings, path);
        for (size_t k = 0; k < DEGREE; k++)
            for (size_t i = 0; i < SLICES; i++) {
                /* node k of the element behind slice i */
                bool held =
                    k == 0 ? i < HOLD || i >= SLICES - HOLD : i < HOLD - 1 || i >= SLICES - HOLD;
                if ((path[k * SLICES + i] == start[k * SLICES + i]) != held)
                    fail_msg("%s: node %zu of slice %zu %s", solvers[s], k, i,
                             held ? "moved" : "was held");
            }
    }
    phys_system_close(&spring);
}

/* Energy [SLICES - 1] of the oscillator by rule `left`. */
static void energies(const double *path, double dt, double *energy)
{
    for (size_t i = 0; i + 1 < SLICES; i++) {
        double v = (path[i + 1] - path[i]) / dt;
        energy[i] = 0.5 * v * v + 0.5 * path[i] * path[i];
    }
}

/* The penalty keeps the energy near that of the start. */
static void energy_penalty_holds_the_energy(void **state)
{
    (void)state;
    double change[2] = {0}, energy[SLICES - 1];
    for (size_t kind = 0; kind < 2; kind++) {
        double path[SLICES];
        struct phys_system spring = oscillator(path);
        struct phys_path_settings settings = settings_of(2.5);
        settings.energy_weight = kind == 0 ? 0 : 1e4;
        settings.learning_rate = 1e-3;
        settings.steps = 3000;
        for (size_t i = 0; i < SLICES; i++) /* nearly the motion from rest */
            path[i] = cos(2.5 * (double)i / (SLICES - 1)) + 0.1 * (path[i] - (i == 0));
        energies(path, settings.dt, energy);
        double start = energy[0];
        solve("adam", &spring, &settings, path);
        energies(path, settings.dt, energy);
        for (size_t i = 0; i + 1 < SLICES; i++)
            change[kind] += pow(energy[i] - start, 2);
        phys_system_close(&spring);
    }
    assert_true(change[1] < 0.1 * change[0]);
}

/* The local penalty against a plain loop; E is divided by the number of slices, as published. */
static void local_energy_penalty_is_what_it_says(void **state)
{
    const double dt = 0.07, weight = 13;
    (void)state;
    double path[SLICES], energy[SLICES - 1], expected = 0, objective, mean;
    struct phys_system spring = oscillator(path);
    struct ad_error error = {0};
    struct phys_action action;
    ad_program *program;
    ad_tape *tape = ad_tape_new(AD_F64);
    phys_action_record(tape, &spring, phys_rule_find("left", &error), SLICES, dt, 0, &action);
    phys_action_hold_energy(&action, weight);
    assert_int_equal(
        ad_compile(tape, 2, (ad_var[]){action.objective, action.action_mean}, &program), AD_OK);
    ad_set(program, action.path, path);
    ad_run(program);
    ad_get(program, action.objective, &objective);
    ad_get(program, action.action_mean, &mean);
    energies(path, dt, energy);
    for (size_t i = 1; i + 1 < SLICES; i++)
        expected += weight * pow((energy[i] - energy[i - 1]) / SLICES, 2) / (SLICES - 2);
    assert_close(objective - mean, expected, 1e-12, 0);
    ad_program_free(program);
    ad_tape_free(tape);
    phys_system_close(&spring);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(descents_reach_a_minimum),
        cmocka_unit_test(descents_leave_a_saddle_unless_stopped),
        cmocka_unit_test(held_slices_do_not_move),
        cmocka_unit_test(energy_penalty_holds_the_energy),
        cmocka_unit_test(local_energy_penalty_is_what_it_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
