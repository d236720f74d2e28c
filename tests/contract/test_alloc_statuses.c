/* What a function returns is the status of its error, wherever an allocation fails in it or L has
   no value, and it leaves no memory behind. The linker redirects the library's allocations here. */
#include "jobs.h"
#include "tests/alloc.h"
#include "tests/close.h"

#include <string.h>

static void what_is_returned_is_the_error(void **state)
{
    (void)state;
    for (const struct job *job = jobs; job->name; job++) {
        struct ad_error error = {0};
        alloc.calls = 0;
        if (job->run(&error) != AD_OK || error.status != AD_OK)
            fail_msg("%s: %s", job->name, error.message);
        const size_t all = alloc.calls, tried = job->tried;
        const size_t step = (all + tried - 1) / tried;
        size_t refused = 0;
        for (size_t k = 1; k <= all; k += step) {
            error = (struct ad_error){0};
            const size_t taken = alloc.taken, given = alloc.given;
            alloc.calls = 0;
            alloc.failing = k;
            const enum ad_status status = job->run(&error);
            alloc.failing = 0;
            refused += status != AD_OK;
            if (status != error.status || (status != AD_OK && !strstr(error.message, "memory")))
                fail_msg("%s: allocation %zu: returned %d, the error is %d: %s", job->name, k,
                         status, error.status, error.message);
            const size_t blocks = alloc.given - given, back = alloc.taken - taken;
            if (blocks > back) /* names of files come from libc: more may go back */
                fail_msg("%s: allocation %zu: %zu blocks are lost", job->name, k, blocks - back);
        }
        print_message("%s: %zu allocations, step %zu, %zu refused\n", job->name, all, step,
                      refused);
        assert_true(refused > 0);
    }
}

/* ... and where L has no values: at the centre. */
static void at_the_centre_too(void **state)
{
    size_t refused = 0;
    (void)state;
    jobs_to_the_centre();
    for (const struct job *job = jobs; job->name; job++) {
        struct ad_error error = {0};
        const enum ad_status status = job->run(&error);
        if (status != error.status)
            fail_msg("%s: returned %d, the error is %d: %s", job->name, status, error.status,
                     error.message);
        refused += status != AD_OK;
    }
    print_message("%zu refused\n", refused);
    assert_true(refused > 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_returned_is_the_error),
                                       cmocka_unit_test(at_the_centre_too)};
    return cmocka_run_group_tests(tests, jobs_open, jobs_close);
}
