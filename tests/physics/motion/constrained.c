#include "constrained.h"
#include "tests/close.h"

struct phys_scene constrained_scene(const char *name, size_t dof, phys_lagrangian *L,
                                    scene_start *start, phys_constraint *g, size_t n,
                                    const char *const *names)
{
    struct phys_scene s = scene_of(name, dof, L, 100, 0.01, start);
    s.dims = dof == 4 ? 2 : dof;
    s.picture = PHYS_PICTURE_PLANE;
    s.constraint = g;
    s.constraints = names;
    s.n_constraints = n;
    return s;
}

struct phys_system constrained_system(const struct phys_scene *scene)
{
    struct phys_system system;
    struct ad_error error = {0};
    phys_system_make(scene, &system, &error);
    assert_string_equal(error.message, "");
    return system;
}

static struct phys_motion_settings settings(const char *method, double dt, double error,
                                            double time)
{
    struct ad_error unknown = {0};
    const struct phys_motion_settings how = {
        .size = sizeof how,
        .time = time,
        .dt = dt,
        .error = error,
        .n_samples = CONSTRAINED_SAMPLES,
        .integrator = method ? phys_integrator_find(method, &unknown) : NULL};
    return how;
}

struct phys_motion_solution constrained_motion(const struct phys_system *system, const char *method,
                                               double dt, double error, double time)
{
    struct phys_motion_solution m;
    struct ad_error e = {0};
    const struct phys_motion_settings how = settings(method, dt, error, time);
    phys_motion_solve(system, &how, &m, &e);
    assert_string_equal(e.message, "");
    return m;
}

enum ad_status constrained_refused(const struct phys_scene *scene, const char *method,
                                   struct ad_error *error)
{
    struct phys_system system = constrained_system(scene);
    struct phys_motion_solution m;
    const struct phys_motion_settings how = settings(method, 0, 0, 1);
    *error = (struct ad_error){0};
    phys_motion_solve(&system, &how, &m, error);
    phys_motion_solution_free(&m);
    phys_system_close(&system);
    return error->status;
}
