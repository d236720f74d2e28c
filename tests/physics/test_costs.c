/* What results cost: steps and evaluations of every method on problems that are told apart by them,
   to 10 %. Choices that no result shows (first steps, orders, guesses, when to give up) show here.
   A change that costs less changes the table. */
#include "motion.h"
#include "systems.h"
#include "physics/fit/fit.h"
#include "physics/modes/modes.h"
#include "physics/stability/periodic.h"
#include "physics/stability/stability.h"
#include "tests/close.h"

#include <stdio.h>
#include <string.h>

/* [0] where nothing else is said: calls of `proceed`. */
enum { COSTS = 3 };

static size_t asked, differing;

static bool goes_on(void *context)
{
    (void)context;
    asked++;
    return true;
}

struct row {
    const char *what;
    double setting, time, cost[COSTS];
};

static void compare(const char *name, const struct row *row, const double cost[COSTS])
{
    bool same = true;
    for (size_t k = 0; k < COSTS; k++)
        same = same && is_close(cost[k], row->cost[k], 0.1, 2);
    print_message("{\"%s\", %g, %g, {%g, %g, %g}},\n", row->what, row->setting, row->time, cost[0],
                  cost[1], cost[2]);
    if (!same)
        print_error("%s of %s: %g, %g, %g; expected %g, %g, %g\n", name, row->what, cost[0],
                    cost[1], cost[2], row->cost[0], row->cost[1], row->cost[2]);
    differing += !same;
}

/* Steps, steps rejected, evaluations of "SCENE METHOD", by a tolerance or a step. */
static void motions(void **state)
{
    static const struct row rows[] = {
        {"kepler dopri5", 1e-5, 20, {70, 20, 542}},
        {"kepler dopri5", 1e-10, 6, {159, 0, 956}},
        {"kepler dop853", 1e-5, 20, {38, 13, 600}},
        {"kepler dop853", 1e-12, 20, {214, 39, 2998}},
        {"kepler taylor", 1e-5, 20, {53, 0, 702}},
        {"kepler taylor", 1e-14, 20, {100, 0, 2222}},
        {"arenstorf dopri5", 1e-6, 17, {118, 17, 812}},
        {"arenstorf dop853", 1e-9, 17, {116, 37, 1800}},
        {"arenstorf taylor", 1e-12, 17, {99, 0, 2100}},
        {"dblpend dopri5", 1e-4, 8, {25, 9, 206}},
        {"dblpend dop853", 1e-8, 8, {51, 19, 822}},
        {"dblpend taylor", 1e-12, 8, {59, 0, 1260}},
        {"fall dop853", 1e-9, 1.1, {20, 18, 439}},
        {"fall taylor", 1e-9, 1.1, {13, 0, 252}},
        {"dblpend gauss2", 0.02, 4, {200, 0, 3013}},
        {"dblpend gauss4", 0.3, 6, {20, 0, 1152}},
        {"dblpend implicit-midpoint", 0.01, 2, {200, 0, 1433}},
        {"kepler gauss3", 0.1, 10, {100, 0, 2866}},
        {"kepler gauss5", 0.4, 10, {25, 0, 1848}},
        {"pendulum variational-left", 0.05, 10, {200, 0, 601}},
        {"dblpend variational-midpoint", 0.02, 2, {100, 0, 452}},
        {"dblpend variational-trapezoid", 0.02, 2, {100, 0, 453}},
        {"kepler variational-gauss2", 0.1, 5, {50, 0, 209}},
        {"dblpend variational-gauss3", 0.1, 3, {30, 0, 160}},
        {"pendulum variational-gauss4", 0.5, 10, {20, 0, 81}},
    };
    (void)state;
    for (size_t r = 0; r < LENGTH(rows); r++) {
        struct motion m;
        char scene[32], method[32];
        sscanf(rows[r].what, "%31s %31s", scene, method);
        motion_open(&m, scene, strncmp(method, "variational", 11) == 0, NULL);
        motion_run(&m, method, rows[r].setting, rows[r].time, AD_OK);
        compare(
            "cost", &rows[r],
            (double[]){(double)m.info.steps, (double)m.info.rejected, (double)m.info.evaluations});
        motion_close(&m);
    }
}

