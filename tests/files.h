/* Helpers for files: a private folder, and the reference data in tests/data. */
#ifndef TESTS_FILES_H
#define TESTS_FILES_H

#include <stddef.h>

enum { PATH_ROOM = 512 };

struct path {
    char text[PATH_ROOM];
};

/* cmocka setup and teardown of a group: a new folder in $TMPDIR or /tmp, removed with all in it. */
int files_setup(void **state);
int files_teardown(void **state);

/* Removes a folder with all in it; nonzero: not all of it. */
int files_remove(const char *path);

/* A name in that folder. */
struct path files_temporary(const char *name);
/* Writes `size` bytes to it, and returns it. */
struct path files_write(const char *name, const char *text, size_t size);
/* The same for a string. */
struct path files_write_text(const char *name, const char *text);
/* Writes a matrix [rows x cols] as CSV, to all digits, below a line of names (NULL: none). */
void files_write_csv(const char *path, const char *header, size_t rows, size_t cols,
                     const double *values);
/* Contents of a file as a string (free); fails the test if it cannot be read. */
char *files_read(const char *path, size_t *size);
/* Fails the test unless both have the same bytes. */
void files_are_same(const char *path, const char *other);

/* A file or folder of tests/data. A file that is kept as NAME.xz is unpacked into the test's own
   folder. */
struct path files_data(const char *name);

#endif
