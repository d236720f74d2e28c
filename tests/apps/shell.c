/* Runs the command under test as a user would (shell.h). */
#include "shell.h"
#include "tests/close.h"
#include "tests/files.h"
#include "apps/command.h"
#include "apps/interrupt.h"
#include "libraries.h"

#include <dirent.h>
#include <dlfcn.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <wordexp.h>

static char folder[256];
static char out[1 << 20], err[1 << 16], path[512];

static const char *build(void)
{
    const char *given = getenv("LEASTACTION_BUILD");
    return given ? given : "build";
}

/* Loaded once here, not by each child that uses them: that takes longer than most runs. */
static void load_libraries(void)
{
    dlopen(AD_LIBRARY_hdf5, RTLD_LAZY | RTLD_LOCAL);
    dlopen(AD_LIBRARY_openblas, RTLD_LAZY | RTLD_LOCAL);
}

int shell_setup(void **state)
{
    load_libraries();
    (void)state;
    char name[4096], *root = realpath(".", NULL);
    const char *given = getenv("LEASTACTION");
    snprintf(name, sizeof name, "%s/leastaction", build());
    char *command = realpath(given ? given : name, NULL);
    const char *base = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/leastaction-command-XXXXXX", base ? base : "/tmp");
    if (!root || !command || !mkdtemp(folder)) {
        fprintf(stderr, "no command %s: build it first\n", given ? given : name);
        return -1;
    }
    setenv("ROOT", root, 1);
    setenv("LA", command, 1);
    free(root);
    free(command);
    snprintf(name, sizeof name, "%s/work", folder);
    return mkdir(name, 0777);
}

int shell_teardown(void **state)
{
    (void)state;
    return files_remove(folder);
}

static void read_file(const char *name, char *text, size_t size)
{
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *in = fopen(path, "r");
    size_t length = in ? fread(text, 1, size - 1, in) : 0;
    text[length] = '\0';
    if (in)
        fclose(in);
}

void shell_read(void)
{
    read_file("out", out, sizeof out);
    read_file("err", err, sizeof err);
}

void shell_enter(void)
{
    static const int caught[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGSYS}; /* by cmocka */
    for (size_t k = 0; k < sizeof caught / sizeof *caught; k++)
        signal(caught[k], SIG_DFL);
    if (!freopen(shell_path("../out"), "w", stdout) ||
        !freopen(shell_path("../err"), "w", stderr) || chdir(shell_path("")) != 0 ||
        setenv("PWD", shell_path(""), 1) != 0)
        _exit(127);
}

/* A line is the command with its words and nothing else: no redirection, no other program, no
   pattern of files. A scene from a shared object needs all symbols of the real command, and `build`
   its place. */
static bool is_plain(const char *line, wordexp_t *words)
{
    return !getenv("LEASTACTION") && strncmp(line, "$LA ", 4) == 0 && !strstr(line, ".so") &&
           strncmp(line + 4, "build", 5) != 0 && !strpbrk(line, "*?[~") &&
           wordexp(line, words, WRDE_NOCMD | WRDE_UNDEF) == 0;
}

/* In a process of its own, but without a shell, and without loading the command and its libraries:
   that takes longer than most runs. */
static int run_plain(wordexp_t *words)
{
    int status = -1;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        shell_enter();
        interrupt_start();
        exit(command_main((int)words->we_wordc, words->we_wordv));
    }
    wordfree(words);
    assert_true(child > 0 && waitpid(child, &status, 0) == child);
    return status;
}

static int run(const char *format, va_list arguments)
{
    char line[8192];
    wordexp_t words;
    int n = snprintf(line, sizeof line, "cd %s/work && { ", folder);
    char *given = line + n;
    n += vsnprintf(given, sizeof line - (size_t)n, format, arguments);
    bool plain = is_plain(given, &words);
    snprintf(line + n, sizeof line - (size_t)n, "; } >../out 2>../err");
    int status = plain ? run_plain(&words) : system(line);
    shell_read();
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

int shell(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int status = run(format, arguments);
    va_end(arguments);
    return status;
}

void shell_works(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    int status = run(format, arguments);
    va_end(arguments);
    if (status != 0)
        print_error("%s", err);
    assert_int_equal(status, 0);
}

const char *shell_out(void) { return out; }
const char *shell_err(void) { return err; }

const char *shell_last_line(void)
{
    size_t length = strlen(out);
    if (length && out[length - 1] == '\n')
        out[--length] = '\0';
    const char *newline = strrchr(out, '\n');
    return newline ? newline + 1 : out;
}

/* Behind the key in `json`; fails the test where it is not. */
static const char *after(const char *json, const char *key)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(json, quoted);
    if (!at)
        fail_msg("no %s in %s", key, json);
    return at + strlen(quoted);
}

static double number_at(const char *text)
{
    return strncmp(text, "null", 4) == 0 ? (double)NAN : strtod(text, NULL);
}

double shell_number(const char *key) { return number_at(after(shell_last_line(), key)); }

double shell_number_in(const char *object, const char *key)
{
    return number_at(after(after(shell_last_line(), object), key));
}

const char *shell_path(const char *name)
{
    snprintf(path, sizeof path, "%s/work/%s", folder, name);
    return path;
}

size_t shell_files(void)
{
    size_t n = 0;
    DIR *directory = opendir(shell_path(""));
    for (struct dirent *entry; directory && (entry = readdir(directory));)
        n += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    if (directory)
        closedir(directory);
    return n;
}

void shell_clean(void)
{
    if (files_remove(shell_path("")) != 0 || mkdir(path, 0777) != 0)
        fprintf(stderr, "%s cannot be emptied\n", path);
}

int shell_empty(void **state)
{
    (void)state;
    shell_clean();
    return 0;
}
