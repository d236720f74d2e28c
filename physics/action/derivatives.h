/* L with its first and second derivatives at any number of points, recorded once for a block of
   them: grids of all rules, lengths and times are evaluated by the same programs. */
#ifndef PHYSICS_ACTION_DERIVATIVES_H
#define PHYSICS_ACTION_DERIVATIVES_H

#include "physics/lagrangian/coupling.h"
#include "internal.h"

struct phys_derivatives {
    size_t dof, columns;           /* points of a block */
    ad_tape *tape;                 /* of its own; NULL: that of an action */
    ad_var path;                   /* input of the action's */
    ad_var q, v, t, seed;          /* else inputs: [dof x columns], [1 x columns], [dof x 1] */
    ad_var L, L_q, L_v;            /* [1 x columns], [dof x columns] */
    ad_var L_qq, L_qv, L_vq, L_vv; /* times the seed, [dof x columns]; L_qv: d/dq of L_v seed */
    ad_program *first, *second;    /* L, L_q, L_v (not of an action); L_q, L_v and the others */
    double *work;                  /* [2 dof + 1][columns], [dof] */
    bool units;                    /* coordinates may differ in unit (units.h) */
    struct phys_pattern coupling;
    const struct phys_scene *scene; /* whose L it is, ... */
    void *params;                   /* ... [params_bytes] with these parameters */
};

/* Blocks of `columns` points; or one block, the points of the path of which `action` recorded L.
   Ends with phys_derivatives_free, whatever it returned. */
enum ad_status phys_derivatives_new(struct phys_derivatives *d, const struct phys_system *system,
                                    size_t columns, const struct phys_action *action,
                                    struct ad_error *error);
/* The first derivatives alone: `second` is NULL. */
enum ad_status phys_derivatives_first_new(struct phys_derivatives *d,
                                          const struct phys_system *system, size_t columns,
                                          struct ad_error *error);
void phys_derivatives_free(struct phys_derivatives *d);
/* Whether they are of a system's L with its present parameters. */
bool phys_derivatives_serve(const struct phys_derivatives *d, const struct phys_system *system);
/* Programs that take long become machine code (ad_native_lazy). */
void phys_derivatives_native(struct phys_derivatives *d);
/* Sets the points of a block in a program: d->work holds q, v and t. */
void phys_derivatives_set(struct phys_derivatives *d, ad_program *program);
/* Runs `second` at the points set for the coordinates of a colour, of which no row of L's second
   derivatives couples two (coupling.h). */
void phys_derivatives_colour(struct phys_derivatives *d, size_t colour);

#endif
