/* Frames of a moving object, to learn a Hamiltonian from pixels (task 5 of S. Greydanus et al.,
   arXiv 1906.01563): rendered here, or a user's own.

       struct hnn_frames frames;
       struct hnn_split_pairs pairs;
       if (hnn_frames_read("pixels.h5", &frames, &error) == AD_OK &&
           hnn_frames_split(&frames, 0.2, seed, &pairs, &error) == AD_OK)
           for (size_t i = 0; i < pairs.n_train; i++)
               step(hnn_frames_pair(&frames, pairs.train[i]),
                    hnn_frames_pair(&frames, pairs.train[i] + 1));
       hnn_split_pairs_free(&pairs);
       hnn_frames_free(&frames);

   A single frame has no velocity. A sample is therefore a pair of successive frames, stacked: 2
   height width pixels in a row. Frames are contiguous in memory, so pair k is the data that begin
   at frame k, without a copy; the pair one step later begins at frame k + 1.

   Units are those of struct hnn_rod; pixels are 0 to 1. Errors: AD_E_ARGUMENT, AD_E_INPUT and
   AD_E_IO for files, AD_E_MEMORY. Threads: as in hnn.h. */
#ifndef HNN_PIXELS_PIXELS_H
#define HNN_PIXELS_PIXELS_H

#include "hnn/hnn.h"

AD_HEADER_BEGIN

/* ---- the pendulum ---- */

/* The filter of a pixel. */
enum hnn_filter {
    HNN_AREA,    /* the mean over its own area */
    HNN_BILINEAR /* weighted mean, the weights falling to 0 at one pixel width from its centre in
                    rows and columns: smoother; the published frames were reduced this way */
};
extern const char *const hnn_filters[]; /* names, NULL-terminated */
/* By name; AD_E_ARGUMENT, naming the nearest, if there is none. */
enum ad_status hnn_filter_find(const char *name, enum hnn_filter *filter, struct ad_error *error);

/* A uniform rod turning about one end, as Gym's Pendulum-v0 without torque, and its rendering. The
   angle is from hanging, positive to the right. Lengths are in world units, y upwards from the
   pivot; pictures are grey on black, values from 0 to 1. */
struct hnn_rod {
    double gravity, mass, length, dt;
    double radius;                   /* half the width of the rod, which has round ends */
    double axle;                     /* radius of a black disc on the pivot */
    double shade;                    /* value of a pixel that the rod covers */
    double left, right, bottom, top; /* the part of the world that a frame shows */
    enum hnn_filter filter;
};
/* Gym's: g = 10, m = l = 1, dt = 0.05, width 0.2; the frame is rows 220 to 390 and columns 165 to
   335 of a screen of 500 pixels that shows +-2.2; red minus green of (.8, .3, .3) is 0.5. */
struct hnn_rod hnn_rod_published(void);
/* AD_E_ARGUMENT names the value that is out of range. */
enum ad_status hnn_rod_check(const struct hnn_rod *rod, struct ad_error *error);

/* One step of semi-implicit Euler, in place; angle and speed [1]. */
void hnn_rod_step(const struct hnn_rod *rod, double *angle, double *speed);
/* Renders the frame at an angle, [height x width] from the top left. With HNN_AREA a pixel's value
   is exact, shade times its covered fraction; with HNN_BILINEAR it is the sum over 12 x 12 cells,
   each of them exact. */
void hnn_rod_draw(const struct hnn_rod *rod, double angle, size_t height, size_t width,
                  float *pixels);

/* ---- frames ---- */

struct hnn_frames {
    size_t trajectories, frames; /* frames of each trajectory, at least 3 */
    size_t height, width;
    float *pixels;         /* [trajectories x frames x height x width] */
    double *angle, *speed; /* [trajectories x frames] rad, rad/s, of hnn_rod_step; NULL: unknown */
    bool has_rod;          /* the frames show this rod: */
    struct hnn_rod rod;    /* of bodies that are drawn here: its left to top are what frames show */
    void *reserved[4];     /* NULL: room for what later releases add */
};
void hnn_frames_free(struct hnn_frames *frames); /* takes zero-initialised ones too */

