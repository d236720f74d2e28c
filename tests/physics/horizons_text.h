/* Horizons tables as text, in every form in which the service prints them. */
#ifndef TESTS_HORIZONS_TEXT_H
#define TESTS_HORIZONS_TEXT_H

#include <stdbool.h>
#include <stddef.h>

enum form { FORM_CSV, FORM_LABELLED, FORM_BARE };

struct layout {
    enum form form;
    int type; /* 1 to 3 */
    const char *units;
    bool old;     /* as before 2015: JDCT, "Coordinate systm" */
    bool delta_t; /* a column that nobody needs (CSV) */
    bool crlf;
};

enum { STATES = 4 };

struct states {
    const char *target;      /* "Mars (499)" */
    double first, step;      /* JD, days */
    double state[STATES][6]; /* m, m/s */
};

/* High-entropy states of planetary size, the same for one seed. */
struct states random_states(const char *target, unsigned seed);

/* The table (free). */
char *print_table(const struct states *states, const struct layout *layout);

/* A copy of `text` with the first `from` made `to` (free); fails the test if there is none. */
char *replaced(const char *text, const char *from, const char *to);

#endif
