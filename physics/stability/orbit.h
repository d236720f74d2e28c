/* For physics/stability/ only: motions over a period, and their variations. */
#ifndef PHYSICS_STABILITY_ORBIT_H
#define PHYSICS_STABILITY_ORBIT_H

#include "physics/motion/motion.h"

/* Of x = (q, v), and of what varies with it: parameters. */
struct phys_orbit {
    size_t d;           /* of x */
    const double *size; /* [d + parameters] units */
    double tolerance;
    bool (*proceed)(void *context); /* as in phys_simulation */
    void *context;
};

/* From x [d] at a time to another: y [ode->n] becomes the end, and the variations of
   phys_ode_variations or phys_ode_parameters, begun as the unit matrix. */
enum ad_status phys_orbit_follow(const struct phys_orbit *orbit, const struct phys_ode *ode,
                                 const char *method, const double *x, double from, double to,
                                 double *y, struct ad_error *error);
/* Whether neither L nor the forces depend on time. */
bool phys_orbit_is_timeless(const struct phys_system *system, struct ad_error *error);

#endif
