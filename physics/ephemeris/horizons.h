/* Reader of NASA/JPL Horizons vector tables (https://ssd.jpl.nasa.gov/horizons/manual.html), as
   saved from the web page, the API or a mail:

       struct phys_horizons table;
       struct ad_error error = {0};
       if (phys_horizons_read("mars.txt", &table, &error) != AD_OK) puts(error.message);
       ... table.position[3 * i + k] ...
       phys_horizons_free(&table);

   Read: output formats 1 to 3 (position; and velocity; and light time, range, range rate), CSV or
   labelled or bare rows; units KM-S, KM-D, AU-D; epochs in TDB (JDTDB, formerly JDCT); any header
   before. Columns are found by their names, so further ones (delta-T, uncertainties) do no harm. A
   table must hold geometric cartesian states at increasing epochs in equal steps.

   Errors: AD_E_INPUT with file and line, AD_E_IO, AD_E_MEMORY. Threads: functions may run at once.
 */
#ifndef PHYSICS_EPHEMERIS_HORIZONS_H
#define PHYSICS_EPHEMERIS_HORIZONS_H

#include "autodiff/autodiff.h"

#include <limits.h>

AD_HEADER_BEGIN

enum { PHYS_HORIZONS_NO_ID = INT_MIN };

/* One table as found. Positions in m, velocities in m/s, whatever the file's units were. */
struct phys_horizons {
    char target[64];  /* name without the id, e.g. "Mars" */
    char center[128]; /* e.g. "Solar System Barycenter (0)"; a site on it follows after a comma */
    char frame[128];  /* e.g. "Ecliptic of J2000.0" */
    char units[32];   /* in the file, e.g. "KM-S" */
    int id; /* numeric id of the target, e.g. 499; PHYS_HORIZONS_NO_ID if none is printed */
    char start_date[32]; /* calendar date of the first epoch, YYYY-MM-DD */
    size_t n;            /* epochs, at least 1 */
    double *jd;          /* [n] Julian dates TDB */
    double *position;    /* [n x 3] */
    double *velocity;    /* [n x 3]; NULL for tables of format 1 */
    double gm;           /* m^3/s^2 as printed in the header; 0 if absent */
};

/* Reads one table, line by line, to the end of the file; pipes will do. Free with
   phys_horizons_free; empty on failure. AD_E_INPUT names file, line, column and what was expected:
   no $$SOE or $$EOE, a missing or unknown header line, a record cut short, text or a value that is
   not finite where a number belongs, epochs that do not increase or not in equal steps, a second
   table. AD_E_IO: cannot be read. */
enum ad_status phys_horizons_read(const char *file, struct phys_horizons *table,
                                  struct ad_error *error);
void phys_horizons_free(struct phys_horizons *table);

/* Reads the tables of the bodies in `bodies` (comma-separated names or ids, in that order) from the
   files in a folder. A body is recognised by its name or id in the header, letter case ignored, not
   by the name of its file; "ceres" finds "1 Ceres (A801 AA)" and "mars" finds "Mars Barycenter"
   where there is no "Mars". Other files, and rows of other bodies, are not read. AD_E_INPUT: a body
   without or with two tables; tables that disagree in epochs, centre or frame (both files are
   named). AD_E_ARGUMENT: no bodies, or one named twice. `tables` [n] is owned by the caller: free
   each, then the array. */
enum ad_status phys_horizons_folder(const char *folder, const char *bodies, size_t *n,
                                    struct phys_horizons **tables, struct ad_error *error);

/* Index of an epoch given as an index (digits) or as a calendar date YYYY-MM-DD (TDB midnight;
   Gregorian from 1582-10-15 on, Julian before, as in Horizons). AD_E_ARGUMENT if the table has no
   such epoch, naming those it has. */
enum ad_status phys_horizons_epoch(const struct phys_horizons *table, const char *from,
                                   size_t *index, struct ad_error *error);

/* Calendar date of a Julian date, YYYY-MM-DD, in the same calendar. */
void phys_horizons_date(double jd, char *date, size_t size);

AD_HEADER_END
#endif
