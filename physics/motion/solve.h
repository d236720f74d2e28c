/* A complete motion: from its start to a time, by a method and steps chosen where none are given,
   with its measured error and the events on the way:

       struct phys_motion_settings settings = {.size = sizeof settings, .time = 10, .error = 1e-9};
       struct phys_motion_solution motion;
       phys_motion_solve(&system, &settings, &motion, &error);
       ... motion.x[2 * dof * i + k] at motion.t[i], known to motion.error ...
       phys_motion_solution_free(&motion);

   phys_motion_diagnose (physics/stability/diagnostics.h) judges how reliable it is.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_MOTION_SOLVE_H
#define PHYSICS_MOTION_SOLVE_H

#include "motion.h"
#include "physics/lagrangian/conserved.h"

AD_HEADER_BEGIN

enum {
    PHYS_MOTION_TRIALS = 3,
    PHYS_MOTION_FEW = 100 /* most bodies; beyond, quadratic costs are omitted: the reference, the
                             closest approach, momenta */
};

/* Beyond this difference, in units of the motion's size, the motion is unpredictable. */
#define PHYS_MOTION_LOST 0.1

/* ---- events (crossings.c) ---- */

/* The crossing of a value by a quantity of the motion, such as theta=0, "v_x<0.1",
   distance:1,2=0.5. */
struct phys_crossing {
    const char *text; /* not copied */
    const struct phys_quantity *quantity;
    size_t which[2]; /* a coordinate; or two bodies, where the second may be none: distance from the
                        origin */
    double value;
    int direction; /* +1: it rises through the value, -1: it falls */
    bool last;     /* ends the motion; parsing sets false */
};
/* Parses QUANTITY=VALUE, or > for rising and < for falling crossings; quantities are a coordinate,
   v_ and a coordinate, energy, an observable, and, for bodies in the plane or in space, distance:A
   or distance:A,B. AD_E_ARGUMENT lists what the scene has. */
enum ad_status phys_crossing_read(const struct phys_system *system, const char *text,
                                  struct phys_crossing *crossing, struct ad_error *error);

/* Crossings found, n of them, in order of time. */
struct phys_crossed {
    size_t n, room;
    double *which; /* [n] number of the crossing, from 1 */
    double *touch; /* [n] 1: touches the value without crossing it */
    double *t;     /* [n] */
    double *x;     /* [n][2 dof]: q, then v */
    /* [n] how far t may be off by the measured error of the motion; NaN: that is not known */
    double *uncertainty;
    size_t undecided; /* extrema nearer to a value than the error, without a crossing there, ... */
    size_t which_undecided; /* ... and the crossing that has one */
    bool *constant; /* [n_crossings] the quantity changes by rounding alone: it crosses nothing */
};

/* ---- the motion (solve.c) ---- */

/* Zero means the default, except for the time. */
struct phys_motion_settings {
    size_t size;         /* sizeof(struct phys_motion_settings) */
    const double *q, *v; /* [dof] at t = 0; NULL: the scene's start of this seed */
    uint64_t seed;
    double time;
    double error; /* required error of the whole motion: the largest distance of the coordinates */
    /* NULL: dop853; with a required error dop853, or gauss5 where rounding stops dop853. */
    const struct phys_integrator *integrator;
    double dt;               /* fixed steps; 0: by the required error, or the scene's */
    double tolerance;        /* adaptive steps; 0: by the required error, or 1e-9 */
    size_t every, n_samples; /* as in struct phys_simulation; both 0: 1000, of many bodies 200 */
    size_t n_crossings;
    const struct phys_crossing *crossings;
    bool reverse;      /* also run back to the start */
    bool no_reference; /* do not measure the error */
    /* proceed is called before every step, sample at every sample; false interrupts. NULL: none. */
    bool (*proceed)(void *context);
    bool (*progress)(void *context, double t);
    void *context;
};

/* A setting tried for a required error. */
struct phys_motion_trial {
    const struct phys_integrator *integrator;
    double setting;               /* dt, or the tolerance of a step */
    double estimate;              /* estimate of the largest error over the run; NaN: unknown */
    size_t evaluations, searched; /* evaluations of this setting; of all other runs */
    bool chosen;
};

/* Errors are distances of the coordinates from the reference plus its uncertainty; NaN: unknown. */
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
    double worst_error; /* of one coordinate, `worst`, in units of its largest value */
    size_t worst;
    double reversal; /* distance from the start after running back */
    /* Of the reference: largest uncertainty; distance from the start after running back; from a run
       by dop853, where running back measures nothing; time from which it is unknown (INFINITY:
       known throughout; NaN: no reference); longest time between two evaluations of the forces;
       size of the coordinates; tolerance of its steps, more than 1e-15 where rounding of the forces
       is more. */
    double reference_uncertainty, reference_reversal, reference_forward, known_until, seen, size;
    double reference_tolerance;
    double time_resolution, time_unresolved;
    struct phys_closest_approach closest;
    struct phys_crossed crossed;
    bool keeps_energy;
    struct phys_conserved conserved;
    size_t n_trials;
    struct phys_motion_trial trial[PHYS_MOTION_TRIALS];
};

/* Follows the motion. The required error may be missed: see phys_motion_met. On AD_E_ACCURACY (out
   of reach, or the motion is lost) and AD_E_NONFINITE the solution has what was reached;
   AD_E_ARGUMENT where the motion cannot begin. An interruption is not an error (info.stop). The
   system must outlive the solution; free it with phys_motion_solution_free in any case. */
enum ad_status phys_motion_solve(const struct phys_system *system,
                                 const struct phys_motion_settings *settings,
                                 struct phys_motion_solution *solution, struct ad_error *error);
void phys_motion_solution_free(struct phys_motion_solution *solution);
/* work [n]: what the forces outside of L, and L's own dependence on time, have done at each sample
   since the first; the energy there less that is the start's, but for the method's error.
   `unknown`: how far the work may be off: large where forces jump. */
enum ad_status phys_motion_work(const struct phys_motion_solution *motion, double *work,
                                double *unknown, struct ad_error *error);
/* Of a scene with constraints: force [n][dof] = G^T lambda, the generalised forces that keep the
   motion on them at each sample, and how far the samples are off: the largest distance of the
   coordinates, residual[0], and of the velocities, residual[1], from ones that satisfy them. */
enum ad_status phys_motion_reactions(const struct phys_motion_solution *motion, double *force,
                                     double residual[2], struct ad_error *error);
/* Whether a motion can begin at q, v [dof] (NULL: at the scene's start of this seed): AD_E_ARGUMENT
   where the mass matrix is singular or the forces are not finite. */
enum ad_status phys_motion_check_start(const struct phys_system *system, uint64_t seed,
                                       const double *q, const double *v, struct ad_error *error);
/* AD_E_ACCURACY if the method was chosen for an error and the measured error is larger. */
enum ad_status phys_motion_met(const struct phys_motion_settings *settings,
                               const struct phys_motion_solution *solution, struct ad_error *error);

AD_HEADER_END
#endif
