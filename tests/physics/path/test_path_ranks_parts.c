/* Paths over ranks: starts, signs of L_vv, refusals, shares, and when machine code is chosen. */
#include "path_jobs.h"
#include "physics/path/ranks/elimination.h"
#include "tests/close.h"
#include "tests/mentions.h"
#include "tests/native.h"
#include "tests/physics/systems.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

static void start_shares(void *context, struct ad_ranks *ranks)
{
    struct path_job *j = context;
    const double ends[] = {0.5, -0.25};
    size_t rank = ranks ? ranks->rank : 0;
    struct phys_path_share share;
    if (phys_path_share(ranks, rank, j->settings.slices, &share, &j->error[rank]) != AD_OK)
        return;
    double *path = malloc(j->rows * share.slices * sizeof *path);
    phys_path_ranks_start(ranks, &j->system, &j->settings, 1, false, NULL, path, &j->error[rank]);
    path_job_copy_share(j, &share, path, j->path, true);
    phys_path_ranks_start(ranks, &j->system, &j->settings, 1, true, ends, path, &j->error[rank]);
    path_job_copy_share(j, &share, path, j->gradient, true);
    free(path);
}

/* The motion, inner nodes too, which Newton's method hardly moves; the line; both alike on ranks.
 */
static void test_starts(void **state)
{
    (void)state;
    struct path_job alone = path_job_of(&path_tasks[1], "newton"),
                    j = path_job_of(&path_tasks[1], "newton");
    size_t slices = j.settings.slices, n = j.rows * slices;
    double *motion = malloc(n * sizeof *motion);
    struct ad_error error = {0};
    start_shares(&alone, NULL);
    with_ranks(3, start_shares, &j);
    assert_string_equal(alone.error[0].message, "");
    memcpy(j.path + n - 1, alone.path + n - 1, sizeof *j.path);
    assert_true(path_job_apart(&j, j.path, alone.path) == 0 &&
                path_job_apart(&j, j.gradient, alone.gradient) == 0);
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
    path_job_free(&alone);
    path_job_free(&j);
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

/* Where the ends are conjugate, the sign of an eigenvalue is within rounding. */
static void test_conjugate_ends(void **state)
{
    (void)state;
    const double signs[] = {1, 1}, rest[4 * 2 * 101] = {0};
    for (int conjugate = 0; conjugate < 2; conjugate++) {
        const struct phys_scene scene =
            scene_of("two", 2, oscillators, 101, (conjugate ? M_PI : 3) / 100, NULL);
        struct phys_system system = {.scene = &scene, .dof = 2, .params = (void *)signs};
        struct phys_path_settings settings = phys_path_defaults(&system);
        struct phys_spectrum spectrum;
        struct ad_error error = {0};
        settings.rule = phys_rule_find("gauss4", &error);
        assert_int_equal(
            phys_path_ranks_spectrum(NULL, &system, &settings, rest, &spectrum, &error), AD_OK);
        assert_int_equal(spectrum.undetermined, conjugate);
    }
}

/* ---- refusals ---- */

static void refused(struct path_job *j, const char *mentions)
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
    struct path_job j = path_job_of(&path_tasks[0], "newton");
    const struct path_job good = j;
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
    path_job_free(&j);
}

/* Ranks that were not given the same path all say so. */
static void differ(void *context, struct ad_ranks *ranks)
{
    struct path_job *jobs = context;
    struct path_job j = jobs[ranks->rank];
    phys_path_ranks_gradient(ranks, &j.system, &j.settings, j.path, j.gradient, &j.figures[0],
                             &jobs[ranks->rank].error[0]);
}

static void test_differing(void **state)
{
    (void)state;
    struct path_job jobs[2] = {path_job_of(&path_tasks[0], "newton"),
                               path_job_of(&path_tasks[0], "newton")};
    jobs[1].settings.dt *= 2;
    with_ranks(2, differ, jobs);
    for (size_t k = 0; k < 2; k++) {
        assert_int_equal(jobs[k].error[0].status, AD_E_INPUT);
        assert_mentions(jobs[k].error[0].message, "path rank 1");
        path_job_free(&jobs[k]);
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
    struct path_job *j = context;
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
    struct path_job j = path_job_of(&path_tasks[3], "adam");
    j.settings.steps = 100000000;
    with_ranks(2, choose_code, &j);
    assert_int_equal(j.error[0].status + j.error[1].status, AD_OK);
    assert_true(j.figures[0].action == 1 && j.figures[1].action == 1);
    path_job_free(&j);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_starts),         cmocka_unit_test(test_signs),
        cmocka_unit_test(test_conjugate_ends), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_differing),      cmocka_unit_test(test_code),
        cmocka_unit_test(test_shares),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
