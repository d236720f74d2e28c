/* Checksums: a run file with any byte changed, added or missing is refused before HDF5 reads it;
   files without a checksum pass. And the names under which such files are written. */
#define _GNU_SOURCE
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "physics/io/atomic_file.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/checksum.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/syscall.h>
#include <unistd.h>

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

/* In place of the kernel's, where `scripted`: the numbers to come, then an error. */
static bool scripted;
static unsigned char drawn[4];
static size_t n_drawn;

ssize_t getrandom(void *buffer, size_t size, unsigned flags)
{
    if (!scripted)
        return syscall(SYS_getrandom, buffer, size, flags);
    if (n_drawn == 0) {
        errno = ENOSYS;
        return -1;
    }
    memset(buffer, drawn[--n_drawn], size);
    return (ssize_t)size;
}

/* E2: a name that is taken is drawn again, and no name is made without a random number. */
static void test_temporary_names(void **state)
{
    (void)state;
    struct path target = files_temporary("out.csv");
    struct phys_atomic_file file, other;
    struct ad_error error = {0};
    scripted = true;
    memcpy(drawn, (unsigned char[]){8, 7, 7, 7}, sizeof drawn);
    n_drawn = sizeof drawn;
    assert_int_equal(phys_atomic_file_begin(&file, target.text, &error), AD_OK);
    assert_non_null(strstr(file.temporary, "0707070707070707"));
    assert_int_equal(phys_atomic_file_begin(&other, target.text, &error), AD_OK);
    assert_non_null(strstr(other.temporary, "0808080808080808"));
    phys_atomic_file_abandon(&other);
    phys_atomic_file_abandon(&file);
    assert_int_equal(n_drawn, 0);
    assert_int_equal(phys_atomic_file_begin(&file, target.text, &error), AD_E_IO);
    assert_non_null(strstr(error.message, strerror(ENOSYS)));
    assert_null(file.target);
    scripted = false;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_every_byte),
                                       cmocka_unit_test(test_without_seal),
                                       cmocka_unit_test(test_temporary_names)};
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
