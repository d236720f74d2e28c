/* Charts: measurements that write CSV files and pictures to a folder and print a table. A chart is
   a function in a file of its own and a line of charts.def. It opens sheets and pictures, measures
   row by row, and draws; all files are put in place at its end, or none.

       enum ad_status chart_NAME(struct chart *chart, struct ad_error *error)
       {
           struct sheet *sheet = chart_sheet(chart, "NAME", columns, error);
           struct plot *plot = chart_picture(chart, "NAME", error);
           ... sheet_row(sheet, ROW(...), error) ...
           ... figure_begin(&figure, plot, &layout) ... unless there is an error
           return error->status;
       } */
#ifndef APPS_BENCH_CHART_H
#define APPS_BENCH_CHART_H

#include "apps/output/figure.h"
#include "apps/output/result.h"
#include "apps/output/sheet.h"

enum { CHART_SHEETS = 4, CHART_PICTURES = 8 };

struct chart {
    const char *folder, *format; /* created where missing; of the pictures: svg or png */
    bool quick;                  /* fewer repetitions, a smaller range */
    bool quiet;                  /* no tables on the terminal */
    const char *data, *from;     /* ephemeris: the folder of tables, and the first day */
    size_t days;
    double latency, bandwidth, flops; /* scale: of the machines planned for; s, bytes/s, 1/s */

    struct json json;   /* of results that are not rows */
    const char *missed; /* why the exit status is 1; NULL: it is 0 */
    size_t sheets, pictures;
    struct sheet sheet[CHART_SHEETS];
    struct result csv[CHART_SHEETS];
    struct plot picture[CHART_PICTURES];
};

/* Begins NAME.csv in the folder under lines that say on what machine, when and with which versions.
   Called before anything is measured, so that a folder that cannot be written is found at once.
   Never NULL; where there is an error the sheet takes no rows. */
struct sheet *chart_sheet(struct chart *chart, const char *name, const struct column *columns,
                          struct ad_error *error);
/* Begins the picture NAME.svg (or .png). Never NULL; where there is an error it has no streams. */
struct plot *chart_picture(struct chart *chart, const char *name, struct ad_error *error);
/* For a table on the terminal that is no sheet; NULL: quiet. */
FILE *chart_terminal(const struct chart *chart);

#define CHART(name) enum ad_status chart_##name(struct chart *chart, struct ad_error *error);
#include "charts.def"
#undef CHART
/* Parts of `integrators`, `linear` and `gradients`: drift.csv, energy over many periods at equal
   work; ensembles.csv, members at once and one after the other; threads.csv, gradients and a
   training step on one thread and on two, missed where a bit differs; forces.csv, accelerations
   beside hand-written C. */
enum ad_status chart_ensembles(struct chart *chart, struct ad_error *error);
enum ad_status chart_drift(struct chart *chart, struct ad_error *error);
enum ad_status chart_threads(struct chart *chart, struct ad_error *error);
enum ad_status chart_forces(struct chart *chart, struct ad_error *error);
enum ad_status chart_sizes(struct chart *chart, struct ad_error *error);

#endif
