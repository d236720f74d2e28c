/* A picture of panels with curves, by gnuplot (plot.h), in one style for all charts.

       figure_begin(&figure, plot, &layout);
       figure_panel(&figure, &panel);          the next place, row by row
       figure_curve(&figure, sheet, ...);          ... any number of them
       figure_end(&figure);

   Other commands go to plot->script: before figure_begin what holds for the whole picture, between
   a panel and its first curve what holds for that panel. */
#ifndef APPS_OUTPUT_FIGURE_H
#define APPS_OUTPUT_FIGURE_H

#include "plot.h"
#include "sheet.h"

struct range {
    double low, high;
};

/* Takes a value in; a range begins as {INFINITY, -INFINITY}. */
void range_widen(struct range *range, double value);
/* With margins in units of its span. */
struct range range_with_margins(struct range range, double below, double above);
/* The power of ten that an axis is labelled in; 0 where plain numbers are short. */
int range_exponent(struct range range);

/* An axis of a scene: "x / 10^{11} m". Name and unit may hold any text; pure numbers have the unit
   1. */
struct axis {
    const char *name, *unit;
    struct range range; /* both 0: gnuplot's own */
    int power;          /* the values are in units of 10^power */
};

/* A rectangle, in shares of the picture from the left and below. */
struct place {
    double left, right, bottom, top;
};

/* Places of panels, in the same shares. */
struct layout {
    int width, height; /* of the picture; 0: as it is */
    const char *title; /* above all panels; NULL: none */
    int rows, columns; /* 0: 1 */
    struct place room; /* of all panels together */
    struct {
        double x, y;
    } gap;                  /* between them */
    const char *expression; /* the title as an expression of gnuplot's */
    const char *found;      /* a second line: what the run found; NULL: none */
    size_t frames; /* of an animation, in which commands know the frame as f, from 0; 0: a still */
};

/* Two panels side by side under a title of two lines, with room for a legend above the right one
   (KEY_ABOVE) and one between them (KEY_BESIDE). */
extern const struct layout figure_pair;
#define KEY_ABOVE "at graph 0.5,1.01 center bottom horizontal samplen 1.5 width 0"
#define KEY_BESIDE "at graph 1.03,1 " KEY_COLUMN
#define KEY_COLUMN "left top vertical Left reverse samplen 1.5"
/* The most entries of a legend; more curves are shown as groups. */
enum { FIGURE_LEGEND = 8 };

struct panel {
    const char *title, *x, *y; /* of the axes; NULL: none */
    struct axis across, up;    /* or these */
    struct axis depth;         /* with a name: a view in space, of splot */
    struct axis colour;        /* with a name: that of the colour bar */
    struct place place;        /* all 0: the next of the layout */
    bool equal;                /* units of both axes are equally long; they have ranges */
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

#define STYLE(colour_, mark_, width_, size_)                                                       \
    (&(const struct style){                                                                        \
        .colour = (colour_), .mark = (mark_), .width = (width_), .size = (size_)})
/* Of curves that differ in nothing but their number: those of Okabe and Ito, which colour-blind
   readers tell apart. */
extern const char *const figure_colours[FIGURE_LEGEND];
#define COLOUR_REFERENCE "#c4c4c4"
/* Of densities, white where there is nothing. */
#define DENSITY_PALETTE                                                                            \
    "set palette defined (0 '#ffffff', .15 '#cfe3f3', .4 '#62acd8', .75 '#0b4f8a', 1 '#06264a')\n"

/* A line of findings with commas between; what is longer than a picture is wide is left out. */
struct line {
    char text[180];
    size_t length;
};
void line_add(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));

struct figure {
    struct plot *plot;
    struct layout layout;
    int panel;     /* how many there are */
    size_t blocks; /* of data */
    bool drawing;  /* a plot command is open */
    bool space;    /* ... of splot */
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
/* The same in a style; title NULL: none. */
void figure_draw(struct figure *figure, const struct style *style, const char *title,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));
void figure_end(struct figure *figure);

#endif
