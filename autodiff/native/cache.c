/* The cache of compiled programs: $XDG_CACHE_HOME/leastaction or ~/.cache/leastaction, one file per
   program. Code is loaded from it, so the folder and its files must belong to the user and be
   writable by no one else.

   A file is the shared object, followed by its source, both lengths and a checksum. It is named by
   a hash of the source and loaded only if source and checksum agree: a hash collision or a
   truncated file costs one compilation. Files are put in place by renaming; if two processes write
   the same one, the later wins, and either is right. */
#include "cache.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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
    if (length < 0 ||
        length + (int)sizeof "/leastaction/0123456789abcdef.so.XXXXXX.so" > PATH_MAX) {
        ad_fail(note, AD_E_IO, "no cache folder: its path is too long");
        return false;
    }
    mkdir(path, 0700); /* errors are found below */
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

char *ad_native_read(const char *path, size_t *bytes)
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

bool ad_native_is_intact(const char *path, const char *source)
{
    size_t bytes = 0, length = strlen(source);
    struct trailer t;
    char *text = ad_native_read(path, &bytes);
    bool whole = text && bytes > sizeof t + length;
    if (whole) {
        memcpy(&t, text + bytes - sizeof t, sizeof t);
        whole = t.source_bytes == length && t.object_bytes == bytes - sizeof t - length &&
                memcmp(text + t.object_bytes, source, length) == 0 &&
                t.checksum == ad_hash(AD_HASH_BEGIN, text, t.object_bytes);
    }
    free(text);
    return whole;
}

/* ---- names ---- */

uint64_t ad_native_key(const char *source)
{
    return ad_hash(AD_HASH_BEGIN, source, strlen(source));
}

static bool entry_path(char path[PATH_MAX], uint64_t key, const char *kind, struct ad_error *note)
{
    if (!cache_folder(path, note))
        return false;
    size_t length = strlen(path);
    snprintf(path + length, PATH_MAX - length, "/%016llx.%s", (unsigned long long)key, kind);
    return true;
}

bool ad_native_is_slow(uint64_t key)
{
    char path[PATH_MAX];
    return entry_path(path, key, "slow", NULL) && access(path, F_OK) == 0;
}

void ad_native_mark_slow(uint64_t key)
{
    char path[PATH_MAX];
    int file = entry_path(path, key, "slow", NULL)
                   ? open(path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600)
                   : -1;
    if (file >= 0)
        close(file);
}

/* ---- loading ---- */

/* The object at `path`, if it loads and has the functions run0 ... run<n - 1>. */
static void *open_functions(const char *path, size_t n, ad_segment_code *functions[], char *reason,
                            size_t room)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        snprintf(reason, room, "%s", dlerror());
    for (size_t k = 0; library && k < n; k++) {
        char name[32];
        snprintf(name, sizeof name, "run%zu", k);
        void *symbol = dlsym(library, name);
        memcpy(&functions[k], &symbol,
               sizeof symbol); /* ISO C has no cast from object to function pointers */
        if (symbol)
            continue;
        snprintf(reason, room, "%s has no function %s", path, name);
        dlclose(library);
        library = NULL;
    }
    return library;
}

void *ad_native_load(const char *source, const char *isa, const struct compiler *c, size_t n,
                     ad_segment_code *functions[], bool *built, struct ad_error *note)
{
    char path[PATH_MAX], reason[200];
    void *library;
    if (!entry_path(path, ad_native_key(source), "so", note))
        return NULL;
    if (ad_native_is_intact(path, source)) {
        if ((library = open_functions(path, n, functions, reason, sizeof reason)))
            return library;
        unlink(path); /* and compile it again */
    }
    if (!c) {
        ad_fail(note, AD_E_IO, "not compiled yet");
        return NULL;
    }
    if (!ad_native_build(path, source, isa, c, note))
        return NULL;
    if (built)
        *built = true;
    if (!(library = open_functions(path, n, functions, reason, sizeof reason))) {
        unlink(path);
        ad_fail(note, AD_E_IO, "%.80s wrote an object that cannot be loaded: %s", c->words[0],
                reason);
    }
    return library;
}
