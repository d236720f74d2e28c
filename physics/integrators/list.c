/* The table of integrators. */
#include "stepper.h"
#include "physics/internal.h"

const struct phys_integrator *const phys_integrators[] = {
    &phys_euler,
    &phys_semi_implicit,
    &phys_verlet,
    &phys_velocity_verlet,
    &phys_yoshida4,
    &phys_yoshida6,
    &phys_rk4,
    &phys_dopri5,
    &phys_dop853,
    &phys_implicit_midpoint,
    &phys_gauss2,
    &phys_gauss3,
    &phys_gauss4,
    &phys_gauss5,
    &phys_variational_left,
    &phys_variational_midpoint,
    &phys_variational_trapezoid,
    &phys_variational_gauss2,
    &phys_variational_gauss3,
    &phys_variational_gauss4,
    NULL,
};

enum { N_INTEGRATORS = LENGTH(phys_integrators) - 1 };

const struct phys_integrator *phys_integrator_find(const char *name, struct ad_error *error)
{
    const char *names[N_INTEGRATORS];
    for (size_t k = 0; k < N_INTEGRATORS; k++)
        names[k] = phys_integrators[k]->name;
    return phys_integrators[phys_find("integrator", name, N_INTEGRATORS, names, error)];
}
