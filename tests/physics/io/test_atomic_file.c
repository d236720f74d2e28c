/* Temporary files of threads that begin and clean at once: a file that begin has returned is never
   taken for left over by another. */
#include "physics/io/atomic_file.h"
#include "tests/close.h"

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { THREADS = 4, TIMES = 800 };

static char target[64];

/* Returns the number of files that were lost after begin, as a pointer. */
static void *begin_often(void *unused)
{
    size_t lost = 0;
    (void)unused;
    for (int i = 0; i < TIMES; i++) {
        struct phys_atomic_file file;
        struct ad_error error = {0};
        if (phys_atomic_file_begin(&file, target, &error) != AD_OK) {
            lost++;
            continue;
        }
        sched_yield();
        lost += access(file.temporary, F_OK) != 0;
        phys_atomic_file_abandon(&file);
    }
    return (void *)lost;
}

static void test_begin_at_once(void **state)
{
    (void)state;
    char folder[] = "/tmp/leastaction-XXXXXX";
    pthread_t threads[THREADS];
    size_t lost = 0;
    assert_non_null(mkdtemp(folder));
    snprintf(target, sizeof target, "%s/run.csv", folder);
    for (int k = 0; k < THREADS; k++)
        assert_int_equal(pthread_create(&threads[k], NULL, begin_often, NULL), 0);
    for (int k = 0; k < THREADS; k++) {
        void *result;
        pthread_join(threads[k], &result);
        lost += (size_t)result;
    }
    assert_int_equal(lost, 0);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_begin_at_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
