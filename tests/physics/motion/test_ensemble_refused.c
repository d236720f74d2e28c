/* Ensembles that are refused: columns, numbers and methods. */
#include "tests/physics/systems.h"
#include "tests/close.h"
#include "physics/motion/ensemble.h"

#include <string.h>

static void test_refusals(void **state)
{
    (void)state;
    const struct {
        const char *names[2];
        double values[4];
        const char *integrator, *word;
    } cases[] = {{{"a", "a"}, {0}, NULL, "twice"},
                 {{"a", "aa"}, {0}, NULL, "'aa'"},
                 {{"a", "v_c"}, {0}, NULL, "'v_c'"},
                 {{"a", "m11"}, {0}, NULL, "m1 to m2"},
                 {{"a", "l1"}, {0, 1, 0, (double)INFINITY}, NULL, "row 2"},
                 {{"a", "b"}, {0, 0, (double)NAN, 0}, NULL, "row 2"},
                 {{"a", "b"}, {0}, "rk4", "rk4"}};
    struct phys_system system = system_opened("dblpend");
    for (size_t i = 0; i < LENGTH(cases); i++) {
        struct phys_ensemble e;
        struct ad_error error = {0};
        struct phys_motion_settings motion = {.size = sizeof motion, .time = 1};
        struct phys_ensemble_settings settings = {.size = sizeof settings,
                                                  .n = 2,
                                                  .n_columns = 2,
                                                  .names = cases[i].names,
                                                  .values = cases[i].values,
                                                  .motion = &motion};
        if (cases[i].integrator)
            motion.integrator = phys_integrator_find(cases[i].integrator, &error);
        assert_int_equal(phys_ensemble_solve(&system, &settings, &e, &error), AD_E_ARGUMENT);
        if (!strstr(error.message, cases[i].word))
            fail_msg("%s", error.message);
        phys_ensemble_free(&e);
    }
    phys_system_close(&system);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
