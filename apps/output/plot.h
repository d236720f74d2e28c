/* Pictures by gnuplot: SVG, PNG, or animated GIF by the extension of the target.

       struct plot plot;
       plot_begin(&plot, "fig.svg", error)
       ... the numbers to plot.data, gnuplot commands to plot.script ...
       plot_commit(&plot, &drawn, error)         or plot_abandon(&plot)

   The gnuplot variable `data` is the name of the data file; terminal and output are set, and the
   axes are grey, left and below. Strings from outside must pass through quote_gnuplot (quote.h).
   Without gnuplot, data and commands are kept as fig.svg.dat and fig.svg.gp. */
#ifndef APPS_OUTPUT_PLOT_H
#define APPS_OUTPUT_PLOT_H

#include "apps/quote.h"
#include "physics/io/atomic_file.h"

#include <stdio.h>

struct plot_format;

struct plot {
    FILE *data, *script;
    bool animated; /* the target is a GIF: one frame a plot command */
    int width,
        height; /* 1040 x 440 where plot_begin's are left; a PNG has 1.5 times as many pixels */
    const struct plot_format *format;
    struct phys_atomic_file picture_file, data_file, script_file;
    char *script_text; /* behind `script` */
    size_t script_length;
};

/* AD_E_ARGUMENT for another extension, AD_E_IO for a target that cannot be written. */
enum ad_status plot_begin(struct plot *plot, const char *target, struct ad_error *error);
/* Draws and renames to the target. Without gnuplot data and commands are kept instead, and standard
   error says how to draw them. */
enum ad_status plot_commit(struct plot *plot, struct ad_error *error);
/* Removes what was written. Does nothing for a zero-initialised plot. */
void plot_abandon(struct plot *plot);

#endif
