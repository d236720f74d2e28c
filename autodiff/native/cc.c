/* Runs the system's C compiler: which one, its flags, its exit status. No shell is involved. */
#include "cc.h"
#include "process.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- which compiler ---- */

/* "ccache gcc" is two words. */
static size_t split_words(struct compiler *c)
{
    size_t n = 0;
    for (char *rest = c->text, *word; n < MAX_WORDS && (word = strtok_r(rest, " \t", &rest)); n++)
        c->words[n] = word;
    c->words[n] = NULL;
    return n;
}

/* An executable file of this name, searched along PATH unless the name has a slash. */
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

/* Identifies the compiler by the words of its command, and by its file, which changes with its
   version: faster than running it. "ccache gcc" has two files. */
static bool identify(struct compiler *c)
{
    size_t used = 0;
    for (size_t k = 0; c->words[k]; k++) {
        char path[PATH_MAX];
        struct stat s = {0};
        const char *word = find_program(c->words[k], path) ? path : c->words[k];
        if (word == path ? stat(path, &s) != 0 : k == 0)
            return false;
        int n = snprintf(c->identity + used, sizeof c->identity - used, "%s%s %lld %lld",
                         k ? " " : "", word, (long long)s.st_size, (long long)s.st_mtime);
        if (n < 0 || (size_t)n >= sizeof c->identity - used)
            return false;
        used += (size_t)n;
    }
    return true;
}

bool ad_cc_find(struct compiler *c, struct ad_error *note)
{
    const char *name = getenv("CC");
    if (!name || !*name)
        name = "cc";
    if (snprintf(c->text, sizeof c->text, "%s", name) >= (int)sizeof c->text ||
        split_words(c) == 0 || !identify(c)) {
        ad_fail(note, AD_E_IO, "no C compiler: %.100s is not found", name);
        return false;
    }
    return true;
}

/* ---- flags and runs ---- */

/* The flags of the kernels (see the Makefile), without -ffast-math. The source vectorises
   explicitly, and says whether multiply-adds are contracted: clang takes -ffp-contract=fast for an
   answer to that, whatever the source says. gcc 12 writes some stores as an index without a
   pointer, takes that for the null pointer and the function for free of effects, and omits its
   call, unless null may be an address. */
#define ALWAYS                                                                                     \
    "-O2", "-std=gnu11", "-w", "-shared", "-fPIC", "-fno-math-errno", "-fno-trapping-math",        \
        "-fno-tree-vectorize", "-fno-delete-null-pointer-checks"
static const char *const base[] = {ALWAYS, NULL};
static const char *const avx2[] = {ALWAYS, "-mavx2", "-mfma", NULL};
static const char *const avx512[] = {ALWAYS,       "-mavx512f", "-mavx512dq", "-mavx512vl",
                                     "-mavx512bw", "-mavx2",    "-mfma",      NULL};
/* Appended after the source. */
static const char *const libraries[] = {
#if defined(__GLIBC__) && defined(__x86_64__)
    "-lmvec",
#endif
    "-lm", NULL};

const char *const *ad_cc_flags(const char *isa)
{
    return strcmp(isa, "avx512") == 0 ? avx512 : strcmp(isa, "avx2") == 0 ? avx2 : base;
}

static void append(const char *to[], size_t *n, const char *const *words)
{
    while (*words)
        to[(*n)++] = *words++;
    to[*n] = NULL;
}

enum { MAX_ARGUMENTS = 32 };

/* Exit status, or -1. `running` is the process id while it runs. */
static int run_compiler(const struct compiler *c, const char *const *arguments, bool silent,
                        _Atomic pid_t *running)
{
    const char *words[MAX_WORDS + MAX_ARGUMENTS + 1];
    size_t n = 0;
    append(words, &n, (const char *const *)c->words);
    append(words, &n, arguments);
    pid_t child;
    if (ad_process_start(words, silent ? AD_OUTPUT_NONE : AD_OUTPUT_SHARED, NULL, &child) != 0)
        return -1;
    *running = child;
    int status = ad_process_wait(child);
    *running = 0;
    return status;
}

int ad_cc_run(const struct compiler *c, const char *const *arguments, bool silent)
{
    _Atomic pid_t running = 0;
    return run_compiler(c, arguments, silent, &running);
}

bool ad_cc_compile(const struct compiler *c, const char *isa, const char *source,
                   const char *object, _Atomic pid_t *running, struct ad_error *note)
{
    const char *words[MAX_ARGUMENTS + 1];
    size_t n = 0;
    append(words, &n, ad_cc_flags(isa));
    append(words, &n, (const char *const[]){"-x", "c", "-o", object, source, "-x", "none", NULL});
    append(words, &n, libraries);
    if (run_compiler(c, words, true, running) == 0)
        return true;
    ad_fail(note, AD_E_IO, "%s failed to compile the generated code", c->words[0]);
    return false;
}
