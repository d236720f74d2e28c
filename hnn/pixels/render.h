/* Geometry of the rod of pixels.h in a grid of pixels (render.c), for the filters (filter.c). */
#ifndef HNN_PIXELS_RENDER_H
#define HNN_PIXELS_RENDER_H

#include "pixels.h"

struct hnn_point {
    double x, y;
};

/* How a rod lies in a frame. */
struct hnn_drawing {
    const struct hnn_rod *rod;
    struct hnn_point first, step; /* middle of the first pixel; from one to the next, down too */
    struct hnn_point along;       /* unit vector; across it is (-along.y, along.x) */
    struct hnn_point half_width;  /* of a pixel, to the right, in coordinates along and across */
    struct hnn_point half_height;
    double reach; /* from a pixel's middle to its corners */
};
struct hnn_drawing hnn_drawing_of(const struct hnn_rod *rod, double angle, size_t height,
                                  size_t width);
/* The covered part of pixel (i, j). */
double hnn_drawing_coverage(const struct hnn_drawing *drawing, size_t i, size_t j);

#endif
