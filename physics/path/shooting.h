/* The motion through the two ends of a path, integrated accurately, by multiple shooting; and the
   flow of small variations along it. Independent of rules and grids. */
#ifndef PHYSICS_PATH_SHOOTING_H
#define PHYSICS_PATH_SHOOTING_H

#include "internal.h"
#include "physics/lagrangian/curvature.h"

struct phys_shooting {
    const struct phys_system *system;
    struct phys_curvature at;
    size_t dof, n; /* segments, each much shorter than the fastest oscillation on it */
    double *time;  /* [n+1] */
    double *state; /* [n+1][2 dof]: q, v at the nodes */
    double *begun; /* the same on the path that was given */
    double *flow;  /* [n][2 dof][2 dof]: of (q, p) over each segment, by columns, in `scale` */
    double *scale; /* [2 dof]: units of q and of p, whose products are equal */
    double *size;  /* [2 dof]: of q and v, for the control of errors */
    double *y;     /* room: [2 dof + 4 dof^2] and the units of its errors */
    double tolerance;
};

/* Nodes from path [s*dof x slices]. False: L_vv is singular or not finite on it, or it would take
   too many segments. Ends with phys_shooting_free, whatever it returned. */
bool phys_shooting_new(struct phys_shooting *s, const struct phys_system *system,
                       const struct phys_path_settings *settings, const double *path,
                       struct ad_error *error);
void phys_shooting_free(struct phys_shooting *s);
/* Moves the nodes onto the motion between the two ends, by Newton's method, with steps of a
   relative error under `tolerance`. False: it does not converge. */
bool phys_shooting_solve(struct phys_shooting *s, double tolerance);
/* How far from the path given the motion found is, as a share of the path's extent. */
double phys_shooting_moved(const struct phys_shooting *s);
/* The flow [2 dof][2 dof] from node i to time t, and the state there; false: lost. */
bool phys_shooting_flow(struct phys_shooting *s, size_t i, double t, double *flow, double *state);

#endif
