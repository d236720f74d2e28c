/* A progress line: updated in place on a terminal, one line a minute elsewhere. */
#ifndef APPS_PROGRESS_H
#define APPS_PROGRESS_H

#include <stdbool.h>

struct progress {
    bool shown, terminal;
    double next; /* time of the next update, s */
};

/* `quiet`: nothing is ever shown. */
void progress_start(struct progress *progress, bool quiet);
/* True at most ten times a second, or once a minute: when a line is worth formatting. */
bool progress_due(struct progress *progress);
/* Replaces the line, or prints another. */
void progress_line(struct progress *progress, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* Removes the line of a terminal. */
void progress_end(struct progress *progress);

#endif
