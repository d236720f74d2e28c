#include "constrained_path.h"
#include "tests/close.h"

#include <stdlib.h>

static double *room(const struct phys_system *system, const struct phys_path_settings *settings)
{
    return calloc(settings->rule->degree * system->dof * settings->slices, sizeof(double));
}

struct constrained_path constrained_path(const struct phys_scene *scene, const char *rule,
                                         size_t slices, double T, const double *q0,
                                         const double *q1)
{
    struct constrained_path r = {.system = constrained_system(scene)};
    struct ad_error error = {0};
    r.settings = phys_path_defaults(&r.system);
    r.settings.rule = phys_rule_find(rule, &error);
    r.settings.slices = slices;
    r.settings.dt = T / (double)(slices - 1);
    r.path = room(&r.system, &r.settings);
    for (size_t k = 0; k < r.system.dof; k++) {
        r.path[k * slices] = q0[k];
        r.path[(k + 1) * slices - 1] = q1[k];
    }
    phys_path_line(r.system.dof, slices, r.path, r.path);
    return r;
}

enum ad_status constrained_path_find(struct constrained_path *r, struct ad_error *error)
{
    struct ad_error unknown = {0};
    *error = (struct ad_error){0};
    phys_rule_interpolate(r->settings.rule, r->system.dof, r->settings.slices, r->path);
    return phys_path_find(phys_solver_find("newton", &unknown), &r->system, &r->settings, r->path,
                          &r->found, error);
}

void constrained_path_found(struct constrained_path *r)
{
    struct ad_error error;
    constrained_path_find(r, &error);
    assert_string_equal(error.message, "");
    assert_true(r->found.stationary);
}

void constrained_path_end(struct constrained_path *r)
{
    phys_path_found_free(&r->found);
    phys_system_close(&r->system);
    free(r->path);
}
