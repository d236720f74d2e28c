/* What the two kinds of data set share on the command line: motions (cmd_dataset.c) and frames
   (dataset_pixels.c). */
#ifndef APPS_DATASET_H
#define APPS_DATASET_H

#include "apps/options.h"

struct dataset_options {
    struct common common;
    const char *out;
    size_t trials, points;
    /* motions */
    double time, noise, min_radius, max_radius, spread, strength;
    /* frames */
    const char *size, *filter, *rows, *columns;
    double dt, max_angle, max_speed;
};

/* --out names a file of HDF5. */
bool dataset_is_hdf5(const char *out);

/* Draws frames and writes them, all that the command does for the task `pixels`. */
enum ad_status dataset_pixels(const struct dataset_options *options, struct ad_error *error);

#endif
