/* Paths over ranks: the path, gradient and index of the solvers of one process, and the same bits
   on 1, 2, 3 and 4 ranks. */
#include "tests/close.h"
#include "physics/path/ranks/elimination.h"
#include "tests/mentions.h"
#include "tests/native.h"
#include "tests/physics/systems.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

enum { RANKS = 4 };

struct task {
    const char *scene, *rule;
    size_t slices;
    double dt, bend; /* bend: how far the start is from the motion */
    bool ring;       /* of ten sites, whose element matrices have another order */
};

static const struct task tasks[] = {
    {"pendulum", "left", 100, 0, 0.3, false},        {"pendulum", "gauss3", 30, 4, 0.1, false},
    {"dblpend", "midpoint", 101, 0, 0.02, false},    {"threebody", "gauss2", 61, 0.5, 0.001, false},
    {"sine-gordon", "gauss2", 21, 0.2, 0.001, true},
};

/* Where the action has a minimum. */
static const struct task minima[] = {
    {"sine-gordon", "gauss2", 21, 0.02, 0.1, true},
    {"dblpend", "gauss4", 30, 0.02, 0.1, false},
    {"pendulum", "left", 100, 0.3, 0.3, false},
};

struct job {
    const struct phys_solver *solver;
    struct phys_system system;
    struct phys_path_settings settings;
    size_t rows;
    const double *start;     /* [rows x slices] */
    double *path, *gradient; /* [rows x slices] */
    struct phys_path_info info[RANKS];
    struct phys_path_figures figures[RANKS];
    struct phys_spectrum spectrum[RANKS];
    struct ad_error error[RANKS];
};

/* Columns of a share from those of the whole path, or back, but for its last one's inner nodes. */
static void copy_share(const struct job *j, const struct phys_path_share *s, double *share,
                       double *whole, bool back)
{
    size_t dof = j->system.dof, n = j->settings.slices;
    for (size_t row = 0; row < j->rows; row++)
        for (size_t i = 0; i + (row >= dof) < s->slices; i++) {
            double *in = share + row * s->slices + i, *out = whole + row * n + s->first + i;
            *(back ? out : in) = *(back ? in : out);
        }
}

static void work(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct phys_path_share share;
    if (phys_path_share(ranks, rank, j->settings.slices, &share, error) != AD_OK)
        return;
    double *path = calloc(2 * j->rows * share.slices, sizeof *path);
    double *gradient = path + j->rows * share.slices;
    copy_share(j, &share, path, (double *)j->start, false);
    phys_path_ranks_gradient(ranks, &j->system, &j->settings, path, gradient, &j->figures[rank],
                             error);
    phys_path_ranks_solve(ranks, j->solver, &j->system, &j->settings, path, &j->info[rank], error);
    phys_path_ranks_spectrum(ranks, &j->system, &j->settings, path, &j->spectrum[rank], error);
    copy_share(j, &share, path, j->path, true);
    copy_share(j, &share, gradient, j->gradient, true);
    free(path);
}

static struct job job_of(const struct task *task, const char *solver)
{
    struct job j = {.system = system_opened(task->scene)};
    struct ad_error error = {0};
    if (task->ring) {
        system_set(&j.system, "sites", 10);
        system_set(&j.system, "ring", 1);
    }
    j.solver = phys_solver_find(solver, &error);
    j.settings = phys_path_defaults(&j.system);
    j.settings.rule = phys_rule_find(task->rule, &error);
    j.settings.slices = task->slices;
    j.settings.dt = task->dt > 0 ? task->dt : j.settings.dt;
    j.settings.steps = 40;
    j.rows = j.settings.rule->degree * j.system.dof;
    size_t n = j.rows * task->slices;
    double *start = malloc(3 * n * sizeof *start);
    j.path = start + n;
    j.gradient = j.path + n;
    enum phys_motion_of which;
    assert_int_equal(phys_path_motion(&j.system, &j.settings, NULL, 1, start, &which, &error),
                     AD_OK);
    for (size_t d = 0; d < j.system.dof; d++)
        for (size_t i = 0; i < task->slices; i++) {
            double s = (double)i / (double)(task->slices - 1);
            start[d * task->slices + i] += task->bend * s * (1 - s) * (double)(d + 1);
        }
    phys_rule_interpolate(j.settings.rule, j.system.dof, task->slices, start);
    j.start = start;
    return j;
}

