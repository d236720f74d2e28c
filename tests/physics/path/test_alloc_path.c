/* A step of a descent allocates nothing; a failing allocation anywhere gives a status, never a
   crash or a leak. The linker redirects the library's allocations here. */
#include "tests/physics/published.h"
#include "physics/physics.h"
#include "tests/alloc.h"
#include "tests/close.h"

#include <stdlib.h>
#include <string.h>

/* ---- jobs ---- */

enum { SLICES = 12, STEPS = 5, MOST = 100 };

static bool note_calls(void *context, const struct phys_path_step *step)
{
    size_t *seen = context;
    seen[step->step] = alloc.calls;
    return true;
}

struct result {
    size_t seen[STEPS + 1]; /* allocations before each step */
    double path[MOST * SLICES];
};

/* Everything from a name to a found path. */
static enum ad_status run(const char *scene, struct result *result, struct ad_error *error)
{
    double q[MOST], v[MOST], *path = result->path;
    struct phys_system system;
    phys_motion *motion = NULL;
    if (phys_system_open(scene, &system, error) == AD_OK) {
        size_t dof = system.dof;
        double dt = system.scene->dt;
        struct phys_path_info info;
        struct phys_path_settings settings = {.size = sizeof settings,
                                              .rule = phys_rule_find("left", error),
                                              .slices = SLICES,
                                              .steps = STEPS,
                                              .dt = dt,
                                              .learning_rate = 1e-6,
                                              .progress = note_calls,
                                              .context = result->seen};
        assert_true(dof <= MOST);
        if (system.scene->start(system.params, 1, q, v, error) == AD_OK &&
            phys_motion_new(&system, &motion, error) == AD_OK &&
            phys_first_slices(motion, q, v, SLICES, dt, false, path, error) == AD_OK &&
            phys_ode_path(motion, SLICES, dt, 1, path, error) == AD_OK &&
            phys_motion_path(&system, NULL, q, v, SLICES, dt, path, error) == AD_OK)
            phys_path_solve(phys_solver_find("adam", error), &system, &settings, path, &info,
                            error);
    }
    phys_motion_free(motion);
    phys_system_close(&system);
    return error->status;
}

static void a_step_allocates_nothing(void **state)
{
    (void)state;
    for (size_t s = 0; phys_scenes[s]; s++) {
        static struct result result;
        struct ad_error error = {0};
        run(phys_scenes[s]->name, &result, &error);
        assert_no_error(&error);
        for (size_t k = 1; k <= STEPS; k++)
            assert_int_equal(result.seen[k], result.seen[0]);
    }
}

/* Fails allocation `at` of a run; false where the run has no so many. */
static bool survives(const char *scene, size_t at, const struct result *expected)
{
    static struct result result;
    struct ad_error error = {0};
    size_t before = alloc.given - alloc.taken;
    memset(&result, 0, sizeof result);
    alloc.calls = 0;
    alloc.failing = at;
    enum ad_status status = run(scene, &result, &error);
    bool failed = alloc.calls >= at;
    alloc.failing = 0;
    if (alloc.given - alloc.taken != before)
        fail_msg("%s: %zu blocks lost at allocation %zu", scene, alloc.given - alloc.taken - before,
                 at);
    /* memory that is merely trimmed may be refused: then nothing else may change */
    if (status == AD_OK)
        assert_memory_equal(result.path, expected->path, sizeof result.path);
    else if (status != AD_E_MEMORY)
        fail_msg("%s: status %d at allocation %zu: %s", scene, status, at, error.message);
    return failed;
}

static void every_failing_allocation_gives_a_status(void **state)
{
    (void)state;
    const char *const scenes[] = {"pendulum", "dblpend", "threebody", "ephemeris"};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        static struct result expected;
        struct ad_error error = {0};
        memset(&expected, 0, sizeof expected);
        run(scenes[s], &expected, &error);
        assert_no_error(&error);
        size_t at = 1;
        while (survives(scenes[s], at, &expected))
            at++;
        assert_true(at > 50); /* there was something to fail */
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_allocates_nothing),
        cmocka_unit_test(every_failing_allocation_gives_a_status),
    };
    setenv("LEASTACTION_NATIVE", "0", 1); /* its sources are allocated by libc, and not counted */
    return cmocka_run_group_tests(tests, NULL, NULL);
}
