/* Atomic replacement of files (atomic_file.h). The contents are synced before the renaming, and the
   folder after it, so that a crash leaves the old or the new file. */
#include "atomic_file.h"
#include "autodiff/free.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- removal by a signal handler ---- */

enum { MOST_AT_ONCE = 64 };

static _Atomic(char *) unfinished[MOST_AT_ONCE];

/* Puts `now` where `before` was; a file more than there are places is not kept. */
static void replace(char *before, char *now)
{
    for (size_t k = 0; k < MOST_AT_ONCE; k++) {
        char *expected = before;
        if (atomic_compare_exchange_strong(&unfinished[k], &expected, now))
            return;
    }
}

bool phys_atomic_file_abandon_all(void)
{
    bool any = false;
    for (size_t k = 0; k < MOST_AT_ONCE; k++) {
        char *name = atomic_load(&unfinished[k]);
        if (name && unlink(name) == 0)
            any = true;
    }
    return any;
}

/* ---- names ---- */

static enum ad_status fail(struct ad_error *error, const char *name, const char *reason)
{
    return ad_fail(error, AD_E_IO, "%s: cannot be written: %s", name, reason);
}

/* Before anything is written: the name is to blame. */
static enum ad_status refuse(struct ad_error *error, const char *name, const char *reason)
{
    return ad_fail(error, AD_E_IO,
                   "%s: cannot be written: %s; expected a file in a folder that can be written to",
                   name, reason);
}

/* Length of the folder part of a name, its last slash included. */
static size_t folder_length(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? (size_t)(slash - name) + 1 : 0;
}

/* The target behind symbolic links, or why it cannot be one; and its permissions, where it is. */
static char *resolve(const char *target, mode_t *mode, const char **reason)
{
    struct stat status;
    *reason = NULL;
    *mode = 0;
    if (stat(target, &status) != 0) {
        if (errno != ENOENT)
            *reason = strerror(errno);
        return *reason ? NULL : strdup(target);
    }
    if (!S_ISREG(status.st_mode))
        *reason = S_ISDIR(status.st_mode) ? "it is a folder" : "it is not a regular file";
    else if (access(target, W_OK) != 0)
        *reason = strerror(errno);
    *mode = status.st_mode & 0777;
    return *reason ? NULL : realpath(target, NULL);
}

static void forget(struct phys_atomic_file *file)
{
    if (file->temporary) {
        replace(file->temporary, NULL);
        close(file->lock);
    }
    AD_FREE(file->target, file->temporary);
    *file = (struct phys_atomic_file){0};
}

enum ad_status phys_atomic_file_begin(struct phys_atomic_file *file, const char *target,
                                      struct ad_error *error)
{
    const char *reason;
    mode_t mode;
    *file = (struct phys_atomic_file){.target = resolve(target, &mode, &reason)};
    if (reason)
        return refuse(error, target, reason);
    if (!file->target)
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", target);
    phys_temporary_clean(file->target, folder_length(file->target));
    sigset_t all, before; /* no signal comes between the file and the note of it */
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    int failed = phys_temporary_new(file->target, folder_length(file->target), &file->temporary,
                                    &file->lock);
    if (!failed)
        replace(NULL, file->temporary);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (failed) {
        forget(file);
        return failed == ENOMEM ? ad_fail(error, AD_E_MEMORY, "%s: out of memory", target)
                                : refuse(error, target, strerror(failed));
    }
    if (mode)
        fchmod(file->lock, mode);
    return AD_OK;
}

/* 0, or the error number. */
static int sync_name(const char *name, int flags)
{
    int descriptor = open(name, flags);
    if (descriptor < 0)
        return errno;
    int failed = fsync(descriptor) != 0 ? errno : 0;
    if (close(descriptor) != 0 && !failed)
        failed = errno;
    return failed;
}

static int sync_folder(const char *name)
{
    size_t length = folder_length(name);
    if (length == 0)
        return sync_name(".", O_RDONLY | O_DIRECTORY);
    char *folder = strndup(name, length);
    int failed = folder ? sync_name(folder, O_RDONLY | O_DIRECTORY) : ENOMEM;
    free(folder);
    return failed == EINVAL ? 0 : failed; /* file systems that cannot sync a folder say EINVAL */
}

enum ad_status phys_atomic_file_commit(struct phys_atomic_file *file, struct ad_error *error)
{
    if (!file->target)
        return AD_OK;
    int failed = sync_name(file->temporary, O_WRONLY);
    if (!failed && rename(file->temporary, file->target) != 0)
        failed = errno;
    if (failed) {
        fail(error, file->target, strerror(failed));
        phys_atomic_file_abandon(file);
        return AD_E_IO;
    }
    failed = sync_folder(file->target);
    enum ad_status status = failed ? fail(error, file->target, strerror(failed)) : AD_OK;
    forget(file);
    return status;
}

void phys_atomic_file_abandon(struct phys_atomic_file *file)
{
    if (file->temporary)
        unlink(file->temporary);
    forget(file);
}