static void job_free(struct job *j)
{
    free((double *)j->start);
    phys_system_close(&j->system);
}

/* The largest difference of two paths, but for the unused nodes of the last column. */
static double apart(const struct job *j, const double *a, const double *b)
{
    size_t slices = j->settings.slices;
    double most = 0;
    for (size_t k = 0; k < j->rows * slices; k++)
        if (k < j->system.dof * slices || (k + 1) % slices != 0)
            most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

static void test_newton(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(tasks); k++) {
        struct job j = job_of(&tasks[k], "newton");
        struct ad_error error = {0};
        struct phys_path_info info;
        struct phys_spectrum spectrum;
        double *path = malloc(j.rows * j.settings.slices * sizeof *path);
        memcpy(path, j.start, j.rows * j.settings.slices * sizeof *path);
        assert_int_equal(phys_path_solve(j.solver, &j.system, &j.settings, path, &info, &error),
                         AD_OK);
        assert_int_equal(phys_path_spectrum(&j.system, &j.settings, path, &spectrum, &error),
                         AD_OK);
        work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(j.info[0].stop, PHYS_STOP_ROUNDING);
        assert_true(apart(&j, j.path, path) < 1e-12);
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
        job_free(&j);
    }
}

static void assert_same_bits(const struct task *task, const char *solver)
{
    struct job alone = job_of(task, solver);
    work(&alone, NULL);
    size_t n = alone.rows * alone.settings.slices;
    for (size_t ranks = 1; ranks <= RANKS; ranks++) {
        struct job j = job_of(task, solver);
        with_ranks(ranks, work, &j);
        memcpy(j.path + n - 1, alone.path + n - 1, sizeof *j.path); /* no rank's */
        assert_true(apart(&j, j.path, alone.path) == 0);
        assert_true(apart(&j, j.gradient, alone.gradient) == 0);
        for (size_t r = 0; r < ranks; r++) {
            assert_string_equal(j.error[r].message, "");
            j.info[r].seconds = alone.info[0].seconds;
            assert_memory_equal(&j.info[r], &alone.info[0], sizeof j.info[r]);
            assert_memory_equal(&j.figures[r], &alone.figures[0], sizeof j.figures[r]);
            assert_int_equal(j.spectrum[r].index, alone.spectrum[0].index);
            assert_int_equal(j.spectrum[r].legendre, alone.spectrum[0].legendre);
        }
        job_free(&j);
    }
    job_free(&alone);
}

static void test_bits(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(tasks); k++)
        assert_same_bits(&tasks[k], "newton");
    assert_same_bits(&tasks[3], "adam");
    assert_same_bits(&tasks[3], "lbfgs");
    assert_same_bits(&minima[0], "lbfgs");
    assert_same_bits(&tasks[0], "sgd");
}

static void test_adam(void **state)
{
    (void)state;
    struct job j = job_of(&tasks[3], "adam");
    struct ad_error error = {0};
    struct phys_path_info info;
    double *path = malloc(j.rows * j.settings.slices * sizeof *path);
    memcpy(path, j.start, j.rows * j.settings.slices * sizeof *path);
    assert_int_equal(phys_path_solve(j.solver, &j.system, &j.settings, path, &info, &error), AD_OK);
    work(&j, NULL);
    assert_string_equal(j.error[0].message, "");
    assert_int_equal(j.info[0].steps, info.steps);
    assert_close(j.info[0].action, info.action, 1e-9, 0);
    assert_true(apart(&j, j.path, path) < 1e-9 && apart(&j, j.path, j.start) > 1e-3);
    free(path);
    job_free(&j);
}

/* The path of Newton's method, in few steps. */
static void test_lbfgs(void **state)
{
    (void)state;
    for (size_t k = 0; k < LENGTH(minima); k++) {
        struct job newton = job_of(&minima[k], "newton");
        struct job j = job_of(&minima[k], "lbfgs");
        work(&newton, NULL);
        work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(newton.spectrum[0].index, 0);
        assert_int_equal(j.info[0].stop, PHYS_STOP_ROUNDING);
        assert_true(j.info[0].steps <= 30);
        assert_true(apart(&j, j.path, newton.path) < 1e-9 && apart(&j, j.path, j.start) > 1e-3);
        job_free(&newton);
        job_free(&j);
    }
}

