/* The system's C compiler: which one, with what flags, and a run of it. No shell comes in between.
 */
#include "native.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* ---- which ---- */

/* "ccache gcc" is two words. */
static size_t split_words(struct compiler *c)
{
    size_t n = 0;
    for (char *rest = c->text, *word; n < MAX_WORDS && (word = strtok_r(rest, " \t", &rest)); n++)
        c->words[n] = word;
    c->words[n] = NULL;
    return n;
}

/* An executable file of this name, along PATH unless it names a folder. */
static bool find_program(const char *name, char path[PATH_MAX])
{
    const char *search = getenv("PATH");
    if (strchr(name, '/'))
        return snprintf(path, PATH_MAX, "%s", name) < PATH_MAX && access(path, X_OK) == 0;
    while (search && *search) {
        int length = (int)strcspn(search, ":");
        if (snprintf(path, PATH_MAX, "%.*s/%s", length, search, name) < PATH_MAX &&
            access(path, X_OK) == 0)
            return true;
        search += length + (search[length] == ':');
    }
    return false;
}

/* Another compiler, or another version of it, is another file: faster to ask than the compiler. */
static bool identify(const char *path, struct compiler *c)
{
    struct stat s;
    return stat(path, &s) == 0 &&
           snprintf(c->identity, sizeof c->identity, "%s %lld %lld", path, (long long)s.st_size,
                    (long long)s.st_mtime) < (int)sizeof c->identity;
}

bool ad_native_compiler(struct compiler *c, struct ad_error *note)
{
    char path[PATH_MAX];
    const char *name = getenv("CC");
    if (!name || !*name)
        name = "cc";
    if (snprintf(c->text, sizeof c->text, "%s", name) >= (int)sizeof c->text ||
        split_words(c) == 0 || !find_program(c->words[0], path) || !identify(path, c)) {
        ad_fail(note, AD_E_IO, "no C compiler: %.100s is not found", name);
        return false;
    }
    return true;
}

/* ---- how ---- */

/* As the kernels are compiled (see the Makefile): no -ffast-math, and products are not contracted
   into sums, so that the bits are the interpreter's. Everything else is explicit in the source. */
#define ALWAYS                                                                                     \
    "-O2", "-std=gnu11", "-w", "-shared", "-fPIC", "-ffp-contract=off", "-fno-math-errno",         \
        "-fno-trapping-math", "-fno-tree-vectorize"
static const char *const base[] = {ALWAYS, NULL};
static const char *const avx2[] = {ALWAYS, "-mavx2", "-mfma", NULL};
static const char *const avx512[] = {ALWAYS,       "-mavx512f", "-mavx512dq", "-mavx512vl",
                                     "-mavx512bw", "-mavx2",    "-mfma",      NULL};
/* After the source. */
static const char *const libraries[] = {
#if defined(__GLIBC__) && defined(__x86_64__)
    "-lmvec",
#endif
    "-lm", NULL};

const char *const *ad_native_flags(const char *isa)
{
    return strcmp(isa, "avx512") == 0 ? avx512 : strcmp(isa, "avx2") == 0 ? avx2 : base;
}

static void append(char *to[], size_t *n, const char *const *words)
{
    while (*words)
        to[(*n)++] = (char *)(uintptr_t)*words++; /* posix_spawn does not write to them */
}

/* Runs a program with nothing to read and nowhere to print; its exit status, or -1. */
static int run(char *const words[])
{
    posix_spawn_file_actions_t files;
    pid_t child;
    int status = -1;
    if (posix_spawn_file_actions_init(&files) != 0)
        return -1;
    bool started = posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0) == 0 &&
                   posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0) == 0 &&
                   posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0) == 0 &&
                   posix_spawnp(&child, words[0], &files, NULL, words, environ) == 0;
    posix_spawn_file_actions_destroy(&files);
    if (!started)
        return -1;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

bool ad_native_compile(const struct compiler *c, const char *isa, const char *source,
                       const char *object, struct ad_error *note)
{
    enum { MAX_FLAGS = 32 };
    char *words[MAX_WORDS + MAX_FLAGS];
    size_t n = 0;
    append(words, &n, (const char *const *)c->words);
    append(words, &n, ad_native_flags(isa));
    append(words, &n, (const char *const[]){"-x", "c", "-o", object, source, "-x", "none", NULL});
    append(words, &n, libraries);
    words[n] = NULL;
    if (run(words) == 0)
        return true;
    ad_fail(note, AD_E_IO, "%s does not compile what the program became", c->words[0]);
    return false;
}
