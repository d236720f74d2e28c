/* The path of an initial-value problem by the classical Runge-Kutta method with many steps a slice
   (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.1). */
#include "physics/internal.h"

#include <stdlib.h>

struct state {
    size_t n;
    double t, *q, *v;  /* where the motion is */
    double *x, *u, *a; /* one stage: coordinates, velocities, accelerations */
    double *sum_u, *sum_a;
};

static void layout(struct state *s, size_t n, double *work)
{
    *s = (struct state){.n = n,
                        .q = work,
                        .v = work + n,
                        .x = work + 2 * n,
                        .u = work + 3 * n,
                        .a = work + 4 * n,
                        .sum_u = work + 5 * n,
                        .sum_a = work + 6 * n};
}

/* Goes `share` of the way along the last stage; its rates enter the sums with `weight`. */
static enum ad_status stage(phys_motion *motion, struct state *s, double h, double share,
                            double weight, struct ad_error *error)
{
    for (size_t k = 0; k < s->n; k++) {
        s->x[k] = s->q[k] + share * h * s->u[k];
        s->u[k] = s->v[k] + share * h * s->a[k];
    }
    if (phys_motion_acceleration(motion, s->x, s->u, s->t + share * h, s->a, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < s->n; k++) {
        s->sum_u[k] += weight * s->u[k];
        s->sum_a[k] += weight * s->a[k];
    }
    return AD_OK;
}

static enum ad_status step(phys_motion *motion, struct state *s, double h, struct ad_error *error)
{
    for (size_t k = 0; k < s->n; k++)
        s->u[k] = s->a[k] = s->sum_u[k] = s->sum_a[k] = 0;
    if (stage(motion, s, h, 0, 1, error) != AD_OK || stage(motion, s, h, 0.5, 2, error) != AD_OK ||
        stage(motion, s, h, 0.5, 2, error) != AD_OK || stage(motion, s, h, 1, 1, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < s->n; k++) {
        s->q[k] += h / 6 * s->sum_u[k];
        s->v[k] += h / 6 * s->sum_a[k];
    }
    return AD_OK;
}

static void store(const struct state *s, size_t slices, size_t i, double *path)
{
    for (size_t k = 0; k < s->n; k++)
        path[k * slices + i] = s->q[k];
}

static enum ad_status march(phys_motion *motion, struct state *s, size_t slices, double dt,
                            size_t substeps, double *path, struct ad_error *error)
{
    double h = dt / (double)substeps;
    store(s, slices, 0, path);
    for (size_t i = 1; i < slices; i++) {
        for (size_t j = 0; j < substeps; j++) {
            s->t = (double)(i - 1) * dt + (double)j * h;
            if (step(motion, s, h, error) != AD_OK)
                return error->status;
        }
        store(s, slices, i, path);
    }
    return AD_OK;
}

enum ad_status phys_fine_path(phys_motion *motion, const double *q, const double *v, size_t slices,
                              double dt, size_t substeps, double *path, struct ad_error *error)
{
    if (phys_lacks(motion, "motion", error) || phys_lacks(q, "coordinates", error) ||
        phys_lacks(v, "velocities", error) || phys_lacks(path, "room for a path", error))
        return error->status;
    size_t n = phys_motion_system(motion)->dof;
    double *work = malloc(7 * n * sizeof *work);
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct state s;
    layout(&s, n, work);
    for (size_t k = 0; k < n; k++) {
        s.q[k] = q[k];
        s.v[k] = v[k];
    }
    enum ad_status status = march(motion, &s, slices, dt, substeps, path, error);
    free(work);
    return status;
}

enum ad_status phys_first_slices(phys_motion *motion, const double *q, const double *v,
                                 size_t slices, double dt, bool euler, double *path,
                                 struct ad_error *error)
{
    enum { SUBSTEPS = 64 };
    if (phys_lacks(motion, "motion", error) || phys_lacks(q, "coordinates", error) ||
        phys_lacks(v, "velocities", error) || phys_lacks(path, "room for a path", error))
        return error->status;
    size_t n = phys_motion_system(motion)->dof;
    double *two = malloc(2 * n * sizeof *two);
    if (!two)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    enum ad_status status =
        euler ? AD_OK : phys_fine_path(motion, q, v, 2, dt, SUBSTEPS, two, error);
    for (size_t k = 0; k < n && status == AD_OK; k++) {
        path[k * slices] = q[k];
        path[k * slices + 1] = euler ? q[k] + v[k] * dt : two[2 * k + 1];
    }
    free(two);
    return status;
}
