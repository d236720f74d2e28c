/* A number of a CSV file is copied at most twice on its way to a batch: column, samples, batch. The
   linker redirects the library's allocations, and every place a marked number stood in is counted
   where its memory is freed (tests/alloc.h). */
#include "datasets.h"
#include "tests/alloc.h"
#include "tests/close.h"
#include "autodiff/free.h"
#include "hnn/train/train.h"

#include <stdio.h>
#include <stdlib.h>

enum { ROWS = 1000 };

static const double marked = 1.2345678901234567;

/* Rows of which every 7th lacks a value; the row after them has the number, as q. */
static struct path write_rows(bool missing)
{
    static char text[ROWS * 32];
    char *p = text + sprintf(text, "q,p,dqdt,dpdt\n");
    for (int k = 0; k < ROWS; k++)
        p += sprintf(p, missing && k % 7 == 0 ? ",1,1,%d\n" : "%d,2,3,1\n", k % 9);
    sprintf(p, "%.17g,2,3,4\n", marked);
    return files_write_text("copies.csv", text);
}

/* Places of the number from the file to a batch of all samples in a drawn order. */
static size_t places(bool missing)
{
    struct path file = write_rows(missing);
    struct hnn_dataset_settings how = {
        .size = sizeof how, .file = file.text, .skip_missing = missing};
    struct hnn_training training = hnn_training_defaults();
    struct ad_error error = {0};
    struct hnn_data samples;
    alloc = (struct alloc){.marked = marked};
    struct hnn_dataset data = dataset_of(&how);
    const size_t n = data.train.n;
    assert_int_equal(data.missing, missing ? (ROWS + 6) / 7 : 0);
    assert_int_equal(n, ROWS + 1 - data.missing);
    assert_int_equal(hnn_data_new(&samples, AD_F64, &training, &data.train, NULL, 2, 2, &error),
                     AD_OK);
    assert_int_equal(hnn_data_shuffle(&samples, 3, &error), AD_OK);
    uint32_t *drawn = malloc(n * sizeof *drawn);
    double *x = malloc(2 * n * sizeof *x), *target = malloc(2 * n * sizeof *target);
    hnn_data_draw(&samples, n, drawn);
    hnn_data_copy(&samples, drawn, 0, n, n, x, target);
    AD_FREE(drawn, x, target);
    hnn_data_free(&samples);
    hnn_dataset_free(&data);
    alloc.marked = 0;
    return alloc.places;
}

static void test_copies(void **state)
{
    (void)state;
    assert_int_equal(places(false), 3);
    assert_int_equal(places(true), 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_copies)};
    return cmocka_run_group_tests_name("copies", tests, files_setup, files_teardown);
}
