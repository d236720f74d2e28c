/* Compiled programs are kept: in $XDG_CACHE_HOME/leastaction, or ~/.cache/leastaction, one file a
   program. Code is loaded from there, so the folder and its files must be the user's own and closed
   to others' writing.

   A file is the shared object, then the source it was made from, then their lengths and a checksum.
   It is named by a hash of the source and loaded only if source and checksum agree: two sources of
   one hash, or half a file, cost a compilation and nothing else. Files appear by renaming, whole;
   of two processes that write the same one, the later wins, and either file is right. */
#include "autodiff/native.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct trailer {
    uint64_t object_bytes, source_bytes, checksum;
};

/* FNV-1a. */
static uint64_t hash(uint64_t h, const void *data, size_t n)
{
    for (const unsigned char *byte = data; n-- > 0; byte++)
        h = (h ^ *byte) * 0x100000001b3u;
    return h;
}

static const uint64_t HASH_START = 0xcbf29ce484222325u;

/* ---- folder ---- */

static bool own_and_closed(const struct stat *s)
{
    return s->st_uid == geteuid() && (s->st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

static bool cache_folder(char path[PATH_MAX], struct ad_error *note)
{
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    bool given = cache && *cache == '/';
    if (!given && !(home && *home == '/')) {
        ad_fail(note, AD_E_IO, "no cache folder: neither XDG_CACHE_HOME nor HOME is set");
        return false;
    }
    int length = snprintf(path, PATH_MAX, "%s%s", given ? cache : home, given ? "" : "/.cache");
    if (length < 0 || length + (int)sizeof "/leastaction/0123456789abcdef.so.XXXXXX" > PATH_MAX) {
        ad_fail(note, AD_E_IO, "no cache folder: its path is too long");
        return false;
    }
    mkdir(path, 0700); /* one that cannot be made is found out about below */
    strcat(path, "/leastaction");
    mkdir(path, 0700);
    struct stat s;
    if (lstat(path, &s) != 0 || !S_ISDIR(s.st_mode) || !own_and_closed(&s)) {
        ad_fail(note, AD_E_IO,
                "cache folder %.200s: not a folder that only its owner, you, can "
                "write to",
                path);
        return false;
    }
    return true;
}

/* ---- reading ---- */

/* All of a file of the user's own; NULL if it is not that. The caller frees. */
static char *read_own_file(const char *path, size_t *bytes)
{
    char *text = NULL;
    struct stat s;
    int file = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return NULL;
    if (fstat(file, &s) == 0 && S_ISREG(s.st_mode) && own_and_closed(&s) && s.st_size > 0 &&
        (text = malloc((size_t)s.st_size))) {
        size_t got = 0;
        ssize_t more = 1;
        while (got < (size_t)s.st_size && more > 0) {
            more = read(file, text + got, (size_t)s.st_size - got);
            got += more > 0 ? (size_t)more : 0;
        }
        *bytes = got;
    }
    close(file);
    return text;
}

bool ad_native_is_whole(const char *path, const char *source)
{
    size_t bytes = 0, length = strlen(source);
    struct trailer t;
    char *text = read_own_file(path, &bytes);
    bool whole = text && bytes > sizeof t + length;
    if (whole) {
        memcpy(&t, text + bytes - sizeof t, sizeof t);
        whole = t.source_bytes == length && t.object_bytes == bytes - sizeof t - length &&
                memcmp(text + t.object_bytes, source, length) == 0 &&
                t.checksum == hash(HASH_START, text, t.object_bytes);
    }
    free(text);
    return whole;
}

/* ---- writing ---- */

static bool write_all(int file, const void *data, size_t n)
{
    const char *at = data;
    while (n > 0) {
        ssize_t wrote = write(file, at, n);
        if (wrote <= 0)
            return false;
        at += wrote;
        n -= (size_t)wrote;
    }
    return true;
}

/* Source and trailer behind the object. */
static bool seal(const char *object, const char *source)
{
    size_t bytes = 0;
    char *text = read_own_file(object, &bytes);
    if (!text)
        return false;
    struct trailer t = {bytes, strlen(source), hash(HASH_START, text, bytes)};
    int file = open(object, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
    bool done =
        file >= 0 && write_all(file, source, t.source_bytes) && write_all(file, &t, sizeof t);
    done = file >= 0 && close(file) == 0 && done;
    free(text);
    return done;
}

/* A new file beside `path`, open for writing; -1 if there can be none. */
static int new_file(const char *path, char name[PATH_MAX])
{
    return snprintf(name, PATH_MAX, "%s.XXXXXX", path) < PATH_MAX ? mkstemp(name) : -1;
}

static bool build(const char *path, const char *source, const char *isa, const struct compiler *c,
                  struct ad_error *note)
{
    char text[PATH_MAX], object[PATH_MAX];
    int file = new_file(path, text), empty;
    if (file < 0) {
        ad_fail(note, AD_E_IO, "%.200s: %s", path, strerror(errno));
        return false;
    }
    bool done = write_all(file, source, strlen(source));
    done = close(file) == 0 && done;
    if (done && (done = (empty = new_file(path, object)) >= 0)) {
        close(empty);
        done = ad_cc_compile(c, isa, text, object, note) && chmod(object, 0600) == 0 &&
               seal(object, source) && rename(object, path) == 0;
        if (!done)
            unlink(object);
    }
    unlink(text);
    if (!done)
        ad_fail(note, AD_E_IO, "%.200s cannot be written", path);
    return done;
}

/* ---- loading ---- */

void *ad_native_load(const char *source, const char *isa, const struct compiler *c,
                     struct ad_error *note)
{
    char path[PATH_MAX];
    if (!cache_folder(path, note))
        return NULL;
    size_t length = strlen(path);
    snprintf(path + length, PATH_MAX - length, "/%016llx.so",
             (unsigned long long)hash(HASH_START, source, strlen(source)));
    if (!ad_native_is_whole(path, source) && !build(path, source, isa, c, note))
        return NULL;
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        ad_fail(note, AD_E_IO, "%s", dlerror());
    return library;
}
