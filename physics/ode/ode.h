/* Initial-value problems y' = f(t, y): the vector field of a Lagrangian, of a Hamiltonian, or of a
   user's callback.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_ODE_ODE_H
#define PHYSICS_ODE_ODE_H

#include "physics/system/system.h"

AD_HEADER_BEGIN

/* rate [n] = f(t, y [n]). A failure ends the simulation with its message; a method with error
   control first tries a smaller step after AD_E_NONFINITE. */
typedef enum ad_status phys_field(void *context, double t, const double *y, double *rate,
                                  struct ad_error *error);

enum { PHYS_SERIES_MOST = 30 };

/* A first-order system. One with halves has y = (q, v) or (q, p), n/2 numbers each. */
struct phys_ode {
    const char *name; /* names the moving thing in messages; NULL: "the motion" */
    size_t n;         /* length of y */
    phys_field *field;
    /* For systems that separate, else NULL. kick: rate [n/2] of the second half, from the first
       half and t alone; drift: rate of the first half, from the second half alone; NULL if the two
       are equal. */
    phys_field *kick, *drift;
    /* With a kick: rate of exponential decay of the second half (friction proportional to the
       masses). `field` includes it; splitting methods treat it exactly. */
    double friction;
    /* Taylor coefficients c [order + 1][n] of the motion about t, c[0..n-1] = y given, order at
       most PHYS_SERIES_MOST; cut [n]: what rounding cut off y, or NULL. NULL: not known. */
    enum ad_status (*series)(void *context, size_t order, double t, double *c, const double *cut,
                             struct ad_error *error);
    /* rest [n]: what rounding cut off the first coefficients where it cut `cut` [n] off y; NULL:
       not known. */
    void (*rest)(void *context, double t, const double *y, const double *cut, double *rest);
    /* The halves are conjugate (up to a constant linear map), so that symplectic methods preserve
       the symplectic form of mechanics. */
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
    const struct phys_system *system; /* the system, n = 2 dof; NULL: not made from one */
    void *context;
    void (*free)(void *context); /* or NULL */
    /* Moves y [n] onto constraints, after each step of a method; NULL: there are none. */
    enum ad_status (*project)(void *context, double t, double *y, struct ad_error *error);
    void *reserved[6]; /* NULL: room for what later releases add */
};

/* The Euler-Lagrange equations of any Lagrangian in y = (q, v). They separate if the masses are
   constant and the accelerations depend on q and t alone. The system must outlive the ode. */
enum ad_status phys_ode_lagrangian(const struct phys_system *system, struct phys_ode *ode,
                                   struct ad_error *error);
/* The motion and `columns` of its variations, which follow the linearised equations: y = (q, v),
   then (dq, dv) of each. Where (dq, dv) begin as the columns of the unit matrix, they are the
   state-transition matrix. By Taylor series alone: of L without kinks, with constant masses or at
   most 6 coordinates; AD_E_ARGUMENT otherwise. */
enum ad_status phys_ode_variations(const struct phys_system *system, size_t columns,
                                   struct phys_ode *ode, struct ad_error *error);
/* The same with n parameters of the scene, by name, as variables: their values are read from the
   system whenever the motion is, so that phys_system_set holds without another recording. After the
   `columns` follow n more, of the variations by these parameters; they begin as the derivatives of
   the start by them, or at 0. AD_E_ARGUMENT, too, for what phys_param_use finds to be no variable.
 */
enum ad_status phys_ode_parameters(const struct phys_system *system, size_t columns, size_t n,
                                   const char *const names[], struct phys_ode *ode,
                                   struct ad_error *error);
/* The same motion in y = (q, p), p = L_v, with q' = v(q, p) and p' = L_q: canonical for any
   Lagrangian with a regular mass matrix L_vv. v is found by Newton's method; where L is quadratic
   in v the first step is exact. Of a scene that is given by its H, Hamilton's equations. */
enum ad_status phys_ode_canonical(const struct phys_system *system, struct phys_ode *ode,
                                  struct ad_error *error);

/* The gas scene, of up to thousands of bodies: its equations of motion without a mass matrix, with
   the friction apart, and, with a cutoff, from the pairs that are near. phys_ode_lagrangian takes
   them, too. The energy is that of the bodies, T + V. */
enum phys_gas_pairs {
    PHYS_GAS_AUTO, /* whichever is faster */
    PHYS_GAS_ALL,
    PHYS_GAS_NEAR /* needs a cutoff */
};
enum ad_status phys_ode_gas(const struct phys_system *system, enum phys_gas_pairs pairs,
                            struct phys_ode *ode, struct ad_error *error);

/* Hamilton's equations q' = H_p, p' = -H_q by the tape, in y = (q, p). They separate if H = T(p) +
   V(q, t). params are read during the call and not kept. */
enum ad_status phys_ode_hamiltonian(phys_hamiltonian *H, size_t dof, const void *params,
                                    struct phys_ode *ode, struct ad_error *error);
/* Takes zero-initialised and failed ones too. */
void phys_ode_free(struct phys_ode *ode);

/* y [n] from q, v [n/2 each] and back. */
enum ad_status phys_ode_enter(const struct phys_ode *ode, double t, const double *q,
                              const double *v, double *y, struct ad_error *error);
enum ad_status phys_ode_leave(const struct phys_ode *ode, double t, const double *y, double *q,
                              double *v, struct ad_error *error);
/* The name of component k of y: "x of earth", "the velocity of ...", or "y3" if it has none. */
void phys_ode_component(const struct phys_ode *ode, size_t k, char *name, size_t size);

AD_HEADER_END
#endif
