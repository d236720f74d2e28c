/* The motion of a Lagrangian in y = (q, p): q' = v with L_v(q, v) = p, and p' = L_q + Q - D_v. */
#include "autodiff/free.h"
#include "internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct context {
    const struct phys_system *system;
    phys_legendre *legendre;
    double *v; /* [dof] */
};

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const struct context *c = context;
    size_t dof = c->system->dof;
    if (phys_legendre_velocity(c->legendre, y, y + dof, t, rate, error) == AD_OK)
        phys_legendre_momentum(c->legendre, y, rate, t, NULL, rate + dof);
    return error->status;
}

static enum ad_status enter(void *context, double t, const double *q, const double *v, double *y,
                            struct ad_error *error)
{
    const struct context *c = context;
    size_t dof = c->system->dof;
    (void)error;
    memcpy(y, q, dof * sizeof *y);
    phys_legendre_momentum(c->legendre, q, v, t, y + dof, NULL);
    return AD_OK;
}

static enum ad_status leave(void *context, double t, const double *y, double *q, double *v,
                            struct ad_error *error)
{
    const struct context *c = context;
    size_t dof = c->system->dof;
    memcpy(q, y, dof * sizeof *q);
    return phys_legendre_velocity(c->legendre, y, y + dof, t, v, error);
}

static double energy(void *context, double t, const double *y)
{
    const struct context *c = context;
    struct ad_error error = {0};
    if (phys_legendre_velocity(c->legendre, y, y + c->system->dof, t, c->v, &error) != AD_OK)
        return (double)NAN;
    return phys_legendre_energy(c->legendre, y, c->v, t);
}

static void component(const void *context, size_t k, char *name, size_t size)
{
    const struct context *c = context;
    phys_state_name(c->system, k, "momentum", name, size);
}

static void release(void *context)
{
    struct context *c = context;
    phys_legendre_free(c->legendre);
    AD_FREE(c->v, c);
}

enum ad_status phys_ode_canonical(const struct phys_system *system, struct phys_ode *ode,
                                  struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, system, system->scene))
        return error->status;
    if (system->scene->constraint)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has constraints, of which variational methods and momenta know nothing; "
                       "take rattle or dop853",
                       system->scene->name);
    if (system->scene->hamiltonian)
        return phys_ode_scene_hamiltonian(system, ode, error);
    struct context *c = calloc(1, sizeof *c);
    *ode = (struct phys_ode){.context = c, .free = c ? release : NULL};
    if (!c || !(c->v = calloc(system->dof, sizeof *c->v)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    c->system = system;
    if (phys_legendre_new(system, &c->legendre, error) != AD_OK)
        return error->status;
    ode->name = system->scene->name;
    ode->n = 2 * system->dof;
    ode->field = field;
    ode->canonical = !phys_system_has_forces(system);
    ode->energy = energy;
    ode->enter = enter;
    ode->leave = leave;
    ode->component = component;
    ode->system = system;
    return AD_OK;
}
