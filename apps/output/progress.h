/* A progress line: updated in place on a terminal, one line a minute elsewhere. */
#ifndef APPS_OUTPUT_PROGRESS_H
#define APPS_OUTPUT_PROGRESS_H

#include <stdbool.h>
#include <stdio.h>

struct progress {
    bool shown, terminal;
    double next;    /* time of the next update, s */
    double started; /* ... and of the start */
    FILE *log;      /* rows at most five times a second; NULL: none */
    double next_row;
    double from; /* what was done before it, of a run that is resumed */
};

/* `quiet`: no line is shown. `log`: a file that rows are appended to as they come; NULL: none. */
void progress_start(struct progress *progress, bool quiet, const char *log);
/* True at most ten times a second, or once a minute, and when a row is due: when a line is worth
   formatting. */
bool progress_due(struct progress *progress);
/* The titles of such a file; false: it cannot be written. */
bool progress_log_begin(const char *log);
/* Replaces the line, or prints another, with the rate so far and the time left for the rest of
   `total` at that rate; total 0: how much there is to do is not known. */
void progress_line(struct progress *progress, double done, double total, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 4, 5)))
#endif
    ;
/* Removes the line of a terminal. */
void progress_end(struct progress *progress);

#endif
