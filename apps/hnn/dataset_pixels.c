/* leastaction dataset pixels: frames of a swinging rod. */
#include "apps/command.h"
#include "dataset.h"
#include "apps/option_values.h"
#include "autodiff/clock.h"
#include "hnn/pixels/frames.h"
#include "physics/io/hdf5_file.h"

#include <string.h>

/* ---- options ---- */

/* N, or HEIGHT,WIDTH. */
enum ad_status dataset_read_size(const char *text, struct hnn_video_settings *settings,
                                 struct ad_error *error)
{
    double size[2];
    bool both = text && strchr(text, ',');
    if (!text)
        return AD_OK;
    if (numbers_read("size", text, both ? 2 : 1, "N, or HEIGHT,WIDTH", size, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < 1 + (size_t)both; k++)
        if (!(size[k] >= 1 && size[k] <= 4096 && size[k] == floor(size[k])))
            return ad_fail(error, AD_E_ARGUMENT, "--size: expected 1 to 4096 pixels, got %g",
                           size[k]);
    settings->height = (size_t)size[0];
    settings->width = (size_t)size[both];
    return AD_OK;
}

/* The frame within the published screen of 500 pixels, on which the world is 4.4 wide. */
static enum ad_status read_view(const struct dataset_options *o, struct hnn_rod *rod,
                                struct ad_error *error)
{
    const double half = 2.2, unit = 2 * half / 500;
    double two[2];
    if (o->rows) {
        if (numbers_read("rows", o->rows, 2, "first and last row", two, error) != AD_OK)
            return error->status;
        rod->top = half - two[0] * unit;
        rod->bottom = half - two[1] * unit;
    }
    if (o->columns) {
        if (numbers_read("columns", o->columns, 2, "first and last column", two, error) != AD_OK)
            return error->status;
        rod->left = two[0] * unit - half;
        rod->right = two[1] * unit - half;
    }
    return AD_OK;
}

static enum ad_status video_settings_of(const struct dataset_options *o,
                                        struct hnn_video_settings *settings, struct ad_error *error)
{
    size_t pairs = settings->frames - 2;
    settings->trajectories = option_count_or(o->trials, settings->trajectories);
    pairs = option_count_or(o->points, pairs);
    settings->frames = pairs + 2;
    settings->rod.dt = option_number_or(o->dt, settings->rod.dt);
    settings->angle_max = option_number_or(o->max_angle, settings->angle_max);
    settings->speed_max = option_number_or(o->max_speed, settings->speed_max);
    if (dataset_read_size(o->size, settings, error) == AD_OK &&
        (!o->filter || hnn_filter_find(o->filter, &settings->rod.filter, error) == AD_OK))
        read_view(o, &settings->rod, error);
    return error->status;
}

/* ---- results ---- */

enum ad_status dataset_check_hdf5(const struct dataset_options *o, struct ad_error *error)
{
    return dataset_is_hdf5(o->out)
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT,
                         "frames are written as HDF5: --out FILE.h5, not '%s'", o->out);
}

static enum ad_status save(const struct dataset_options *o,
                           const struct hnn_video_settings *settings,
                           const struct hnn_frames *frames, struct ad_error *error)
{
    phys_hdf5 *file;
    if (phys_hdf5_create(o->out, &file, error) != AD_OK)
        return error->status;
    phys_hdf5_text(file, "/", "program", "leastaction " LEASTACTION_VERSION);
    phys_hdf5_text(file, "/", "command", o->common.command);
    phys_hdf5_text(file, "/", "task", "pixels");
    phys_hdf5_integer(file, "/", "seed", (int64_t)o->common.seed, NULL);
    phys_hdf5_number(file, "/", "max_angle", settings->angle_max, "rad");
    phys_hdf5_number(file, "/", "max_speed", settings->speed_max, "rad/s");
    hnn_frames_write(frames, file);
    return phys_hdf5_commit(file, error);
}

enum ad_status dataset_show_frames(const struct dataset_options *o, const char *task,
                                   const struct hnn_frames *f, double seconds,
                                   struct ad_error *error)
{
    struct report report = {0};
    report_line(&report, "%s: %zu trajectories of %zu pairs of frames", task, f->trajectories,
                f->frames - 2);
    report_text(&report, "task", NULL, task);
    report_count(&report, "trials", NULL, f->trajectories);
    report_count(&report, "points", NULL, f->frames - 2);
    report_count(&report, "frames", "frames", f->trajectories * f->frames);
    report_count(&report, "height", "height", f->height);
    report_count(&report, "width", "width", f->width);
    return dataset_show(&report, o, seconds, error);
}

enum ad_status dataset_pixels(const struct dataset_options *o, struct ad_error *error)
{
    struct hnn_video_settings settings = hnn_video_published();
    struct hnn_frames frames = {0};
    if (dataset_check_hdf5(o, error) != AD_OK || video_settings_of(o, &settings, error) != AD_OK)
        return error->status;
    double start = ad_now();
    if (hnn_rod_video(&settings, o->common.seed, &frames, error) == AD_OK &&
        save(o, &settings, &frames, error) == AD_OK)
        dataset_show_frames(o, "pixels", &frames, ad_now() - start, error);
    hnn_frames_free(&frames);
    return error->status;
}
