/* Motion: an initial-value problem y' = f(t, y), and the methods that follow it.

       struct phys_ode ode;
       phys_ode_lagrangian(&system, &ode, error);                     y = (q, v)
       struct phys_simulation s = {.integrator = phys_integrator_find("dop853", error),
                                   .t1 = 10, .rtol = 1e-10, .atol = 1e-10};
       phys_simulate(&s, &ode, y, &info, error);                      y: from t0 to t1, in place
       phys_ode_free(&ode);

   A vector field comes from a Lagrangian, from a Hamiltonian, or from a callback of the user; the
   methods do not know which. */
#ifndef PHYSICS_INTEGRATE_H
#define PHYSICS_INTEGRATE_H

#include "physics/physics.h"

#ifdef __cplusplus
extern "C" {
#pragma GCC diagnostic push /* C has a struct and a function of one name */
#pragma GCC diagnostic ignored "-Wshadow"
#endif

/* ---- vector fields ---- */

/* rate [n] = f(t, y [n]). A failure ends the simulation with its message; a method with error
   control first tries a smaller step after AD_E_NONFINITE. */
typedef enum ad_status phys_field(void *context, double t, const double *y, double *rate,
                                  struct ad_error *error);

/* A first-order system. Those with halves have y = (q, v) or (q, p), n/2 numbers each. */
struct phys_ode {
    const char *name; /* of what moves, for messages; NULL: "the motion" */
    size_t n;         /* length of y */
    phys_field *field;
    /* Of systems that separate, else NULL. kick: rate [n/2] of the second half from the first half
       and t alone; drift: of the first half from the second half alone, NULL if they are equal. */
    phys_field *kick, *drift;
    /* Where there is a kick: the second half falls by this share in a unit of time, too (a friction
       proportional to the masses). `field` has it; methods that drift and kick take it exactly. */
    double friction;
    /* The halves are conjugate (up to a constant linear map): what a symplectic method preserves
       in y is the form of mechanics. */
    bool canonical;
    /* Each may be NULL. energy: E(t, y). enter, leave: y [n] from (q, v) and back, where y is not
       (q, v) itself. component: the name of component k of y. */
    double (*energy)(void *context, double t, const double *y);
    enum ad_status (*enter)(void *context, double t, const double *q, const double *v, double *y,
                            struct ad_error *error);
    enum ad_status (*leave)(void *context, double t, const double *y, double *q, double *v,
                            struct ad_error *error);
    void (*component)(const void *context, size_t k, char *name, size_t size);
    /* Why the field is interpreted, "" where it runs as machine code (ad_native_note). */
    const char *(*interpreted)(const void *context);
    const struct phys_system *system; /* what moves, n = 2 dof; NULL: not made of a system */
    void *context;
    void (*free)(void *context); /* or NULL */
};

/* The Euler-Lagrange equations of any Lagrangian in y = (q, v). Separates where the masses are
   constant and the accelerations depend on q and t alone. The system must outlive the ode. */
enum ad_status phys_ode_lagrangian(const struct phys_system *system, struct phys_ode *ode,
                                   struct ad_error *error);
/* The same motion in y = (q, p), p = L_v, where q' = v(q, p) and p' = L_q: canonical for any
   Lagrangian with a regular mass matrix L_vv. v is found by Newton's method; where L is quadratic
   in v the first step is the answer. */
enum ad_status phys_ode_canonical(const struct phys_system *system, struct phys_ode *ode,
                                  struct ad_error *error);

/* The gas scene, of up to thousands of bodies: its equations of motion without a mass matrix, with
   the friction apart, and, with a cutoff, from the pairs that are near. phys_ode_lagrangian takes
   them, too. The energy is that of the bodies, T + V. */
enum phys_gas_pairs {
    PHYS_GAS_AUTO, /* what is faster */
    PHYS_GAS_ALL,
    PHYS_GAS_NEAR /* needs a cutoff */
};
enum ad_status phys_ode_gas(const struct phys_system *system, enum phys_gas_pairs pairs,
                            struct phys_ode *ode, struct ad_error *error);

/* H for all samples at once. q, p: [dof x n], t: [1 x n]; returns [1 x n]. */
typedef ad_var phys_hamiltonian(ad_var q, ad_var p, ad_var t, const void *params);
/* Hamilton's equations q' = H_p, p' = -H_q by the tape, in y = (q, p). Separates where H = T(p) +
   V(q, t). params are read now and not kept. */
enum ad_status phys_ode_hamiltonian(phys_hamiltonian *H, size_t dof, const void *params,
                                    struct phys_ode *ode, struct ad_error *error);
/* Takes zero-initialised and failed ones too. */
void phys_ode_free(struct phys_ode *ode);

/* y [n] from q, v [n/2 each] and back. */
enum ad_status phys_ode_enter(const struct phys_ode *ode, double t, const double *q,
                              const double *v, double *y, struct ad_error *error);
enum ad_status phys_ode_leave(const struct phys_ode *ode, double t, const double *y, double *q,
                              double *v, struct ad_error *error);
/* The name of component k of y: "x of earth", "the velocity of ...", or "y3" where nobody knows. */
void phys_ode_component(const struct phys_ode *ode, size_t k, char *name, size_t size);

/* ---- from L to momenta and energy (legendre.c) ---- */

typedef struct phys_legendre phys_legendre;
/* The system must outlive it. */
enum ad_status phys_legendre_new(const struct phys_system *system, phys_legendre **legendre,
                                 struct ad_error *error);
void phys_legendre_free(phys_legendre *legendre); /* takes NULL */
/* v . L_v - L, right for any L. */
double phys_legendre_energy(phys_legendre *legendre, const double *q, const double *v, double t);
/* p [dof] = L_v, and force [dof] = L_q; either may be NULL. */
void phys_legendre_momentum(phys_legendre *legendre, const double *q, const double *v, double t,
                            double *p, double *force);
/* v [dof] with L_v(q, v, t) = p. AD_E_NONFINITE names the coordinate where there is none. */
enum ad_status phys_legendre_velocity(phys_legendre *legendre, const double *q, const double *p,
                                      double t, double *v, struct ad_error *error);

/* A lower bound of the condition number of the mass matrix L_vv: as many digits of the
   accelerations are lost to rounding. Beyond 1e12 L is refused as degenerate. */
double phys_legendre_condition(phys_legendre *legendre, const double *q, const double *v, double t);

/* What a system of bodies has in total; zero where it has none (scenes not drawn in the plane). */
struct phys_totals {
    double energy;
    double momentum[3], angular[3], centre[3];
    double mass; /* 0: the scene has no bodies */
};
/* Angular momentum about the origin, from momenta L_v; centre of mass from the masses L_vv. */
void phys_totals(phys_legendre *legendre, const double *q, const double *v, double t,
                 struct phys_totals *totals);

/* ---- integrators (integrators/) ---- */

struct phys_scheme; /* how a family of methods takes a step */

/* A method: one file, one const struct, one line in the table. What each takes:
       euler rk4 dopri5 dop853                              any field
       implicit-midpoint gauss2 ... gauss5                  any field
       semi-implicit                                        halves
       verlet velocity-verlet yoshida4 yoshida6             halves that separate: a kick
       variational-RULE                                     a Lagrangian
   Every Hamiltonian has halves; it separates as T(p) + V(q, t). A method that is asked for more
   than it takes refuses: AD_E_ARGUMENT, with what to take instead. */
struct phys_integrator {
    const char *name, *what;
    size_t order;
    bool adaptive;   /* has an error estimate, chooses its steps */
    bool symplectic; /* in canonical halves; semi-implicit: in those that separate */
    bool symmetric;  /* a step of -h undoes a step of h */
    bool separable;  /* needs phys_ode.kick */
    bool lagrangian; /* needs phys_ode.system, in y = (q, p) */
    const struct phys_scheme *scheme;
    const void *coefficients;
};
extern const struct phys_integrator *const phys_integrators[]; /* NULL-terminated */
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct phys_integrator *phys_integrator_find(const char *name, struct ad_error *error);

/* ---- simulation (simulate.c) ---- */

/* Functions g_k(t, y) whose roots are wanted. */
struct phys_events {
    size_t n;
    void (*values)(void *context, double t, const double *y, double *g); /* g [n] */
    int direction; /* +1: roots where g rises, -1: falls, 0: both */
    /* A root of g_k; false ends the simulation there. */
    bool (*found)(void *context, size_t k, double t, const double *y);
    void *context;
    /* An extremum of g_k that is 0 but for rounding; the same. NULL: not asked for. */
    bool (*touched)(void *context, size_t k, double t, const double *y);
    /* Roots are looked for between a few points of a step where the sign changes, which is cheaper;
       else every root of a step is isolated. */
    bool coarse;
};

enum phys_simulation_stop {
    PHYS_SIMULATION_END = 1,    /* t1 reached */
    PHYS_SIMULATION_EVENT,      /* an event asked for it */
    PHYS_SIMULATION_INTERRUPTED /* sample or proceed returned false */
};

/* Zero is a default wherever it is possible. */
struct phys_simulation {
    const struct phys_integrator *integrator;
    double t0, t1; /* t1 < t0 runs backwards */
    /* Fixed steps: their length, shortened a little where whole steps do not fill the time.
       Adaptive: the first step; 0: from the field. */
    double dt;
    /* Adaptive: a step's error e_k is held under atol s_k + rtol |y_k|; scale s [n], NULL: ones.
       atol 0: as rtol, and scale NULL then means phys_typical_sizes of the start. */
    double rtol, atol;
    const double *scale;
    /* A smaller step ends the simulation: AD_E_ACCURACY, naming time and component. 0: where the
       clock's last digits end, 10 epsilon |t|. */
    double min_step;
    size_t max_steps; /* AD_E_ACCURACY beyond; 0: any number */
    /* Samples: at the start and every so many steps, or, `every` 0, at n_samples equal intervals
       of time up to t1 (fixed steps: at the nearest steps; adaptive: by dense output); and where an
       event ends the simulation. */
    size_t every, n_samples;
    const double *times; /* adaptive: the n_samples times instead, in their order; or NULL */
    bool (*sample)(void *context, double t, const double *y);
    void *context;
    bool watch_energy; /* after every step, where the ode has an energy */
    const struct phys_events *events;
    size_t n_events;
    bool land; /* adaptive: steps end at the samples, which are then not interpolated */
    /* Asked before every step; false ends the simulation as interrupted. NULL: go on. */
    bool (*proceed)(void *context);
};

struct phys_simulation_info {
    enum phys_simulation_stop stop;
    double t;               /* reached */
    size_t steps, rejected; /* steps taken, steps whose error was too large */
    size_t evaluations;     /* of the field, or of the forces, by the method */
    size_t interpolations;  /* and for what lies between steps: samples, events */
    double seconds;         /* of stepping, without callbacks */
    double min_step, max_step;
    double energy_start, energy_drift; /* max |E - E0| / |E0|; absolute where E0 is 0 */
};

/* Follows the motion from y [n] at t0, in place. y and info are what was reached on failure too:
   AD_E_NONFINITE and AD_E_ACCURACY name step, time and component. */
enum ad_status phys_simulate(const struct phys_simulation *settings, const struct phys_ode *ode,
                             double *y, struct phys_simulation_info *info, struct ad_error *error);

/* The samples of a simulation: path [rows x columns], the first `rows` components of y, sample 0
   the start; samples beyond the columns are dropped. y as in phys_simulate; how->sample is not
   called. AD_E_ACCURACY, too, where how->proceed returned false. */
enum ad_status phys_trajectory(const struct phys_simulation *how, const struct phys_ode *ode,
                               double *y, size_t rows, size_t columns, double *path,
                               struct ad_error *error);
/* The motion of a Lagrangian from q and v [dof] at t = 0, at slices dt apart: path [dof x slices].
   Of `how` integrator (NULL: dop853), dt, tolerances, max_steps, proceed and its context count;
   how NULL: relative errors of 1e-13 a step. */
enum ad_status phys_motion_path(const struct phys_system *system, const struct phys_simulation *how,
                                const double *q, const double *v, size_t slices, double dt,
                                double *path, struct ad_error *error);

/* The same from the scene's start; of a scene without one, the closed form between its ends. */
enum ad_status phys_scene_path(const struct phys_system *system, uint64_t seed,
                               const struct phys_simulation *how, size_t slices, double dt,
                               double *path, struct ad_error *error);

/* Typical sizes [n] of the components at y, one for each half: what `scale` may be when lengths
   and velocities differ by powers of ten. */
enum ad_status phys_typical_sizes(const struct phys_ode *ode, double t, const double *y,
                                  double *scale, struct ad_error *error);

/* ---- the motion as well as double precision knows it (reference.c) ---- */

/* A motion followed twice by extrapolation, which is no phys_integrator, at a tolerance of 1e-15:
   the second time by other steps, which round differently. Where the two part the motion is not
   known: it is chaotic, or there is a force that acts for a shorter time than steps see. From there
   it is followed back: what it misses at the start is what both runs may have in common. */
struct phys_reference {
    size_t n, dof;
    double *x;           /* [n][2 dof]: q and v at the times */
    double *uncertainty; /* [n] of the coordinates: distance from the second run, and rounding */
    double reversal;     /* distance from the start after the run back; NaN: there is no way back */
    double
        horizon; /* first time the uncertainty exceeds `lost` sizes of the motion; INFINITY: none */
    double seen; /* longest time between two looks at the forces */
    double size; /* of the coordinates, what phys_typical_sizes says of the start */
    size_t evaluations;
};
/* At n increasing times, from q and v [dof] at times[0] on. proceed: as in phys_simulation.
   AD_E_ACCURACY if it returned false. Ends with phys_reference_free. */
enum ad_status phys_reference(const struct phys_system *system, const double *q, const double *v,
                              size_t n, const double *times, double lost,
                              bool (*proceed)(void *context), void *context,
                              struct phys_reference *reference, struct ad_error *error);
void phys_reference_free(struct phys_reference *reference); /* takes zero-initialised ones */

/* Closest approach of two bodies: events that keep the least distance of all pairs. */
struct phys_closest {
    double distance, t; /* distance INFINITY: fewer than two bodies */
    size_t first, second;
};
struct phys_approach;
/* For an ode of a system; closest begins with the distances at y. Ends with phys_approach_free. */
enum ad_status phys_approach_new(const struct phys_ode *ode, double t, const double *y,
                                 struct phys_approach **approach, struct ad_error *error);
/* What to hand to phys_simulate; and what was least so far. */
const struct phys_events *phys_approach_events(const struct phys_approach *approach);
struct phys_closest phys_approach_closest(const struct phys_approach *approach);
void phys_approach_free(struct phys_approach *approach);

#ifdef __cplusplus
#pragma GCC diagnostic pop
}
#endif
#endif
