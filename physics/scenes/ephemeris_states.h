/* The Sun and the inner planets at one epoch: the start of the ephemeris scene without a table. */
#ifndef PHYSICS_SCENES_EPHEMERIS_STATES_H
#define PHYSICS_SCENES_EPHEMERIS_STATES_H

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

#endif
