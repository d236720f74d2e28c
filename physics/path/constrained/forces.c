/* The forces of constraints along a path (surface.h). */
#include "physics/motion/motion.h"
#include "physics/motion/solve.h"
#include "surface.h"

#include <stdlib.h>

enum ad_status phys_surface_velocity(const struct phys_system *system, const double *q, double t,
                                     double *v, struct ad_error *error)
{
    phys_motion *motion = NULL;
    if (!system->scene->constraint || phys_motion_new(system, &motion, error) != AD_OK)
        return error->status;
    if (phys_motion_constrain(motion, q, v, t, error) == AD_OK)
        phys_constraints_turn(phys_motion_constraints(motion), v);
    phys_motion_free(motion);
    return error->status;
}

/* The momentum of slice i: by the element behind it, of the last by that before. */
static const double *momentum(const struct phys_hessian *h, size_t i, double *p)
{
    const bool last = i == h->elements;
    const double *g = last ? h->gradient + i * h->side - h->dof : h->gradient + i * h->side;
    for (size_t k = 0; k < h->dof; k++)
        p[k] = last ? g[k] : -g[k];
    return p;
}

enum ad_status phys_surface_forces(const struct phys_system *system, struct phys_hessian *h,
                                   const double *path, double *force, struct ad_error *error)
{
    const size_t dof = system->dof, n = h->elements + 1;
    phys_motion *motion = NULL;
    phys_legendre *legendre = NULL;
    double *x = malloc(((3 * dof + 1) * n + dof) * sizeof *x), off[2];
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory for forces of constraints");
    double *t = x + 2 * dof * n, *by_slice = t + n, *p = by_slice + dof * n;
    phys_hessian_gradient_at(h, path, 0);
    if (phys_motion_new(system, &motion, error) == AD_OK)
        phys_legendre_new(system, &legendre, error);
    for (size_t i = 0; i < n && error->status == AD_OK; i++) {
        double *q = x + 2 * dof * i, *v = q + dof;
        t[i] = phys_hessian_slice_time(h, i);
        for (size_t k = 0; k < dof; k++) {
            const size_t before = i < n - 1 ? i : i - 1;
            q[k] = path[k * n + i];
            v[k] = (path[k * n + before + 1] - path[k * n + before]) /
                   (h->dt * phys_hessian_length(h, before));
        }
        if (phys_legendre_velocity(legendre, q, momentum(h, i, p), t[i], v, error) == AD_OK &&
            phys_motion_constrain(motion, q, v, t[i], error) == AD_OK)
            phys_constraints_turn(phys_motion_constraints(motion), v);
    }
    phys_motion_free(motion);
    phys_legendre_free(legendre);
    const struct phys_motion_solution at = {.system = system, .n = n, .t = t, .x = x};
    if (error->status == AD_OK && phys_motion_reactions(&at, by_slice, off, error) == AD_OK)
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < dof; k++)
                force[k * n + i] = by_slice[i * dof + k];
    free(x);
    return error->status;
}
