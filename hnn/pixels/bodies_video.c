/* Frames of bodies that attract each other in a plane (pixels.h): a disc each, which is a rod
   without a length whose pivot is the body. */
#include "physics/linear/vectors.h"
#include "frames.h"
#include "hnn/tasks/task.h"

#include <math.h>
#include <stdlib.h>

static const double radius = 0.15; /* of a disc, in halves of the frame */

/* Half the side of the square that all positions and their discs lie in. */
static double half_of(const struct hnn_task *task, const struct hnn_observations *o)
{
    return phys_largest(task->dof * o->rows, o->values) / (1 - radius);
}

/* Adds the disc of a body at (x, y), no pixel over 1. */
static void add_disc(const struct hnn_rod *frame, double shade, double x, double y,
                     const struct hnn_frames *f, float *disc, float *pixels)
{
    struct hnn_rod body = *frame;
    body.shade = shade;
    body.left -= x, body.right -= x;
    body.bottom -= y, body.top -= y;
    hnn_rod_draw(&body, 0, f->height, f->width, disc);
    for (size_t k = 0; k < f->height * f->width; k++)
        pixels[k] = fminf(pixels[k] + disc[k], 1);
}

static enum ad_status draw(const struct hnn_task *task, const struct hnn_observations *o,
                           struct hnn_frames *f, struct ad_error *error)
{
    const size_t bodies = task->dof / 2, area = f->height * f->width;
    float *disc = malloc(area * sizeof *disc);
    if (!disc)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a frame");
    for (size_t i = 0; i < o->rows; i++) {
        float *pixels = f->pixels + i * area;
        for (size_t k = 0; k < area; k++)
            pixels[k] = 0;
        for (size_t b = 0; b < bodies; b++)
            add_disc(&f->rod, 1 / (double)(b + 1), o->values[b * o->rows + i],
                     o->values[(bodies + b) * o->rows + i], f, disc, pixels);
    }
    free(disc);
    return AD_OK;
}

enum ad_status hnn_bodies_video(const struct hnn_task *task, const struct hnn_sampling *sampling,
                                size_t height, size_t width, enum hnn_filter filter, uint64_t seed,
                                struct hnn_frames *f, struct ad_error *error)
{
    struct hnn_observations o = {0};
    if (AD_LACKS_RESULT(error, f) || AD_LACKS(error, task, sampling))
        return error->status;
    if (task->H != hnn_task_gravity)
        return ad_fail(error, AD_E_ARGUMENT,
                       "frames (size, filter): expected pixels, twobody or threebody, got %s",
                       task->name);
    if (filter != HNN_AREA && filter != HNN_BILINEAR)
        return ad_fail(error, AD_E_ARGUMENT, "filter: expected one that there is, got %d", filter);
    if (sampling->points < 3 || height < 1 || width < 1)
        return ad_fail(error, AD_E_ARGUMENT,
                       "frames: expected at least three of a trajectory (points), and a pixel each "
                       "way, got %zu of %zu x %zu",
                       sampling->points, height, width);
    if (hnn_task_observe(task, sampling, seed, &o, error) == AD_OK &&
        hnn_frames_new(f, sampling->trials, sampling->points, height, width, error) == AD_OK) {
        const double half = half_of(task, &o);
        f->rod = (struct hnn_rod){.radius = radius * half,
                                  .left = -half,
                                  .right = half,
                                  .bottom = -half,
                                  .top = half,
                                  .filter = filter};
        draw(task, &o, f, error);
    }
    hnn_observations_free(&o);
    return error->status;
}
