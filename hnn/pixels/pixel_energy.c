/* The energy of a rod (pixel_energy.h) from states and from angles. */
#include "pixel_energy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The shadow energy of the discrete motion, from an angle and the speed at the same time. */
static double shadow_energy(const struct hnn_rod *rod, double angle, double speed)
{
    const double inertia = rod->mass * rod->length * rod->length / 3;
    const double weight = rod->mass * rod->gravity * rod->length / 2;
    const double w2 = speed * speed, force = weight * sin(angle);
    return inertia * w2 / 2 + weight * (1 - cos(angle)) +
           rod->dt * rod->dt * (w2 * weight * cos(angle) / 12 - force * force / (24 * inertia));
}

double hnn_rod_energy(const struct hnn_rod *rod, double angle, double speed)
{
    if (!rod)
        return NAN;
    double next = angle, speed_after = speed;
    hnn_rod_step(rod, &next, &speed_after);
    return shadow_energy(rod, angle, (speed + speed_after) / 2);
}

void hnn_rod_energies(const struct hnn_rod *rod, size_t n, const double *angle, double *energy)
{
    if (!rod || !angle || !energy)
        return;
    const double turn = 2 * acos(-1);
    for (size_t k = 1; k + 1 < n; k++) {
        double moved =
            remainder(angle[k + 1] - angle[k], turn) + remainder(angle[k] - angle[k - 1], turn);
        energy[k - 1] = shadow_energy(rod, angle[k], moved / (2 * rod->dt));
    }
}

enum ad_status hnn_video_energies(const struct hnn_frames *video, size_t n, const float *pixels,
                                  double *energy, struct ad_error *error)
{
    if (AD_LACKS(error, video, pixels, energy))
        return error->status;
    for (size_t k = 0; k < n; k++)
        energy[k] = NAN;
    if (!video->has_rod || n < 3)
        return AD_OK;
    double *angle = malloc(n * sizeof *angle);
    if (!angle)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu frames", n);
    if (hnn_rod_angles(&video->rod, video->height, video->width, n, pixels, angle, error) == AD_OK)
        hnn_rod_energies(&video->rod, n, angle, energy + 1);
    free(angle);
    return error->status;
}

double hnn_video_energy_mean(size_t n, const double *energy, size_t first, size_t end, double less,
                             int power)
{
    double sum = 0;
    first = first > 1 ? first : 1;
    end = end < n ? end : n - 1;
    if (!energy || n < 3 || first >= end)
        return NAN;
    for (size_t k = first; k < end; k++)
        sum += pow(energy[k] - less, power);
    return sum / (double)(end - first);
}

double hnn_video_mse(size_t n, size_t frame, const float *a, const float *b)
{
    double sum = 0;
    if (!a || !b)
        return NAN;
    for (size_t k = 0; k < n * frame; k++)
        sum += pow((double)a[k] - b[k], 2);
    return sum / (double)(n * frame);
}

size_t hnn_video_begin(const struct hnn_frames *video, size_t trajectory, size_t n, float *pixels,
                       double *energy)
{
    if (!video || !pixels || !energy)
        return 0;
    const size_t frame = video->height * video->width, first = trajectory * video->frames;
    *energy = NAN;
    if (!video->has_rod || !video->angle) {
        n = n < video->frames ? n : video->frames;
        memcpy(pixels, video->pixels + first * frame, n * frame * sizeof *pixels);
        return n;
    }
    double angle = video->angle[first], speed = video->speed[first];
    *energy = hnn_rod_energy(&video->rod, angle, speed);
    for (size_t k = 0; k < n; k++, hnn_rod_step(&video->rod, &angle, &speed))
        hnn_rod_draw(&video->rod, angle, video->height, video->width, pixels + k * frame);
    return n;
}
