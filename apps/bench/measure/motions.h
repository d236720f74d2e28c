/* Test problems for integrators: a scene, a time, and the exact or reference state then. */
#ifndef APPS_BENCH_MEASURE_MOTIONS_H
#define APPS_BENCH_MEASURE_MOTIONS_H

#include "physics/motion/motion.h"
#include <stddef.h>

struct motion_problem {
    const char *name, *title;
    const char *scene;
    struct phys_setting set[4]; /* until a NULL name */
    double time;
    double coarsest; /* longest fixed step that is tried */
    /* q, v [dof] at a time; NULL: by the finest run of two methods */
    void (*exact)(double t, double *q, double *v);
};

extern const struct motion_problem motion_problems[];
enum { MOTION_PROBLEMS = 6 };

/* A problem opened. */
struct problem {
    const struct motion_problem *problem;
    struct phys_system system;
    double time, *q, *v; /* of the start */
    double *end;         /* [2 dof] positions and velocities at the end ... */
    double doubt;        /* ... and how far they may be off, in units of the error */
};

/* Ends with problem_close, whatever it returned. */
enum ad_status problem_open(const struct motion_problem *problem, struct problem *motion,
                            struct ad_error *error);
void problem_close(struct problem *motion);

/* Whether an integrator can follow this motion, and the field in the form that suits it (ode is to
   be freed in either case). */
enum ad_status problem_field(const struct problem *motion, const struct phys_integrator *integrator,
                             struct phys_ode *ode, bool *suits, struct ad_error *error);

/* What one run costs and errs. */
struct problem_cost {
    bool complete; /* false: the motion was lost on the way */
    size_t steps, evaluations;
    double seconds; /* CPU time */
    double error;   /* at the end, in positions or velocities, whichever is larger, relative to
                       their norm */
};

/* Runs once; `setting` is the step, or the tolerance of adaptive methods. */
enum ad_status problem_run(const struct problem *motion, const struct phys_integrator *integrator,
                           const struct phys_ode *ode, double setting, struct problem_cost *cost,
                           struct ad_error *error);

/* ---- motions with exact solutions, to the last digits of a double (exact.c) ---- */

/* The ellipse of a = GM = 1 and eccentricity e at time t after pericentre: q, v [2]. */
void exact_kepler(double e, double t, double *q, double *v);
/* The pendulum of g = l = 1 at time t after it passed the bottom at rate 2k, 0 < k < 1: q, v [1].
 */
void exact_pendulum(double k, double t, double *q, double *v);

#endif
