/* Multiple shooting: the nodes it takes on a path, and the sizes by which it controls errors. */
#include "physics/path/shooting.h"
#include "tests/physics/systems.h"
#include "tests/close.h"

enum { SLICES = 41 };

static void begin(struct phys_shooting *s, struct phys_system *system, double time,
                  const double *path)
{
    struct ad_error error = {0};
    struct phys_path_settings settings = phys_path_defaults(system);
    settings.slices = SLICES;
    settings.dt = time / (SLICES - 1);
    assert_true(phys_shooting_new(s, system, &settings, path, &error));
}

/* Thrown upwards the body is fastest at the start, let fall at the end. At rest its size is one,
   and its velocity's that per segment. */
static void sizes_are_the_largest_on_the_path(void **state)
{
    static const struct {
        double v0, time, size[2];
    } cases[] = {{8, 10, {32, 8}}, {0, 4, {8, 4}}, {2, 4, {2, 2}}, {0, 0, {1, 0}}};
    (void)state;
    for (size_t c = 0; c < LENGTH(cases); c++) {
        struct phys_system system = system_opened("freebody");
        struct phys_shooting s;
        double path[SLICES], time = cases[c].time > 0 ? cases[c].time : 3;
        for (size_t i = 0; i < SLICES; i++) {
            double t = time * (double)i / (SLICES - 1);
            path[i] = cases[c].time > 0 ? 5 + t * (cases[c].v0 - 0.5 * t) : 5;
        }
        begin(&s, &system, time, path);
        print_message("%zu segments, sizes %g %g\n", s.n, s.size[0], s.size[1]);
        assert_close(s.size[0], cases[c].size[0], 0.03, 0);
        assert_close(s.size[1], cases[c].time > 0 ? cases[c].size[1] : (double)s.n / time, 1e-9, 0);
        phys_shooting_free(&s);
        phys_system_close(&system);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_are_the_largest_on_the_path),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
