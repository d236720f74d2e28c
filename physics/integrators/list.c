/* The table of integrators. */
#include "stepper.h"
#include "physics/action/internal.h"

const struct phys_integrator *const phys_integrators[] = {
#define INTEGRATOR(name) &phys_##name,
#include "integrators.def"
#undef INTEGRATOR
    NULL};

enum { N_INTEGRATORS = LENGTH(phys_integrators) - 1 };

const struct phys_integrator *phys_integrator_find(const char *name, struct ad_error *error)
{
    const char *names[N_INTEGRATORS];
    for (size_t k = 0; k < N_INTEGRATORS; k++)
        names[k] = phys_integrators[k]->name;
    return phys_integrators[phys_find("integrator", name, N_INTEGRATORS, names, error)];
}
