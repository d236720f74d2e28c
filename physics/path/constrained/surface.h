/* For physics/path/ only: paths whose nodes keep constraints g(q, t) = 0.

   At a node with G = g_q, Z an orthonormal basis of what G maps to 0, and S_q = G^T mu + Z s, the
   action of nodes q + Z u, moved back along G^T to where g = 0, has the gradient s and the Hessian
   Z^T (S_qq - sum mu g_qq) Z: its Newton step is that of the saddle system of S - mu g, and its
   inertia is that of S between the ends on the constraints (Gabay, Minimizing a differentiable
   function over a differential manifold, J. Optim. Theory Appl. 37, 1982). Nodes are Lobatto's, so
   that keeping g = 0 there alone keeps the order of the rule: the integral of lambda g along the
   path is zero to that order. */
#ifndef PHYSICS_PATH_CONSTRAINED_SURFACE_H
#define PHYSICS_PATH_CONSTRAINED_SURFACE_H

#include "physics/action/hessian.h"
#include "physics/lagrangian/constraints.h"

struct phys_surface {
    const struct phys_hessian *whole; /* of all coordinates */
    struct phys_hessian tangent;      /* of u: degree, elements and times are those of `whole` */
    struct phys_constraints *at;      /* g and G at one node */
    uint32_t *order;                  /* of u: 0, 1, ... */
    bool *moves;                      /* [2][left] of u at the ends, where phys_surface_reduce was
                                         last: the first directions, where coordinates move */
    size_t dof, n, left, nodes;       /* left: dof - n */
    ad_tape *tape;
    ad_program *program; /* q, t, mu -> sum mu g_qq [dof x dof] */
    ad_var q, t, mu, curvature;
    double *Z; /* [nodes][left][dof], where phys_surface_reduce was last */
    double *Q; /* [n][dof] room: orthonormal rows of G; of G; [n][n], [n]; [2 dof] */
    double *W, *A, *b, *x;
    double *H; /* [dof][dof] room */
};

/* NULL, and no error, of a scene without constraints. `whole` must outlive it. */
enum ad_status phys_surface_new(const struct phys_system *system, const struct phys_hessian *whole,
                                struct phys_surface **surface, struct ad_error *error);
void phys_surface_free(struct phys_surface *surface); /* takes NULL */

/* Moves all nodes of a path [degree*dof x slices], of its ends what is free, onto g = 0.
   AD_E_ARGUMENT: what is given at an end cannot keep it; AD_E_NONFINITE: it fails at the time
   named, or normals at neighbouring nodes point to opposite sides, so that no curve on the surface
   need join them. */
enum ad_status phys_surface_meet(struct phys_surface *s, double *path, struct ad_error *error);
/* Projects x onto the tangent space at slice i, or (k > 0) at node k behind it. False: the
   constraints are linearly dependent there. */
bool phys_surface_project(struct phys_surface *s, const double *path, size_t i, size_t k,
                          double *x);
/* The same at an end at q, with 0 for what is given there. */
void phys_surface_project_end(struct phys_surface *s, size_t end, const double *q, double *x);
/* Projects a gradient [degree*dof x slices] at all nodes; returns its norm, NaN where constraints
   are linearly dependent. */
double phys_surface_gradient(struct phys_surface *s, const double *path, double *gradient);
/* Computes `tangent` from `whole`, both at the path. */
void phys_surface_reduce(struct phys_surface *s, const double *path);
/* Z^T x, and Z u: x [degree*dof x slices], u [degree*left x slices]. */
void phys_surface_to(const struct phys_surface *s, const double *x, double *u);
void phys_surface_from(const struct phys_surface *s, const double *u, double *x);

/* Projects v onto the tangent space at q, in the metric of the mass matrix: momenta of a path are
   known up to the impulses of the constraints. Does nothing for a scene without constraints. */
enum ad_status phys_surface_velocity(const struct phys_system *system, const double *q, double t,
                                     double *v, struct ad_error *error);
/* Velocities [dof x slices] at the slices of a stationary path, from its momenta, and the forces of
   the constraints there by the equations of motion. */
enum ad_status phys_surface_forces(const struct phys_system *system, struct phys_hessian *whole,
                                   const double *path, double *force, struct ad_error *error);

#endif
