/* Writes a file of the cache. The source goes to PATH.XXXXXX, which is new and locked (flock) while
   its process lives; the object to PATH.XXXXXX.so, which gets source and trailer appended and is
   renamed to PATH. Both are removed at the end, by the signal handler (ad_native_abandon), or,
   after a killed process, by the next build, which finds them unlocked. */
#include "cache.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* A compilation under way. */
struct making {
    char source[PATH_MAX], object[PATH_MAX];
    int lock;
    _Atomic pid_t compiler;
};

/* ---- removal by a signal handler ---- */

enum { MOST_AT_ONCE = 16 };

static _Atomic(struct making *) under_way[MOST_AT_ONCE];

static void replace(struct making *before, struct making *now)
{
    for (size_t k = 0; k < MOST_AT_ONCE; k++) {
        struct making *expected = before;
        if (atomic_compare_exchange_strong(&under_way[k], &expected, now))
            return;
    }
}

void ad_native_abandon(void)
{
    for (size_t k = 0; k < MOST_AT_ONCE; k++) {
        struct making *m = atomic_load(&under_way[k]);
        pid_t compiler = m ? atomic_load(&m->compiler) : 0;
        if (!m)
            continue;
        if (compiler > 0)
            kill(compiler, SIGTERM);
        unlink(m->source);
        unlink(m->object);
    }
}

/* ---- files left by killed processes ---- */

/* HASH.so.XXXXXX has 22 characters, HASH.so.XXXXXX.so 25. */
enum { HASH_LETTERS = 16, SOURCE_LETTERS = HASH_LETTERS + 10, OBJECT_LETTERS = SOURCE_LETTERS + 3 };

static bool is_temporary(const char *name)
{
    size_t length = strlen(name);
    return strspn(name, "0123456789abcdef") == HASH_LETTERS &&
           strncmp(name + HASH_LETTERS, ".so.", 4) == 0 &&
           (length == SOURCE_LETTERS ||
            (length == OBJECT_LETTERS && strcmp(name + SOURCE_LETTERS, ".so") == 0));
}

/* Objects are removed before their sources: an object without a source belongs to no process. */
static void remove_if_left(int folder, const char *name)
{
    char source[SOURCE_LETTERS + 1];
    snprintf(source, sizeof source, "%s", name);
    int file = openat(folder, source, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0 && errno == ENOENT)
        unlinkat(folder, name, 0);
    if (file < 0)
        return;
    if (flock(file, LOCK_EX | LOCK_NB) == 0) {
        char object[OBJECT_LETTERS + 1];
        snprintf(object, sizeof object, "%s.so", source);
        unlinkat(folder, object, 0);
        unlinkat(folder, source, 0);
    }
    close(file);
}

static void remove_left(const char *path)
{
    char name[PATH_MAX];
    snprintf(name, sizeof name, "%.*s", (int)(strrchr(path, '/') - path), path);
    DIR *folder = opendir(name);
    if (!folder)
        return;
    for (struct dirent *entry; (entry = readdir(folder));)
        if (is_temporary(entry->d_name))
            remove_if_left(dirfd(folder), entry->d_name);
    closedir(folder);
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

/* Appends source and trailer to the object. */
static bool seal(const char *object, const char *source)
{
    size_t bytes = 0;
    char *text = ad_native_read(object, &bytes);
    if (!text)
        return false;
    struct trailer t = {bytes, strlen(source), ad_hash(AD_HASH_BEGIN, text, bytes)};
    int file = open(object, O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
    bool done =
        file >= 0 && write_all(file, source, t.source_bytes) && write_all(file, &t, sizeof t);
    done = file >= 0 && close(file) == 0 && done;
    free(text);
    return done;
}

/* A new, locked source file. Between creation and locking another process may remove it as left
   over; its name is then gone, and another is made. */
static bool begin(struct making *m, const char *path)
{
    struct stat s = {0};
    do {
        if (snprintf(m->source, sizeof m->source, "%s.XXXXXX", path) >= PATH_MAX - 4 ||
            (m->lock = mkstemp(m->source)) < 0)
            return false;
        fcntl(m->lock, F_SETFD, FD_CLOEXEC);
        if (flock(m->lock, LOCK_EX) != 0 || fstat(m->lock, &s) != 0) {
            unlink(m->source);
            close(m->lock);
            return false;
        }
        if (s.st_nlink == 0)
            close(m->lock);
    } while (s.st_nlink == 0);
    memcpy(m->object, m->source, sizeof m->object);
    strcat(m->object, ".so");
    replace(NULL, m);
    return true;
}

static void end(struct making *m)
{
    unlink(m->object);
    unlink(m->source);
    replace(m, NULL);
    close(m->lock);
}

bool ad_native_build(const char *path, const char *source, const char *isa,
                     const struct compiler *c, struct ad_error *note)
{
    struct making m = {.lock = -1};
    remove_left(path);
    if (!begin(&m, path)) {
        ad_fail(note, AD_E_IO, "%.200s: %s", path, strerror(errno));
        return false;
    }
    bool done = write_all(m.lock, source, strlen(source)) &&
                ad_cc_compile(c, isa, m.source, m.object, &m.compiler, note) &&
                chmod(m.object, 0600) == 0 && seal(m.object, source) && rename(m.object, path) == 0;
    end(&m);
    if (!done)
        ad_fail(note, AD_E_IO, "%.200s cannot be written", path);
    return done;
}
