/* Coordinates of a system in a picture: bodies in the plane, or coordinates against time. The data
   have a row a sample: the time, then the coordinates. */
#ifndef APPS_OUTPUT_COORDINATES_H
#define APPS_OUTPUT_COORDINATES_H

#include "figure.h"
#include "physics/system/system.h"

struct coordinates {
    size_t n, step; /* curves, and columns from one to the next */
    bool plane;
    struct axis x, y;
};

void coordinates_begin(struct coordinates *view, const struct phys_system *system,
                       struct range time);
/* Makes room on the axes for samples; coordinate k of sample i is x[k * stride + i * next]. */
void coordinates_widen(struct coordinates *view, size_t samples, const double *x, size_t stride,
                       size_t next);
void coordinates_panel(struct coordinates *view, struct figure *figure);
/* Curve c of the data that gnuplot's words `which` select. */
void coordinates_draw(const struct coordinates *view, struct figure *figure, size_t c,
                      const char *which, const struct style *style, const char *title);

#endif
