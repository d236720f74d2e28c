/* A loop inside a Lagrangian: its action, gradient and Hessian are those of the same steps
 * unrolled.
 */
#include "physics/action/hessian.h"
#include "tests/close.h"

#include <string.h>

enum { SLICES = 5, STEPS = 6, MOST = 64 };

static bool unrolled; /* which of the two the potential records */

static ad_var kinetic(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)q, (void)t, (void)params;
    return ad_mul(0.5, ad_square(v));
}

static ad_var step(ad_var x, ad_var q) { return ad_sin(ad_add(ad_mul(0.9, x), ad_mul(0.3, q))); }

/* The sixth iterate of x -> sin(0.9 x + 0.3 q), at all points at once. */
static ad_var potential(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)v, (void)t, (void)params;
    ad_var x = q;
    if (unrolled) {
        for (int k = 0; k < STEPS; k++)
            x = step(x, q);
        return x;
    }
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var state = ad_input(tape, 1, ad_cols(q), "x"), shared = ad_input(tape, 1, ad_cols(q), "q");
    ad_var next = step(state, shared);
    const struct ad_body body = {.size = sizeof body,
                                 .tape = tape,
                                 .n_state = 1,
                                 .state = &state,
                                 .next = &next,
                                 .n_shared = 1,
                                 .shared = &shared,
                                 .checkpoints = 2};
    ad_scan(q.tape, &body, STEPS, &q, NULL, &q, &x, NULL);
    ad_tape_free(tape);
    return x;
}

static const struct phys_scene scene = {
    .name = "loop", .dof = 1, .kinetic = kinetic, .potential = potential};
static const struct phys_system system_of_it = {.scene = &scene, .dof = 1, .bodies = 1, .dims = 1};

static void test_action(void **state)
{
    (void)state;
    struct ad_error error = {0};
    const struct phys_rule *rule = phys_rule_find("gauss2", &error);
    double path[2 * SLICES], gradient[2][2 * SLICES], element[2][MOST];
    size_t elements = 0;
    for (size_t i = 0; i < LENGTH(path); i++)
        path[i] = sin(1.3 * (double)i);
    for (int u = 0; u < 2; u++) {
        unrolled = u;
        struct phys_action action;
        struct phys_hessian h;
        ad_program *program;
        ad_var by;
        ad_tape *tape = ad_tape_new(AD_F64);
        assert_int_equal(phys_action_record(tape, &system_of_it, rule, SLICES, 0.37, 0.1, &action),
                         AD_OK);
        assert_int_equal(ad_grad(ad_add(action.action, action.objective), 1, &action.path, &by),
                         AD_OK);
        assert_int_equal(ad_compile(tape, 1, &by, &program), AD_OK);
        ad_set(program, action.path, path);
        ad_run(program);
        ad_get(program, by, gradient[u]);
        ad_program_free(program);
        ad_tape_free(tape);
        assert_int_equal(phys_hessian_new(&h, &system_of_it, rule, SLICES, 0.37, NULL, &error),
                         AD_OK);
        phys_hessian_at(&h, path, 0);
        elements = phys_hessian_size(&h);
        assert_in_range(elements, 1, MOST);
        memcpy(element[u], h.element, elements * sizeof(double));
        phys_hessian_free(&h);
    }
    for (size_t i = 0; i < LENGTH(path); i++)
        assert_close(gradient[0][i], gradient[1][i], 1e-13, 1e-14);
    for (size_t i = 0; i < elements; i++)
        assert_close(element[0][i], element[1][i], 1e-13, 1e-14);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_action)};
    return cmocka_run_group_tests_name("a loop in a Lagrangian", tests, NULL, NULL);
}
