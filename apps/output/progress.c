/* A progress line (progress.h). */
#include "progress.h"
#include "autodiff/clock.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <unistd.h>

/* Seconds before the first line, so that short runs print none, and between lines. */
static const double first[] = {60, 0.2}, between[] = {60, 0.1}, row_between = 0.2;

bool progress_log_begin(const char *log)
{
    FILE *out = fopen(log, "w");
    bool begun = out && fputs("seconds,done,total,seconds_left\n", out) >= 0;
    return out && fclose(out) == 0 && begun;
}

void progress_start(struct progress *progress, bool quiet, const char *log)
{
    bool terminal = isatty(STDERR_FILENO);
    *progress = (struct progress){.shown = !quiet, .terminal = terminal, .started = ad_now()};
    progress->next = progress->started + first[terminal];
    progress->log = log ? fopen(log, "a") : NULL;
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
    if (!progress->shown && !progress->log)
        return false;
    double time = coarse_now();
    return (progress->shown && time >= progress->next) ||
           (progress->log && time >= progress->next_row);
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

static void write_row(const struct progress *progress, double done, double total)
{
    double seconds = ad_now() - progress->started;
    double left = (total - done) * seconds / (done - progress->from);
    fprintf(progress->log, "%.3f,%.9g,", seconds, done);
    if (total > 0)
        fprintf(progress->log, "%.9g", total);
    if (total > 0 && isfinite(left) && left >= 0)
        fprintf(progress->log, ",%.3g\n", left);
    else
        fputs(",\n", progress->log);
    fflush(progress->log);
}

void progress_line(struct progress *progress, double done, double total, const char *format, ...)
{
    double time = coarse_now();
    if (progress->log && time >= progress->next_row) {
        write_row(progress, done, total);
        progress->next_row = time + row_between;
    }
    if (!progress->shown || time < progress->next)
        return;
    progress->next = time + between[progress->terminal];
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
    if (progress->log)
        fclose(progress->log);
    progress->log = NULL;
}
