/* Derivatives of L at points (derivatives.h), by programs of second gradients: with a unit vector u
   as the seed,
       d/dq <L_q, u> and d/dv <L_q, u>   are column u of L_qq and L_vq at every point,
       d/dq <L_v, u> and d/dv <L_v, u>   those of L_qv and L_vv,
   so a run for each colour of coordinates that no row couples gives them all; all but the first
   recompute only what depends on the seed. */
#include "derivatives.h"
#include "autodiff/free.h"
#include "units.h"

#include <stdlib.h>
#include <string.h>

/* L at the points, on the tape of the action or on one of its own. */
static ad_var lagrangian(struct phys_derivatives *d, const struct phys_system *system,
                         const struct phys_action *action)
{
    if (action) {
        d->path = ad_hold(action->path);
        d->q = action->points.q;
        d->v = action->points.v;
        return action->L;
    }
    d->q = ad_hold(ad_input(d->tape, d->dof, d->columns, "q"));
    d->v = ad_hold(ad_input(d->tape, d->dof, d->columns, "v"));
    d->t = ad_hold(ad_input(d->tape, 1, d->columns, "t"));
    return phys_system_lagrangian(system, d->q, d->v, d->t);
}

/* Those by the coordinates times a seed. */
static void record_second(struct phys_derivatives *d)
{
    ad_var at[2] = {d->q, d->v}, by[2];
    d->seed = ad_input(d->L.tape, d->dof, 1, "seed");
    ad_grad(ad_dot(d->L_q, d->seed), 2, at, by);
    d->L_qq = by[0];
    d->L_vq = by[1];
    ad_grad(ad_dot(d->L_v, d->seed), 2, at, by);
    d->L_qv = by[0];
    d->L_vv = by[1];
}

static enum ad_status record(struct phys_derivatives *d, const struct phys_system *system,
                             const struct phys_action *action, bool second, struct ad_error *error)
{
    ad_var by[2];
    d->L = lagrangian(d, system, action);
    ad_tape *tape = d->L.tape;
    ad_grad(d->L, 2, (ad_var[]){d->q, d->v}, by);
    d->L_q = by[0];
    d->L_v = by[1];
    if (second)
        record_second(d);
    if (!action) /* discrete d'Alembert: the virtual work of all forces at the rule's points */
        d->L_q = phys_system_add_forces(system, d->L_q, d->q, d->v, d->t);
    if (phys_tape_status(tape, error) != AD_OK)
        return error->status;
    if ((!action && ad_compile(tape, 3, (ad_var[]){d->L, d->L_q, d->L_v}, &d->first) != AD_OK) ||
        (second &&
         ad_compile(tape, 6, (ad_var[]){d->L_q, d->L_v, d->L_qq, d->L_vq, d->L_qv, d->L_vv},
                    &d->second) != AD_OK))
        return phys_tape_status(tape, error);
    return AD_OK;
}

static enum ad_status make(struct phys_derivatives *d, const struct phys_system *system,
                           size_t columns, const struct phys_action *action, bool second,
                           struct ad_error *error)
{
    *d = (struct phys_derivatives){.units = phys_may_differ_in_unit(system),
                                   .dof = system->dof,
                                   .scene = system->scene,
                                   .columns = action ? ad_cols(action->points.q) : columns};
    d->work = malloc(((2 * d->dof + 1) * d->columns + d->dof) * sizeof *d->work);
    if (!action)
        d->tape = ad_tape_new(AD_F64);
    const size_t bytes = system->scene->params_bytes;
    if ((d->params = malloc(bytes + 1)) && bytes > 0)
        memcpy(d->params, system->params, bytes);
    if (!d->work || !d->params || (!action && !d->tape) ||
        (second && !phys_coupling_new(&d->coupling, system, PHYS_COUPLING_L, PHYS_COUPLING_FEW)))
        return ad_fail(error, AD_E_MEMORY, "out of memory for derivatives of L");
    return record(d, system, action, second, error);
}

enum ad_status phys_derivatives_new(struct phys_derivatives *d, const struct phys_system *system,
                                    size_t columns, const struct phys_action *action,
                                    struct ad_error *error)
{
    return make(d, system, columns, action, true, error);
}

enum ad_status phys_derivatives_first_new(struct phys_derivatives *d,
                                          const struct phys_system *system, size_t columns,
                                          struct ad_error *error)
{
    return make(d, system, columns, NULL, false, error);
}

void phys_derivatives_free(struct phys_derivatives *d)
{
    ad_program_free(d->first);
    ad_program_free(d->second);
    ad_tape_free(d->tape);
    phys_pattern_free(&d->coupling);
    AD_FREE(d->work, d->params);
    *d = (struct phys_derivatives){0};
}

bool phys_derivatives_serve(const struct phys_derivatives *d, const struct phys_system *system)
{
    const size_t bytes = system->scene->params_bytes;
    return d->scene == system->scene && d->second &&
           (bytes == 0 || memcmp(d->params, system->params, bytes) == 0);
}

void phys_derivatives_native(struct phys_derivatives *d)
{
    if (d->first)
        ad_native_lazy(d->first);
    if (d->second)
        ad_native_lazy(d->second);
}

void phys_derivatives_set(struct phys_derivatives *d, ad_program *program)
{
    const double *q = d->work, *v = q + d->dof * d->columns, *t = v + d->dof * d->columns;
    ad_set(program, d->q, q);
    ad_set(program, d->v, v);
    ad_set(program, d->t, t);
}

void phys_derivatives_colour(struct phys_derivatives *d, size_t colour)
{
    double *u = d->work + (2 * d->dof + 1) * d->columns;
    for (size_t k = 0; k < d->dof; k++)
        u[k] = d->coupling.colour[k] == colour;
    ad_set(d->second, d->seed, u);
    if (colour == 0)
        ad_run(d->second);
    else
        ad_rerun(d->second);
}
