/* Motions that may be lost (follow.h). */
#include "follow.h"
#include "tests/close.h"
#include "tests/mentions.h"

void follow_open(struct motion *m, const char *scene, const char *parameter, double value)
{
    motion_open(m, scene, false, (const struct phys_setting[]){{parameter, value}, {NULL, 0}});
}

static bool follow(struct motion *m, const char *integrator, struct phys_simulation settings)
{
    m->error = (struct ad_error){0};
    settings.integrator = phys_integrator_find(integrator, &m->error);
    assert_int_equal(m->error.status, AD_OK);
    settings.watch_energy = true;
    return phys_simulate(&settings, &m->ode, m->y, &m->info, &m->error) == AD_OK;
}

bool follow_steps(struct motion *m, const char *integrator, double dt, size_t steps)
{
    double t1 = dt * (double)steps;
    return follow(
        m, integrator,
        (struct phys_simulation){.size = sizeof(struct phys_simulation), .dt = dt, .t1 = t1});
}

bool follow_to(struct motion *m, const char *integrator, double tolerance, double t1)
{
    static const double ones[2 * MOTION_DOF] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    return follow(m, integrator,
                  (struct phys_simulation){.size = sizeof(struct phys_simulation),
                                           .rtol = tolerance,
                                           .atol = tolerance,
                                           .scale = ones,
                                           .t1 = t1});
}

double follow_energy_error(const struct motion *m)
{
    double E = m->ode.energy(m->ode.context, m->info.t, m->y);
    return (E - m->info.energy_start) / fabs(m->info.energy_start);
}

void follow_advice(struct motion *m, const char *integrator, double dt,
                   struct phys_step_advice *advice)
{
    const double t = 0;
    m->error = (struct ad_error){0};
    phys_step_advise(phys_integrator_find(integrator, &m->error), &m->system, 1, m->y, &t, dt,
                     advice, &m->error);
    assert_int_equal(m->error.status, AD_OK);
}

void assert_told(const struct ad_error *error, enum ad_status status, const char *names)
{
    if (error->status != status)
        print_error("status %d, expected %d: %s\n", error->status, status, error->message);
    assert_int_equal(error->status, status);
    assert_mentions(error->message, names);
}
