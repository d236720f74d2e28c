/* For physics/ only: holonomic constraints g(q, t) = 0 of a motion. With G = g_q, W = M^-1 G^T and
   S = G W the forces that keep them are G^T lambda, S lambda = -G a - d(G v + g_t)/dt, where a is
   the acceleration without them (index reduction; Hairer, Wanner, Solving Ordinary Differential
   Equations II, section VII.1). Constraints are independent where S, its diagonal scaled to 1, has
   a condition number under PHYS_MASS_SINGULAR: singular values of G M^-1/2 down to 1e-6. */
#ifndef PHYSICS_LAGRANGIAN_CONSTRAINTS_H
#define PHYSICS_LAGRANGIAN_CONSTRAINTS_H

#include "internal.h"

/* At the state evaluated last. */
struct phys_constraints {
    const struct phys_system *system;
    size_t n, dof;
    ad_tape *tape;
    ad_program *program;
    ad_var x[3], out[4];   /* q, v, t; g, rate, bias [n x 1], G^T [dof x n] */
    double *g, *rate;      /* [n] g, and G v + g_t */
    double *bias;          /* [n] the derivative of the rate by t, as far as a is not in it */
    double *G, *W;         /* [n][dof] G, and W^T */
    double *S, *size;      /* [n][n] factored; [n] roots of its diagonal */
    double *lambda, *room; /* [n] multipliers; [n (n + 1) + dof] */
    double *by_coordinate; /* [dof][n] G as the tape has it */
    int *pivots;
};

/* NULL, and no error, of a scene without constraints. Takes NULL. */
enum ad_status phys_constraints_new(const struct phys_system *system, struct phys_constraints **c,
                                    struct ad_error *error);
void phys_constraints_free(struct phys_constraints *c);
/* g, rate, bias and G; v NULL: at rest. */
void phys_constraints_evaluate(struct phys_constraints *c, const double *q, const double *v,
                               double t);

/* Whether g depends on time; true where that cannot be found out. */
bool phys_constraints_move(const struct phys_constraints *c, struct ad_error *error);

/* ---- of a motion (NULL: it has none) ---- */

struct phys_constraints *phys_motion_constraints(const phys_motion *motion);
/* All of the above. AD_E_NONFINITE names constraints that depend on each other, or contradict each
   other. */
enum ad_status phys_motion_constrain(phys_motion *motion, const double *q, const double *v,
                                     double t, struct ad_error *error);
/* Free accelerations become those of the constrained motion, at the state of _constrain. */
void phys_constraints_push(struct phys_constraints *c, double *a);
/* Moves q along the directions W [n][dof] until g = 0; moved [dof] (NULL: not wanted) is by how
   much. */
enum ad_status phys_constraints_meet(struct phys_constraints *c, const double *W, double t,
                                     double *q, double *moved, struct ad_error *error);
/* Takes off v what changes g, at the state of _constrain. */
void phys_constraints_turn(struct phys_constraints *c, double *v);
/* The two for a state; in the metric of M, so that units make no difference. */
enum ad_status phys_motion_project(phys_motion *motion, double t, double *q, double *v,
                                   struct ad_error *error);
/* Distances of q and v from ones that satisfy the constraints, to first order. */
enum ad_status phys_motion_residual(phys_motion *motion, const double *q, const double *v, double t,
                                    double residual[2], struct ad_error *error);
/* AD_E_NONFINITE where constraints lose their independence on the way from x0 [2 dof] = q, v at t
   to x at t + h: no state of a motion need be at that place. */
enum ad_status phys_motion_check_step(phys_motion *motion, double t, double h, const double *x0,
                                      const double *x, struct ad_error *error);
/* AD_E_ARGUMENT where `what`, such as "start", cannot be at (q, v, t), v NULL: at any v, with the
   constraint, its residual and a state that would do. */
enum ad_status phys_motion_check_constraints(phys_motion *motion, const char *what, const double *q,
                                             const double *v, double t, struct ad_error *error);

#endif
