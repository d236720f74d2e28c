/* H4: the estimates of phys_path_refine on random problems (scene, ends, time, tolerance, rule),
   against the motion between the same ends by multiple shooting at 1e-15. Compiled with another
   PROBLEMS, it measures their distribution. */
#include "physics/motion/motion.h"
#include "physics/path/shooting.h"
#include "physics/io/random.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef PROBLEMS
#define PROBLEMS 20
#endif

enum { GUESS = 12, DOF = 6, MEASURED = 12 }; /* slices of the path at which it is measured */

static const struct kind {
    const char *scene;
    double time; /* the longest */
    double kick; /* change of a velocity at the start */
} kinds[] = {{"dblpend", 3, 1},   {"dblpend", 8, 0.3},    {"pendulum", 60, 0.03},
             {"kepler", 6, 0.3},  {"double-well", 12, 1}, {"cubic", 9, 0.4},
             {"figure8", 4, 0.1}, {"dimer", 2, 0.5},      {"spring", 9, 1}};
static const char *const rules[] = {NULL, NULL, NULL, NULL, "gauss3", "gauss6", "midpoint"};

static double between(struct phys_random *random, double a, double b)
{
    return a + (b - a) * phys_random_uniform(random);
}

struct problem {
    struct phys_system system;
    struct phys_path_settings settings;
    double tolerance, guess[DOF * GUESS];
    char name[96];
};

/* Its ends lie on a motion; the guess is near it. False: there is no motion. */
static bool pose(struct problem *p, uint64_t seed)
{
    struct phys_random random;
    struct ad_error error = {0};
    phys_random_seed(&random, seed);
    const struct kind *kind = &kinds[(size_t)between(&random, 0, LENGTH(kinds))];
    const char *rule = rules[(size_t)between(&random, 0, LENGTH(rules))];
    double q[DOF], v[DOF], T = kind->time * between(&random, 0.1, 1);
    p->system = system_opened(kind->scene);
    size_t dof = p->system.dof;
    system_start(&p->system, 1, q, v);
    for (size_t k = 0; k < dof; k++)
        v[k] += kind->kick * between(&random, -1, 1);
    p->settings = phys_path_defaults(&p->system);
    p->settings.rule = rule ? phys_rule_find(rule, &error) : NULL;
    p->settings.slices = GUESS;
    p->settings.dt = T / (GUESS - 1);
    p->settings.steps = 50;
    p->tolerance = pow(10, between(&random, rule && strcmp(rule, "midpoint") == 0 ? -4 : -10, -2));
    snprintf(p->name, sizeof p->name, "%2d %s %s T %.3g", (int)seed, kind->scene,
             rule ? rule : "ladder", T);
    if (phys_motion_path(&p->system, NULL, q, v, GUESS, p->settings.dt, p->guess, &error) != AD_OK)
        return false;
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 1; i + 1 < GUESS; i++)
            p->guess[k * GUESS + i] += 0.01 * between(&random, -1, 1) * fabs(q[k]);
    return true;
}

/* Distance of a path from the motion between its ends; NaN: shooting finds none near it. */
static double true_error(const struct problem *p, const struct phys_refined *r)
{
    struct phys_shooting s;
    struct ad_error error = {0};
    size_t n = r->settings->slices, dof = p->system.dof;
    double most = 0, flow[4 * DOF * DOF], state[2 * DOF];
    bool known = phys_shooting_new(&s, &p->system, r->settings, r->path, &error) &&
                 phys_shooting_solve(&s, 1e-15);
    for (size_t i = 0, node = 0; known && i < n; i += (n + MEASURED - 1) / MEASURED) {
        double t = (double)i * r->settings->dt;
        while (node + 1 < s.n && s.time[node + 1] <= t)
            node++;
        known = phys_shooting_flow(&s, node, t, flow, state);
        for (size_t k = 0; known && k < dof; k++)
            most = fmax(most, fabs(state[k] - r->path[k * n + i]));
    }
    phys_shooting_free(&s);
    return known ? most : (double)NAN;
}

static void estimates_are_rarely_under_the_error(void **state)
{
    (void)state;
    size_t solved = 0, known = 0, over[2] = {0, 0};
    for (uint64_t seed = 1; seed <= PROBLEMS; seed++) {
        struct problem p;
        struct phys_refined refined = {0};
        struct ad_error error = {0};
        if (pose(&p, seed) && phys_path_refine(&p.system, &p.settings, p.guess, 0, p.tolerance,
                                               &refined, &error) == AD_OK) {
            double estimate = refined.level[refined.n - 1].estimate;
            double error_made = true_error(&p, &refined), ratio = error_made / estimate;
            print_message("%-36s %4zu slices, tolerance %.1e, estimate %.1e, true/estimate %.3f\n",
                          p.name, refined.settings->slices, p.tolerance, estimate, ratio);
            assert_true(estimate <= p.tolerance);
            solved++;
            known += isnan(ratio) ? 0 : 1;
            over[0] += ratio > 1;
            over[1] += ratio > 2;
        } else
            print_message("%-36s tolerance %.1e: %s\n", p.name, p.tolerance, error.message);
        phys_refined_free(&refined);
        phys_system_close(&p.system);
    }
    print_message("%d problems, %zu refined, %zu measured, %zu above the estimate, %zu above "
                  "twice\n",
                  PROBLEMS, solved, known, over[0], over[1]);
    assert_true(4 * solved >= 3 * PROBLEMS && 10 * known >= 9 * solved);
    assert_true(100 * over[0] <= known);
    assert_int_equal(over[1], 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(estimates_are_rarely_under_the_error)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
