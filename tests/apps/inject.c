/* File faults (inject.h). The kernel notifies this process of the calls that change files
   (seccomp_unotify(2), Linux 5.6), which lets them pass or returns an error. This reaches buffered
   streams, HDF5, and programs started by the command. */
#define _GNU_SOURCE
#include "inject.h"

#include "shell.h"
#include "apps/command.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <omp.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

/* Where a call says which file it is for. */
enum subject { DESCRIPTOR, NAME };

static const struct watched {
    const char *name;
    int number, error;
    bool space; /* may fail for want of space */
    enum subject subject;
} watched[] = {
    {"write", SYS_write, ENOSPC, true, DESCRIPTOR},
    {"write", SYS_writev, ENOSPC, true, DESCRIPTOR},
    {"write", SYS_pwrite64, ENOSPC, true, DESCRIPTOR},
    {"truncate", SYS_ftruncate, ENOSPC, true, DESCRIPTOR},
    {"sync", SYS_fsync, EIO, false, DESCRIPTOR},
    {"close", SYS_close, EIO, false, DESCRIPTOR},
    {"open", SYS_openat, ENOSPC, true, NAME},
#ifdef SYS_rename
    {"rename", SYS_rename, EIO, false, NAME},
#endif
    {"rename", SYS_renameat2, EIO, false, NAME},
};
enum { N_WATCHED = sizeof watched / sizeof *watched };

/* ---- the child ---- */

void inject_words(struct words *words, const char *line)
{
    words->n = snprintf(words->text, sizeof words->text, "leastaction %s", line) > 0 ? 0 : -1;
    for (char *rest = words->text, *word;
         words->n < INJECT_WORDS && (word = strtok_r(rest, " ", &rest));)
        words->word[words->n++] = word;
    words->word[words->n] = NULL;
}

size_t inject_step(size_t all)
{
    const char *given = getenv("FAULTS");
    size_t tried = given ? strtoul(given, NULL, 10) : 3;
    return tried ? (all + tried - 1) / tried : all + 1;
}

size_t inject_first(size_t step)
{
    const char *share = getenv("FUZZ_SHARE");
    return 1 + (share ? strtoul(share, NULL, 10) % 3 : 0) * step / 3;
}

/* Asks for the calls of this process from now on; returns where they are to be read. */
static int hand_over(void)
{
    struct sock_filter filter[2 * N_WATCHED + 2];
    size_t n = 0;
    filter[n++] =
        (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr));
    for (size_t k = 0; k < N_WATCHED; k++) {
        filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K,
                                                   (unsigned)watched[k].number, 0, 1);
        filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF);
    }
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    const struct sock_fprog program = {(unsigned short)n, filter};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
        return -1;
    return (int)syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER,
                        &program);
}

/* ---- this process ---- */

/* The file behind a descriptor of another process lies in the work folder, or is it. */
static bool in_work_folder(unsigned pid, unsigned long long descriptor)
{
    char link[64], file[512];
    snprintf(link, sizeof link, "/proc/%u/fd/%llu", pid, descriptor);
    ssize_t length = readlink(link, file, sizeof file - 2);
    file[length > 0 ? length : 0] = '\0';
    const char *folder = shell_path("");
    return strncmp(strcat(file, "/"), folder, strlen(folder)) == 0;
}

static bool for_reading(unsigned pid, unsigned long long descriptor)
{
    char name[64], line[64];
    unsigned flags = 0;
    snprintf(name, sizeof name, "/proc/%u/fdinfo/%llu", pid, descriptor);
    FILE *info = fopen(name, "r");
    while (info && fgets(line, sizeof line, info))
        if (sscanf(line, "flags: %o", &flags) == 1)
            break;
    if (info)
        fclose(info);
    return (flags & O_ACCMODE) == O_RDONLY;
}

static const struct watched *watched_call(const struct seccomp_notif *call)
{
    size_t k = 0;
    while (watched[k].number != call->data.nr)
        k++;
    const __u64 *argument = call->data.args;
    bool counts = watched[k].subject == DESCRIPTOR
                      ? in_work_folder(call->pid, argument[0]) &&
                            (watched[k].number != SYS_close || !for_reading(call->pid, argument[0]))
                      : watched[k].number != SYS_openat || (argument[2] & O_ACCMODE) != O_RDONLY;
    return counts ? &watched[k] : NULL;
}

static int answer(const struct seccomp_notif *call, pid_t child, struct inject *inject)
{
    const struct watched *w = watched_call(call);
    if (!w)
        return 0;
    inject->calls++;
    if (!inject->first || inject->calls < inject->first ||
        (inject->calls > inject->first && !(inject->and_after && w->space)))
        return 0;
    if (inject->calls == inject->first) {
        inject->what = w->name;
        inject->and_after |= call->pid != (__u32)child;
    }
    return w->error;
}

static void answer_calls(int listener, pid_t child, struct inject *inject)
{
    struct pollfd ready = {.fd = listener, .events = POLLIN};
    while (poll(&ready, 1, -1) > 0 && (ready.revents & POLLIN)) {
        struct seccomp_notif call = {0};
        if (ioctl(listener, SECCOMP_IOCTL_NOTIF_RECV, &call) != 0)
            continue;
        int error = answer(&call, child, inject);
        struct seccomp_notif_resp reply = {.id = call.id, .error = -error, .flags = 0};
        if (!error)
            reply.flags |= (__u32)SECCOMP_USER_NOTIF_FLAG_CONTINUE;
        ioctl(listener, SECCOMP_IOCTL_NOTIF_SEND, &reply);
    }
}

/* The listener of a child, which says under which number it is open there. */
static int listener_of(pid_t child, int from_child)
{
    int number = -1, process = (int)syscall(SYS_pidfd_open, child, 0);
    if (recv(from_child, &number, sizeof number, 0) != sizeof number)
        number = -1;
    int listener = (int)syscall(SYS_pidfd_getfd, process, number, 0);
    close(process);
    return listener;
}

/* The exit status of a child, or 128 + its signal; then what it printed can be read. */
static int wait_for(pid_t child)
{
    int status;
    if (waitpid(child, &status, 0) != child)
        return -1;
    shell_read();
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

int inject_run(const struct words *words, struct inject *inject)
{
    int ends[2];
    inject->calls = 0;
    inject->what = "";
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0)
        return -1;
    pid_t child = fork();
    if (child == 0) {
        struct words own = *words;
        shell_enter();
        omp_get_max_threads(); /* clang's runtime opens a file first, and aborts where it cannot */
        int listener = hand_over();
        char go;
        send(ends[1], &listener, sizeof listener, 0);
        if (recv(ends[1], &go, 1, 0) != 1)
            _exit(127);
        exit(command_main(own.n, own.word));
    }
    int listener = listener_of(child, ends[0]);
    if (listener >= 0) {
        send(ends[0], "", 1, 0);
        close(ends[0]);
        close(ends[1]);
        answer_calls(listener, child, inject);
        close(listener);
    } else {
        close(ends[0]);
        close(ends[1]);
    }
    int status = wait_for(child);
    return listener < 0 ? -1 : status;
}

int inject_without_rights(const struct words *words)
{
    const uid_t nobody = 65534;
    pid_t child = fork();
    if (child == 0) {
        struct words own = *words;
        shell_enter();
        if (geteuid() == 0 && setuid(nobody) != 0)
            _exit(127);
        int done = command_main(own.n, own.word);
        fflush(NULL);
        _exit(done); /* gcov would write its counts, without rights, and say that it cannot */
    }
    return wait_for(child);
}
