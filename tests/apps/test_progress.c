/* C12: without a terminal a run prints a progress line from time to time, and none with --quiet. */
#include "apps/output/progress.h"
#include "tests/close.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* What a run of three steps, all of them due, prints to a standard error that is a file. */
static void print(bool quiet, char *text, size_t size)
{
    FILE *file = tmpfile();
    int before = dup(STDERR_FILENO);
    struct progress progress;
    assert_non_null(file);
    dup2(fileno(file), STDERR_FILENO);
    progress_start(&progress, quiet, NULL);
    for (int k = 1; k <= 3; k++) {
        if (progress_due(&progress)) /* not for a minute */
            progress_line(&progress, 0, 0, "early");
        double next = progress.next;
        progress.next = 0;
        if (progress_due(&progress))
            progress_line(&progress, 0, 0, "step %d", k);
        assert_true(quiet || progress.next > next - 1);
    }
    progress_end(&progress);
    dup2(before, STDERR_FILENO);
    close(before);
    rewind(file);
    text[fread(text, 1, size - 1, file)] = 0;
    fclose(file);
}

static void test_lines(void **state)
{
    char text[200];
    (void)state;
    print(false, text, sizeof text);
    assert_string_equal(text, "leastaction: step 1\nleastaction: step 2\nleastaction: step 3\n");
}

/* The rate counts from where a resumed run began. */
static void test_rate(void **state)
{
    char text[200] = "";
    FILE *file = tmpfile();
    int before = dup(STDERR_FILENO);
    struct progress progress;
    (void)state;
    assert_non_null(file);
    dup2(fileno(file), STDERR_FILENO);
    progress_start(&progress, false, NULL);
    progress.next = 0;
    progress.started -= 100;
    progress.from = 1000;
    progress_line(&progress, 1200, 1320, "step");
    progress.next = 0;
    progress_line(&progress, 1200, 2200, "step");
    progress.next = 0;
    progress_line(&progress, 1200, 201200, "step");
    progress.next = 0;
    progress_line(&progress, 1200, 0, "step");
    dup2(before, STDERR_FILENO);
    close(before);
    rewind(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    assert_string_equal(text, "leastaction: step, 2/s, 60 s left\n"
                              "leastaction: step, 2/s, 8 min left\n"
                              "leastaction: step, 2/s, 27.8 h left\n"
                              "leastaction: step, 2/s\n");
}

/* Rows of a log, whether lines are shown or not. */
static void test_log(void **state)
{
    char name[] = "/tmp/progressXXXXXX", text[200] = "";
    struct progress progress;
    double seconds, left;
    (void)state;
    int file = mkstemp(name);
    assert_true(file >= 0 && progress_log_begin(name));
    progress_start(&progress, true, name);
    progress.started -= 100;
    assert_true(progress_due(&progress));
    progress_line(&progress, 50, 200, "step");
    assert_false(progress_due(&progress)); /* not at once again */
    progress.next_row = 0;
    progress_line(&progress, 60, 0, "step");
    progress_end(&progress);
    assert_true(read(file, text, sizeof text - 1) > 0);
    close(file);
    remove(name);
    const char *row = strchr(text, '\n') + 1;
    assert_memory_equal(text, "seconds,done,total,seconds_left\n", 32);
    assert_int_equal(sscanf(row, "%lf,50,200,%lf", &seconds, &left), 2);
    assert_close(seconds, 100, 0.01, 0);
    assert_close(left, 300, 0.01, 0);
    assert_true(strstr(row, ",60,,\n"));
    assert_false(progress_log_begin("/nowhere/at/all"));
}

static void test_quiet(void **state)
{
    char text[200];
    (void)state;
    print(true, text, sizeof text);
    assert_string_equal(text, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lines), cmocka_unit_test(test_rate),
                                       cmocka_unit_test(test_log), cmocka_unit_test(test_quiet)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
