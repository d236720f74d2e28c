/* Inside of scans (scan.h): what is scanned (scan_axes.c), running (scan.c), the numbers
   shown (scan_choice.c), the table (scan_table.c) and its picture (scan_picture.c). */
#ifndef APPS_OUTPUT_SCAN_PARTS_H
#define APPS_OUTPUT_SCAN_PARTS_H

#include "apps/output/report.h"
#include "outputs.h"
#include "scan.h"

enum { AXES = 2, PANELS = 4, MOST = 100000, MOST_SEED = 1000000000, LONGEST = 8, KEY = 96 };

struct axis_of_scan {
    const char *flag; /* "scan", "sweep" or "seeds" */
    char name[64];
    char unit[64];
    double from, to;
    size_t n;
    bool log;
    const struct option *option; /* NULL: a parameter of the scene */
    char **text;                 /* [n] values of the option */
    bool list;                   /* they were listed, and stand at equal distances in pictures */
};

/* What a run came to, for all ranks: status, error, and the rows of its report one behind the
   other, a struct scan_row each. */
struct scan_record {
    char *bytes; /* NULL: none */
    size_t n;
};
struct scan_row {
    char key[KEY];
    char unit[40];
    bool labelled;
    double value;
};

/* A number of the reports: one a run, NaN where a report is without. */
struct result_column {
    char key[KEY];
    char unit[40];
    double *value; /* [runs] */
    bool labelled, shown;
    size_t panel; /* where it is shown, from 1; of items FROM-TO all in one */
};

struct scan {
    const struct command *command;
    const struct common *common;
    struct axis_of_scan axis[AXES];
    const char *scene;
    size_t axes, runs, run; /* run: which is on */
    size_t n;
    struct result_column *column;
    int *status; /* [runs] */
    size_t missed;
    size_t first;                 /* that missed */
    struct ad_error why, unshown; /* of the picture */
    bool no_memory;
    FILE *rows;                 /* of the run that is on */
    struct scan_record *record; /* [runs], each until its place in the table is due */
};

/* Reads and checks all axes before anything runs; freed by scan_axes_free. */
enum ad_status scan_axes_read(struct scan *scan, struct ad_error *error);
void scan_axes_free(struct scan *scan);
/* Gives the options of a run the values of its place. */
enum ad_status scan_axes_store(const struct scan *scan, size_t run, struct common *member,
                               struct ad_error *error);
/* NAME-OPTION=VALUE.EXT, to be freed: a file of one of the runs. NULL: out of memory. */
char *scan_member_file(const struct scan *scan, size_t run, const char *file);

/* The value at place k of an axis, from 0 to n - 1, or, of a list, the place; halves are the edges
   of cells. */
double scan_between(const struct axis_of_scan *axis, double k);
/* The place of a run on an axis, and the value scanned there: NaN for a word. */
size_t scan_place(const struct scan *scan, size_t axis, size_t run);
double scan_value(const struct scan *scan, size_t axis, size_t run);
/* The word, NULL for a number. */
const char *scan_word(const struct scan *scan, size_t axis, size_t run);
/* The scene, or another argument. */
const char *scan_subject(const struct scan *scan);
/* Whether the last axis is that of seeds; then the spread of a number over those of a point. */
bool scan_over_seeds(const struct scan *scan);
struct spread scan_spread(const struct scan *scan, const struct result_column *column,
                          size_t point);
/* Marks the columns of --curves KEY,...; else the first that the text has and that vary. */
enum ad_status scan_choose(struct scan *scan, struct ad_error *error);
enum ad_status scan_draw(const void *scan, struct plot *plot, struct ad_error *error);
/* The outputs of the table. */
extern const struct output_kind scan_outputs;

#endif
