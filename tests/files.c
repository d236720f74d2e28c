/* Files for tests (files.h). */
#include "files.h"

#include "close.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct path folder;

int files_setup(void **state)
{
    (void)state;
    const char *base = getenv("TMPDIR");
    snprintf(folder.text, sizeof folder.text, "%s/leastaction-XXXXXX", base ? base : "/tmp");
    return mkdtemp(folder.text) ? 0 : -1;
}

static int remove_one(const char *path, const struct stat *status, int type, struct FTW *walk)
{
    (void)status, (void)type, (void)walk;
    return remove(path);
}

int files_remove(const char *path) { return nftw(path, remove_one, 8, FTW_DEPTH | FTW_PHYS); }

int files_teardown(void **state)
{
    (void)state;
    return files_remove(folder.text);
}

static struct path join(const char *base, const char *name)
{
    struct path path;
    int n = snprintf(path.text, sizeof path.text, "%s/%s", base, name);
    assert_in_range(n, 1, sizeof path.text - 1);
    return path;
}

struct path files_temporary(const char *name) { return join(folder.text, name); }

struct path files_write(const char *name, const char *text, size_t size)
{
    struct path path = files_temporary(name);
    FILE *stream = fopen(path.text, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(text, 1, size, stream), size);
    assert_int_equal(fclose(stream), 0);
    return path;
}

struct path files_write_text(const char *name, const char *text)
{
    return files_write(name, text, strlen(text));
}

void files_write_csv(const char *path, const char *header, size_t rows, size_t cols,
                     const double *values)
{
    FILE *stream = fopen(path, "w");
    assert_non_null(stream);
    if (header)
        fprintf(stream, "%s\n", header);
    for (size_t k = 0; k < rows * cols; k++)
        fprintf(stream, "%.17g%c", values[k], (k + 1) % cols ? ',' : '\n');
    assert_int_equal(fclose(stream), 0);
}

char *files_read(const char *path, size_t *size)
{
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    assert_int_equal(fseek(stream, 0, SEEK_END), 0);
    long length = ftell(stream);
    assert_in_range(length, 0, 1 << 30);
    rewind(stream);
    *size = (size_t)length;
    char *text = calloc(1, *size + 1);
    assert_non_null(text);
    assert_int_equal(fread(text, 1, *size, stream), *size);
    fclose(stream);
    return text;
}

void files_are_same(const char *path, const char *other)
{
    size_t a, b;
    char *one = files_read(path, &a), *two = files_read(other, &b);
    assert_int_equal(a, b);
    assert_memory_equal(one, two, a);
    free(one);
    free(two);
}

struct path files_data(const char *name)
{
    struct path path = join("tests/data", name);
    if (access(path.text, R_OK) == 0)
        return path;
    char command[2 * PATH_ROOM + 64];
    struct path unpacked = files_temporary("unpacked");
    snprintf(command, sizeof command, "xz -dc '%s.xz' >'%s'", path.text, unpacked.text);
    if (system(command) != 0)
        fail_msg("no %s", path.text);
    return unpacked;
}
