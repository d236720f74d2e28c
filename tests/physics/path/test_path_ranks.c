/* Paths over ranks: the path, gradient and index of the solvers of one process, and the same bits
   on 1, 2, 3 and 4 ranks. */
#include "path_jobs.h"
#include "physics/path/ranks/elimination.h"
#include "tests/close.h"
#include "tests/physics/systems.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

/* Where the action has a minimum. */
static const struct path_task minima[] = {
    {"sine-gordon", "gauss2", 21, 0.02, 0.1, true},
    {"dblpend", "gauss4", 30, 0.02, 0.1, false},
    {"pendulum", "left", 100, 0.3, 0.3, false},
};

static void test_newton(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(path_tasks); k++) {
        struct path_job j = path_job_of(&path_tasks[k], "newton");
        struct ad_error error = {0};
        struct phys_path_info info;
        struct phys_spectrum spectrum;
        double *path = malloc(j.rows * j.settings.slices * sizeof *path);
        memcpy(path, j.start, j.rows * j.settings.slices * sizeof *path);
        assert_int_equal(phys_path_solve(j.solver, &j.system, &j.settings, path, &info, &error),
                         AD_OK);
        assert_int_equal(phys_path_spectrum(&j.system, &j.settings, path, &spectrum, &error),
                         AD_OK);
        path_job_work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(j.info[0].stop, PHYS_STOP_ROUNDING);
        assert_true(path_job_apart(&j, j.path, path) < 1e-12);
        assert_close(j.info[0].action, info.action, 1e-12, 0);
        assert_close(j.info[0].kinetic_mean, info.kinetic_mean, 1e-12, 0);
        assert_close(j.info[0].energy_mean, info.energy_mean, 1e-11, 0);
        assert_close(j.info[0].energy_drift, info.energy_drift, 1e-9, 1e-13);
        assert_close(j.figures[0].action, info.start.action, 1e-13, 0);
        assert_close(j.figures[0].grad_norm, info.start.grad_norm, 1e-10, 0);
        assert_close(j.figures[0].potential_mean, info.start.potential_mean, 1e-12, 0);
        assert_int_equal(j.spectrum[0].legendre, spectrum.legendre);
        assert_int_equal(j.spectrum[0].index, spectrum.index);
        assert_false(j.spectrum[0].undetermined);
        phys_spectrum_free(&spectrum);
        free(path);
        path_job_free(&j);
    }
}

static void assert_same_bits(const struct path_task *task, const char *solver)
{
    struct path_job alone = path_job_of(task, solver);
    path_job_work(&alone, NULL);
    size_t n = alone.rows * alone.settings.slices;
    for (size_t ranks = 1; ranks <= PATH_JOB_RANKS; ranks++) {
        struct path_job j = path_job_of(task, solver);
        with_ranks(ranks, path_job_work, &j);
        memcpy(j.path + n - 1, alone.path + n - 1, sizeof *j.path); /* no rank's */
        assert_true(path_job_apart(&j, j.path, alone.path) == 0);
        assert_true(path_job_apart(&j, j.gradient, alone.gradient) == 0);
        for (size_t r = 0; r < ranks; r++) {
            assert_string_equal(j.error[r].message, "");
            j.info[r].seconds = alone.info[0].seconds;
            assert_memory_equal(&j.info[r], &alone.info[0], sizeof j.info[r]);
            assert_memory_equal(&j.figures[r], &alone.figures[0], sizeof j.figures[r]);
            assert_int_equal(j.spectrum[r].index, alone.spectrum[0].index);
            assert_int_equal(j.spectrum[r].legendre, alone.spectrum[0].legendre);
        }
        path_job_free(&j);
    }
    path_job_free(&alone);
}

static void test_bits(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(path_tasks); k++)
        assert_same_bits(&path_tasks[k], "newton");
    assert_same_bits(&path_tasks[3], "adam");
    assert_same_bits(&path_tasks[3], "lbfgs");
    assert_same_bits(&minima[0], "lbfgs");
    assert_same_bits(&path_tasks[0], "sgd");
}

