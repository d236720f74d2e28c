/* Stationary paths: the table of solvers, and the checks of settings common to them. */
#include "path_program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const struct phys_solver *const phys_solvers[] = {
#define SOLVER(name) &phys_solver_##name,
#include "solvers.def"
#undef SOLVER
    NULL,
};

enum { N_SOLVERS = LENGTH(phys_solvers) - 1 };

const struct phys_solver *phys_solver_find(const char *name, struct ad_error *error)
{
    const char *names[N_SOLVERS];
    for (size_t k = 0; k < N_SOLVERS; k++)
        names[k] = phys_solvers[k]->name;
    return phys_solvers[phys_find("solver", name, N_SOLVERS, names, error)];
}

void phys_path_defaults_to(struct phys_path_settings *settings, const struct phys_system *system)
{
    struct phys_path_settings defaults = {.size = sizeof defaults};
    if (system && system->scene) {
        const struct phys_scene *scene = system->scene;
        defaults = (struct phys_path_settings){
            .size = sizeof(struct phys_path_settings),
            .rule = &phys_rule_left,
            .slices = scene->slices,
            .dt = scene->dt,
            .steps = scene->paper ? scene->paper->steps : 500,
            .learning_rate = scene->paper ? scene->paper->learning_rate : 1e-2,
        };
    }
    AD_GIVE(settings, &defaults);
}

static bool positive(double x) { return x > 0 && isfinite(x); }

static enum ad_status check_mesh(const struct phys_solver *solver,
                                 const struct phys_path_settings *s, struct ad_error *error)
{
    const double *mesh = s->mesh;
    if (mesh && (strcmp(solver->name, "newton") != 0 || s->rule->repeat))
        return ad_fail(error, AD_E_ARGUMENT, "mesh: expected solver newton, got %s and rule %s",
                       solver->name, s->rule->name);
    for (size_t i = 0; mesh && i + 1 < s->slices; i++)
        if (!(mesh[i + 1] > mesh[i]))
            return ad_fail(error, AD_E_ARGUMENT, "mesh: got %g after %g, expected ascending times",
                           mesh[i + 1], mesh[i]);
    if (mesh && (mesh[0] != 0 || mesh[s->slices - 1] != (double)(s->slices - 1)))
        return ad_fail(error, AD_E_ARGUMENT, "mesh: got %g to %g, expected 0 to %zu", mesh[0],
                       mesh[s->slices - 1], s->slices - 1);
    return AD_OK;
}

static enum ad_status check_settings(const struct phys_solver *solver,
                                     const struct phys_path_settings *s, struct ad_error *error)
{
    if (AD_LACKS(error, solver, s))
        return error->status;
    bool rated = solver->rated || s->adam_steps > 0;
    if (!s->rule)
        return ad_fail(error, AD_E_ARGUMENT, "no action rule; expected one of phys_rules");
    if (s->slices < 3)
        return ad_fail(error, AD_E_ARGUMENT, "%zu slices, expected 3 or more", s->slices);
    if (!positive(s->dt))
        return ad_fail(error, AD_E_ARGUMENT, "time step %g, expected a positive number", s->dt);
    if (rated && !positive(s->learning_rate))
        return ad_fail(error, AD_E_ARGUMENT, "learning rate %g, expected a positive number",
                       s->learning_rate);
    if (!(s->tolerance >= 0))
        return ad_fail(error, AD_E_ARGUMENT, "tolerance %g, expected 0 or more", s->tolerance);
    if (!isfinite(s->energy_weight))
        return ad_fail(error, AD_E_ARGUMENT, "energy weight %g, expected a finite number",
                       s->energy_weight);
    if (!(s->momentum >= 0 && s->momentum < 1))
        return ad_fail(error, AD_E_ARGUMENT, "momentum %g, expected 0 or more and less than 1",
                       s->momentum);
    if (s->hold > (s->slices - 1) / 2)
        return ad_fail(error, AD_E_ARGUMENT, "%zu slices held at either end of %zu: none may move",
                       s->hold, s->slices);
    if (check_mesh(solver, s, error) != AD_OK)
        return error->status;
    if (phys_free_ends(s) &&
        ((solver != &phys_solver_newton && solver != &phys_solver_lbfgs) || s->hold > 1))
        return ad_fail(error, AD_E_ARGUMENT,
                       "free coordinates at an end: expected solver newton or lbfgs and 1 slice "
                       "held, got %s and %zu",
                       solver->name, s->hold);
    return AD_OK;
}

bool phys_free_ends(const struct phys_path_settings *settings)
{
    const struct phys_ends *ends = settings->ends;
    return ends && (ends->free[0] || ends->free[1] || ends->n_relations);
}

/* Constraints are known to newton alone, and hold at ends that are given. */
static enum ad_status check_constraints(const struct phys_solver *solver,
                                        const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        const double *path, struct ad_error *error)
{
    const struct phys_scene *scene = system->scene;
    const size_t dof = system->dof, n = settings->slices;
    const struct phys_grid grid = phys_grid_of(settings);
    phys_motion *motion = NULL;
    if (!scene->constraint)
        return AD_OK;
    if (solver != &phys_solver_newton)
        return ad_fail(error, AD_E_ARGUMENT, "%s has constraints: expected solver newton, got %s",
                       scene->name, solver->name);
    if (settings->hold > 1)
        return ad_fail(error, AD_E_ARGUMENT, "%s has constraints: expected hold 1, got %zu",
                       scene->name, settings->hold);
    if (settings->ends && settings->ends->n_relations)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s has constraints: expected ends that are given or free, got relations "
                       "between them",
                       scene->name);
    if (scene->n_constraints >= dof)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: %zu constraints leave nothing of %zu coordinates to move", scene->name,
                       scene->n_constraints, dof);
    double *q = malloc(dof * sizeof *q);
    if (!q)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_motion_new(system, &motion, error);
    for (size_t end = 0; end < 2 && error->status == AD_OK; end++) {
        if (settings->ends && settings->ends->free[end])
            continue;
        for (size_t k = 0; k < dof; k++)
            q[k] = path[k * n + end * (n - 1)];
        phys_motion_check_constraints(motion, end ? "end of the path" : "start of the path", q,
                                      NULL, end ? phys_grid_time(&grid, n - 1) : 0, error);
    }
    phys_motion_free(motion);
    free(q);
    return error->status;
}

enum ad_status phys_path_check(const struct phys_solver *solver, const struct phys_system *system,
                               const struct phys_path_settings *settings, const double *path,
                               const struct phys_path_info *info, struct ad_error *error)
{
    enum ad_status status = check_settings(solver, settings, error);
    if (AD_LACKS(error, system, system->scene, path, info))
        return error->status;
    if (status == AD_OK &&
        phys_ends_check(system, settings->ends, settings->slices, path, error) != AD_OK)
        return error->status;
    return status == AD_OK ? check_constraints(solver, system, settings, path, error) : status;
}

enum ad_status phys_path_solve(const struct phys_solver *solver, const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct phys_path_info *info, struct ad_error *error)
{
    if (phys_path_check(solver, system, settings, path, info, error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    return solver->solve(system, settings, path, info, error);
}
