/* Simulations stored as paths on equal slices (motion.h). */
#include "method.h"
#include "solving.h"
#include "autodiff/sized.h"
#include "physics/ode/internal.h"

#include <stdlib.h>
#include <string.h>

enum ad_status phys_ode_for(const struct phys_system *system,
                            const struct phys_integrator *integrator, struct phys_ode *ode,
                            struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, integrator))
        return error->status;
    if (integrator->lagrangian || (system && system->scene && system->scene->hamiltonian &&
                                   strcmp(integrator->name, "taylor") != 0))
        return phys_ode_canonical(system, ode, error);
    if (phys_ode_lagrangian(system, ode, error) != AD_OK)
        return error->status;
    bool splits = integrator->separable || strcmp(integrator->name, "semi-implicit") == 0;
    if (ode->canonical || ode->project || !integrator->symplectic || splits) {
        phys_ode_thin(ode);
        return AD_OK;
    }
    phys_ode_free(ode);
    return phys_ode_canonical(system, ode, error);
}

struct collector {
    const struct phys_simulation *how;
    size_t rows, columns, n;
    double *path;
};

static bool keep(void *context, double t, const double *y)
{
    struct collector *c = context;
    (void)t;
    for (size_t k = 0; k < c->rows && c->n < c->columns; k++)
        c->path[k * c->columns + c->n] = y[k];
    c->n++;
    return true;
}

static bool proceed(void *context)
{
    const struct collector *c = context;
    return !c->how->proceed || c->how->proceed(c->how->context);
}

enum ad_status phys_trajectory(const struct phys_simulation *how, const struct phys_ode *ode,
                               double *y, size_t rows, size_t columns, double *path,
                               struct phys_simulation_info *info, struct ad_error *error)
{
    struct phys_simulation_info unwanted = {0};
    info = info ? info : &unwanted;
    if (AD_LACKS(error, how, path))
        return error->status;
    AD_OWN(phys_simulation, how, proceed, error);
    struct collector collector = {how, rows, columns, 0, path};
    struct phys_simulation settings = *how;
    settings.sample = keep;
    settings.proceed = proceed;
    settings.context = &collector;
    if (phys_simulate(&settings, ode, y, info, error) == AD_OK &&
        info->stop == PHYS_SIMULATION_INTERRUPTED)
        ad_fail(error, AD_E_ACCURACY, "interrupted at t = %g", info->t);
    return error->status;
}

enum { SERIES_DOF = 32 }; /* beyond, dop853 costs less */

const struct phys_integrator *phys_motion_method(const struct phys_ode *ode, const double *y,
                                                 struct ad_error *error)
{
    double rows[4 * SERIES_DOF];
    struct ad_error none = {0};
    bool has = ode->series && ode->n <= 2 * SERIES_DOF;
    if (has) {
        memcpy(rows, y, ode->n * sizeof *y);
        has = ode->series(ode->context, 1, 0, rows, NULL, &none) == AD_OK;
    }
    phys_keep_memory(&none, error);
    return phys_integrator_find(has ? "taylor" : "dop853", error);
}

enum ad_status phys_motion_path(const struct phys_system *system, const struct phys_simulation *how,
                                const double *q, const double *v, size_t slices, double dt,
                                double *path, struct ad_error *error)
{
    struct phys_ode own = {0};
    static const struct phys_simulation tightly = {.size = sizeof tightly, .rtol = 1e-13};
    if (AD_LACKS(error, system, system->scene, q, v))
        return error->status;
    how = how ? how : &tightly;
    AD_OWN(phys_simulation, how, proceed, error);
    struct phys_simulation settings = *how;
    if (phys_motion_check_on_constraints(system, q, v, error) != AD_OK)
        return error->status;
    size_t dof = system->dof;
    double *y = malloc(2 * dof * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    settings.t1 = (double)(slices - 1) * dt;
    settings.n_samples = slices - 1;
    const struct phys_integrator *given = settings.integrator;
    const struct phys_ode *by = settings.ode ? settings.ode : &own;
    if ((by != &own || phys_ode_for(system, given ? given : phys_integrator_find("dop853", error),
                                    &own, error) == AD_OK) &&
        phys_ode_enter(by, 0, q, v, y, error) == AD_OK &&
        (settings.integrator = given ? given : phys_motion_method(by, y, error)))
        phys_trajectory(&settings, by, y, dof, slices, path, NULL, error);
    phys_ode_free(&own);
    free(y);
    return error->status;
}

enum ad_status phys_scene_path(const struct phys_system *system, uint64_t seed,
                               const struct phys_simulation *how, size_t slices, double dt,
                               double *path, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, path))
        return error->status;
    const struct phys_scene *scene = system->scene;
    if (scene->between)
        return scene->between(system->params, slices, path, error);
    double *q = malloc(2 * system->dof * sizeof *q), *v = q ? q + system->dof : NULL;
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (scene->start(system->params, seed, q, v, error) == AD_OK)
        phys_motion_path(system, how, q, v, slices, dt, path, error);
    free(q);
    return error->status;
}
