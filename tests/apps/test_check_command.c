/* leastaction check, on scenes of a user and on those built in. */
#include "tests/close.h"
#include "shell.h"
#include "tests/mentions.h"

#include <string.h>

static void build_scene(const char *name)
{
    shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT $ROOT/tests/apps/scenes/%s.c -o %s.so",
                name, name);
}

static void test_check(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int status;
        const char *says;
    } cases[] = {
        {"good", 0, "locality ok"}, {"nonlocal", 1, "FAILED slice 0 x1 1"},
        {"jump", 1, "x1 slice 0"},  {"nonfinite", 1, "log \"depth\""},
        {"magnetic", 1, "v y1"}, /* F6 */
        {"shape", 2, ""},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        build_scene(cases[k].name);
        assert_int_equal(shell("$LA check ./%s.so", cases[k].name), cases[k].status);
        assert_mentions(shell_out(), cases[k].says);
        assert_int_equal(shell("$LA check %s.so --json", cases[k].name), cases[k].status);
        if (cases[k].status < 2)
            assert_non_null(strstr(shell_last_line(),
                                   cases[k].status ? "\"passed\": false" : "\"passed\": true"));
    }
    assert_mentions(shell_err(), "leastaction check: mass Lagrangian 1 x 11");
    shell_works("$LA path good.so --solver adam --steps 5 --json");
    assert_non_null(strstr(shell_last_line(), "\"scene\": \"mass\""));
}

/* The kink is far from all slices: no difference sees it. */
static void test_kinks(void **state)
{
    (void)state;
    static const struct {
        const char *V, *kink;
    } cases[] = {
        {"ad_abs(ad_sub(x, 100))", "\"kink\": \"abs,"},
        {"ad_max(x, 100)", "\"kink\": \"abs,"},
        {"ad_sqrt(ad_square(ad_sub(x, 7)))", "root of a square\""},
        {"ad_square(x)", "\"kink\": null"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        shell_works("${CC:-cc} -std=c11 -shared -fPIC -I$ROOT '-DV(x)=%s' "
                    "$ROOT/tests/apps/scenes/kink.c -o k.so && $LA check ./k.so --json",
                    cases[k].V);
        assert_non_null(strstr(shell_last_line(), cases[k].kink));
    }
}

static void test_check_built_in(void **state)
{
    (void)state;
    static const char *const names[] = {"freebody",  "pendulum", "dblpend", "threebody",
                                        "ephemeris", "spring",   "kepler"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        shell_works("$LA check %s", names[k]);
    shell_works("$LA check gas --set bodies=9");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_check, shell_empty),
        cmocka_unit_test_teardown(test_kinks, shell_empty),
        cmocka_unit_test_teardown(test_check_built_in, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
