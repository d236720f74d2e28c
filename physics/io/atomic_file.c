/* Files that appear whole or not at all (whole.h). The order of syncing is what survives a crash:
   contents, then the name, then the folder that holds the name. */
#include "atomic_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

/* FOLDER/.PID.NAME: hidden, unique among running processes, with the target's extension. */
static char *temporary_name(const char *target)
{
    size_t folder = folder_length(target), size = strlen(target) + 32;
    char *name = malloc(size);
    if (name)
        snprintf(name, size, "%.*s.%ld.%s", (int)folder, target, (long)getpid(), target + folder);
    return name;
}

/* The target behind symbolic links, or why it cannot be one. */
static char *resolve(const char *target, const char **reason)
{
    struct stat status;
    *reason = NULL;
    if (stat(target, &status) != 0) {
        if (errno != ENOENT)
            *reason = strerror(errno);
        return *reason ? NULL : strdup(target);
    }
    if (!S_ISREG(status.st_mode))
        *reason = S_ISDIR(status.st_mode) ? "it is a folder" : "it is not a regular file";
    else if (access(target, W_OK) != 0)
        *reason = strerror(errno);
    return *reason ? NULL : realpath(target, NULL);
}

static void forget(struct phys_whole *file)
{
    free(file->target);
    free(file->temporary);
    *file = (struct phys_whole){0};
}

enum ad_status phys_whole_begin(struct phys_whole *file, const char *target, struct ad_error *error)
{
    const char *reason;
    *file = (struct phys_whole){.target = resolve(target, &reason)};
    if (reason)
        return refuse(error, target, reason);
    file->temporary = file->target ? temporary_name(file->target) : NULL;
    if (!file->temporary) {
        forget(file);
        return ad_fail(error, AD_E_MEMORY, "%s: out of memory", target);
    }
    int descriptor = open(file->temporary, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (descriptor < 0) {
        enum ad_status status = refuse(error, target, strerror(errno));
        forget(file);
        return status;
    }
    close(descriptor);
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

enum ad_status phys_whole_commit(struct phys_whole *file, struct ad_error *error)
{
    if (!file->target)
        return AD_OK;
    int failed = sync_name(file->temporary, O_WRONLY);
    if (!failed && rename(file->temporary, file->target) != 0)
        failed = errno;
    if (failed) {
        fail(error, file->target, strerror(failed));
        phys_whole_abandon(file);
        return AD_E_IO;
    }
    failed = sync_folder(file->target);
    enum ad_status status = failed ? fail(error, file->target, strerror(failed)) : AD_OK;
    forget(file);
    return status;
}

void phys_whole_abandon(struct phys_whole *file)
{
    if (file->temporary)
        unlink(file->temporary);
    forget(file);
}
