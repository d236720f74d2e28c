/* Frames of the pendulum from random starts, as published (experiment-pixels of S. Greydanus et
   al., arXiv 1906.01563, appendix B). */
#include "frames.h"
#include "autodiff/sized.h"

#include <math.h>

void hnn_video_published_to(struct hnn_video_settings *settings)
{
    const struct hnn_video_settings defaults = {.size = sizeof defaults,
                                                .rod = hnn_rod_published(),
                                                .trajectories = 200,
                                                .frames = 102,
                                                .height = 28,
                                                .width = 28,
                                                .angle_max = acos(-1) / 6,
                                                .speed_max = 1};
    AD_GIVE(settings, &defaults);
}

static enum ad_status check(const struct hnn_video_settings *f, struct ad_error *error)
{
    if (AD_LACKS(error, f) || hnn_rod_check(&f->rod, error) != AD_OK)
        return error->status;
    if (f->trajectories < 1 || f->frames < 3)
        return ad_fail(error, AD_E_ARGUMENT,
                       "frames: expected at least one trajectory, and three of each: a pair, and "
                       "the next one");
    if (f->height < 1 || f->width < 1)
        return ad_fail(error, AD_E_ARGUMENT, "frames: expected at least one pixel each way");
    if (!(f->angle_max >= 0 && f->speed_max >= 0 && isfinite(f->angle_max + f->speed_max)))
        return ad_fail(error, AD_E_ARGUMENT,
                       "frames: expected angle and speed of starts of at least 0");
    return AD_OK;
}

/* Rounds values to multiples of 1/255, as bytes hold them. */
static void round_to_bytes(size_t n, float *pixels)
{
    for (size_t k = 0; k < n; k++)
        pixels[k] = rintf(255 * pixels[k]) / 255;
}

enum ad_status hnn_rod_video(const struct hnn_video_settings *settings, uint64_t seed,
                             struct hnn_frames *f, struct ad_error *error)
{
    struct phys_random random;
    if (AD_LACKS_RESULT(error, f))
        return error->status;
    AD_OWN(hnn_video_settings, settings, speed_max, error);
    if (check(settings, error) != AD_OK ||
        hnn_frames_new(f, settings->trajectories, settings->frames, settings->height,
                       settings->width, error) != AD_OK ||
        hnn_frames_new_motion(f, error) != AD_OK)
        return error->status;
    f->has_rod = true;
    f->rod = settings->rod;
    phys_random_seed(&random, seed);
    for (size_t i = 0, k = 0; i < f->trajectories; i++) {
        double angle = (2 * phys_random_uniform(&random) - 1) * settings->angle_max;
        double speed = (2 * phys_random_uniform(&random) - 1) * settings->speed_max;
        for (size_t end = k + f->frames; k < end; k++, hnn_rod_step(&f->rod, &angle, &speed)) {
            f->angle[k] = angle;
            f->speed[k] = speed;
            hnn_rod_draw(&f->rod, angle, f->height, f->width, f->pixels + k * f->height * f->width);
        }
    }
    if (f->rod.filter == HNN_BILINEAR)
        round_to_bytes(f->trajectories * f->frames * f->height * f->width, f->pixels);
    return AD_OK;
}
