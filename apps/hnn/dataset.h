/* Options shared by the two kinds of data set: motions (cmd_dataset.c) and frames
   (dataset_pixels.c), of a rod or of the bodies of a motion. */
#ifndef APPS_HNN_DATASET_H
#define APPS_HNN_DATASET_H

#include "apps/output/report.h"
#include "hnn/pixels/pixels.h"

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

/* Adds what all tasks report, and shows it; not behind a table on standard output. */
enum ad_status dataset_show(struct report *report, const struct dataset_options *options,
                            double seconds, struct ad_error *error);

/* Of frames: refuses an --out that is not HDF5; --size; what is reported. */
enum ad_status dataset_check_hdf5(const struct dataset_options *options, struct ad_error *error);
enum ad_status dataset_read_size(const char *text, struct hnn_video_settings *settings,
                                 struct ad_error *error);
enum ad_status dataset_show_frames(const struct dataset_options *options, const char *task,
                                   const struct hnn_frames *frames, double seconds,
                                   struct ad_error *error);

/* Draws frames and writes them, all that the command does for the task `pixels`. */
enum ad_status dataset_pixels(const struct dataset_options *options, struct ad_error *error);

#endif
