/* The potential of one coordinate, U(q) = -L(q, 0), and the speed at a given energy. */
#ifndef PHYSICS_PATH_POTENTIAL_H
#define PHYSICS_PATH_POTENTIAL_H

#include "internal.h"

enum { PHYS_POTENTIAL_LANES = 128 };

struct phys_potential {
    ad_tape *tape;
    ad_var q, v, energy, mass; /* v L_v - L, L_vv */
    ad_var place, U, slope, bend;
    ad_program *of_motion, *of_place;
    bool quadratic; /* L_vv does not depend on v */
};

/* Ends with phys_potential_free, whatever it returned. */
enum ad_status phys_potential_new(struct phys_potential *p, const struct phys_system *system,
                                  struct ad_error *error);
void phys_potential_free(struct phys_potential *p);
/* U and its first two derivatives at q. */
void phys_potential_at(struct phys_potential *p, double q, double *U, double *slope, double *bend);
/* U [n] at q [n]. */
void phys_potential_values(struct phys_potential *p, size_t n, const double *q, double *U);
/* Speeds [n] at q [n] in a direction, where the energy is above U by K [n] > 0; NaN: none. */
void phys_potential_speeds(struct phys_potential *p, int direction, size_t n, const double *q,
                           const double *K, double *speed);
/* v L_v - L */
double phys_potential_energy(struct phys_potential *p, double q, double v);

#endif
