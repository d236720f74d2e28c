/* Bodies of the ephemeris scene: the Sun and the inner planets at one epoch, its start without a
   table; others by approximate positions; and its parameters, for the functions that choose its
   bodies (physics/ephemeris/). */
#ifndef PHYSICS_SCENES_EPHEMERIS_H
#define PHYSICS_SCENES_EPHEMERIS_H

#include <stddef.h>

/* State vectors from NASA/JPL Horizons (DE441; Mars: mar097), geometric, ecliptic of J2000, about
   the solar-system barycentre. SI units. */
struct ephemeris_body {
    const char *name;
    int id;                /* as in Horizons */
    double gm;             /* m^3/s^2, measured: from the header of the Horizons table */
    double published_mass; /* kg, rounded: arXiv 2303.02115 */
    double position[3];    /* m */
    double velocity[3];    /* m/s */
};

#define PHYS_EPHEMERIS_JD 2459774.5 /* TDB */
#define PHYS_EPHEMERIS_DATE "2022-07-14"

enum { PHYS_EPHEMERIS_BODIES = 5 };

/* Sun, Mercury, Venus, Earth, Mars. */
extern const struct ephemeris_body phys_ephemeris_bodies[PHYS_EPHEMERIS_BODIES];

/* ---- bodies without a table: approximate positions at any date ---- */

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

/* ---- parameters ---- */

enum { PHYS_EPHEMERIS_MOST = 32 };

struct ephemeris {
    double G, dims, relativity;
    double mass[PHYS_EPHEMERIS_BODIES]; /* of those bodies; 0: GM / G */
    size_t n;                           /* chosen bodies; 0: those at that epoch */
    struct ephemeris_body body[PHYS_EPHEMERIS_MOST];
    char names[PHYS_EPHEMERIS_MOST][24];
};

size_t phys_ephemeris_count(const struct ephemeris *ephemeris);
const struct ephemeris_body *phys_ephemeris_body(const struct ephemeris *ephemeris, size_t k);

#endif
