/* G8: structs of callers with fewer or more fields than this library has. */
#include "autodiff/sized.h"
#include "tests/mentions.h"

#include <stdio.h>
#include <stdlib.h>

struct old {
    size_t size;
    double a;
};
struct now {
    size_t size;
    double a, b;
};
struct later {
    size_t size;
    double a, b, c;
};

static enum ad_status use(const struct now *given, struct now *seen, struct ad_error *error)
{
    AD_OWN(now, given, a, error);
    *seen = *given;
    return AD_OK;
}

static void fields_that_a_caller_lacks_are_0(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct now seen = {0};
    struct old *old = malloc(sizeof *old); /* no byte more, for AddressSanitizer */
    assert_non_null(old);
    *old = (struct old){.size = sizeof *old, .a = 3};
    assert_int_equal(use((const struct now *)(const void *)old, &seen, &error), AD_OK);
    assert_true(seen.size == sizeof seen && seen.a == 3 && seen.b == 0);
    struct now defaults = {.a = 5, .b = 6};
    ad_give(old, &defaults, sizeof defaults);
    assert_true(old->size == sizeof *old && old->a == 5);
    free(old);
}

static void fields_that_the_library_lacks_are_refused_unless_0(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct now seen = {0};
    struct later later = {.size = sizeof later, .a = 1, .b = 2};
    assert_int_equal(use((const struct now *)(const void *)&later, &seen, &error), AD_OK);
    assert_true(seen.a == 1 && seen.b == 2 && seen.size == sizeof seen);
    later.c = 1;
    assert_int_equal(use((const struct now *)(const void *)&later, &seen, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "use given 32 24");
    ad_give(&(struct later){.size = sizeof later}, &(struct now){.a = 1}, sizeof(struct now));
}

static void sizes_that_cannot_be_are_refused(void **state)
{
    (void)state;
    static const size_t sizes[] = {0, 8, 15, SIZE_MAX, (size_t)1 << 40};
    struct now given = {.a = 1}, seen = {0};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        struct ad_error error = {0};
        given.size = sizes[k];
        assert_int_equal(use(&given, &seen, &error), AD_E_ARGUMENT);
        assert_mentions(error.message, "use given sizeof 24");
    }
    struct ad_error error = {0};
    assert_int_equal(use(NULL, &seen, &error), AD_E_ARGUMENT);
    assert_mentions(error.message, "use given NULL");
}

static void versions_agree(void **state)
{
    (void)state;
    char text[32];
    snprintf(text, sizeof text, "%d.%d.%d", LEASTACTION_VERSION_MAJOR, LEASTACTION_VERSION_MINOR,
             LEASTACTION_VERSION_PATCH);
    assert_string_equal(text, LEASTACTION_VERSION);
    assert_string_equal(leastaction_version(), LEASTACTION_VERSION);
    assert_true(LEASTACTION_VERSION_NUMBER == LEASTACTION_VERSION_MAJOR * 10000 +
                                                  LEASTACTION_VERSION_MINOR * 100 +
                                                  LEASTACTION_VERSION_PATCH);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fields_that_a_caller_lacks_are_0),
        cmocka_unit_test(fields_that_the_library_lacks_are_refused_unless_0),
        cmocka_unit_test(sizes_that_cannot_be_are_refused),
        cmocka_unit_test(versions_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
