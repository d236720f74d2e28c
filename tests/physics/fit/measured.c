#include "measured.h"
#include "tests/close.h"

#include <math.h>
#include <string.h>

void add_trial(struct measured *m, const struct phys_system *system, const double *start, double t0,
               double dt, size_t rows, const double noise[2], struct phys_random *random)
{
    struct ad_error error = {0};
    struct phys_ode ode;
    const size_t d = 2 * system->dof, at = m->data.n;
    double y[MOST];
    assert_true(at + rows <= ROWS && d <= MOST);
    memcpy(y, start, d * sizeof *y);
    assert_int_equal(phys_ode_lagrangian(system, &ode, &error), AD_OK);
    for (size_t k = 0; k < rows; k++) {
        const struct phys_simulation how = {.size = sizeof how,
                                            .integrator = phys_integrator_find("taylor", &error),
                                            .t0 = t0 + dt * ((double)k - 1),
                                            .t1 = t0 + dt * (double)k,
                                            .rtol = 1e-14};
        if (k > 0)
            assert_int_equal(phys_simulate(&how, &ode, y, NULL, &error), AD_OK);
        m->t[at + k] = t0 + dt * (double)k;
        m->trial[at + k] = at == 0 ? 0 : m->trial[at - 1] + 1;
        for (size_t i = 0; i < d; i++)
            m->x[(at + k) * d + i] =
                y[i] + (noise ? noise[i >= d / 2] * phys_random_normal(random) : 0);
    }
    phys_ode_free(&ode);
    m->data = (struct phys_fit_data){
        .size = sizeof(struct phys_fit_data), at + rows, m->t, m->trial, m->x};
}

void forget_velocities(struct measured *m, size_t dof)
{
    for (size_t k = 0; k < m->data.n; k++)
        for (size_t i = dof; i < 2 * dof; i++)
            m->x[k * 2 * dof + i] = NAN;
}

struct phys_fit fitted(const struct phys_system *system, const struct measured *m,
                       const struct phys_fit_settings *how)
{
    struct phys_fit fit;
    struct ad_error error = {0};
    phys_fit_solve(system, &m->data, how, &fit, &error);
    assert_string_equal(error.message, "");
    return fit;
}
