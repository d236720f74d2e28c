/* The forces of constraints along a motion (solve.h). */
#include "physics/lagrangian/constraints.h"
#include "solve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum ad_status phys_motion_reactions(const struct phys_motion_solution *motion, double *force,
                                     double residual[2], struct ad_error *error)
{
    const struct phys_motion_solution *m = motion;
    phys_motion *equations = NULL;
    if (AD_LACKS(error, m, force, residual) || AD_LACKS(error, m->system))
        return error->status;
    residual[0] = residual[1] = 0;
    if (!m->system->scene->constraint)
        return ad_fail(error, AD_E_ARGUMENT, "%s: expected constraints", m->system->scene->name);
    const size_t dof = m->system->dof;
    double *a = malloc(dof * sizeof *a), off[2];
    if (!a)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        phys_motion_new(m->system, &equations, error);
    const struct phys_constraints *c = equations ? phys_motion_constraints(equations) : NULL;
    memset(force, 0, m->n * dof * sizeof *force);
    for (size_t i = 0; i < m->n && error->status == AD_OK; i++) {
        const double *q = m->x + 2 * i * dof, *v = q + dof;
        if (phys_motion_residual(equations, q, v, m->t[i], off, error) != AD_OK ||
            phys_motion_acceleration(equations, q, v, m->t[i], a, error) != AD_OK)
            break;
        for (size_t j = 0; j < 2; j++)
            residual[j] = fmax(residual[j], off[j]);
        for (size_t j = 0; j < c->n * dof; j++)
            force[i * dof + j % dof] += c->lambda[j / dof] * c->G[j];
    }
    phys_motion_free(equations);
    free(a);
    return error->status;
}
