/* Integrators: methods for initial-value problems, by name.

   Units are the scene's. Errors: AD_E_ARGUMENT for NULL and numbers out of range, AD_E_MEMORY,
   AD_E_NONFINITE where L is not finite, and those named. Threads: calls may run at once unless
   they change one object; a system may be read by several. */
#ifndef PHYSICS_INTEGRATORS_INTEGRATORS_H
#define PHYSICS_INTEGRATORS_INTEGRATORS_H

#include "physics/ode/ode.h"

AD_HEADER_BEGIN

struct phys_scheme; /* the step of a family of methods */

/* A method: one file, one const struct, one line in the table. What each takes:
       euler rk4 dopri5 dop853                              any field
       implicit-midpoint gauss2 ... gauss5                  any field
       taylor                                               a Lagrangian without kinks
       semi-implicit                                        halves
       verlet velocity-verlet yoshida4 yoshida6             halves that separate: a kick
       wisdom-holman wisdom-holman-corrected                bodies of which one dominates (gm)
       rattle                                               the same, with constraints
       variational-RULE                                     a Lagrangian
   Every Hamiltonian has halves; it separates as T(p) + V(q, t). A method that is asked for more
   than it takes refuses: AD_E_ARGUMENT, with what to take instead. */
struct phys_integrator {
    const char *name, *what;
    size_t order;    /* 0: chosen by the tolerance */
    bool adaptive;   /* estimates its error and chooses its steps */
    bool symplectic; /* in canonical halves; semi-implicit: in those that separate */
    bool symmetric;  /* a step of -h undoes a step of h */
    bool separable;  /* needs phys_ode.kick */
    bool lagrangian; /* needs phys_ode.system, in y = (q, p) */
    bool dominated;  /* needs phys_scene.gm, of which one is far larger than the others */
    const struct phys_scheme *scheme;
    const void *coefficients;
};
/* Tolerance of a step: component k may err by atol s_k + rtol |y_k|; scale s [n], NULL: ones. */
struct phys_tolerance {
    double rtol, atol;
    const double *scale;
};

extern const struct phys_integrator *const phys_integrators[]; /* NULL-terminated */
/* By name; NULL and AD_E_ARGUMENT, naming the nearest, if there is none. */
const struct phys_integrator *phys_integrator_find(const char *name, struct ad_error *error);

AD_HEADER_END
#endif
