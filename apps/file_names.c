/* Checks that the files of a run are different ones (file_names.h). */
#include "file_names.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* The file that a name refers to, or, if there is none, the folder and name. */
struct place {
    bool known, exists, is_folder;
    dev_t device;
    ino_t number; /* of the file, or of the folder */
    const char *name;
};

static const char *last_part(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? slash + 1 : name;
}

/* The folder that a name is in; false where there is none. */
static bool stat_folder(const char *name, struct stat *status)
{
    size_t length = (size_t)(last_part(name) - name);
    char *folder = malloc(length + 2);
    if (!folder)
        return false;
    sprintf(folder, "%.*s.", (int)length, name);
    bool found = stat(folder, status) == 0;
    free(folder);
    return found;
}

static struct place place_of(const char *name)
{
    struct stat status;
    if (!name || strcmp(name, "-") == 0)
        return (struct place){0};
    if (stat(name, &status) == 0)
        return (struct place){true,          true,          S_ISDIR(status.st_mode),
                              status.st_dev, status.st_ino, ""};
    bool known = stat_folder(name, &status);
    return (struct place){known, false, false, status.st_dev, status.st_ino, last_part(name)};
}

static bool same_place(const struct place *a, const struct place *b)
{
    return a->known && b->known && a->exists == b->exists && a->device == b->device &&
           a->number == b->number && strcmp(a->name, b->name) == 0;
}

/* Folders are read for tables and for frames; these are neither. */
static bool is_read_from_folders(const char *name)
{
    static const char *const others[] = {".h5", ".hdf5", ".svg", ".gif", ".html"};
    const char *dot = strrchr(last_part(name), '.');
    for (size_t k = 0; dot && k < sizeof others / sizeof *others; k++)
        if (strcasecmp(dot, others[k]) == 0)
            return false;
    return true;
}

/* Whether the file is, under any name, a member of the folder, or of a folder in it where `deeper`
   (frames are read from both). */
static bool is_member(const struct place *file, int folder, bool deeper)
{
    bool found = false;
    DIR *members = folder >= 0 ? fdopendir(folder) : NULL;
    for (struct dirent *member; members && !found && (member = readdir(members));) {
        struct stat status;
        const char *name = member->d_name;
        if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0 ||
            fstatat(folder, name, &status, 0) != 0)
            continue;
        found = (status.st_dev == file->device && status.st_ino == file->number &&
                 is_read_from_folders(name)) ||
                (deeper && S_ISDIR(status.st_mode) &&
                 is_member(file, openat(folder, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC), false));
    }
    if (members)
        closedir(members);
    else if (folder >= 0)
        close(folder);
    return found;
}

static enum ad_status compare(const struct file_name *output, const struct file_name *other,
                              struct ad_error *error)
{
    struct place a = place_of(output->file), b = place_of(other->file);
    if (same_place(&a, &b))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s%s and %s%s name the same file, '%s'; expected a file for each",
                       output->dashes, output->option, other->dashes, other->option, output->file);
    if (!other->output && b.is_folder && a.exists &&
        is_member(&a, open(other->file, O_RDONLY | O_DIRECTORY | O_CLOEXEC), true))
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s%s: '%s' is in the folder of %s%s already; expected a file elsewhere",
                       output->dashes, output->option, output->file, other->dashes, other->option);
    return AD_OK;
}

static enum ad_status compare_stream(const struct file_name *output, int descriptor,
                                     const char *name, struct ad_error *error)
{
    struct place a = place_of(output->file);
    struct stat status;
    if (!a.exists || fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode) ||
        status.st_dev != a.device || status.st_ino != a.number)
        return AD_OK;
    return ad_fail(error, AD_E_ARGUMENT,
                   "%s%s: %s goes to '%s' already; expected a file of its own", output->dashes,
                   output->option, name, output->file);
}

enum ad_status file_names_check(size_t n, const struct file_name names[], struct ad_error *error)
{
    for (size_t a = 0; a < n && error->status == AD_OK; a++) {
        if (!names[a].output || !names[a].file)
            continue;
        for (size_t b = 0; b < n && error->status == AD_OK; b++)
            if (b > a || (b < a && !names[b].output))
                compare(&names[a], &names[b], error);
        if (error->status == AD_OK &&
            compare_stream(&names[a], STDOUT_FILENO, "standard output", error) == AD_OK)
            compare_stream(&names[a], STDERR_FILENO, "standard error", error);
    }
    return error->status;
}
