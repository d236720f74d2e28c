/* Limits of methods, known before they fail: the longest stable step on an oscillation, and the
   time after which a chaotic motion is unpredictable.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_STABILITY_STABILITY_H
#define PHYSICS_STABILITY_STABILITY_H

#include "physics/motion/motion.h"

AD_HEADER_BEGIN

/* ---- steps (normal_modes.c, step_stability.c) ---- */

enum { PHYS_NORMAL_MODES_DOF = 1000 };

/* Small oscillations about a point, where M x'' = -K x with M = L_vv, K = -L_qq (terms in the
   velocities are ignored): from the eigenvalues of M^-1 K. */
struct phys_normal_modes {
    double frequency;  /* of the fastest oscillation, in radians; 0: there is none */
    double t;          /* the point it belongs to */
    size_t coordinate; /* coordinate of its largest amplitude */
    double growth;     /* largest exponential rate of leaving an unstable point; 0: none */
};
/* The fastest over n points x [n][2 dof], each q and then v, and times t [n]. AD_E_ARGUMENT for
   more than PHYS_NORMAL_MODES_DOF coordinates or a mass matrix that is not positive; AD_E_NONFINITE
   names a coordinate. */
enum ad_status phys_normal_modes(const struct phys_system *system, size_t n, const double *x,
                                 const double *t, struct phys_normal_modes *motion,
                                 struct ad_error *error);

/* Limits of w h for a method with steps h on an oscillation of frequency w, measured on the
   method's own steps; INFINITY where there is none. */
struct phys_step_limits {
    double stability; /* beyond, amplitudes grow: 2 for verlet, 2 sqrt 2 for rk4, 0 for euler */
    /* A step advances the phase by a third of a circle. There nonlinear forces drive a symplectic
       method off any orbit, however small: sqrt 3 for verlet, 2 sqrt 3 for implicit-midpoint
       (Skeel, Zhang, Schlick, SIAM J. Sci. Comput. 18, 1997). INFINITY for other methods. */
    double resonance;
};
/* AD_E_ARGUMENT for adaptive methods. */
enum ad_status phys_step_limits(const struct phys_integrator *integrator,
                                struct phys_step_limits *limits, struct ad_error *error);

enum phys_step_verdict {
    PHYS_STEP_GOOD,
    PHYS_STEP_RESONANT, /* beyond the resonance */
    PHYS_STEP_UNSTABLE  /* beyond stability */
};
struct phys_step_advice {
    enum phys_step_verdict verdict;
    struct phys_normal_modes motion; /* the fastest */
    double limit, resonance;         /* of dt there */
    char text[512];                  /* a warning and what to try; empty for good steps */
};
/* Stability of steps dt of a method at n points x, t [n], as of phys_normal_modes: the start, or a
   whole motion. */
enum ad_status phys_step_advise(const struct phys_integrator *integrator,
                                const struct phys_system *system, size_t n, const double *x,
                                const double *t, double dt, struct phys_step_advice *advice,
                                struct ad_error *error);

/* ---- chaos (lyapunov.c) ---- */

struct phys_lyapunov_settings {
    size_t size;      /* sizeof(struct phys_lyapunov_settings) */
    double t0, t1;    /* t1 > t0 */
    double tolerance; /* of the integration; 0: 1e-13 */
    const double
        *scale; /* [n] sizes of the components that differences are measured in; NULL: ones */
    const double *direction; /* [n] of the difference at the start; NULL: three irregular ones */
    double known, lost;      /* size of a difference at the start, and when it is too large */
    bool (*proceed)(void *context); /* as in phys_simulation; AD_E_ACCURACY where it is false */
    void *context;
};

struct phys_lyapunov {
    double exponent;    /* logarithmic growth rate of a small difference: mean over the runs */
    double least, most; /* over the runs, which differ in direction and rounding */
    double time;        /* the inverse of the exponent; INFINITY where nothing grows */
    double growth;      /* from t0 to t1 */
    /* Mean exponential growth of nearby orbits (Cincotta, Simo, Astron. Astrophys. Suppl. 147,
       2000): 2 on regular motions whose frequency depends on the amplitude, where differences grow
       in proportion to time; 0 on isochronous ones (the spring); exponent * time / 2 on chaotic
       ones. */
    double megno;
    /* True if this still holds for growth beyond that of the motion itself: differences of an
       unstable linear motion grow with it, and an equilibrium does not move. A short time span
       cannot decide. */
    bool chaotic;
    /* Times at which a difference `known` has grown to `lost`: first and last of the runs;
       INFINITY: not before t1. Where the motion is not chaotic, in units of its largest size until
       then. */
    double horizon, latest;
};

/* Follows small differences along the motion from y [n] at t0 by the linearised field. */
enum ad_status phys_lyapunov(const struct phys_ode *ode, const double *y,
                             const struct phys_lyapunov_settings *settings,
                             struct phys_lyapunov *result, struct ad_error *error);

/* The k largest Lyapunov exponents [k] of the motion from x = (q, v) at t0, in descending order,
   and how much each changed over the second half of the time [k]; NaN on errors. Of `settings`, t0,
   t1, tolerance, scale, proceed and its context are used. Variations follow the linearised
   equations: what phys_ode_variations refuses is refused. */
enum ad_status phys_lyapunov_spectrum(const struct phys_system *system, const double *x,
                                      const struct phys_lyapunov_settings *settings, size_t k,
                                      double *exponents, double *spread, struct ad_error *error);

/* The state-transition matrix [d][d], d = 2 dof: row i, column j is the derivative of component i
   of (q, v) at t1 by component j at t0, where the motion starts from x = (q, v); and the
   uncertainty of each entry, by which two runs of different steps differ. Of `settings`, t0, t1,
   proceed and its context are used. AD_E_ACCURACY where the runs differ by a thousandth of the
   largest entry; what phys_ode_variations refuses is refused. */
enum ad_status phys_transition(const struct phys_system *system, const double *x,
                               const struct phys_lyapunov_settings *settings, double *matrix,
                               double *uncertainty, struct ad_error *error);

/* The derivatives [2 dof][n] of (q, v) at t1 by parameters names[n] of the scene, and their
   uncertainties. The motion starts from x = (q, v), whatever the parameters; where x is NULL, from
   the scene's start drawn from `seed`, whose own dependence on them counts. Settings and errors as
   phys_transition; AD_E_ARGUMENT names a parameter that L has as a plain number. */
enum ad_status phys_sensitivity(const struct phys_system *system, const double *x, uint64_t seed,
                                const struct phys_lyapunov_settings *settings, size_t n,
                                const char *const names[], double *matrix, double *uncertainty,
                                struct ad_error *error);

AD_HEADER_END
#endif
