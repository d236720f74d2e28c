/* The published path of an initial-value problem: semi-implicit Euler of first order. */
#include "physics/internal.h"

#include <stdlib.h>

static enum ad_status march(phys_motion *motion, size_t slices, double dt, double damping,
                            double *path, double *work, struct ad_error *error)
{
    size_t n = phys_motion_system(motion)->dof;
    double *q = work, *v = work + n, *a = work + 2 * n;
    for (size_t k = 0; k < n; k++) {
        q[k] = path[k * slices + 1];
        v[k] = (q[k] - path[k * slices]) / dt;
    }
    for (size_t i = 2; i < slices; i++) {
        if (phys_motion_acceleration(motion, q, v, (double)(i - 1) * dt, a, error) != AD_OK)
            return error->status;
        for (size_t k = 0; k < n; k++) {
            v[k] = (v[k] + a[k] * dt) * damping;
            q[k] += v[k] * dt;
            path[k * slices + i] = q[k];
        }
    }
    return AD_OK;
}

enum ad_status phys_ode_path(phys_motion *motion, size_t slices, double dt, double damping,
                             double *path, struct ad_error *error)
{
    double *work = malloc(3 * phys_motion_system(motion)->dof * sizeof *work);
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    enum ad_status status = march(motion, slices, dt, damping, path, work, error);
    free(work);
    return status;
}