/* Trials, evaluations of the last and of all, for a required error. */
static void required_errors(void **state)
{
    static const struct row rows[] = {
        {"kepler", 1e-6, 10, {1, 595, 4221}},    {"kepler", 1e-11, 10, {1, 1012, 4247}},
        {"dblpend", 1e-3, 5, {1, 390, 4076}},    {"dblpend", 1e-9, 5, {1, 792, 4107}},
        {"pendulum", 1e-8, 30, {1, 120, 4018}},  {"arenstorf", 1e-5, 17, {1, 1326, 4939}},
        {"figure8", 1e-10, 12, {1, 2090, 4284}}, {"spring", 1e-10, 300, {1, 4004, 24533}},
    };
    (void)state;
    for (size_t r = 0; r < LENGTH(rows); r++) {
        struct phys_system system = system_opened(rows[r].what);
        struct phys_motion_solution m;
        struct ad_error error = {0};
        asked = 0;
        const struct phys_motion_settings how = {.size = sizeof how,
                                                 .time = rows[r].time,
                                                 .error = rows[r].setting,
                                                 .n_samples = 10,
                                                 .proceed = goes_on};
        assert_int_equal(phys_motion_solve(&system, &how, &m, &error), AD_OK);
        compare("required error", &rows[r],
                (double[]){(double)m.n_trials, (double)m.info.evaluations, (double)asked});
        phys_motion_solution_free(&m);
        phys_system_close(&system);
    }
}

/* Levels, elements of the last, calls of `proceed` of phys_path_refine from a straight line. */
static void paths(void **state)
{
    static const struct row rows[] = {
        {"pendulum", 1e-6, 1, {3, 8, 60}},      {"pendulum", 1e-10, 3, {3, 8, 60}},
        {"kepler", 1e-8, 2, {4, 16, 202}},      {"dblpend", 1e-6, 0.5, {2, 8, 67}},
        {"double-well", 1e-8, 4, {4, 16, 454}}, {"cubic", 1e-9, 2, {3, 8, 73}},
        {"freebody", 1e-9, 5, {3, 8, 60}},      {"threebody", 1e-6, 0.5, {2, 8, 68}},
    };
    (void)state;
    for (size_t r = 0; r < LENGTH(rows); r++) {
        enum { SLICES = 9 };
        struct phys_system system = system_opened(rows[r].what);
        struct phys_path_settings how = phys_path_defaults(&system);
        struct phys_refined refined;
        struct ad_error error = {0};
        double q[MOTION_DOF], v[MOTION_DOF], path[MOTION_DOF * SLICES];
        system_start(&system, 1, q, v);
        how.rule = NULL;
        how.slices = SLICES;
        how.dt = rows[r].time / (SLICES - 1);
        how.proceed = goes_on;
        how.adam_steps = 0;
        assert_int_equal(phys_motion_path(&system, NULL, q, v, SLICES, how.dt, path, &error),
                         AD_OK);
        for (size_t k = 0; k < system.dof * SLICES; k++) {
            const double *line = path + k / SLICES * SLICES;
            const double at = (double)(k % SLICES) / (SLICES - 1);
            path[k] = k % SLICES == 0 ? line[0] : (1 - at) * line[0] + at * line[SLICES - 1];
        }
        asked = 0;
        phys_path_refine(&system, &how, path, 0, rows[r].setting, &refined, &error);
        assert_string_equal(error.message, "");
        compare("path", &rows[r],
                (double[]){(double)refined.n, (double)refined.level[refined.n - 1].elements,
                           (double)asked});
        phys_refined_free(&refined);
        phys_system_close(&system);
    }
}

/* ---- searches ---- */

struct sought {
    struct phys_system system;
    double time, q[MOTION_DOF], v[MOTION_DOF], x[2 * MOTION_DOF];
};

static double reference(struct sought *s, double accuracy, struct ad_error *error)
{
    struct phys_reference result;
    const double t[] = {0, s->time / 3, s->time};
    phys_reference(&s->system, s->q, s->v, 3, t, accuracy, goes_on, NULL, &result, error);
    phys_reference_free(&result);
    return 0;
}

static double periodic(struct sought *s, double accuracy, struct ad_error *error)
{
    struct phys_periodic result;
    const struct phys_periodic_settings how = {
        .size = sizeof how, .x = s->x, .period = s->time * (1 + accuracy), .proceed = goes_on};
    phys_periodic_find(&s->system, &how, &result, error);
    const double iterations = (double)result.iterations;
    phys_periodic_free(&result);
    return iterations;
}

