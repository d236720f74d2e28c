/* Coordinates of a system in a picture: bodies in the plane or in space, coordinates against time,
   or, of a lattice, a map of site and time. The data have a row a sample: the time, then the
   coordinates. Curves are told apart by colour and named in the legend; many share one colour. */
#ifndef APPS_OUTPUT_COORDINATES_H
#define APPS_OUTPUT_COORDINATES_H

#include "figure.h"
#include "physics/system/system.h"

enum coordinates_view { VIEW_TIME, VIEW_PLANE, VIEW_SPACE, VIEW_MAP };

struct coordinates {
    const struct phys_system *system;
    enum coordinates_view view;
    size_t n, step; /* curves, and columns from one to the next */
    bool named;     /* few enough for a name and a colour each */
    struct axis x, y, z;
    const char *when; /* gnuplot's condition on a row; NULL: all rows are shown */
    char label[32];
};

/* `even`: samples are equally far apart in time, which a map needs. */
void coordinates_begin(struct coordinates *view, const struct phys_system *system,
                       struct range time, bool even);
/* Makes room on the axes for samples; coordinate k of sample i is x[k * stride + i * next]. */
void coordinates_widen(struct coordinates *view, size_t samples, const double *x, size_t stride,
                       size_t next);
void coordinates_panel(struct coordinates *view, struct figure *figure);
/* All curves of the data that gnuplot's words `which` select, in their own colours or, with
   style->colour, in one; `fade`, 0 to 255, makes them transparent. A map is drawn as one. */
void coordinates_draw(const struct coordinates *view, struct figure *figure, const char *which,
                      const struct style *style, int fade);
/* Names of the curves, for the legend; and fixed centres of the scene. */
void coordinates_legend(const struct coordinates *view, struct figure *figure);

#endif
