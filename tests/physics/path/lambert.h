/* Lambert's motions by Lagrange's equation. */
#ifndef TESTS_PHYSICS_PATH_LAMBERT_H
#define TESTS_PHYSICS_PATH_LAMBERT_H

#include <stddef.h>

enum { LAMBERT_MOST = 40 };
/* Energies of those in a time between r1 and r2 at distance c, s half the sum of all three; their
   number, less than LAMBERT_MOST. */
size_t lambert_energies(double s, double c, double time, double *energy);

#endif
