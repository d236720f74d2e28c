/* Motion: solution of an initial-value problem y' = f(t, y) by a given method.

       struct phys_ode ode;
       phys_ode_lagrangian(&system, &ode, error);                     y = (q, v)
       struct phys_simulation s = {.size = sizeof s, .integrator = phys_integrator_find("dop853",
   error), .t1 = 10, .rtol = 1e-10, .atol = 1e-10}; phys_simulate(&s, &ode, y, &info, error); y:
   from t0 to t1, in place phys_ode_free(&ode);

   Vector fields: physics/ode/ode.h; methods: physics/integrators/integrators.h.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_MOTION_MOTION_H
#define PHYSICS_MOTION_MOTION_H

#include "physics/integrators/integrators.h"
#include "physics/lagrangian/legendre.h"

AD_HEADER_BEGIN

/* ---- simulation (simulate.c) ---- */

/* Functions g_k(t, y) whose roots are events. */
struct phys_events {
    size_t n;
    void (*values)(void *context, double t, const double *y, double *g); /* g [n] */
    int direction; /* +1: roots where g rises, -1: falls, 0: both */
    /* Called at a root of g_k; returning false ends the simulation there. */
    bool (*found)(void *context, size_t k, double t, const double *y);
    void *context;
    /* Called at an extremum of g_k that is 0 to rounding, likewise. NULL: such extrema are ignored.
     */
    bool (*touched)(void *context, size_t k, double t, const double *y);
    /* Search a few points of each step for changes of sign, which is cheaper; otherwise every root
       of a step is isolated. */
    bool coarse;
    int *signs; /* [n] last signs that were not 0, in: before the start, out: at the end; or NULL */
    void *reserved[4]; /* NULL: room for what later releases add */
};

enum phys_simulation_stop {
    PHYS_SIMULATION_END = 1,    /* t1 reached */
    PHYS_SIMULATION_EVENT,      /* an event asked for it */
    PHYS_SIMULATION_INTERRUPTED /* sample or proceed returned false */
};

/* Zero means the default wherever there is one. */
struct phys_simulation {
    size_t size; /* sizeof(struct phys_simulation) */
    const struct phys_integrator *integrator;
    double t0, t1; /* t1 < t0 runs backwards */
    /* Fixed steps: their length, shortened a little where whole steps do not fill the time.
       Adaptive: the first step; 0: from the field. */
    double dt;
    /* Adaptive: the error e_k of a step is kept below atol s_k + rtol |y_k|; scale s [n]. NULL:
       from the motion, so that units make no difference: the largest |y_k| so far, of each half
       where the ode has halves. atol 0: equal to rtol, with phys_typical_sizes of the start where
       the ode has halves. */
    double rtol, atol;
    const double *scale;
    /* A smaller step ends the simulation: AD_E_ACCURACY, naming time and component. 0: the
       resolution of t, 10 epsilon |t|. */
    double min_step;
    size_t max_steps; /* AD_E_ACCURACY beyond; 0: no limit */
    /* Samples: at the start and every `every` steps, or, `every` 0, at n_samples equal intervals of
       time up to t1 (fixed steps: at the nearest steps; adaptive: by dense output); and where an
       event ends the simulation. */
    size_t every, n_samples;
    const double *times; /* adaptive: ascending times of the n_samples instead; or NULL */
    bool (*sample)(void *context, double t, const double *y);
    void *context;
    bool watch_energy; /* after every step, or every sample where the method gives its state there
                          alone (wisdom-holman-corrected), if the ode has an energy */
    const struct phys_events *events;
    size_t n_events;
    bool land; /* adaptive: steps end at the samples, which are then not interpolated */
    /* Called before every step; false interrupts the simulation. NULL: never. */
    bool (*proceed)(void *context);
    /* phys_motion_path, phys_scene_path: by phys_ode_for, for all motions of a system; NULL: made
       for the one. */
    const struct phys_ode *ode;
};

struct phys_simulation_info {
    enum phys_simulation_stop stop;
    double t;               /* reached */
    size_t samples;         /* given */
    size_t steps, rejected; /* steps taken, steps rejected */
    size_t evaluations;     /* evaluations of the field, or of the forces, by the method */
    size_t interpolations;  /* evaluations for output between steps: samples, events */
    double seconds;         /* seconds of stepping, without callbacks */
    double min_step, max_step;
    double energy_start, energy_drift; /* max |E - E0| / |E0|; absolute where E0 is 0 */
};

/* Follows the motion from y [n] at t0 to t1, in place. On failure y and info are what was reached:
   AD_E_NONFINITE and AD_E_ACCURACY name step, time and component. */
enum ad_status phys_simulate(const struct phys_simulation *settings, const struct phys_ode *ode,
                             double *y, struct phys_simulation_info *info, struct ad_error *error);

/* A simulation from t = 0 to t1: steps of dt, or adaptive within a tolerance, whichever the method
   takes. */
