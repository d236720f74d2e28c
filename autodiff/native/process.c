/* Starts other programs and waits for them (process.h). */
#include "process.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdint.h>
#include <sys/wait.h>

extern char **environ;

static int direct(posix_spawn_file_actions_t *files, int stream, int output)
{
    return output == AD_OUTPUT_SHARED ? 0
           : output == AD_OUTPUT_NONE
               ? posix_spawn_file_actions_addopen(files, stream, "/dev/null", O_WRONLY, 0)
               : posix_spawn_file_actions_adddup2(files, output, stream);
}

int ad_process_start(const char *const words[], int output, const sigset_t *blocked, pid_t *child)
{
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    int reason = posix_spawn_file_actions_init(&files);
    if (reason != 0)
        return reason;
    if ((reason = posix_spawnattr_init(&attributes)) == 0) {
        if (blocked) {
            posix_spawnattr_setsigmask(&attributes, blocked);
            posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
        }
        if ((reason = posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0)) == 0 &&
            (reason = direct(&files, 1, output)) == 0 && (reason = direct(&files, 2, output)) == 0)
            reason = posix_spawnp(child, words[0], &files, &attributes,
                                  (char *const *)(uintptr_t)words, environ);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&files);
    return reason;
}

int ad_process_wait(pid_t child)
{
    int status = -1;
    pid_t ended;
    do
        ended = waitpid(child, &status, 0);
    while (ended < 0 && errno == EINTR);
    return ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}
