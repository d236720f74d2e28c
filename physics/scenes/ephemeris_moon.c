/* The Moon about the Earth (ephemeris.h) by the low-precision series of The Astronomical
   Almanac, page D22 (after E. W. Brown): 0.3 degrees in longitude, 0.2 in latitude, 0.003 in
   parallax. Angles are in degrees and of the ecliptic of date; the precession since J2000 is
   subtracted from the longitude. */
#include "ephemeris.h"

#include <math.h>

static const double degree = M_PI / 180, earth_radius = 6378137.0;
static const double century = 36525 * 86400.0, precession = 1.396971;

/* amplitude * sin (or cos) of phase + rate T */
struct term {
    double amplitude, phase, rate;
};

static const struct term longitude[] = {
    {6.29, 135.0, 477198.87}, {-1.27, 259.3, -413335.36}, {0.66, 235.7, 890534.22},
    {0.21, 269.9, 954397.74}, {-0.19, 357.5, 35999.05},   {-0.11, 186.5, 966404.03},
};
static const struct term latitude[] = {
    {5.13, 93.3, 483202.02},
    {0.28, 228.2, 960400.89},
    {-0.28, 318.3, 6003.15},
    {-0.17, 217.6, -407332.21},
};
static const struct term parallax[] = {
    {0.0518, 135.0, 477198.87},
    {0.0095, 259.3, -413335.36},
    {0.0078, 235.7, 890534.22},
    {0.0028, 269.9, 954397.74},
};

#define TERMS(list) (sizeof(list) / sizeof *(list))

/* Sum of a series and its rate per century; `quarter` turns sines into cosines. */
static void series(size_t n, const struct term *terms, double quarter, double T, double *value,
                   double *rate)
{
    for (size_t k = 0; k < n; k++) {
        double angle = fmod(terms[k].phase + terms[k].rate * T, 360) * degree + quarter;
        *value += terms[k].amplitude * sin(angle);
        *rate += terms[k].amplitude * cos(angle) * terms[k].rate * degree;
    }
}

void phys_ephemeris_moon(const void *unused, double gm, double T, double position[3],
                         double velocity[3])
{
    double l = 218.32 + (481267.881 - precession) * T, l_rate = 481267.881 - precession;
    double b = 0, b_rate = 0, p = 0.9508, p_rate = 0;
    (void)unused, (void)gm;
    series(TERMS(longitude), longitude, 0, T, &l, &l_rate);
    series(TERMS(latitude), latitude, 0, T, &b, &b_rate);
    series(TERMS(parallax), parallax, M_PI / 2, T, &p, &p_rate);

    double scale = degree / century; /* degrees per century to radians per second */
    l = fmod(l, 360) * degree, b *= degree, p *= degree;
    l_rate *= scale, b_rate *= scale, p_rate *= scale;
    double r = earth_radius / sin(p), r_rate = -r * p_rate / tan(p);
    const double along[] = {cos(b) * cos(l), cos(b) * sin(l), sin(b)};
    const double by_b[] = {-sin(b) * cos(l), -sin(b) * sin(l), cos(b)};
    const double by_l[] = {-cos(b) * sin(l), cos(b) * cos(l), 0};
    for (int k = 0; k < 3; k++) {
        position[k] = r * along[k];
        velocity[k] = r_rate * along[k] + r * (b_rate * by_b[k] + l_rate * by_l[k]);
    }
}
