/* Where the forces change with time itself, for the reference motion. */
#ifndef PHYSICS_MOTION_TIME_SCAN_H
#define PHYSICS_MOTION_TIME_SCAN_H

#include "physics/system/system.h"

struct phys_time_scan {
    size_t n;
    double *times;     /* [n], ascending: dense where the forces change abruptly */
    double resolution; /* a change between two times so far apart is not seen; 0: L is without t */
    double unresolved; /* from when on changes follow each other too fast; INFINITY: never */
};
/* The forces at a fixed state beside q and v [dof], from t0 to t1. Free with phys_time_scan_free in
   any case. */
enum ad_status phys_time_scan(const struct phys_system *system, const double *q, const double *v,
                              double t0, double t1, struct phys_time_scan *scan,
                              struct ad_error *error);
/* Adds those of the forces along a motion, x [2 dof][n] = q, v at times t [n], that is cubic
   between them: of what travels and meets it. None are added where the motion itself is not
   resolved. */
enum ad_status phys_time_scan_along(const struct phys_system *system, size_t n, const double *t,
                                    const double *x, struct phys_time_scan *scan,
                                    struct ad_error *error);
void phys_time_scan_free(struct phys_time_scan *scan);

#endif
