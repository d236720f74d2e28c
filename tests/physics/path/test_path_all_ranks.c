/* Searches for all paths, dealt out among ranks, find what one process finds, to the last bit, on
   every rank; starts and boxes are indeed run by several; any rank ends a search for all. */
#include "physics/path/path.h"
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 4 };

struct job {
    const char *scene, *name; /* a parameter */
    double value;
    size_t slices;
    double time;
    bool interrupted;         /* by the last rank, at once */
    bool free_end, free_time; /* of energy -0.5 */
    struct phys_system system[MOST];
    struct phys_solutions all[MOST];
    struct ad_error error[MOST];
    size_t dealt[MOST];
};

static bool ends(void *context)
{
    (void)context;
    return false;
}

static void work(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct phys_system *system = &j->system[rank];
    struct phys_path_settings settings = phys_path_defaults(system);
    double *path = calloc(2 * system->dof * j->slices, sizeof *path);
    enum phys_motion_of which;
    static const bool is_free[] = {true};
    const struct phys_ends free_end = {.size = sizeof free_end, .free = {NULL, is_free}};
    settings.rule = phys_rule_find("gauss2", error);
    settings.slices = j->slices;
    settings.dt = j->time / (double)(j->slices - 1);
    settings.ranks = ranks;
    const struct phys_ends free_time = {
        .size = sizeof free_time, .free_time = true, .energy = -0.5};
    settings.ends = j->free_end ? &free_end : j->free_time ? &free_time : NULL;
    phys_path_motion(system, &settings, NULL, 1, path, &which, error);
    if (j->interrupted && ranks && rank + 1 == ranks->count)
        settings.proceed = ends;
    if (error->status == AD_OK)
        phys_path_all(system, &settings, path, 40, 1, &j->all[rank], error);
    if (ranks)
        j->dealt[rank] = ranks->dealt;
    free(path);
}

static void run(struct job *j, size_t count)
{
    for (size_t k = 0; k < count + !count; k++) {
        j->error[k] = (struct ad_error){0};
        j->system[k] = system_opened(j->scene);
        system_set(&j->system[k], j->name, j->value);
    }
    with_ranks(count, work, j);
    for (size_t k = 0; k < count + !count; k++) {
        if (j->error[k].status != AD_OK)
            fail_msg("%s, rank %zu of %zu: %s", j->scene, k, count, j->error[k].message);
        phys_system_close(&j->system[k]);
    }
}

static void same_solutions(const struct phys_solutions *a, const struct phys_solutions *b,
                           size_t numbers)
{
    assert_int_equal(a->n, b->n);
    for (size_t k = 0; k < a->n; k++) {
        const struct phys_solution *x = &a->solution[k], *y = &b->solution[k];
        assert_memory_equal(x->path, y->path, numbers * sizeof *x->path);
        assert_true(x->energy == y->energy && x->action == y->action && x->time == y->time);
        assert_int_equal(x->copies, y->copies);
        assert_int_equal(x->hits, y->hits);
        assert_int_equal(x->resolved, y->resolved);
        assert_int_equal(x->spectrum.index, y->spectrum.index);
    }
    assert_int_equal(a->unresolved, b->unresolved);
    assert_int_equal(a->interrupted, b->interrupted);
    assert_int_equal(a->starts, b->starts);
    assert_int_equal(a->led, b->led);
    assert_int_equal(a->found_once, b->found_once);
    assert_memory_equal(&a->undecided, &b->undecided, sizeof a->undecided);
    assert_memory_equal(&a->unseen, &b->unseen, sizeof a->unseen);
    assert_memory_equal(&a->unseen_limit, &b->unseen_limit, sizeof a->unseen_limit);
    assert_memory_equal(&a->fastest, &b->fastest, sizeof a->fastest);
}

static void check(struct job *j, size_t least, bool dealt)
{
    run(j, 0);
    struct phys_solutions one = j->all[0];
    struct phys_system system = system_opened(j->scene);
    system_set(&system, j->name, j->value);
    const size_t numbers = 2 * system.dof * j->slices;
    phys_system_close(&system);
    assert_true(one.n >= least);
    for (size_t count = 1; count <= MOST; count++) {
        run(j, count);
        for (size_t k = 0; k < count; k++) {
            same_solutions(&j->all[k], &one, numbers);
            assert_true(count == 1 || (j->dealt[k] > 0) == dealt);
            phys_solutions_free(&j->all[k]);
        }
    }
    phys_solutions_free(&one);
}

static void test_one_coordinate(void **state)
{
    (void)state;
    struct job j = {.scene = "pendulum", .name = "l", .value = 1, .slices = 51, .time = 10};
    check(&j, 3, false);
}

/* Starts from many velocities, in the place of times by energy. */
static void test_free_end(void **state)
{
    (void)state;
    struct job j = {
        .scene = "pendulum", .name = "l", .value = 1, .slices = 51, .time = 6, .free_end = true};
    check(&j, 2, true);
}

static void test_two_coordinates(void **state)
{
    (void)state;
    struct job j = {.scene = "kepler", .name = "gm", .value = 1, .slices = 21, .time = 1.5};
    check(&j, 2, true);
    j.free_time = true;
    j.time = 5;
    check(&j, 2, true);
}

static void test_many_coordinates(void **state)
{
    (void)state;
    struct job j = {.scene = "sine-gordon", .name = "sites", .value = 4, .slices = 21, .time = 4};
    check(&j, 2, true);
}

static void test_interrupted(void **state)
{
    (void)state;
    struct job j = {
        .scene = "kepler", .name = "gm", .value = 1, .slices = 21, .time = 3, .interrupted = true};
    run(&j, 3);
    for (size_t k = 0; k < 3; k++) {
        assert_true(j.all[k].interrupted);
        assert_int_equal(j.all[k].n, j.all[0].n);
    }
    for (size_t k = 0; k < 3; k++)
        phys_solutions_free(&j.all[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_coordinate),  cmocka_unit_test(test_free_end),
        cmocka_unit_test(test_two_coordinates), cmocka_unit_test(test_many_coordinates),
        cmocka_unit_test(test_interrupted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
