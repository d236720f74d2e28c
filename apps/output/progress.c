/* A progress line (progress.h). */
#include "progress.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

/* Seconds before the first line, so that short runs print none, and between lines. */
static const double first[] = {60, 0.2}, between[] = {60, 0.1};

void progress_start(struct progress *progress, bool quiet)
{
    bool terminal = isatty(STDERR_FILENO);
    *progress = (struct progress){.shown = !quiet, .terminal = terminal, .started = ad_now()};
    progress->next = progress->started + first[terminal];
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

/* "35/s, 2 min left"; nothing where the rate is not known. */
static void print_rate(const struct progress *progress, double done, double total)
{
    double rate = (done - progress->from) / (ad_now() - progress->started);
    double left = (total - done) / rate;
    if (!(rate > 0) || !isfinite(rate))
        return;
    fprintf(stderr, ", %.3g/s", rate);
    if (total > 0 && left >= 0)
        fprintf(stderr,
                left < 90     ? ", %.0f s left"
                : left < 5400 ? ", %.0f min left"
                              : ", %.1f h left",
                left < 90     ? left
                : left < 5400 ? left / 60
                              : left / 3600);
}

void progress_line(struct progress *progress, double done, double total, const char *format, ...)
{
    if (!progress->shown)
        return;
    va_list arguments;
    va_start(arguments, format);
    fputs(progress->terminal ? "\r\033[K" : "leastaction: ", stderr);
    vfprintf(stderr, format, arguments);
    print_rate(progress, done, total);
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