/* [2 height width] of frames k and k + 1, k counted over all trajectories. */
static inline const float *hnn_frames_pair(const struct hnn_frames *frames, size_t k)
{
    return frames->pixels + k * frames->height * frames->width;
}

/* The pairs k for which k + 1 is a pair of the same trajectory, too: frames - 2 of each. */
struct hnn_split_pairs {
    size_t n_train, n_test;
    size_t *train, *test; /* train and test share one allocation, owned by train */
};
/* Reserves all pairs of round(fraction trajectories) trajectories, chosen by the seed, for the
   test. AD_E_ARGUMENT if nothing is left to train on, or nothing to test although fraction > 0.
   Free with hnn_split_pairs_free in any case. */
enum ad_status hnn_frames_split(const struct hnn_frames *frames, double fraction, uint64_t seed,
                                struct hnn_split_pairs *pairs, struct ad_error *error);
void hnn_split_pairs_free(struct hnn_split_pairs *pairs);

/* ---- from files ---- */

/* Reads frames. HDF5: the array "frames" (or the only one of three or four dimensions) [trajectory,
   time, height, width], or [time, height, width] for one trajectory; real numbers from -1 to 1, or
   integers from 0 to 255, which become value/255. "angle" and "speed" beside it and attributes as
   written by hnn_frames_save are optional. A folder: grey PGM or PNG files of 8 bits in natural
   order of their names; each subfolder is a trajectory, or the folder itself is one. AD_E_INPUT
   names file, frame, and what was expected. Free with hnn_frames_free in any case. */
enum ad_status hnn_frames_read(const char *path, struct hnn_frames *frames, struct ad_error *error);
/* Both at once, on many ranks: each reads the trajectories of its share of the pairs to train on
   and of those for the test (hnn_samples_share), and the few that hnn_video_motion follows; pixels
   of others are 0, and take no memory. AD_E_INPUT where ranks read other frames. */
enum ad_status hnn_frames_read_split(const char *path, double fraction, uint64_t seed,
                                     struct ad_ranks *ranks, struct hnn_frames *frames,
                                     struct hnn_split_pairs *pairs, struct ad_error *error);
/* Writes an HDF5 file atomically: "frames" f32, "angle" and "speed" f64, and the rod as attributes
   of the file: gravity, mass, length, dt, radius, axle, shade, left, right, bottom, top. */
enum ad_status hnn_frames_save(const struct hnn_frames *frames, const char *file,
                               struct ad_error *error);

/* ---- from the pendulum ---- */

struct hnn_video_settings {
    size_t size; /* sizeof(struct hnn_video_settings) */
    struct hnn_rod rod;
    size_t trajectories, frames, height, width;
    double angle_max, speed_max; /* starts: uniform within +- */
};
/* As published: 200 trajectories of 102 frames, 28 x 28, that is 100 pairs with a next one of each;
   within pi/6 of hanging and a speed of 1. */
void hnn_video_published_to(struct hnn_video_settings *settings);
static inline struct hnn_video_settings hnn_video_published(void)
{
    struct hnn_video_settings settings;
    settings.size = sizeof settings;
    hnn_video_published_to(&settings);
    return settings;
}
/* Renders the motion from random starts; with HNN_BILINEAR in 256 levels, as published.
   AD_E_ARGUMENT names what is out of range. Free with hnn_frames_free in any case. */
enum ad_status hnn_rod_video(const struct hnn_video_settings *settings, uint64_t seed,
                             struct hnn_frames *frames, struct ad_error *error);

/* ---- from bodies in a plane ---- */

struct hnn_task;     /* hnn/data/data.h */
struct hnn_sampling; /* likewise */

/* Renders the motion of the task's bodies, sampled as by hnn_task_observe: `points` frames of
   each trial. Frames show a square about the origin in which all bodies
   lie; body k is a disc of the value 1/k, whose radius is .15 halves of the square, and sums are
   cut at 1. AD_E_ARGUMENT: fewer than three points, no pixels, another filter, or a task other than
   twobody and threebody. Free with hnn_frames_free in any case. */
enum ad_status hnn_bodies_video(const struct hnn_task *task, const struct hnn_sampling *sampling,
                                size_t height, size_t width, enum hnn_filter filter, uint64_t seed,
                                struct hnn_frames *frames, struct ad_error *error);

AD_HEADER_END
#endif
