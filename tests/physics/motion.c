/* Scenes in motion (motion.h). */
#include "motion.h"
#include "tests/close.h"

const struct phys_setting unit_pendulum[] = {{"l", 1}, {"theta0", 0}, {"rate0", 1.8}, {NULL, 0}};

void motion_open(struct motion *m, const char *scene, bool canonical,
                 const struct phys_setting *set)
{
    double q[MOTION_DOF], v[MOTION_DOF];
    *m = (struct motion){0};
    assert_int_equal(phys_system_open(scene, &m->system, &m->error), AD_OK);
    for (; set && set->name; set++)
        assert_int_equal(phys_system_set(&m->system, set->name, set->value, &m->error), AD_OK);
    assert_true(m->system.dof <= MOTION_DOF);
    assert_int_equal(m->system.scene->start(m->system.params, 1, q, v, &m->error), AD_OK);
    assert_int_equal(
        (canonical ? phys_ode_canonical : phys_ode_lagrangian)(&m->system, &m->ode, &m->error),
        AD_OK);
    assert_int_equal(phys_ode_enter(&m->ode, 0, q, v, m->y, &m->error), AD_OK);
}

void motion_close(struct motion *m)
{
    phys_ode_free(&m->ode);
    phys_system_close(&m->system);
}

void motion_run_by(struct motion *m, const struct phys_integrator *integrator, double dt, double t1,
                   enum ad_status status)
{
    m->settings.size = sizeof m->settings;
    m->settings.integrator = integrator;
    m->settings.t1 = t1;
    if (integrator->adaptive)
        m->settings.rtol = m->settings.atol = dt;
    else
        m->settings.dt = dt;
    m->error = (struct ad_error){0};
    phys_simulate(&m->settings, &m->ode, m->y, &m->info, &m->error);
    if (m->error.status != status)
        print_error("%s: %s\n", integrator->name, m->error.message);
    assert_int_equal(m->error.status, status);
}

void motion_run(struct motion *m, const char *integrator, double dt, double t1,
                enum ad_status status)
{
    struct ad_error error = {0};
    const struct phys_integrator *found = phys_integrator_find(integrator, &error);
    assert_non_null(found);
    motion_run_by(m, found, dt, t1, status);
}