/* Without forces that vary the preconditioner is the whole inverse: one step. */
static void test_kinetic_inverse(void **state)
{
    (void)state;
    static const struct task fall[] = {{"freebody", "left", 300, 0.05, 4, false},
                                       {"freebody", "gauss2", 21, 0.3, 4, false},
                                       {"freebody", "gauss4", 70, 0.1, 4, false}};
    for (size_t k = 0; k < LENGTH(fall); k++) {
        struct job j = job_of(&fall[k], "lbfgs");
        system_set(&j.system, "m", 3.7);
        j.settings.steps = 1;
        work(&j, NULL);
        assert_string_equal(j.error[0].message, "");
        assert_int_equal(j.info[0].steps, 1);
        assert_true(j.info[0].grad_norm < 1e-9 * j.info[0].start.grad_norm);
        job_free(&j);
    }
}

/* Without room for its joints a rank makes them again. */
static void test_joints_made_again(void **state)
{
    (void)state;
    struct job j = job_of(&tasks[3], "newton");
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
    assert_true(apart(&j, step[0], j.start) > 1e-4);
    phys_elimination_free(&e);
    phys_ranked_free(&p);
    job_free(&j);
}

static void start_shares(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    const double ends[] = {0.5, -0.25};
    size_t rank = ranks ? ranks->rank : 0;
    struct phys_path_share share;
    if (phys_path_share(ranks, rank, j->settings.slices, &share, &j->error[rank]) != AD_OK)
        return;
    double *path = malloc(j->rows * share.slices * sizeof *path);
    phys_path_ranks_start(ranks, &j->system, &j->settings, 1, false, NULL, path, &j->error[rank]);
    copy_share(j, &share, path, j->path, true);
    phys_path_ranks_start(ranks, &j->system, &j->settings, 1, true, ends, path, &j->error[rank]);
    copy_share(j, &share, path, j->gradient, true);
    free(path);
}

/* The motion, inner nodes too, which Newton's method hardly moves; the line; both alike on ranks.
 */
static void test_starts(void **state)
{
    (void)state;
    struct job alone = job_of(&tasks[1], "newton"), j = job_of(&tasks[1], "newton");
    size_t slices = j.settings.slices, n = j.rows * slices;
    double *motion = malloc(n * sizeof *motion);
    struct ad_error error = {0};
    start_shares(&alone, NULL);
    with_ranks(3, start_shares, &j);
    assert_string_equal(alone.error[0].message, "");
    memcpy(j.path + n - 1, alone.path + n - 1, sizeof *j.path);
    assert_true(apart(&j, j.path, alone.path) == 0 && apart(&j, j.gradient, alone.gradient) == 0);
    assert_int_equal(phys_scene_path(&j.system, 1, NULL, slices, j.settings.dt, motion, &error),
                     AD_OK);
    phys_rule_interpolate(j.settings.rule, 1, slices, motion);
    for (size_t k = 0; k < n; k++) {
        if (k < slices) {
            assert_close(j.path[k], motion[k], 0, 1e-11);
            assert_close(j.gradient[k], 0.5 - 0.75 * (double)k / (double)(slices - 1), 1e-14,
                         1e-15);
        } else if ((k + 1) % slices != 0) {
            assert_close(j.path[k], motion[k], 0, 1e-3);
        }
    }
    free(motion);
    job_free(&alone);
    job_free(&j);
}

static ad_var oscillators(ad_var q, ad_var v, ad_var t, const void *params)
{
    const double *sign = params;
    ad_var L = ad_sub(ad_square(v), ad_square(q));
    (void)t;
    return ad_add(ad_mul(sign[0], ad_row(L, 0)), ad_mul(sign[1], ad_row(L, 1)));
}

/* At rest for 10 units of time, more than three half periods, so that the index of each of the two
   is 3; that of -S where L_vv is negative. */
