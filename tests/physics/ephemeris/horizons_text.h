/* Horizons tables as text, in every form in which the service prints them, and what reading them
   must give. */
#ifndef TESTS_PHYSICS_EPHEMERIS_HORIZONS_TEXT_H
#define TESTS_PHYSICS_EPHEMERIS_HORIZONS_TEXT_H

#include "physics/ephemeris/horizons.h"

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

/* The commonest: labelled, type 3, km and s. */
extern const struct layout plain_layout;

/* A copy of `text` with the first `from` made `to` (free); fails the test if there is none. */
char *replaced(const char *text, const char *from, const char *to);

/* Reads a table that must be fine. */
struct phys_horizons read_fine(const char *file);
void free_tables(struct phys_horizons *tables, size_t n);

/* Is this what was printed, to the last of 16 digits? */
void assert_states(const struct phys_horizons *table, const struct states *states, int type);

#endif
