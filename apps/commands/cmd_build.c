/* leastaction build: compiles a user's Lagrangian in C to a scene for all subcommands. */
#include "autodiff/free.h"
#include "apps/command.h"
#include "apps/file_names.h"
#include "apps/quote.h"
#include "autodiff/native/cc.h"
#include "physics/io/atomic_file.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct options {
    struct common common;
    const char *out, *include;
};

/* Cuts the last part off a path; false where there is none left. */
static bool to_parent(char *path)
{
    char *slash = strrchr(path, '/');
    if (!slash || slash == path)
        return false;
    *slash = '\0';
    return true;
}

static bool has_headers(const char *folder)
{
    char header[PATH_MAX];
    return snprintf(header, sizeof header, "%s/physics/physics.h", folder) < PATH_MAX &&
           access(header, R_OK) == 0;
}

/* The headers that belong to this command: where both were installed, or in the tree it was built
   in. */
static enum ad_status find_headers(char folder[PATH_MAX], struct ad_error *error)
{
    char at[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", at, sizeof at - 1);
    at[length > 0 ? length : 0] = '\0';
    while (to_parent(at)) {
        snprintf(folder, PATH_MAX, "%.*s/include/leastaction", PATH_MAX - 32, at);
        if (has_headers(folder))
            return AD_OK;
        memcpy(folder, at, sizeof at);
        if (has_headers(folder))
            return AD_OK;
    }
    return ad_fail(error, AD_E_INPUT,
                   "physics/physics.h is not installed beside the command; expected --include "
                   "FOLDER that contains it");
}

/* my_scene.c becomes my_scene.so; the caller frees. */
static char *default_out(const char *source)
{
    const char *dot = strrchr(source, '.'), *slash = strrchr(source, '/');
    size_t stem = dot && (!slash || dot > slash) ? (size_t)(dot - source) : strlen(source);
    char *out = malloc(stem + sizeof ".so");
    if (out) {
        memcpy(out, source, stem);
        memcpy(out + stem, ".so", sizeof ".so");
    }
    return out;
}

/* Paths that a compiler does not take for options. */
static enum ad_status compile_paths(const char *source, const char *name, const char *include,
                                    const char *to, struct ad_error *error)
{
    struct compiler compiler;
    const char *const words[] = {"-std=c11", "-D_XOPEN_SOURCE=700",
                                 "-O2",      "-Wall",
                                 "-shared",  "-fPIC",
                                 "-I",       include,
                                 name,       "-o",
                                 to,         "-lm",
                                 NULL};
    if (access(source, R_OK) != 0)
        return ad_fail(error, AD_E_INPUT, "%s: cannot be read: %s; expected a Lagrangian in C",
                       source, strerror(errno));
    if (!ad_cc_find(&compiler, error))
        return error->status;
    if (ad_cc_run(&compiler, words, false) != 0)
        ad_fail(error, AD_E_INPUT, "%s: %s failed to compile it; see its messages above", source,
                compiler.words[0]);
    return error->status;
}

static enum ad_status compile(const char *source, const char *include, const char *to,
                              struct ad_error *error)
{
    char *name = quote_path(source), *folder = quote_path(include), *output = quote_path(to);
    if (name && folder && output)
        compile_paths(source, name, folder, output, error);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory");
    AD_FREE(name, folder, output);
    return error->status;
}

/* Checks that the result is a scene; if not, the message names the source, because the object is
   removed. */
static enum ad_status try_scene(const char *source, const char *library, struct phys_system *system,
                                struct ad_error *error)
{
    char path[PATH_MAX]; /* with a slash: a file, not the name of a scene */
    struct ad_error why = {0};
    int n = snprintf(path, sizeof path, "%s%s", strchr(library, '/') ? "" : "./", library);
    if (phys_system_open(path, system, &why) == AD_OK)
        return AD_OK;
    const char *reason = strncmp(why.message, path, (size_t)n) == 0 ? why.message + n : why.message;
    return ad_fail(error, why.status, "%s%s", source, reason);
}

static void report(const struct options *options, const struct phys_system *system, const char *out)
{
    if (options->common.quiet)
        return;
    quote_terminal(stdout, out);
    printf(": %s, %zu coordinate%s; leastaction check ", system->scene->what, system->dof,
           system->dof == 1 ? "" : "s");
    quote_shell(stdout, strchr(out, '/') ? "" : "./", out);
    puts(" checks it");
}

static int run(const void *values, struct ad_error *error)
{
    const struct options *options = values;
    const char *source = options->common.argument[0];
    char *out = options->out ? strdup(options->out) : default_out(source), folder[PATH_MAX];
    struct phys_atomic_file file = {0};
    struct phys_system system = {0};
    if (!out)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (file_names_check(
                 2, (struct file_name[]){{"", "SCENE.c", source, false}, {"--", "out", out, true}},
                 error) == AD_OK &&
             (options->include || find_headers(folder, error) == AD_OK) &&
             phys_atomic_file_begin(&file, out, error) == AD_OK &&
             compile(source, options->include ? options->include : folder, file.temporary, error) ==
                 AD_OK &&
             try_scene(source, file.temporary, &system, error) == AD_OK &&
             phys_atomic_file_commit(&file, error) == AD_OK)
        report(options, &system, out);
    phys_system_close(&system);
    phys_atomic_file_abandon(&file);
    free(out);
    return command_status(error);
}

#define AT(member) offsetof(struct options, member)

static const struct option table[] = {
    {"out", "FILE.so", OPTION_OUTPUT, NULL, "the scene [SCENE.so]", AT(out)},
    {"include", "FOLDER", OPTION_TEXT, NULL, "that contains physics/physics.h [beside the command]",
     AT(include)},
};

const struct command command_build = {
    .line = {.name = "build",
             .what = "a scene from a Lagrangian in C",
             .arguments = {"SCENE.c"},
             .options = table,
             .n_options = sizeof table / sizeof *table,
             .more =
                 "SCENE.c exports const struct phys_scene leastaction_scene (physics/physics.h)."
                 "\nThe compiler is $CC, or cc."},
    .bytes = sizeof(struct options),
    .run = run,
};
