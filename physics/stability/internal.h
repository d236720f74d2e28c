/* For physics/ only. */
#ifndef PHYSICS_STABILITY_INTERNAL_H
#define PHYSICS_STABILITY_INTERNAL_H

#include "diagnostics.h"
#include "physics/motion/motion.h"
#include "periodic.h"

/* The derivatives [n][2 dof] of the scene's start (q, v) by n parameters, and what they may be off
   by; by differences. AD_E_NONFINITE where there is none. */
enum ad_status phys_start_slopes(const struct phys_system *system, uint64_t seed, size_t n,
                                 const char *const names[], double *slope, double *uncertainty,
                                 struct ad_error *error);

/* Adds a warning where steps of an implicit method, tried, are as good and cost less
   (stiffness.c). */
void phys_judge_stiffness(const struct phys_motion_settings *settings,
                          const struct phys_motion_solution *m, struct phys_diagnosis *d);

/* ---- motions over a period, and their variations ---- */

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

/* The multipliers and the kind of a periodic motion, given x and its
   period; sizes [2 dof] of coordinates and velocities. */
enum ad_status phys_multipliers(const struct phys_system *system, const double *size,
                                struct phys_periodic *found,
                                const struct phys_periodic_settings *settings,
                                struct ad_error *error);

#endif
