/* A progress line (progress.h). */
#include "progress.h"
#include "autodiff/clock.h"

#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

/* Seconds before the first line, so that short runs print none, and between lines. */
static const double first[] = {60, 0.2}, between[] = {60, 0.1};

void progress_start(struct progress *progress, bool quiet)
{
    bool terminal = isatty(STDERR_FILENO);
    *progress = (struct progress){
        .shown = !quiet, .terminal = terminal, .next = ad_now() + first[terminal]};
}

/* The clock without the processor's counter, where there is one: 7 ns instead of 36, and a few
   milliseconds late. */
static double coarse_now(void)
{
#ifdef CLOCK_MONOTONIC_COARSE
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC_COARSE, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
#else
    return ad_now();
#endif
}

bool progress_due(struct progress *progress)
{
    if (!progress->shown)
        return false;
    double time = coarse_now();
    if (time < progress->next)
        return false;
    progress->next = time + between[progress->terminal];
    return true;
}

void progress_line(struct progress *progress, const char *format, ...)
{
    if (!progress->shown)
        return;
    va_list arguments;
    va_start(arguments, format);
    fputs(progress->terminal ? "\r\033[K" : "leastaction: ", stderr);
    vfprintf(stderr, format, arguments);
    if (!progress->terminal)
        fputc('\n', stderr);
    va_end(arguments);
    fflush(stderr);
}

void progress_end(struct progress *progress)
{
    if (progress->shown && progress->terminal)
        fputs("\r\033[K", stderr);
}
