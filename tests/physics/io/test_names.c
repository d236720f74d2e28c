/* Nearest names: typing errors are recognised, other words are not. */
#include "physics/physics.h"
#include "tests/close.h"

#include <string.h>

static const char *const scenes[] = {"freebody", "pendulum",  "dblpend", "threebody",
                                     "gas",      "ephemeris", "spring",  "kepler"};

static void test_slips(void **state)
{
    (void)state;
    static const struct {
        const char *typed, *meant; /* NULL: nothing near */
    } cases[] = {
        {"pendulum", "pendulum"},
        {"pendelum", "pendulum"},
        {"pednulum", "pendulum"},
        {"PENDULUM", "pendulum"},
        {"pendulm", "pendulum"},
        {"dblepnd", "dblpend"},
        {"threbody", "threebody"},
        {"gass", "gas"},
        {"ags", "gas"},
        {"epheremis", "ephemeris"},
        {"sprnig", "spring"},
        {"keppler", "kepler"},
        {"quantum", NULL},
        {"x", NULL},
        {"", NULL},
        {"zzzzzzzz", NULL},
        {"of", NULL},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const char *found = phys_nearest(cases[k].typed, sizeof scenes / sizeof *scenes, scenes);
        if (!found || !cases[k].meant)
            assert_ptr_equal(found, cases[k].meant);
        else
            assert_string_equal(found, cases[k].meant);
    }
    assert_null(phys_nearest("gas", 0, NULL));
}

/* The first of two equally near; a swap counts as one slip. */
static void test_choice(void **state)
{
    (void)state;
    static const char *const names[] = {"m1", "m2", "l1", "l2"};
    assert_string_equal(phys_nearest("m3", 4, names), "m1");
    assert_string_equal(phys_nearest("2l", 4, names), "l2");
}

static void test_long_names(void **state)
{
    (void)state;
    char wide[300];
    memset(wide, 'a', sizeof wide);
    wide[299] = '\0';
    const char *const names[] = {wide, wide + 236}; /* 299 and 63 characters */
    assert_null(phys_nearest(wide, 2, names));
    assert_ptr_equal(phys_nearest(wide + 237, 2, names), wide + 236);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slips),
        cmocka_unit_test(test_choice),
        cmocka_unit_test(test_long_names),
    };
    return cmocka_run_group_tests_name("nearest", tests, NULL, NULL);
}
