#include "own.h"
#include "tests/close.h"
#include "physics/lagrangian/internal.h"

enum ad_status begin_own(const void *params, uint64_t seed, double *q, double *v,
                         struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    q[0] = 0.5;
    v[0] = 0.25;
    return AD_OK;
}

enum ad_status follow_own(const struct phys_scene *scene, const char *method, double t, double y[2])
{
    struct phys_system system;
    struct phys_ode ode;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_simulation how = {.size = sizeof how,
                                  .integrator = phys_integrator_find(method, &error),
                                  .t1 = t,
                                  .rtol = 1e-14,
                                  .atol = 1e-14};
    assert_int_equal(phys_system_make(scene, &system, &error), AD_OK);
    assert_int_equal(phys_ode_lagrangian(&system, &ode, &error), AD_OK);
    y[0] = 0.5;
    y[1] = 0.25;
    phys_simulate(&how, &ode, y, &info, &error);
    phys_ode_free(&ode);
    phys_system_close(&system);
    return error.status;
}
