/* Random numbers that depend on the seed alone, on every machine. */
#ifndef PHYSICS_IO_RANDOM_H
#define PHYSICS_IO_RANDOM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct phys_random {
    uint64_t state[4];
    double spare; /* second number of the last normal pair */
    bool has_spare;
};

/* Starts the sequence of a seed. */
void phys_random_seed(struct phys_random *random, uint64_t seed);
/* In [0, 1), 53 random bits. */
double phys_random_uniform(struct phys_random *random);
/* Mean 0, standard deviation 1. */
double phys_random_normal(struct phys_random *random);
/* n draws, `once` of which gave what no other gave: the chance that one more gives what none did is
   about once / n (Good, Biometrika 40, 1953). *limit: its upper bound at 95 % confidence if `once`
   is Poisson distributed. Without draws both are 1. */
double phys_random_unseen(size_t once, size_t n, double *limit);

#endif