static void test_signs(void **state)
{
    (void)state;
    const double signs[][2] = {{1, 1}, {-1, -1}, {1, -1}};
    const enum phys_definite kinds[] = {PHYS_POSITIVE, PHYS_NEGATIVE, PHYS_INDEFINITE};
    for (size_t k = 0; k < LENGTH(signs); k++) {
        const struct phys_scene scene = scene_of("two", 2, oscillators, 101, 0.1, NULL);
        struct phys_system system = {.scene = &scene, .dof = 2, .params = (void *)signs[k]};
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_spectrum spectrum;
        struct ad_error error = {0};
        const double rest[2 * 101] = {0};
        assert_int_equal(
            phys_path_ranks_spectrum(NULL, &system, &settings, rest, &spectrum, &error), AD_OK);
        assert_int_equal(spectrum.legendre, kinds[k]);
        assert_int_equal(spectrum.index, k < 2 ? 6 : 0);
        assert_true(k < 2 ? isinf(spectrum.not_definite) : spectrum.not_definite == 0);
        assert_false(spectrum.undetermined);
    }
}

/* ---- refusals ---- */

static void refused(struct job *j, const char *mentions)
{
    struct ad_error error = {0};
    assert_int_equal(phys_path_ranks_solve(NULL, j->solver, &j->system, &j->settings, j->path,
                                           &j->info[0], &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, mentions);
}

static void test_refused(void **state)
{
    (void)state;
    struct ad_error none = {0};
    struct job j = job_of(&tasks[0], "newton");
    const struct job good = j;
    struct phys_solver own = *j.solver;
    own.name = "own";
    j.solver = &own;
    refused(&j, "own expected newton lbfgs adam sgd");
    j = good;
    j.settings.rule = phys_rule_find("left+repeat", &none);
    refused(&j, "left+repeat expected");
    j = good;
    j.settings.hold = 2;
    refused(&j, "hold none");
    j = good;
    j.settings.slices = 2;
    refused(&j, "2 slices 3");
    j = good;
    job_free(&j);
}

/* Ranks that were not given the same path all say so. */
static void differ(void *context, struct ad_ranks *ranks)
{
    struct job *jobs = context;
    struct job j = jobs[ranks->rank];
    phys_path_ranks_gradient(ranks, &j.system, &j.settings, j.path, j.gradient, &j.figures[0],
                             &jobs[ranks->rank].error[0]);
}

static void test_differing(void **state)
{
    (void)state;
    struct job jobs[2] = {job_of(&tasks[0], "newton"), job_of(&tasks[0], "newton")};
    jobs[1].settings.dt *= 2;
    with_ranks(2, differ, jobs);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(jobs[k].error[0].status, AD_E_INPUT);
        assert_mentions(jobs[k].error[0].message, "path rank 1");
        job_free(&jobs[k]);
    }
}

static void test_shares(void **state)
{
    (void)state;
    struct ad_ranks ranks = {.size = sizeof ranks, .count = 7};
    const size_t slices[] = {60, 100, 1001, 100000, 10000000};
    for (size_t k = 0; k < LENGTH(slices); k++) {
        struct phys_path_share share = {0, 1};
        struct ad_error error = {0};
        size_t next = 0;
        for (size_t rank = 0; rank < ranks.count; rank++) {
            assert_int_equal(phys_path_share(&ranks, rank, slices[k], &share, &error), AD_OK);
            assert_int_equal(share.first, next);
            assert_in_range(share.slices, slices[k] / 14, slices[k] / 4);
            next = share.first + share.slices - 1;
        }
        assert_int_equal(next, slices[k] - 1);
    }
    struct phys_path_share share;
    struct ad_error error = {0};
    assert_int_equal(phys_path_share(&ranks, 0, 20, &share, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "7 ranks 20 slices 5 blocks");
}

/* Machine code from the first block on, by the steps of the whole path: never in the middle. */
static void choose_code(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    struct phys_ranked_path p;
    j->settings.native = true;
    phys_ranked_new(&p, ranks, &j->system, &j->settings, false, &j->error[ranks->rank]);
    j->figures[ranks->rank].action = !*ad_native_note(p.hessian.of->first);
    phys_ranked_free(&p);
}

static void test_code(void **state)
{
    (void)state;
    native_need_compiler();
    struct job j = job_of(&tasks[3], "adam");
    j.settings.steps = 100000000;
    with_ranks(2, choose_code, &j);
    assert_int_equal(j.error[0].status + j.error[1].status, AD_OK);
    assert_true(j.figures[0].action == 1 && j.figures[1].action == 1);
    job_free(&j);
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
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_signs),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_differing),
        cmocka_unit_test(test_code),
        cmocka_unit_test(test_shares),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
