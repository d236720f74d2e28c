/* The output files of a run. All are begun before it starts, so that an unwritable one is detected
   before anything is computed. */
#ifndef APPS_OUTPUT_OUTPUTS_H
#define APPS_OUTPUT_OUTPUTS_H

#include "apps/options.h"
#include "plot.h"
#include "report.h"
#include "result.h"

struct outputs {
    phys_hdf5 *file;         /* NULL, or with .out or .script NULL: not asked for */
    struct result csv, page; /* the page is made of the file, which is kept where --out asks */
    struct plot plot;
};

/* What a run writes, of whatever struct; file, csv and picture are called where they are asked for.
 */
struct output_kind {
    void (*report)(const void *run, struct report *report);
    /* Datasets: program, command and the report are there already. */
    enum ad_status (*file)(const void *run, phys_hdf5 *file, struct ad_error *error);
    void (*csv)(const void *run, FILE *out);
    enum ad_status (*picture)(const void *run, struct plot *plot, struct ad_error *error);
    /* Before the run, with the files begun; NULL: nothing. */
    enum ad_status (*begin)(void *run, struct outputs *outputs, struct ad_error *error);
};
/* Begins the files, runs, writes and shows. `go` NULL: it has run. */
enum ad_status outputs_run(const struct output_kind *kind, const struct common *common, void *run,
                           enum ad_status (*go)(void *run, struct ad_error *error),
                           struct ad_error *error);

#endif
