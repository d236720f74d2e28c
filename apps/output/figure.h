/* A picture of panels with curves, by gnuplot (plot.h): one look for all charts.

       figure_begin(&figure, plot, &layout);
       figure_panel(&figure, &panel);          the next place, row by row
       figure_curve(&figure, sheet, ...);          ... any number of them
       figure_end(&figure); */
#ifndef APPS_OUTPUT_FIGURE_H
#define APPS_OUTPUT_FIGURE_H

#include "plot.h"
#include "sheet.h"

/* Places of panels, in shares of the picture. */
struct layout {
    int width, height; /* of the picture */
    const char *title; /* above all panels; NULL: none */
    int rows, columns;
    double left, right, bottom, top; /* margins of all panels together, from the left and below */
    double gap_x, gap_y;
};

struct panel {
    const char *title, *x, *y; /* of the axes; NULL: none */
    const char *log;           /* axes with powers of ten: "x", "y", "xy"; NULL: none */
    const char *x_range, *y_range, *x_tics,
        *y_tics;      /* as gnuplot's set takes them; NULL: its own */
    const char *key;  /* where the legend stands; NULL: there is none */
    const char *more; /* further commands, ended by a newline; NULL: none */
};

struct style {
    const char *colour;
    int mark;           /* of points; 0: none */
    double width, size; /* of lines (0: none) and marks; size 0: 0.6 */
    const char *dash;   /* NULL: solid */
    const char *axes;   /* NULL: the panel's; else x1y2 */
};

/* The words behind the data of an element: "with lines lw 2 ... title ..."; title NULL: none. */
void style_write(FILE *out, const struct style *style, const char *title);
#define STYLE(colour_, mark_, width_, size_)                                                       \
    (&(const struct style){                                                                        \
        .colour = (colour_), .mark = (mark_), .width = (width_), .size = (size_)})
/* Of densities, white where there is nothing. */
#define DENSITY_PALETTE                                                                            \
    "set palette defined (0 '#ffffff', .15 '#cfe3f3', .4 '#62acd8', .75 '#0b4f8a', 1 '#06264a')\n"

struct figure {
    struct plot *plot;
    struct layout layout;
    int panel;     /* how many there are */
    size_t blocks; /* of data */
    bool drawing;  /* a plot command is open */
};

void figure_begin(struct figure *figure, struct plot *plot, const struct layout *layout);
void figure_panel(struct figure *figure, const struct panel *panel);
/* A curve of the rows of a sheet in which each of some keys, pairs (key, name) at the end of the
   arguments, has the name behind it: y over x. Rows without either number are left out. `title`
   NULL: it is not in the legend. */
#define figure_curve(...) figure_curve_where(__VA_ARGS__, (const char *)NULL)
void figure_curve_where(struct figure *figure, const struct sheet *sheet, const char *x,
                        const char *y, const char *title, const struct style *style, ...);
/* Another element of the plot command: gnuplot's words after "plot". */
void figure_element(struct figure *figure, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void figure_end(struct figure *figure);

#endif
