/* Internals of energy_sweep.h: the shape of the potential (energy_levels.c), times of motions
   (energy_time.c), roots (energy_sweep.c) and paths (energy_path.c). */
#ifndef PHYSICS_PATH_ALL_ENERGY_PARTS_H
#define PHYSICS_PATH_ALL_ENERGY_PARTS_H

#include "energy_sweep.h"
#include "physics/path/potential.h"

#define PHYS_ENERGY_NEAREST 1e-11 /* to a height, of the potential's size */

/* A maximum or minimum of U. */
struct phys_energy_place {
    double q, U, bend;
};

struct phys_energy_sweep {
    struct phys_energy_question ask;
    struct phys_potential U;
    double a, b;                     /* the ends, by q */
    double width;                    /* of a cell of an integral, in its variable */
    double size;                     /* of U: what its last digits are relative to */
    double low, high, low_U, high_U; /* the range that was looked at */
    size_t n_places;
    struct phys_energy_place *place; /* by q */
    size_t n_levels;
    double *level; /* heights that bound the motion, ascending; the last is the highest energy */
    size_t n_roots;
    struct phys_energy_root *root;
    bool certified, limited, lost, ended;
};

/* Places and levels, from `density` times the least number of samples of U. False: out of memory,
   or U is not finite between the ends. */
bool phys_energy_levels(struct phys_energy_sweep *s, size_t density);
/* Where a motion of energy E turns on that side (1 or -1) of the ends; false, and the end: nowhere.
 */
bool phys_energy_turns(struct phys_energy_sweep *s, double E, int side, double *q);

/* Where a motion is, and the times since the first knot: to the right, and on the way back. */
struct phys_energy_knot {
    double q, there, back;
};
/* The way between the turning points at an energy, or to the ends where there are none: by q. */
struct phys_energy_way {
    bool left, right; /* there is a turning point */
    size_t n, room;
    struct phys_energy_knot *knot, from, to; /* [n]; from, to: those at the ends */
};
/* Takes a zero-initialised or used way, whose knots are the caller's to free. False: lost. */
bool phys_energy_way_find(struct phys_energy_sweep *s, double E, struct phys_energy_way *way);
/* The time of a motion that begins in a direction and turns so often; infinite where there is none.
 */
double phys_energy_way_time(const struct phys_energy_way *way, int direction, size_t turns_made);

/* level + side * exp(log_gap), or that of one given energy */
double phys_energy_of(const struct phys_energy_root *root);

#endif
