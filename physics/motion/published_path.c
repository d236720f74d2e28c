/* The published path of an initial-value problem, by semi-implicit Euler of first order. */
#include "motion.h"
#include "physics/ode/internal.h"

#include <stdlib.h>
#include <string.h>

static enum ad_status step_path(phys_motion *motion, size_t slices, double dt, double damping,
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
    if (AD_LACKS(error, motion, path) ||
        phys_refuse_constraints(phys_motion_system(motion), "published paths", error) != AD_OK)
        return error->status;
    double *work = malloc(3 * phys_motion_system(motion)->dof * sizeof *work);
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    enum ad_status status = step_path(motion, slices, dt, damping, path, work, error);
    free(work);
    return status;
}

enum ad_status phys_first_slices(phys_motion *motion, const double *q, const double *v,
                                 size_t slices, double dt, bool euler, double *path,
                                 struct ad_error *error)
{
    if (AD_LACKS(error, motion, q, v, path))
        return error->status;
    const struct phys_system *system = phys_motion_system(motion);
    size_t n = system->dof;
    double *two = malloc(2 * n * sizeof *two);
    if (!two)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    enum ad_status status = euler ? AD_OK : phys_motion_path(system, NULL, q, v, 2, dt, two, error);
    for (size_t k = 0; k < n && status == AD_OK; k++) {
        path[k * slices] = q[k];
        path[k * slices + 1] = euler ? q[k] + v[k] * dt : two[2 * k + 1];
    }
    free(two);
    return status;
}

enum ad_status phys_published_path(const struct phys_system *system, uint64_t seed, size_t slices,
                                   double dt, bool euler, double damping, const double *given,
                                   double *path, struct ad_error *error)
{
    phys_motion *motion = NULL;
    if (AD_LACKS(error, system, system->scene, path))
        return error->status;
    size_t dof = system->dof;
    double *q = malloc(2 * dof * sizeof *q);
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; given && k < dof; k++)
        memcpy(path + k * slices, given + k * slices, 2 * sizeof *path);
    if (phys_motion_new(system, &motion, error) == AD_OK && !given &&
        system->scene->start(system->params, seed, q, q + dof, error) == AD_OK)
        phys_first_slices(motion, q, q + dof, slices, dt, euler, path, error);
    if (error->status == AD_OK)
        phys_ode_path(motion, slices, dt, damping, path, error);
    phys_motion_free(motion);
    free(q);
    return error->status;
}
