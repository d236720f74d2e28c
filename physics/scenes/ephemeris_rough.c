/* Jupiter, Saturn and the Moon (ephemeris.h). Elements: E. M. Standish and J. G. Williams,
   Approximate positions of the planets, table 1 (1800 to 2050), https://ssd.jpl.nasa.gov/planets/
   approx_pos.html. GM: of DE440, Jupiter without its moons. */
#include "ephemeris.h"

static const struct ephemeris_orbit jupiter = {
    .a = {5.20288700, -0.00011607},
    .e = {0.04838624, -0.00013253},
    .inclination = {1.30439695, -0.00183714},
    .L = {34.39644051, 3034.74612775},
    .w = {14.72847983, 0.21252668},
    .node = {100.47390909, 0.20469106},
};

static const struct ephemeris_orbit saturn = {
    .a = {9.53667594, -0.00125060},
    .e = {0.05386179, -0.00050991},
    .inclination = {2.48599187, 0.00193609},
    .L = {49.95424423, 1222.49362201},
    .w = {92.59887831, -0.41897216},
    .node = {113.66242448, -0.28867794},
};

const struct ephemeris_rough phys_ephemeris_rough[PHYS_EPHEMERIS_ROUGH] = {
    {"jupiter", 599, 10, 1.26686534e17, &jupiter, phys_ephemeris_kepler},
    {"saturn", 699, 10, 3.7931207e16, &saturn, phys_ephemeris_kepler},
    {"moon", 301, 399, 4.902800066e12, 0, phys_ephemeris_moon},
};

void phys_ephemeris_place(const struct ephemeris_rough *rough, double jd,
                          const struct ephemeris_body *centre, struct ephemeris_body *body)
{
    double T = (jd - 2451545) / 36525;
    *body = (struct ephemeris_body){.name = rough->name, .id = rough->id, .gm = rough->gm};
    rough->state(rough->motion, rough->gm + centre->gm, T, body->position, body->velocity);
    for (int k = 0; k < 3; k++) {
        body->position[k] += centre->position[k];
        body->velocity[k] += centre->velocity[k];
    }
}
