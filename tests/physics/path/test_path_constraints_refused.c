/* Paths with constraints: what is refused. */
#include "constrained_path.h"
#include "tests/close.h"
#include "tests/mentions.h"

static const char *const one[] = {"surface"}, *const two[] = {"first", "second"};

static ad_var twice(ad_var q, ad_var t, const void *params)
{
    ad_var g = constrained_sphere(q, t, params);
    return ad_concat_rows(2, (ad_var[]){g, ad_mul(3.0, g)});
}

static void refused(const struct phys_scene *scene, const double *q0, const double *q1,
                    void change(struct phys_path_settings *), const char *says)
{
    struct constrained_path r = constrained_path(scene, "gauss2", 9, 1, q0, q1);
    struct ad_error error;
    if (change)
        change(&r.settings);
    const double before = r.path[4];
    assert_int_equal(constrained_path_find(&r, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, says);
    assert_true(r.path[4] == before);
    constrained_path_end(&r);
}

static void hold_two(struct phys_path_settings *s) { s->hold = 2; }

static void relate_ends(struct phys_path_settings *s)
{
    static const bool moves[3] = {true, false, false};
    static const double relation[7] = {1, 0, 0, -1};
    static struct phys_ends ends = {
        .size = sizeof ends, .free = {moves, moves}, .n_relations = 1, .relation = relation};
    s->ends = &ends;
}

static void what_cannot_be_is_refused(void **state)
{
    (void)state;
    const struct phys_scene ball =
                                constrained_scene("ball", 3, constrained_coasts, constrained_tilted,
                                                  constrained_sphere, 1, one),
                            same = constrained_scene("same", 3, constrained_coasts,
                                                     constrained_tilted, twice, 2, two),
                            fixed = constrained_scene("fixed", 2, constrained_coasts,
                                                      constrained_tilted, twice, 2, two);
    const double a[] = {0.6, 0, 0.8}, b[] = {0, 1, 0}, off[] = {1.2, 0, 1.6}, centre[3] = {0};
    refused(&ball, a, off, NULL, "ball end surface g 1.5 0.6 0.8");
    refused(&ball, off, b, NULL, "ball start surface g 1.5 0.6 0.8");
    refused(&ball, centre, b, NULL, "ball surface gradient");
    refused(&ball, a, b, hold_two, "ball constraints hold 2");
    refused(&ball, a, b, relate_ends, "ball constraints relations");
    refused(&same, a, b, NULL, "same first second redundant");
    refused(&fixed, a, b, NULL, "fixed 2 constraints 2 coordinates");
    struct constrained_path r = constrained_path(&ball, "gauss2", 9, 1, a, b);
    struct ad_error error = {0};
    struct phys_path_info info;
    assert_int_equal(phys_path_solve(phys_solver_find("adam", &error), &r.system, &r.settings,
                                     r.path, &info, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "ball constraints newton adam");
    error = (struct ad_error){0};
    assert_int_equal(phys_path_ranks_solve(NULL, phys_solver_find("newton", &error), &r.system,
                                           &r.settings, r.path, &info, &error),
                     AD_E_ARGUMENT);
    assert_mentions(error.message, "ranks constraints");
    constrained_path_end(&r);
    /* a line between opposite points goes through the centre, where the sphere has no normal, or
       jumps over it: each half of the nodes would rest */
    for (size_t slices = 9; slices < 11; slices++) {
        r = constrained_path(&ball, slices == 9 ? "gauss2" : "midpoint", slices, 1, a,
                             (double[]){-0.6, 0, -0.8});
        assert_int_equal(constrained_path_find(&r, &error), AD_E_NONFINITE);
        assert_mentions(error.message,
                        slices == 9 ? "ball constraints t 0.5" : "ball jumps t 0.55*");
        constrained_path_end(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cannot_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
