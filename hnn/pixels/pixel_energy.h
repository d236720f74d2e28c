/* Angle and energy of the rod of pixels.h measured on frames, rendered or decoded by a model.

       hnn_rod_angles(&rod, 28, 28, n, pixels, angle, &error);
       hnn_rod_energies(&rod, n, angle, energy);                 n - 2 of them

   The motion is that of hnn_rod_step, whose angles follow the Stoermer-Verlet scheme with the speed
   w_k = (angle_{k+1} - angle_{k-1})/(2 dt). With I = m l^2/3 and V = m g (l/2)(1 - cos angle) its
   energy I w^2/2 + V oscillates by dt^2 3g/(2l)/4, one per cent as published. The scheme conserves,
   up to dt^4, the shadow energy

       E = I w^2/2 + V + dt^2 (w^2 V''/12 - V'^2/(24 I))

   (E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, IX.3), zero when hanging at
   rest: both the true energy and the measured one are this E.

   Units are those of struct hnn_rod. Errors: AD_E_ARGUMENT, AD_E_MEMORY. Threads: functions may
   run at once. */
#ifndef HNN_PIXELS_PIXEL_ENERGY_H
#define HNN_PIXELS_PIXEL_ENERGY_H

#include "pixels.h"

AD_HEADER_BEGIN

/* E of a state of hnn_rod_step, whose speed belongs to half a step before its angle. */
double hnn_rod_energy(const struct hnn_rod *rod, double angle, double speed);

/* Angles in (-pi, pi] of the rods in n contiguous frames [height x width]: least squares in angle
   and brightness, so that pale frames are fitted as well. NaN for an empty frame. AD_E_MEMORY. */
enum ad_status hnn_rod_angles(const struct hnn_rod *rod, size_t height, size_t width, size_t n,
                              const float *pixels, double *angle, struct ad_error *error);

/* E at angles 1 ... n - 2 of n successive angles; energy [n - 2]. */
void hnn_rod_energies(const struct hnn_rod *rod, size_t n, const double *angle, double *energy);

/* ---- of videos ---- */

/* E of n successive frames, of the size and the rod of `video`: energy [n], NaN at both ends, and
   everywhere if there is no rod or fewer than three frames. AD_E_MEMORY. */
enum ad_status hnn_video_energies(const struct hnn_frames *video, size_t n, const float *pixels,
                                  double *energy, struct ad_error *error);
/* Mean of (E - less)^power over frames first ... end - 1 of energy [n], without the video's ends;
   NaN: there are none. */
double hnn_video_energy_mean(size_t n, const double *energy, size_t first, size_t end, double less,
                             int power);
/* Mean squared difference of n frames [frame]. */
double hnn_video_mse(size_t n, size_t frame, const float *a, const float *b);
/* The first frames [n x frame] of a trajectory of `video`: n rendered ones if the rod and its start
   are known, else as many of n as exist. Returns their number; *energy is that of the rod, NaN:
   unknown. */
size_t hnn_video_begin(const struct hnn_frames *video, size_t trajectory, size_t n, float *pixels,
                       double *energy);

AD_HEADER_END
#endif
