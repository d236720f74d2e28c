/* Systems of the Sun and its planets, with and without tables of Horizons.

   Units are AU, days and solar masses, unless said. Errors: AD_E_ARGUMENT, AD_E_MEMORY. Threads:
   calls may run at once on different systems. */
#ifndef PHYSICS_EPHEMERIS_EPHEMERIS_H
#define PHYSICS_EPHEMERIS_EPHEMERIS_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

struct phys_horizons;

/* Chooses the bodies (comma-separated names or ids) and the dimensions, 2 or 3, of an ephemeris
   system that runs without tables; a mass set by name stays. jupiter, saturn and moon are known
   roughly, from mean elements and series. AD_E_ARGUMENT names what is unknown. */
enum ad_status phys_ephemeris_choose(struct phys_system *system, const char *bodies, size_t dims,
                                     struct ad_error *error);
/* Bodies, start and reference path from n tables of the same epochs: slice i is epoch first + i.
   Masses are the tables' GM over G, save those set by name. The tables are not kept. reference:
   [n*dims x slices], or NULL. Tables of type 1 have no velocities: those at the start are then from
   differences of positions, of second order. */
enum ad_status phys_ephemeris_use(struct phys_system *system, size_t n,
                                  const struct phys_horizons *tables, size_t first, size_t slices,
                                  size_t dims, double *reference, struct ad_error *error);
/* Adds bodies with approximate orbits to a system whose bodies are chosen: jupiter and saturn need
   the Sun, the moon the Earth. jd: Julian date TDB of the system's start. */
enum ad_status phys_ephemeris_add(struct phys_system *system, const char *bodies, double jd,
                                  struct ad_error *error);

AD_HEADER_END
#endif
