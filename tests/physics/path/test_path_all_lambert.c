/* All fourteen of Lambert's motions in a time of up to six turns, by a search that is as long as
   searches get (make test-long). */
#include "tests/close.h"
#include "tests/physics/path/lambert.h"
#include "tests/physics/published.h"
#include "tests/physics/systems.h"

#include <math.h>
#include <stdlib.h>

enum { SLICES = 201, DEGREE = 4 };

static void fourteen_motions(void **state)
{
    static double path[DEGREE * 2 * SLICES];
    const double time = 26, apart = hypot(1.5, 1.2);
    double energy[LAMBERT_MOST];
    struct phys_system kepler = system_opened("kepler");
    struct phys_solutions all;
    struct ad_error error = {0};
    const struct phys_path_settings settings = {.size = sizeof settings,
                                                .rule = phys_rule_find("gauss4", &error),
                                                .slices = SLICES,
                                                .dt = time / (SLICES - 1),
                                                .learning_rate = 1};
    (void)state;
    if (getenv("FUZZ_SHARE")) /* under sanitizers it takes minutes */
        skip();
    for (size_t i = 0; i < SLICES; i++) {
        path[i] = 1 - 1.5 * (double)i / (SLICES - 1);
        path[SLICES + i] = 1.2 * (double)i / (SLICES - 1);
    }
    phys_rule_interpolate(settings.rule, 2, SLICES, path);
    const size_t n = lambert_energies((1 + 1.3 + apart) / 2, apart, time, energy);
    assert_int_equal(n, 14);
    phys_path_all(&kepler, &settings, path, 1, 1, &all, &error);
    assert_no_error(&error);
    print_message("%zu motions, %.3g undecided\n", all.n, all.undecided);
    assert_int_equal(all.n, n);
    for (size_t k = 0; k < n; k++) {
        double least = (double)INFINITY;
        for (size_t i = 0; i < n; i++)
            least = fmin(least, fabs(all.solution[i].energy - energy[k]));
        assert_close(least, 0, 0, 1e-6);
    }
    assert_true(!all.saturated || all.undecided <= 1e-3);
    phys_solutions_free(&all);
    phys_system_close(&kepler);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(fourteen_motions)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
