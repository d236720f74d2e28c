/* A line on the terminal that says how far a run is; nothing where stderr is not a terminal. */
#ifndef APPS_PROGRESS_H
#define APPS_PROGRESS_H

#include <stdbool.h>

struct progress {
    bool shown;
    double next; /* time of the next update, s */
};

/* `quiet`: nothing is ever shown. */
void progress_start(struct progress *progress, bool quiet);
/* True at most ten times a second: when a line is worth formatting. */
bool progress_due(struct progress *progress);
/* Replaces the line. */
void progress_line(struct progress *progress, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* Removes the line. */
void progress_end(struct progress *progress);

#endif
