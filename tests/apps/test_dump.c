/* leastaction dump: what a file holds; files that lead to others. */
#include "tests/close.h"
#include "shell.h"
#include "physics/io/hdf5_file.h"
#include "tests/mentions.h"

#include <hdf5.h>
#include <stdio.h>
#include <string.h>

static void test_dump(void **state)
{
    (void)state;
    shell_works(
        "$LA path pendulum --solver adam --steps 2 --every 1 --slices 8 --out run.h5 --quiet");
    shell_works("$LA dump run.h5");
    assert_non_null(strstr(shell_out(), "\n    dt = 1 s\n"));
    assert_non_null(strstr(shell_out(), "\n/path  f64 [3 x 1 x 8]\n"));
    shell_works("$LA dump run.h5 --csv -");
    assert_non_null(strstr(shell_out(), "\n/path,,f64,3 x 1 x 8,\n"));
    shell_works("$LA dump run.h5 --json");
    assert_non_null(strstr(shell_last_line(), "\"object\": \"path\", \"kind\": \"f64\", \"shape\": "
                                              "[3, 1, 8], \"attributes\": {"));
    shell_works("$LA dump run.h5 --dataset step --csv step.csv && cat step.csv");
    assert_string_equal(shell_out(), "0\n1\n2\n");
    shell_works("$LA dump run.h5 --dataset step --json");
    assert_non_null(strstr(shell_out(), "\"values\": [0, 1, 2]}"));
    shell_works("$LA dump run.h5 --dataset path --csv - | cut -d, -f1,2,3");
    assert_non_null(strstr(shell_out(), "2,0,1.57079632"));
    assert_int_equal(shell("$LA dump run.h5 --dataset pth"), 2);
    assert_mentions(shell_err(), "'pth'");
}

/* More numbers than are read at once. */
static void test_dump_of_many(void **state)
{
    (void)state;
    shell_works("$LA simulate kepler --time 1 --samples 40000 --no-reference --quiet --out k.h5 "
                "--csv k.csv");
    shell_works("$LA dump k.h5 --dataset time --csv time.csv");
    shell_works("tail -n +2 k.csv | cut -d, -f1 | cmp - time.csv");
}

/* E5: a file that leads to another one is refused, and nothing of that one is said or written. */
static void test_dump_of_links(void **state)
{
    (void)state;
    static const char *const lines[] = {"dump out.h5", "dump out.h5 --json",
                                        "dump out.h5 --dataset q --csv q.csv",
                                        "train out.h5 --state q,q --steps 1 --out m.h5",
                                        "rollout out.h5 --time 1 --x0 1,0 --csv q.csv"};
    const double other[] = {1234.5, 1234.5};
    const hsize_t two = 2;
    for (int storage = 0; storage < 2; storage++) {
        FILE *bytes = fopen(shell_path("other.bin"), "wb");
        assert_true(bytes && fwrite(other, sizeof *other, 2, bytes) == 2 && fclose(bytes) == 0);
        hid_t second = H5Fcreate(shell_path("other.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        hid_t space = H5Screate_simple(1, &two, NULL), how = H5Pcreate(H5P_DATASET_CREATE);
        hid_t q = H5Dcreate2(second, "q", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, how, H5P_DEFAULT);
        H5Dwrite(q, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, other);
        H5Dclose(q);
        H5Fclose(second);
        hid_t file = H5Fcreate(shell_path("out.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        if (storage) {
            H5Pset_external(how, shell_path("other.bin"), 0, sizeof other);
            H5Dclose(
                H5Dcreate2(file, "q", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, how, H5P_DEFAULT));
        } else {
            H5Lcreate_external("other.h5", "/q", file, "q", H5P_DEFAULT, H5P_DEFAULT);
        }
        H5Pclose(how);
        H5Sclose(space);
        H5Fclose(file);
        for (size_t k = 0; k < LENGTH(lines); k++) {
            assert_int_equal(shell("$LA %s", lines[k]), 2);
            assert_mentions(shell_err(), storage ? "'q'" : "'/q'");
            assert_null(strstr(shell_out(), "1234.5"));
            assert_null(strstr(shell_err(), "1234.5"));
            shell_works("! ls q.csv m.h5 2>/dev/null");
        }
        shell_clean();
    }
}

/* A heap of texts that says one of them is longer than the heap: HDF5 reads on past the end of its
   memory. A later file says so, too, and no temporary file stays. */
static void test_crash_of_hdf5(void **state)
{
    (void)state;
    if (SANITIZED)
        skip(); /* which stop at the read, before the crash */
    static const char *const lines[] = {"dump d.h5",
                                        "dump d.h5 --json --csv a.csv",
                                        "rollout d.h5 --time 1 --x0 1,0 --out a.h5",
                                        "train d.h5 --state q,p --steps 1 --out a.h5",
                                        "field d.h5",
                                        "path pendulum --init d.h5"};
    const char *text = "a text";
    const uint64_t size = (uint64_t)1 << 27;
    hid_t file = H5Fcreate(shell_path("d.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t type = H5Tcopy(H5T_C_S1), one = H5Screate(H5S_SCALAR);
    H5Tset_size(type, H5T_VARIABLE);
    hid_t id = H5Acreate2(file, "format", type, one, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(id, type, &text);
    H5Aclose(id);
    H5Fclose(file);
    FILE *bytes = fopen(shell_path("d.h5"), "r+b");
    static char all[1 << 16];
    assert_non_null(bytes);
    size_t n = fread(all, 1, sizeof all, bytes);
    size_t heap = 0;
    while (heap < n && memcmp(all + heap, "GCOL", 4) != 0)
        heap += 8;
    assert_int_equal(fseek(bytes, (long)heap + 24, SEEK_SET), 0); /* size of its first object */
    assert_true(fwrite(&size, sizeof size, 1, bytes) == 1 && fclose(bytes) == 0);
    for (size_t k = 0; k < sizeof lines / sizeof *lines; k++) {
        int status = shell("$LA %s", lines[k]);
        if (status != 2 || !mentions(shell_err(), "d.h5"))
            fail_msg("%s: status %d, %s", lines[k], status, shell_err());
        assert_int_equal(shell_files(), 1);
    }
    H5Tclose(type);
    H5Sclose(one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_dump, shell_empty),
        cmocka_unit_test_teardown(test_dump_of_many, shell_empty),
        cmocka_unit_test_teardown(test_dump_of_links, shell_empty),
        cmocka_unit_test_teardown(test_crash_of_hdf5, shell_empty),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
