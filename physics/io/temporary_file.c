/* Temporary files beside their targets (atomic_file.h). Ownership is decided by locks instead of
   process ids, which are ambiguous between containers that share a folder. */
#include "atomic_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

static const char prefix[] = ".leastaction.";

enum { PREFIX = sizeof prefix - 1, DIGITS = 16, LONGEST_EXTENSION = 16, ATTEMPTS = 100 };

/* The extension with its dot; "" where there is none, or one that is too long. */
static const char *extension_of(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot && dot != name && strlen(dot) <= LONGEST_EXTENSION ? dot : "";
}

/* Whether the open file still has this name, in the folder `at`. */
static bool is_named(int file, int at, const char *name)
{
    struct stat open, named;
    return fstat(file, &open) == 0 && fstatat(at, name, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

/* Creates and locks one of this name; 0, or the error number. Between the two another process may
   take the file for left over: it has the lock (EWOULDBLOCK) or has removed the name. A file system
   without locks does without; then nothing there is ever taken for left over. */
static int create(const char *name, int *file)
{
    *file = open(name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (*file < 0)
        return errno;
    bool taken = flock(*file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!taken && is_named(*file, AT_FDCWD, name))
        return 0;
    close(*file);
    return EEXIST;
}

int phys_temporary_new(const char *target, size_t folder, char **name, int *lock)
{
    size_t size = folder + PREFIX + DIGITS + LONGEST_EXTENSION + 1;
    int failed = EEXIST;
    *name = malloc(size);
    if (!*name)
        return ENOMEM;
    for (int attempt = 0; attempt < ATTEMPTS && failed == EEXIST; attempt++) {
        uint64_t random;
        if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random) {
            failed = errno;
            break;
        }
        snprintf(*name, size, "%.*s%s%016llx%s", (int)folder, target, prefix,
                 (unsigned long long)random, extension_of(target + folder));
        failed = create(*name, lock);
    }
    if (failed) {
        free(*name);
        *name = NULL;
    }
    return failed;
}

/* .leastaction.0123456789abcdef, and perhaps an extension. */
static bool is_ours(const char *name)
{
    if (strncmp(name, prefix, PREFIX) != 0 || strspn(name + PREFIX, "0123456789abcdef") != DIGITS)
        return false;
    const char *end = name + PREFIX + DIGITS;
    return *end == '\0' || (*end == '.' && strlen(end) <= LONGEST_EXTENSION);
}

static void remove_if_left(int at, const char *name)
{
    struct stat status;
    int file = openat(at, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0)
        return;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
        flock(file, LOCK_EX | LOCK_NB) == 0 && is_named(file, at, name))
        unlinkat(at, name, 0);
    close(file);
}

void phys_temporary_clean(const char *target, size_t folder)
{
    char *name = folder ? strndup(target, folder) : strdup(".");
    DIR *directory = name ? opendir(name) : NULL;
    for (struct dirent *entry; directory && (entry = readdir(directory));)
        if (is_ours(entry->d_name))
            remove_if_left(dirfd(directory), entry->d_name);
    if (directory)
        closedir(directory);
    free(name);
}
