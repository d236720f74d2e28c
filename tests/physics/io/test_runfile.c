/* HDF5 files: what is written is read back, files are replaced atomically, and equal contents give
   equal bytes. */
#include "tests/close.h"
#include "tests/mentions.h"
#include "physics/io/hdf5_file.h"
#include "physics/io/hdf5_handles.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/leastaction-runfile-XXXXXX";
static char target[64];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(target, sizeof target, "%s/run.h5", folder);
    return 0;
}

/* Number of entries of the folder, hidden ones too; removes them. */
static size_t empty_folder(void)
{
    DIR *directory = opendir(folder);
    size_t n = 0;
    char name[512];
    for (struct dirent *entry; (entry = readdir(directory));)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            snprintf(name, sizeof name, "%s/%s", folder, entry->d_name);
            remove(name);
            n++;
        }
    closedir(directory);
    return n;
}

static int remove_folder(void **state)
{
    (void)state;
    empty_folder();
    return rmdir(folder);
}

static const double matrix[2][3] = {{1.1, -2.25e-17, 3e300}, {0.1 + 0.2, -0.0, 5}};
static const float singles[3] = {0.1f, -3.5e-30f, 7};

static phys_hdf5 *written(void)
{
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_create(target, &file, &error), AD_OK);
    phys_hdf5_text(file, "/", "scene", "Jupiter \xe2\x99\x83 'quoted'");
    phys_hdf5_number(file, "/", "dt", 1.0 / 3, "s");
    phys_hdf5_integer(file, "/", "seed", (int64_t)1 << 60, NULL);
    phys_hdf5_folder(file, "parameters");
    phys_hdf5_number(file, "parameters", "mass", 1.99e30, "kg");
    phys_hdf5_write(file, "deep/down/matrix", AD_F64, 2, (size_t[]){2, 3}, matrix);
    phys_hdf5_write(file, "singles", AD_F32, 1, (size_t[]){3}, singles);
    phys_hdf5_text(file, "singles", "unit", "m");
    phys_hdf5_extendable(file, "path", AD_F64, 3, (size_t[]){0, 2, 3});
    for (int k = 0; k < 5; k++) {
        double record[2][3];
        for (int i = 0; i < 6; i++)
            record[i / 3][i % 3] = matrix[i / 3][i % 3] * (k + 1);
        phys_hdf5_append(file, "path", record);
    }
    return file;
}

static void commit(phys_hdf5 *file)
{
    struct ad_error error = {0};
    assert_int_equal(phys_hdf5_commit(file, &error), AD_OK);
}

static phys_hdf5 *reopened(void)
{
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_open(target, &file, &error), AD_OK);
    return file;
}

static void test_round_trip(void **state)
{
    (void)state;
    struct ad_error error = {0};
    double values[6], number;
    char *text;
    commit(written());
    phys_hdf5 *file = reopened();
    assert_int_equal(phys_hdf5_read(file, "deep/down/matrix", 0, 2, values, &error), AD_OK);
    assert_memory_equal(values, matrix, sizeof matrix);
    assert_int_equal(phys_hdf5_read(file, "singles", 0, 3, values, &error), AD_OK);
    for (int k = 0; k < 3; k++)
        assert_true(values[k] == (double)singles[k]);
    assert_int_equal(phys_hdf5_read(file, "path", 3, 1, values, &error), AD_OK);
    for (int k = 0; k < 6; k++)
        assert_true(values[k] == 4 * matrix[k / 3][k % 3]);
    assert_int_equal(phys_hdf5_get(file, "/", "dt", &number, &error), AD_OK);
    assert_true(number == 1.0 / 3);
    assert_int_equal(phys_hdf5_get(file, "parameters", "mass", &number, &error), AD_OK);
    assert_true(number == 1.99e30);
    assert_int_equal(phys_hdf5_get_text(file, "parameters", "mass.unit", &text, &error), AD_OK);
    assert_string_equal(text, "kg");
    free(text);
    assert_int_equal(phys_hdf5_get_text(file, "/", "scene", &text, &error), AD_OK);
    assert_string_equal(text, "Jupiter \xe2\x99\x83 'quoted'");
    free(text);
    phys_hdf5_close(file);
    assert_int_equal(empty_folder(), 1);
}

static void write_item(void *context, const struct phys_hdf5_item *item)
{
    char **end = context;
    *end += sprintf(*end, "%s%s%s=%s", item->object, item->attribute ? "@" : "",
                    item->attribute ? item->attribute : "", phys_hdf5_kind_name(item->kind));
    for (size_t k = 0; k < item->rank; k++)
        *end += sprintf(*end, "[%zu]", item->dims[k]);
    *end += sprintf(*end, "\n");
}

static void test_list(void **state)
{
    (void)state;
    struct ad_error error = {0};
    char text[1024], *end = text;
    commit(written());
    phys_hdf5 *file = reopened();
    assert_int_equal(phys_hdf5_list(file, write_item, &end, &error), AD_OK);
    assert_string_equal(text, "=folder\n@dt=f64\n@dt.unit=text\n@scene=text\n@seed=integer\n"
                              "deep=folder\ndeep/down=folder\ndeep/down/matrix=f64[2][3]\n"
                              "parameters=folder\nparameters@mass=f64\nparameters@mass.unit=text\n"
                              "path=f64[5][2][3]\nsingles=f32[3]\nsingles@unit=text\n");
    phys_hdf5_close(file);
    empty_folder();
}

