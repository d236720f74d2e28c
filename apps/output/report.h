/* The results of a run as one table, from which text, JSON and HDF5 are written, so that all three
   agree. A row has a key (in JSON and, as an attribute, in HDF5), a label (in the text), a unit and
   a value; a row without a label is omitted from the text. Consecutive rows of one label share one
   line of the text. Rows after report_item belong to the next object of an array.

       struct report report = {0};
       report_number(&report, "action", "action", "J s", 1.5);
       report_json(&report, stdout);
       report_free(&report);

   Errors of adding rows are sticky: the first failed allocation is kept, and report_print,
   report_json and report_file return it. Units and texts are copied, keys and labels are not.
   Numbers that are not finite are null in JSON, NaN in HDF5, and blank in the text. */
#ifndef APPS_OUTPUT_REPORT_H
#define APPS_OUTPUT_REPORT_H

#include "apps/options.h"
#include "hnn/hnn.h"
#include "physics/io/hdf5_file.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

struct report_row;

struct report {
    size_t n;
    struct report_row *row;
    const char *array; /* that rows are added to, NULL: the run itself; and the object in it */
    size_t item;
    const char *object; /* rows added while this is set belong to this object of the run, such as
                           "against", and stand on the line of the text of the row before that has
                           their label; NULL: the run itself */
    bool passing; /* rows added while this is set tell of the run and not of its result (times):
                     HDF5 is without them, so that equal runs give equal files */
    bool failed;
};

void report_number(struct report *report, const char *key, const char *label, const char *unit,
                   double value);
void report_count(struct report *report, const char *key, const char *label, size_t value);
void report_flag(struct report *report, const char *key, const char *label, bool value);
void report_text(struct report *report, const char *key, const char *label, const char *value);
/* A list of numbers, [n], copied. */
void report_list(struct report *report, const char *key, const char *label, const char *unit,
                 size_t n, const double values[]);
/* A list of texts of one line each, copied; not in the text. In HDF5 they are lines of one
 * attribute.
 */
void report_texts(struct report *report, const char *key, size_t n, const char *const texts[]);
/* A line of the text alone: a heading, or a sentence. */
void report_line(struct report *report, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* Begins the next object of an array; NULL: back to the run itself. In the text an array is a table
   under the labels of its first object, if these have any. */
void report_item(struct report *report, const char *array);

/* Of a number over the runs of an ensemble: the deviation with n - 1, NaN of fewer than two. */
struct spread {
    size_t n;
    double mean, deviation, least, most;
};

/* Of n values at a distance of `stride`; those that are not finite are left out. */
struct spread spread_of(size_t n, const double values[], size_t stride);
/* Rows of an item of the array "spread": how many are `counted`, mean, deviation, least, most. */
void report_spread(struct report *report, const char *counted, const char *unit,
                   const struct spread *spread);

enum ad_status report_print(const struct report *report, FILE *out, struct ad_error *error);
enum ad_status report_json(const struct report *report, FILE *out, struct ad_error *error);
/* Attributes of the file, lists as datasets, arrays as folders ARRAY/0, ARRAY/1, ..., an object as
   a folder. */
enum ad_status report_file(const struct report *report, phys_hdf5 *file, struct ad_error *error);
/* Names of what the columns or rows of a run file's main dataset are: an attribute with a name a
   line; and how many of them place a body in space (0: they do not). */
void report_coordinates(phys_hdf5 *file, size_t n, const void *context,
                        void (*name)(const void *context, size_t k, char *text, size_t size),
                        size_t of_body);
/* The parameters of a system: attributes of the folder "parameters"; its coordinates: attributes of
   the file. */
void report_parameters(const struct phys_system *system, phys_hdf5 *file);
/* On standard output what the options ask for: JSON, text, or nothing; nothing, too, where `error`
   has something. Frees the report. */
enum ad_status report_show(struct report *report, const struct common *common,
                           struct ad_error *error);
void report_free(struct report *report);

/* ---- units as printed ---- */

/* Pure numbers carry the unit 1, which a reader need not see. */
static inline const char *unit_shown(const char *unit)
{
    return unit && strcmp(unit, "1") != 0 ? unit : "";
}

/* A unit behind a number: with a blank before it. */
static inline const char *unit_blank(const char *unit) { return *unit_shown(unit) ? " " : ""; }
/* The unit of a force, of an energy over a coordinate's: nothing where all are pure numbers. */
enum { UNIT_FORCE = 64 };
static inline void unit_of_force(const char *energy, const char *length, char unit[UNIT_FORCE])
{
    const char *below = unit_shown(length);
    snprintf(unit, UNIT_FORCE, "%s%s%s", *below && !*unit_shown(energy) ? "1" : unit_shown(energy),
             *below ? "/" : "", below);
}

/* ---- learnt scenes (hnn_system_open) ---- */

/* Whose motion the errors are of, and which of n states x [n][2 dof] (q, then v) is the first
   outside the range of training, at what t [n]; NULL: not known when. Nothing of other scenes. */
void report_learnt(const struct phys_system *system, size_t n, const double *t, const double *x,
                   struct report *report);

#endif