static void test_adam(void **state)
{
    (void)state;
    struct path_job j = path_job_of(&path_tasks[3], "adam");
    struct ad_error error = {0};
    struct phys_path_info info;
    double *path = malloc(j.rows * j.settings.slices * sizeof *path);
    memcpy(path, j.start, j.rows * j.settings.slices * sizeof *path);
    assert_int_equal(phys_path_solve(j.solver, &j.system, &j.settings, path, &info, &error), AD_OK);
    path_job_work(&j, NULL);
    assert_string_equal(j.error[0].message, "");
    assert_int_equal(j.info[0].steps, info.steps);
    assert_close(j.info[0].action, info.action, 1e-9, 0);
    assert_true(path_job_apart(&j, j.path, path) < 1e-9 &&
                path_job_apart(&j, j.path, j.start) > 1e-3);
    free(path);
    path_job_free(&j);
}

/* The path of Newton's method, in few steps. */
static void test_lbfgs(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(minima); k++) {
        struct path_job newton = path_job_of(&minima[k], "newton");
        struct path_job j = path_job_of(&minima[k], "lbfgs");
        path_job_work(&newton, NULL);
        path_job_work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(newton.spectrum[0].index, 0);
        assert_int_equal(j.info[0].stop, PHYS_STOP_ROUNDING);
        assert_true(j.info[0].steps <= 30);
        assert_true(path_job_apart(&j, j.path, newton.path) < 1e-9 &&
                    path_job_apart(&j, j.path, j.start) > 1e-3);
        path_job_free(&newton);
        path_job_free(&j);
    }
}

/* Without forces that vary the preconditioner is the whole inverse: one step. */
static void test_kinetic_inverse(void **state)
{
    (void)state;
    static const struct path_task fall[] = {{"freebody", "left", 300, 0.05, 4, false},
                                            {"freebody", "gauss2", 21, 0.3, 4, false},
                                            {"freebody", "gauss4", 70, 0.1, 4, false}};
    for (size_t k = 0; k < LENGTH(fall); k++) {
        struct path_job j = path_job_of(&fall[k], "lbfgs");
        system_set(&j.system, "m", 3.7);
        j.settings.steps = 1;
        path_job_work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(j.info[0].steps, 1);
        assert_true(j.info[0].grad_norm < 1e-9 * j.info[0].start.grad_norm);
        path_job_free(&j);
    }
}

/* Without room for its joints a rank makes them again. */
static void test_joints_made_again(void **state)
{
    (void)state;
    struct path_job j = path_job_of(&path_tasks[3], "newton");
    struct phys_ranked_path p;
    struct phys_elimination e;
    struct ad_error error = {0};
    size_t n = j.rows * j.settings.slices;
    double *step[2] = {j.path, j.gradient};
    assert_int_equal(phys_ranked_new(&p, NULL, &j.system, &j.settings, true, &error), AD_OK);
    p.path = j.start;
    assert_int_equal(phys_elimination_new(&e, &p, &error), AD_OK);
    for (size_t k = 0; k < 2; k++) {
        assert_true(e.keeps);
        e.keeps = k == 0;
        assert_int_equal(phys_eliminate(&e, 0, &error), AD_OK);
        assert_int_equal(phys_elimination_step(&e, step[k], &error), AD_OK);
        e.keeps = true;
    }
    assert_memory_equal(step[0], step[1], n * sizeof *step[0]);
    assert_true(path_job_apart(&j, step[0], j.start) > 1e-4);
    phys_elimination_free(&e);
    phys_ranked_free(&p);
    path_job_free(&j);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_newton),
        cmocka_unit_test(test_bits),
        cmocka_unit_test(test_adam),
        cmocka_unit_test(test_lbfgs),
        cmocka_unit_test(test_kinetic_inverse),
        cmocka_unit_test(test_joints_made_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
