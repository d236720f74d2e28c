/* All second derivatives of a Lagrangian at one point. */
#ifndef PHYSICS_LAGRANGIAN_CURVATURE_H
#define PHYSICS_LAGRANGIAN_CURVATURE_H

#include "internal.h"

struct phys_curvature {
    const struct phys_system *system;
    ad_tape *tape;
    ad_program *program;
    ad_var at_q, at_v, at_t;
    ad_var by_q, by_v, by_vt, by_qq, by_qv, by_vv;
    /* At the place last evaluated: L_q, L_v, L_vt [dof]; L_qq, L_qv and L_vv [dof x dof], element
       (i, j) of L_qv d2L / dq_i dv_j. */
    double *q, *v, *vt, *qq, *qv, *vv;
    bool mixed, diagonal; /* L_qv is not 0; L_vv is diagonal */
    double *factor;       /* [dof x dof] of L_vv, P L U */
    int *pivots;
    size_t *span; /* [dof][2] of each row of L_qq: its first element that is not 0, and past the
                     last */
};

/* Ends with phys_curvature_free, whatever it returned. */
enum ad_status phys_curvature_new(struct phys_curvature *c, const struct phys_system *system,
                                  struct ad_error *error);
void phys_curvature_free(struct phys_curvature *c);
/* False: something is not finite there, or L_vv is singular. */
bool phys_curvature_at(struct phys_curvature *c, const double *q, const double *v, double t);
/* The acceleration [dof] there, along the v that it was evaluated at. */
void phys_curvature_acceleration(struct phys_curvature *c, const double *v, double *a);
/* A variation (dq, dp) of the canonical state goes with dv = L_vv^-1 (dp - L_vq dq), and dp grows
   by L_qq dq + L_qv dv in a unit of time; `force` may be NULL. All are [dof]. */
void phys_curvature_vary(struct phys_curvature *c, const double *dq, const double *dp, double *dv,
                         double *force);

#endif
