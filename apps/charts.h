/* Charts: measurements that leave their data in a folder and print a table. One function, one file
   each; the table of cmd_chart.c names them. */
#ifndef APPS_CHARTS_H
#define APPS_CHARTS_H

#include "../autodiff/autodiff.h"

struct chart_settings {
    const char *folder; /* created where missing */
    bool quick;         /* fewer repetitions */
    bool json, quiet;   /* a JSON object as last line; no table */
};

/* Gradient of the action by the tape and by hand, and the value alone: folder/gradients.csv.
   Returns the exit status: NOT_REACHED where the two gradients differ. */
int chart_gradients(const struct chart_settings *settings, struct ad_error *error);

#endif