static double equilibria(struct sought *s, double accuracy, struct ad_error *error)
{
    struct phys_equilibria result;
    const struct phys_equilibria_settings how = {
        .size = sizeof how, .starts = (size_t)accuracy, .proceed = goes_on};
    phys_equilibria_find(&s->system, &how, &result, error);
    const double n = (double)result.n;
    phys_equilibria_free(&result);
    return n;
}

static double lyapunov(struct sought *s, double accuracy, struct ad_error *error)
{
    struct phys_ode ode;
    struct phys_lyapunov result;
    const struct phys_lyapunov_settings how = {.size = sizeof how,
                                               .t1 = s->time,
                                               .tolerance = accuracy,
                                               .known = 1e-6,
                                               .lost = 1e-2,
                                               .proceed = goes_on};
    phys_ode_lagrangian(&s->system, &ode, error);
    phys_lyapunov(&ode, s->x, &how, &result, error);
    phys_ode_free(&ode);
    return 0;
}

/* Rows of the motion with a parameter 5 % off. */
static double fit(struct sought *s, double change, struct ad_error *error)
{
    enum { ROWS = 60 };
    static double states[ROWS * 2 * MOTION_DOF], t[ROWS];
    const char *const name = s->system.scene->params[0].name;
    const double noise[2 * MOTION_DOF] = {1e-3, 1e-3, 1e-3, 1e-3};
    const double value = phys_system_get(&s->system, name);
    struct phys_motion_solution m;
    struct phys_fit result;
    const struct phys_motion_settings moving = {.size = sizeof moving,
                                                .time = s->time,
                                                .tolerance = 1e-12,
                                                .n_samples = ROWS - 1,
                                                .no_reference = true};
    phys_motion_solve(&s->system, &moving, &m, error);
    assert_int_equal(m.n, ROWS);
    memcpy(t, m.t, sizeof t);
    memcpy(states, m.x, ROWS * 2 * s->system.dof * sizeof *states);
    phys_motion_solution_free(&m);
    const struct phys_fit_data data = {.size = sizeof data, .n = ROWS, .t = t, .x = states};
    const struct phys_fit_settings how = {.size = sizeof how,
                                          .n_free = 1,
                                          .free = &name,
                                          .noise = noise,
                                          .tries = 1,
                                          .proceed = goes_on};
    system_set(&s->system, name, value * (1 + change));
    phys_fit_solve(&s->system, &data, &how, &result, error);
    const double iterations = (double)result.iterations;
    phys_fit_free(&result);
    return iterations;
}

/* What was found, and calls of `proceed`. */
static void searches(void **state)
{
    static const struct {
        double (*find)(struct sought *s, double setting, struct ad_error *error);
        struct row row;
    } rows[] = {
        {reference, {"kepler", 0.1, 20, {0, 4711, 0}}},
        {reference, {"dblpend", 0.1, 10, {0, 4108, 0}}},
        {reference, {"arenstorf", 0.1, 17, {0, 4737, 0}}},
        {periodic, {"kepler", 0.01, 6.28319, {6, 1183, 0}}},
        {periodic, {"figure8", 0.002, 6.3259, {6, 1256, 0}}},
        {equilibria, {"dblpend", 20, 0, {4, 20, 0}}},
        {equilibria, {"double-well", 10, 0, {3, 10, 0}}},
        {lyapunov, {"dblpend", 1e-10, 20, {0, 2361, 0}}},
        {lyapunov, {"kepler", 1e-10, 60, {0, 2656, 0}}},
        {fit, {"pendulum", 0.2, 5, {3, 18, 0}}},
    };
    (void)state;
    for (size_t r = 0; r < LENGTH(rows); r++) {
        struct ad_error error = {0};
        struct sought s = {.system = system_opened(rows[r].row.what), .time = rows[r].row.time};
        system_start(&s.system, 1, s.q, s.v);
        memcpy(s.x, s.q, s.system.dof * sizeof *s.q);
        memcpy(s.x + s.system.dof, s.v, s.system.dof * sizeof *s.v);
        asked = 0;
        const double found = rows[r].find(&s, rows[r].row.setting, &error);
        assert_string_equal(error.message, "");
        compare("search", &rows[r].row, (double[]){found, (double)asked, 0});
        phys_system_close(&s.system);
    }
}

static int all_as_expected(void **state)
{
    size_t rows = differing;
    (void)state;
    differing = 0;
    return rows != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(searches, all_as_expected),
        cmocka_unit_test_teardown(motions, all_as_expected),
        cmocka_unit_test_teardown(required_errors, all_as_expected),
        cmocka_unit_test_teardown(paths, all_as_expected),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
