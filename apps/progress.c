/* A line on the terminal that says how far a run is (progress.h). */
#include "progress.h"

#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* The first line waits, so that a run of a blink shows none. */
void progress_start(struct progress *progress, bool quiet)
{
    *progress = (struct progress){.shown = !quiet && isatty(STDERR_FILENO), .next = now() + 0.2};
}

bool progress_due(struct progress *progress)
{
    if (!progress->shown)
        return false;
    double time = now();
    if (time < progress->next)
        return false;
    progress->next = time + 0.1;
    return true;
}

void progress_line(struct progress *progress, const char *format, ...)
{
    if (!progress->shown)
        return;
    va_list arguments;
    va_start(arguments, format);
    fputs("\r\033[K", stderr);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fflush(stderr);
}

void progress_end(struct progress *progress)
{
    if (progress->shown)
        fputs("\r\033[K", stderr);
}