static inline struct phys_simulation phys_simulation_of(const struct phys_integrator *integrator,
                                                        double setting, double t1)
{
    struct phys_simulation how;
    memset(&how, 0, sizeof how);
    how.size = sizeof how;
    how.integrator = integrator;
    how.t1 = t1;
    if (integrator)
        *(integrator->adaptive ? &how.rtol : &how.dt) = setting;
    return how;
}
/* The vector field of a system in the form that suits a method: y = (q, p) for methods that are
   symplectic in conjugate coordinates, unless the system separates; else (q, v). */
enum ad_status phys_ode_for(const struct phys_system *system,
                            const struct phys_integrator *integrator, struct phys_ode *ode,
                            struct ad_error *error);

enum { PHYS_MOTION_STEPS = 50000 }; /* more steps than this between two slices mean a collision */

/* Stores the samples of a simulation: path [rows x columns] receives the first `rows` components of
   y, sample 0 the start; samples beyond the columns are dropped. y and info as in phys_simulate;
   how->sample is ignored. AD_E_ACCURACY also where how->proceed returned false. */
enum ad_status phys_trajectory(const struct phys_simulation *how, const struct phys_ode *ode,
                               double *y, size_t rows, size_t columns, double *path,
                               struct phys_simulation_info *info, struct ad_error *error);
/* The motion of a Lagrangian from q and v [dof] at t = 0, at slices dt apart: path [dof x slices].
   Of `how`, integrator (NULL: taylor, or dop853), dt, tolerances, max_steps, proceed, its
   context and ode are used; how NULL: relative errors of 1e-13 per step. */
enum ad_status phys_motion_path(const struct phys_system *system, const struct phys_simulation *how,
                                const double *q, const double *v, size_t slices, double dt,
                                double *path, struct ad_error *error);

/* As phys_motion_path, from the scene's start; for a scene without one, the closed form between its
   ends. */
enum ad_status phys_scene_path(const struct phys_system *system, uint64_t seed,
                               const struct phys_simulation *how, size_t slices, double dt,
                               double *path, struct ad_error *error);

/* The published motion from the scene's start: phys_first_slices, then phys_ode_path. `given` NULL,
   or a path [dof x slices] whose first two slices it begins with. */
enum ad_status phys_published_path(const struct phys_system *system, uint64_t seed, size_t slices,
                                   double dt, bool euler, double damping, const double *given,
                                   double *path, struct ad_error *error);

/* Typical sizes [n] of the components at y, one for each half: what `scale` may be when lengths
   and velocities differ by powers of ten. */
enum ad_status phys_typical_sizes(const struct phys_ode *ode, double t, const double *y,
                                  double *scale, struct ad_error *error);

/* ---- the motion as well as double precision knows it (reference.c) ---- */

/* A motion followed twice by extrapolation, which is no phys_integrator, at a tolerance of 1e-15,
   or at the tenfold of it to which the forces are known where their terms cancel: the second time
   by other steps, which round differently. Where the two part the motion is not known: it is
   chaotic, or there is a force that acts for a shorter time than steps see. From there it is
   followed back: what it misses at the start is what both runs may have in common. Where forces
   dissipate and the way back loses the motion, a run by dop853 shows that instead. */
struct phys_reference {
    size_t n, dof;
    double *x; /* [n][2 dof]: q and v at the times */
    /* [2 n] distances from the second run, and rounding: of the coordinates, then of velocities. */
    double *uncertainty;
    double reversal; /* distance from the start after the run back; NaN: there is no way back */
    double forward;  /* largest distance from the run by dop853; NaN: there is none */
    double
        horizon; /* first time an uncertainty exceeds `lost` sizes of the motion; INFINITY: none */
    double tolerance;       /* of a step */
    double seen;            /* longest time between two looks at the forces */
    double time_resolution; /* ... that depend on time explicitly; 0: they do not */
    double
        time_unresolved; /* from when on they change more than can be followed; INFINITY: never */
    double size; /* the largest distance of the coordinates from the origin, up to the horizon */
};
/* The reference motion at n increasing times, from q and v [dof] at times[0]. proceed as in
   phys_simulation: AD_E_ACCURACY if it returned false. Free with phys_reference_free. */
enum ad_status phys_reference(const struct phys_system *system, const double *q, const double *v,
                              size_t n, const double *times, double lost,
                              bool (*proceed)(void *context), void *context,
                              struct phys_reference *reference, struct ad_error *error);
void phys_reference_free(struct phys_reference *reference); /* takes zero-initialised ones */

/* Closest approach of two bodies: events that keep the least distance of any pair. */
struct phys_closest_approach {
    double distance, t; /* distance INFINITY: fewer than two bodies */
    size_t first, second;
    struct phys_events events; /* for phys_simulate, until the end */
    const struct phys_ode *ode;
    double *state;
};
/* Begins with the distances at y [ode->n], for the ode of a system. Neither is copied: both must
   live until phys_closest_approach_end, after which the result stays valid. */
enum ad_status phys_closest_approach_begin(const struct phys_ode *ode, double t, const double *y,
                                           struct phys_closest_approach *closest,
                                           struct ad_error *error);
void phys_closest_approach_end(struct phys_closest_approach *closest);

AD_HEADER_END
#endif
