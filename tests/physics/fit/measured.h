/* Measured motions for fits. */
#ifndef TESTS_PHYSICS_FIT_MEASURED_H
#define TESTS_PHYSICS_FIT_MEASURED_H

#include "physics/io/random.h"
#include "tests/physics/systems.h"

enum { ROWS = 600, MOST = 4 };

struct measured {
    double t[ROWS], x[ROWS * MOST];
    size_t trial[ROWS];
    struct phys_fit_data data;
};

/* Adds a trial of `rows` rows dt apart from t0 on, with noise on coordinates and velocities. */
void add_trial(struct measured *m, const struct phys_system *system, const double *start, double t0,
               double dt, size_t rows, const double noise[2], struct phys_random *random);
void forget_velocities(struct measured *m, size_t dof);
/* Ends the test where the fit fails. */
struct phys_fit fitted(const struct phys_system *system, const struct measured *m,
                       const struct phys_fit_settings *how);

#endif
