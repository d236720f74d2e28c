/* Every motion of one coordinate between two positions in a given time, for L without explicit
   time: the roots of T(E) = time, one function for each initial direction and number of turns. Or
   those of a given energy, in no more than a given time. */
#ifndef PHYSICS_PATH_ALL_ENERGY_SWEEP_H
#define PHYSICS_PATH_ALL_ENERGY_SWEEP_H

#include "physics/path/internal.h"

struct phys_energy_question {
    double from, to, time;
    bool of_energy; /* all motions of this one: `time` is the longest */
    double energy;
    double span, speed; /* natural sizes: the search goes to a thousand times these */
    size_t most_turns;
    bool (*proceed)(void *context); /* false ends it; or NULL */
    void *context;
};

/* A motion: its energy is level + side * exp(log_gap). */
struct phys_energy_root {
    double level, side, log_gap;
    double time;   /* of one of a given energy */
    double dwell;  /* time to spend beside the maxima at `level`, beyond that of this energy */
    int direction; /* of the start: 1 or -1 */
    size_t turns;
};

struct phys_energy_sweep;

/* AD_OK and *sweep NULL: the question is not of this kind, L_vv is not positive, or it was ended.
   `certified`:
   twice as many energies and places gave the same motions; `limited`: there are more of over
   most_turns turns. */
enum ad_status phys_energy_sweep_new(const struct phys_system *system,
                                     const struct phys_energy_question *question,
                                     struct phys_energy_sweep **sweep, struct ad_error *error);
void phys_energy_sweep_free(struct phys_energy_sweep *sweep); /* takes NULL */
size_t phys_energy_sweep_roots(const struct phys_energy_sweep *sweep,
                               const struct phys_energy_root **roots, bool *certified,
                               bool *limited);
/* The motion at times [n], ascending: q [n]. */
bool phys_energy_sweep_path(struct phys_energy_sweep *sweep, const struct phys_energy_root *root,
                            size_t n, const double *times, double *q);

#endif
