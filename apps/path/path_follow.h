/* The true motion, for the commands that look along it. */
#ifndef APPS_PATH_FOLLOW_H
#define APPS_PATH_FOLLOW_H

#include "physics/physics.h"

/* The motion from q and v [dof] at n slices, by adaptive steps whose relative error is under the
   tolerance: path [dof x n]. AD_E_NONFINITE, AD_E_ACCURACY where it cannot be followed. */
enum ad_status path_follow(const struct phys_system *system, const double *q, const double *v,
                           size_t n, double dt, double tolerance, double *path,
                           struct ad_error *error);

#endif
