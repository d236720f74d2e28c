/* Bodies without a table: approximate positions at any date. */
#ifndef PHYSICS_SCENES_EPHEMERIS_ROUGH_H
#define PHYSICS_SCENES_EPHEMERIS_ROUGH_H

#include "ephemeris_states.h"

#include <stddef.h>

/* A body by its mean motion about another one. */
struct ephemeris_rough {
    const char *name;
    int id, about; /* as in Horizons */
    double gm;     /* m^3/s^2 */
    const void *motion;
    /* Position and velocity about the other body, SI, ecliptic of J2000. gm: of both together;
       T: Julian centuries TDB since J2000. */
    void (*state)(const void *motion, double gm, double T, double position[3], double velocity[3]);
};

/* Jupiter and Saturn to some minutes of arc, the Moon to a third of a degree, 1900 to 2050. */
enum { PHYS_EPHEMERIS_ROUGH = 3 };
extern const struct ephemeris_rough phys_ephemeris_rough[PHYS_EPHEMERIS_ROUGH];

/* `body` at the Julian date jd, when the one it moves about is `centre`. */
void phys_ephemeris_place(const struct ephemeris_rough *rough, double jd,
                          const struct ephemeris_body *centre, struct ephemeris_body *body);

/* The two ways of saying where: orbits of Kepler (ephemeris_kepler.c), series for the Moon
   (ephemeris_moon.c). */
struct ephemeris_element {
    double value, rate; /* at J2000, per Julian century */
};
struct ephemeris_orbit {
    struct ephemeris_element a;                       /* au */
    struct ephemeris_element e;                       /* 1 */
    struct ephemeris_element inclination, L, w, node; /* degrees: mean longitude, longitudes of
                                                         perihelion and node */
};
void phys_ephemeris_kepler(const void *orbit, double gm, double T, double position[3],
                           double velocity[3]);
void phys_ephemeris_moon(const void *unused, double gm, double T, double position[3],
                         double velocity[3]);

#endif