static char *contents(long *size)
{
    FILE *in = fopen(target, "rb");
    fseek(in, 0, SEEK_END);
    *size = ftell(in);
    rewind(in);
    char *bytes = malloc((size_t)*size);
    assert_int_equal(fread(bytes, 1, (size_t)*size, in), *size);
    fclose(in);
    return bytes;
}

static herr_t assert_timeless(hid_t object, const char *name, const H5O_info_t *info, void *data)
{
    (void)object, (void)data;
    if (info->atime || info->mtime || info->ctime || info->btime)
        fail_msg("%s has a time", name);
    return 0;
}

static void test_same_bytes(void **state)
{
    (void)state;
    long first_size, second_size;
    commit(written());
    char *first = contents(&first_size);
    hid_t file = H5Fopen(target, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_int_equal(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, assert_timeless, NULL), 0);
    H5Fclose(file);
    commit(written());
    char *second = contents(&second_size);
    assert_int_equal(first_size, second_size);
    assert_memory_equal(first, second, (size_t)first_size);
    free(first);
    free(second);
    empty_folder();
}

static void test_whole_or_not_at_all(void **state)
{
    (void)state;
    struct stat status;
    phys_hdf5 *file = written();
    assert_int_not_equal(stat(target, &status), 0);
    phys_hdf5_abandon(file);
    assert_int_equal(empty_folder(), 0);
    commit(written());
    phys_hdf5_abandon(written()); /* leaves the older file alone */
    phys_hdf5_close(reopened());
    assert_int_equal(empty_folder(), 1);
}

/* The first failure is kept and returned by commit, and no file appears. */
static void test_sticky_failure(void **state)
{
    (void)state;
    struct ad_error error = {0};
    phys_hdf5 *file = written();
    phys_hdf5_append(file, "nothing", matrix);
    phys_hdf5_write(file, "later", AD_F64, 2, (size_t[]){2, 3}, matrix);
    assert_int_equal(phys_hdf5_commit(file, &error), AD_E_IO);
    assert_mentions(error.message, target);
    assert_mentions(error.message, "'nothing'");
    assert_int_equal(empty_folder(), 0);
    assert_int_equal(phys_hdf5_commit(NULL, &error), AD_OK);
}

static void expect_unwritable(const char *name, const char *reason)
{
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_create(name, &file, &error), AD_E_IO);
    assert_null(file);
    assert_mentions(error.message, name);
    assert_mentions(error.message, reason);
}

static void test_unwritable(void **state)
{
    (void)state;
    char name[96];
    snprintf(name, sizeof name, "%s/no/such/run.h5", folder);
    expect_unwritable(name, "No such file or directory");
    expect_unwritable(folder, "it is a folder");
    expect_unwritable("/dev/null", "it is not a regular file");
    assert_int_equal(empty_folder(), 0);
}

/* A link stays a link; its file is replaced. */
static void test_symbolic_link(void **state)
{
    (void)state;
    struct ad_error error = {0};
    struct stat status;
    char link[96];
    phys_hdf5 *file;
    commit(written());
    snprintf(link, sizeof link, "%s/link.h5", folder);
    assert_int_equal(symlink(target, link), 0);
    assert_int_equal(phys_hdf5_create(link, &file, &error), AD_OK);
    phys_hdf5_number(file, "/", "new", 1, NULL);
    commit(file);
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    double value;
    file = reopened();
    assert_int_equal(phys_hdf5_get(file, "/", "new", &value, &error), AD_OK);
    phys_hdf5_close(file);
    assert_int_equal(empty_folder(), 2);
}

static void expect_unreadable(void)
{
    struct ad_error error = {0};
    phys_hdf5 *file;
    assert_int_equal(phys_hdf5_open(target, &file, &error), AD_E_INPUT);
    assert_null(file);
    assert_mentions(error.message, target);
}

static void test_unreadable(void **state)
{
    (void)state;
    expect_unreadable(); /* absent */
    FILE *out = fopen(target, "w");
    fputs("x,y\n1,2\n", out);
    fclose(out);
    expect_unreadable(); /* not HDF5 */
    long size;
    commit(written());
    free(contents(&size));
    assert_int_equal(truncate(target, size / 2), 0);
    expect_unreadable();
    empty_folder();
}

static void test_wrong_reads(void **state)
{
    (void)state;
    struct ad_error error = {0};
    double values[6];
    char *text;
    commit(written());
    phys_hdf5 *file = reopened();
    assert_int_equal(phys_hdf5_read(file, "nothing", 0, 1, values, &error), AD_E_INPUT);
    assert_mentions(error.message, "'nothing'");
    assert_int_equal(phys_hdf5_read(file, "path", 5, 1, values, &error), AD_E_INPUT);
    assert_int_equal(phys_hdf5_read(file, "path", 1, SIZE_MAX, values, &error), AD_E_INPUT);
    assert_int_equal(phys_hdf5_read(file, "singles", 1, 3, values, &error), AD_E_INPUT);
    assert_int_equal(phys_hdf5_get(file, "/", "scene", values, &error), AD_E_INPUT);
    assert_int_equal(phys_hdf5_get(file, "/", "nothing", values, &error), AD_E_INPUT);
    assert_int_equal(phys_hdf5_get_text(file, "/", "dt", &text, &error), AD_E_INPUT);
    phys_hdf5_close(file);
    empty_folder();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),     cmocka_unit_test(test_list),
        cmocka_unit_test(test_same_bytes),     cmocka_unit_test(test_whole_or_not_at_all),
        cmocka_unit_test(test_sticky_failure), cmocka_unit_test(test_unwritable),
        cmocka_unit_test(test_symbolic_link),  cmocka_unit_test(test_unreadable),
        cmocka_unit_test(test_wrong_reads),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
