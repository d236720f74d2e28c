/* The published results (Nature's Cost Function, arXiv 2303.02115, run again) and their data. */
#ifndef TESTS_PHYSICS_PUBLISHED_H
#define TESTS_PHYSICS_PUBLISHED_H

#include "physics/physics.h"

/* Means over slices and bodies, and mean squared distances to the ODE path. */
struct published {
    const char *scene;
    double kinetic_ode, potential_ode, action_ode;
    double kinetic, potential, action;
    double mse_start, mse_end;
};

enum { N_PUBLISHED = 6 };
extern const struct published published[N_PUBLISHED];

/* The scene with the parameters of its preset; fails the test if that cannot be. */
struct phys_system published_system(const char *scene);
/* SCENE_KIND.csv, kind init, ode or final, as [dof x slices], to be freed; skips the test, saying
   so, where the reference data is absent. */
double *published_path(const struct phys_system *system, const char *kind);

/* Mean of (a - b)^2. */
double mean_square_distance(size_t n, const double *a, const double *b);
/* Fails the test with the message if there is an error. */
void assert_no_error(const struct ad_error *error);

#endif
