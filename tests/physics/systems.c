/* Systems of the tests (systems.h). */
#include "systems.h"
#include "published.h"
#include "tests/close.h"

#include <stdlib.h>

struct phys_scene scene_of(const char *name, size_t dof, phys_lagrangian *L, size_t slices,
                           double dt, scene_start *start)
{
    return (struct phys_scene){.version = PHYS_SCENE_VERSION,
                               .size = sizeof(struct phys_scene),
                               .name = name,
                               .what = name,
                               .dof = dof,
                               .dims = 1,
                               .unit = "1",
                               .time_unit = "1",
                               .energy_unit = "1",
                               .lagrangian = L,
                               .slices = slices,
                               .dt = dt,
                               .start = start};
}

struct phys_system system_opened(const char *name)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_open(name, &system, &error);
    assert_no_error(&error);
    return system;
}

void system_set(struct phys_system *system, const char *name, double value)
{
    struct ad_error error = {0};
    phys_system_set(system, name, value, &error);
    assert_no_error(&error);
}

void system_start(const struct phys_system *system, uint64_t seed, double *q, double *v)
{
    struct ad_error error = {0};
    system->scene->start(system->params, seed, q, v, &error);
    assert_no_error(&error);
}

/* Irregular states around the start: the same everywhere, of a size that suits the scene. */
static void scatter_states(const struct phys_system *system, size_t n, double *q, double *v,
                           double *t)
{
    size_t dof = system->dof;
    double *q0 = malloc(2 * dof * sizeof *q0), *v0 = q0 + dof, size = 0, speed = 0;
    system_start(system, 5, q0, v0);
    for (size_t k = 0; k < dof; k++) {
        size = fmax(size, fabs(q0[k]));
        speed = fmax(speed, fabs(v0[k]));
    }
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++) {
            double phase = 1.7 * (double)k + 2.9 * (double)i;
            q[k * n + i] = q0[k] + 0.02 * (size + 0.1) * sin(phase);
            v[k * n + i] = v0[k] + 0.3 * (speed + 0.1) * cos(1.3 * phase);
        }
    for (size_t i = 0; i < n; i++)
        t[i] = 0.3 + 0.7 * (double)i;
    free(q0);
}

void system_check(const struct phys_system *system)
{
    enum { N = 5 };
    struct ad_error error = {0};
    double *q = malloc((2 * system->dof + 1) * N * sizeof *q), *v = q + system->dof * N;
    double *t = v + system->dof * N;
    scatter_states(system, N, q, v, t);
    struct phys_points at = {.size = sizeof at, N, q, v, t};
    phys_check_finite(system, &at, &error);
    assert_no_error(&error);
    for (int order = 1; order <= 2; order++) {
        struct ad_check report;
        phys_check_gradient(system, &at, order, 1e-6, 40, &report, &error);
        assert_no_error(&error);
        if (!report.passed)
            fail_msg("%s, order %d: error %g at input %zu (%zu, %zu)", system->scene->name, order,
                     report.worst, report.input, report.row, report.col);
    }
    struct phys_locality locality;
    phys_check_locality(system, &at, &locality, &error);
    assert_no_error(&error);
    assert_true(locality.passed);
    free(q);
}

void system_energies(const struct phys_system *system, const double *q, const double *v, double *T,
                     double *V)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_var x = ad_input(tape, system->dof, 1, "q"), u = ad_input(tape, system->dof, 1, "v");
    ad_var out[2];
    phys_system_energies(system, x, u, ad_scalar(tape, 0), &out[0], &out[1]);
    ad_program *program;
    assert_int_equal(ad_compile(tape, 2, out, &program), AD_OK);
    ad_set(program, x, q);
    ad_set(program, u, v);
    ad_run(program);
    ad_get(program, out[0], T);
    ad_get(program, out[1], V);
    ad_program_free(program);
    ad_tape_free(tape);
}
