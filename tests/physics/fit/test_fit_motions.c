/* Fits of motions that one stretch, or the first guesses, would not find. */
#include "measured.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

/* Angles of a chaotic double pendulum over 14 Lyapunov times: one stretch from the start would not
   find it. */
static void chaotic_motions_are_fitted(void **state)
{
    static const char *const names[] = {"l1", "m2", "g"};
    static const double noise[] = {1e-3, 0}, truth[] = {1, 1, 1};
    (void)state;
    static struct measured m;
    struct phys_random random;
    struct phys_system system = system_opened("dblpend");
    double start[4];
    phys_random_seed(&random, 5);
    system_start(&system, 1, start, start + 2);
    memset(&m, 0, sizeof m);
    add_trial(&m, &system, start, 0, 0.1, 300, noise, &random);
    forget_velocities(&m, 2);
    system_set(&system, "l1", 1.2);
    system_set(&system, "m2", 0.7);
    system_set(&system, "g", 1.15);
    const struct phys_fit_settings how = {
        .size = sizeof how, .n_free = 3, .free = names, .stretch = 10, .tries = 1};
    struct phys_fit fit = fitted(&system, &m, &how);
    for (size_t k = 0; k < 3; k++)
        assert_true(fabs(fit.value[k] - truth[k]) < 4 * fit.deviation[k]);
    assert_close(fit.noise[0], noise[0], 0.15, 0);
    assert_true(fit.deviation[0] < 1e-3);
    phys_fit_free(&fit);
    phys_system_close(&system);
}

/* Positions alone, of motions from random starts with random parameters, from values that are off
   by up to a half. Steps lead to negative masses, first guesses of the noise weigh gaps wrongly,
   and rates from neighbours in dense and noisy data lead away.
 */
static void random_motions_are_fitted(void **state)
{
    static const struct {
        const char *scene, *names[3];
        size_t n, rows;
        int repeats;
        double dt, most, noise[2];
    } jobs[] = {{"pendulum", {"l", "damping"}, 2, 40, 30, 0.25, 2.6, {1e-3}},
                {"dblpend", {"l1", "l2", "m2"}, 3, 100, 8, 0.04, 1.5, {0.05}},
                {"dblpend", {"l1", "l2", "m2"}, 3, 400, 1, 0.01, 1.5, {0.2}}};
    (void)state;
    static struct measured m;
    struct phys_random random;
    double squares = 0, all = 0;
    phys_random_seed(&random, 6);
    for (size_t job = 0; job < LENGTH(jobs); job++)
        for (int repeat = 0; repeat < jobs[job].repeats; repeat++) {
            struct phys_system system = system_opened(jobs[job].scene);
            double truth[3], start[MOST] = {0};
            system_set(&system, "g", 9.81);
            for (size_t k = 0; k < jobs[job].n; k++) {
                truth[k] =
                    (k == 1 && job == 0 ? 0.2 : 1) * (0.6 + 0.8 * phys_random_uniform(&random));
                system_set(&system, jobs[job].names[k], truth[k]);
            }
            for (size_t i = 0; i < system.dof; i++)
                start[i] = 0.5 + (jobs[job].most - 0.5) * phys_random_uniform(&random);
            memset(&m, 0, sizeof m);
            add_trial(&m, &system, start, 0, jobs[job].dt, jobs[job].rows, jobs[job].noise,
                      &random);
            forget_velocities(&m, system.dof);
            for (size_t k = 0; k < jobs[job].n; k++)
                system_set(&system, jobs[job].names[k],
                           truth[k] * (0.6 + 0.9 * phys_random_uniform(&random)));
            const struct phys_fit_settings how = {
                .size = sizeof how, .n_free = jobs[job].n, .free = jobs[job].names};
            struct phys_fit fit = fitted(&system, &m, &how);
            for (size_t k = 0; k < jobs[job].n; k++, all++)
                squares += pow((fit.value[k] - truth[k]) / fit.deviation[k], 2);
            phys_fit_free(&fit);
            phys_system_close(&system);
        }
    assert_close(squares / all, 1, 0.5, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chaotic_motions_are_fitted),
        cmocka_unit_test(random_motions_are_fitted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
