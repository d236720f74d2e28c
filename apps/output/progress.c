/* A line on the terminal that says how far a run is (progress.h). */
#include "progress.h"
#include "autodiff/clock.h"

#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

/* The first line waits, so that a run of a blink shows none. */
void progress_start(struct progress *progress, bool quiet)
{
    *progress = (struct progress){.shown = !quiet && isatty(STDERR_FILENO), .next = ad_now() + 0.2};
}

bool progress_due(struct progress *progress)
{
    if (!progress->shown)
        return false;
    double time = ad_now();
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
