/* A motion as asked for: from its start to a time, by a method and steps that are chosen where none
   are given, with its error measured and the events on the way:

       struct phys_motion_settings settings = {.time = 10, .error = 1e-9};
       struct phys_motion_solution motion;
       phys_motion_solve(&system, &settings, &motion, &error);
       ... motion.x[2 * dof * i + k] at motion.t[i], known to motion.error ...
       phys_motion_solution_free(&motion);

   phys_motion_diagnose (physics/stability/diagnostics.h) says how far it is to be believed. */
#ifndef PHYSICS_MOTION_SOLVE_H
#define PHYSICS_MOTION_SOLVE_H

#include "motion.h"
#include "physics/lagrangian/conserved.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

enum {
    PHYS_MOTION_TRIALS = 2,
    PHYS_MOTION_FEW = 100 /* bodies; with more, what costs the square of their number is left out:
                             the reference, the closest approach, momenta */
};

/* Where a difference, in units of the motion's size, is too large to speak of a prediction. */
#define PHYS_MOTION_LOST 0.1

/* ---- events (crossings.c) ---- */

/* A value that a quantity of the motion crosses, such as theta=0, "v_x<0.1", distance:1,2=0.5. */
struct phys_crossing {
    const char *text; /* not copied */
    const struct phys_quantity *quantity;
    size_t which[2]; /* coordinate; or two bodies, the second that of no body: from the origin */
    double value;
    int direction; /* +1: it rises through the value, -1: it falls */
    bool last;     /* ends the motion; false as read */
};
/* QUANTITY=VALUE, or > where it rises and < where it falls; the quantities are a coordinate, v_ and
   a coordinate, energy, and of bodies in the plane or in space distance:A or distance:A,B.
   AD_E_ARGUMENT says what the scene has. */
enum ad_status phys_crossing_read(const struct phys_system *system, const char *text,
                                  struct phys_crossing *crossing, struct ad_error *error);

/* Crossings found, n of them, in their order. */
struct phys_crossed {
    size_t n, room;
    double *which; /* [n] number of the crossing, from 1 */
    double *touch; /* [n] 1: it touches the value and turns back */
    double *t;     /* [n] */
    double *x;     /* [n][2 dof]: q, then v */
};

/* ---- the motion (solve.c) ---- */

/* Zero is a default everywhere but for the time. */
struct phys_motion_settings {
    const double *q, *v; /* [dof] at t = 0; NULL: the scene's start of this seed */
    uint64_t seed;
    double time;
    double error; /* asked of the whole motion: the largest distance of the coordinates */
    /* NULL: dop853; with an error asked for, dop853, or gauss5 where its rounding stops it. */
    const struct phys_integrator *integrator;
    double dt;               /* of fixed steps; 0: as the error asks, or the scene's */
    double tolerance;        /* of chosen steps; 0: as the error asks, or 1e-9 */
    size_t every, n_samples; /* as in struct phys_simulation; both 0: 1000, of many bodies 200 */
    size_t n_crossings;
    const struct phys_crossing *crossings;
    bool reverse;      /* run back, too */
    bool no_reference; /* the error is not measured */
    /* Asked before every step; told of every sample; false interrupts, NULL: go on. */
    bool (*proceed)(void *context);
    bool (*progress)(void *context, double t);
    void *context;
};

/* A method tried for an error. */
struct phys_motion_trial {
    const struct phys_integrator *integrator;
    double setting;               /* dt, or the tolerance of a step */
    double estimate;              /* of the largest error over the run; NaN: unknown */
    size_t evaluations, searched; /* of the setting; of all other runs */
    bool chosen;
};

/* Errors are distances of coordinates from the reference plus its uncertainty; NaN: not known. */
struct phys_motion_solution {
    const struct phys_system *system;
    const struct phys_integrator *integrator;
    double setting; /* dt, or the tolerance of a step */
    double *start;  /* [2 dof] q, v */
    struct phys_ode ode;
    struct phys_simulation_info info;
    size_t n, room;   /* samples */
    double *t;        /* [n] */
    double *x;        /* [n][2 dof]: q, then v */
    double *energy;   /* [n]; NaN where it is not known */
    double *distance; /* [n] from the reference; NULL: there is none */
    double error, error_end;
    double reversal; /* distance from the start after running back */
    /* Of the reference: largest uncertainty, distance from the start after running back, from when
       on it is not known (INFINITY: it is all known; NaN: there is none), the longest time between
       two looks at the forces, size of the coordinates. */
    double reference_uncertainty, reference_reversal, known_until, seen, size;
    struct phys_closest_approach closest;
    struct phys_crossed crossed;
    bool keeps_energy;
    struct phys_conserved conserved;
    size_t n_trials;
    struct phys_motion_trial trial[PHYS_MOTION_TRIALS];
};

/* Follows the motion. The error asked for may be missed, see phys_motion_met. AD_E_ACCURACY where
   it is out of reach or the motion is lost, AD_E_NONFINITE: the solution has what was reached. An
   interruption is no error (info.stop). The system must outlive the solution, which ends with
   phys_motion_solution_free, whatever was returned. */
enum ad_status phys_motion_solve(const struct phys_system *system,
                                 const struct phys_motion_settings *settings,
                                 struct phys_motion_solution *solution, struct ad_error *error);
void phys_motion_solution_free(struct phys_motion_solution *solution);
/* AD_E_ACCURACY where the method was chosen for an error and the measured one is more. */
enum ad_status phys_motion_met(const struct phys_motion_settings *settings,
                               const struct phys_motion_solution *solution, struct ad_error *error);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
