/* A failing allocation while a data set is read or made gives a status, never a crash. The linker
   redirects the library's allocations here; leaks are found by the sanitizers. */
#include "hnn/data/data.h"
#include "physics/io/hdf5_file.h"
#include "tests/alloc.h"
#include "tests/close.h"
#include "tests/files.h"

#include <stdlib.h>
#include <string.h>

/* Runs a job with every allocation failing in turn; some it can do without. */
static void assert_survives(enum ad_status (*job)(const char *file, struct ad_error *error),
                            const char *file, size_t at_least)
{
    size_t refused = 0;
    struct ad_error none = {0};
    alloc.calls = 0;
    assert_int_equal(job(file, &none), AD_OK);
    for (size_t k = 1, all = alloc.calls; k <= all; k++) {
        struct ad_error error = {0};
        alloc = (struct alloc){.failing = k};
        enum ad_status status = job(file, &error);
        alloc.failing = 0;
        if (status != AD_OK && (status != AD_E_MEMORY || !strstr(error.message, "memory")))
            fail_msg("allocation %zu: status %d, '%s'", k, status, error.message);
        refused += status != AD_OK;
    }
    assert_true(refused > at_least);
}

static enum ad_status read_text(const char *file, struct ad_error *error)
{
    struct hnn_dataset d;
    struct hnn_dataset_settings s = {.size = sizeof s,
                                     .file = file,
                                     .state = "o,v",
                                     .time = "t",
                                     .test_fraction = 0.4,
                                     .split = HNN_SPLIT_TRIAL,
                                     .rollout = 2};
    hnn_dataset_read(&s, &d, error);
    hnn_dataset_free(&d);
    return error->status;
}

static void test_text(void **state)
{
    (void)state;
    struct path file = files_write_text(
        "text.txt", "# names\n%o v\n1 0 1 2\n1 1 2 3\n1 2 1 1\n2 0 1 1\n2 1 1 1\n2 2 3 1\n");
    assert_survives(read_text, file.text, 20);
}

static enum ad_status read_hdf5(const char *file, struct ad_error *error)
{
    struct hnn_dataset d;
    struct hnn_dataset_settings s = {.size = sizeof s, .file = file, .test_file = file};
    hnn_dataset_read(&s, &d, error);
    hnn_dataset_free(&d);
    return error->status;
}

static void test_hdf5(void **state)
{
    (void)state;
    static const char *const names[] = {"dpdt", "dqdt", "p", "q"};
    double values[5] = {1, 2, 4, 8, 16};
    struct path file = files_temporary("columns.h5");
    struct ad_error error = {0};
    phys_hdf5 *out;
    assert_int_equal(phys_hdf5_create(file.text, &out, &error), AD_OK);
    for (size_t k = 0; k < 4; k++)
        phys_hdf5_write(out, names[k], AD_F64, 1, (size_t[]){5}, values);
    phys_hdf5_write(out, "all", AD_F64, 2, (size_t[]){1, 5}, values);
    phys_hdf5_text(out, "all", "axes", "coordinate, sample");
    phys_hdf5_text(out, "/", "columns", "q,p,dqdt,dpdt");
    assert_int_equal(phys_hdf5_commit(out, &error), AD_OK);
    assert_survives(read_hdf5, file.text, 30);
}

/* Bytes held at most while four columns are read of so many. */
static long most_held(size_t columns, size_t rows)
{
    char *text = malloc(2 * rows * columns), *p = text;
    assert_non_null(text);
    for (size_t k = 0; k < rows * columns; k++) {
        *p++ = (char)('1' + k % 9);
        *p++ = k % columns == columns - 1 ? '\n' : ',';
    }
    struct path file = files_write("columns.csv", text, (size_t)(p - text));
    free(text);
    struct hnn_dataset d;
    struct hnn_dataset_settings s = {
        .size = sizeof s, .file = file.text, .state = "1,3", .rate = "2,4"};
    struct ad_error error = {0};
    alloc = (struct alloc){0};
    assert_int_equal(hnn_dataset_read(&s, &d, &error), AD_OK);
    assert_int_equal(d.train.n, rows);
    hnn_dataset_free(&d);
    assert_true(alloc.held == 0);
    return alloc.most;
}

/* Columns that are not chosen are read past: they cost their place in the table of columns. */
static void test_chosen_columns(void **state)
{
    (void)state;
    enum { ROWS = 50000, MORE = 36 };
    long column = ROWS * (long)sizeof(double), few = most_held(4, ROWS),
         many = most_held(4 + MORE, ROWS);
    assert_true(few > 4 * column);
    assert_in_range(labs(many - few), 0, MORE * 64);
}

static enum ad_status observe(const char *task, struct ad_error *error)
{
    struct hnn_observations o;
    struct hnn_sampling s = hnn_task_find(task, error)->published;
    s.trials = s.points = 2;
    hnn_task_observe(hnn_task_find(task, error), &s, 1, &o, error);
    hnn_observations_free(&o);
    return error->status;
}

static void test_tasks(void **state)
{
    (void)state;
    assert_survives(observe, "spring", 10);
    assert_survives(observe, "threebody", 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_text),
        cmocka_unit_test(test_hdf5),
        cmocka_unit_test(test_chosen_columns),
        cmocka_unit_test(test_tasks),
    };
    return cmocka_run_group_tests_name("failing allocations", tests, files_setup, files_teardown);
}
