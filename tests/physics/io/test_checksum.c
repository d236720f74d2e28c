/* Seals: a run file with any byte changed, added or missing is refused before HDF5 reads it; files
   without a seal pass. */
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/checksum.h"

#include <stdlib.h>

static struct path sealed(void)
{
    struct path file = files_temporary("sealed.h5");
    struct ad_error error = {0};
    phys_hdf5 *run;
    assert_int_equal(phys_hdf5_create(file.text, &run, &error), AD_OK);
    phys_hdf5_text(run, "/", "scene", "pendulum");
    phys_hdf5_write(run, "x", AD_F64, 1, (size_t[]){3}, (double[]){1.5, -2.25, 1e-300});
    assert_int_equal(phys_hdf5_commit(run, &error), AD_OK);
    return file;
}

static enum ad_status opened(const char *file, struct ad_error *error)
{
    phys_hdf5 *run;
    *error = (struct ad_error){0};
    phys_hdf5_open(file, &run, error);
    phys_hdf5_close(run);
    return error->status;
}

static void expect_damaged(const char *bytes, size_t size)
{
    struct ad_error error;
    struct path file = files_write("changed.h5", bytes, size);
    assert_int_equal(opened(file.text, &error), AD_E_INPUT);
    assert_mentions(error.message, "changed.h5 damaged");
}

static void test_every_byte(void **state)
{
    (void)state;
    size_t size;
    struct ad_error error;
    struct path file = sealed();
    char *bytes = files_read(file.text, &size);
    assert_int_equal(opened(file.text, &error), AD_OK);
    for (size_t at = PHYS_CHECKSUM_BYTES; at < size; at += 1 + at % 7) {
        bytes[at] ^= 4;
        expect_damaged(bytes, size);
        bytes[at] ^= 4;
    }
    expect_damaged(bytes, size - 1);
    expect_damaged(bytes, PHYS_CHECKSUM_BYTES);
    expect_damaged(bytes, 100);
    bytes[40] ^= 1; /* in the seal itself */
    expect_damaged(bytes, size);
    free(bytes);
}

static void test_without_seal(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct path text = files_write_text("plain.txt", "leastaction, not sealed");
    assert_int_equal(phys_checksum_check(text.text, "plain", &error), AD_OK);
    assert_int_equal(phys_checksum_check("/nonexistent/file", "none", &error), AD_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_byte),
                                       cmocka_unit_test(test_without_seal)};
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
