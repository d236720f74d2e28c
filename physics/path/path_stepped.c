/* The solver `march`: the path from two given first slices by the discrete equations of the rule,
   slice by slice; an initial-value problem for any Lagrangian. */
#include "physics/action/variational_step.h"
#include "path_program.h"

#include <stdlib.h>
#include <string.h>

/* Stores the element last solved as that of slice i. */
static void store(const phys_variational_step *stepper, const struct phys_path_settings *settings,
                  size_t dof, size_t i, double *path)
{
    const double *x = phys_variational_step_element(stepper);
    size_t slices = settings->slices;
    for (size_t k = 0; k < settings->rule->degree * dof; k++)
        path[k * slices + i] = x[2 * k];
    for (size_t d = 0; d < dof; d++)
        path[d * slices + i + 1] = x[2 * d + 1];
}

static enum ad_status step_slices(phys_variational_step *stepper,
                                  const struct phys_path_settings *settings, size_t dof,
                                  double *work, double *path, struct ad_error *error)
{
    double *q = work, *p = work + dof, *before = work + 2 * dof;
    size_t slices = settings->slices;
    for (size_t d = 0; d < dof; d++) {
        before[d] = path[d * slices];
        q[d] = path[d * slices + 1];
    }
    if (phys_variational_step_start(stepper, 0, before, q, p, error) != AD_OK)
        return error->status;
    store(stepper, settings, dof, 0, path);
    for (size_t i = 1; i + 1 < slices; i++) {
        if (phys_variational_step_next(stepper, (double)i * settings->dt, q, p, error) != AD_OK)
            return error->status;
        store(stepper, settings, dof, i, path);
    }
    for (size_t k = dof; k < settings->rule->degree * dof; k++) /* not used, but finite */
        path[k * slices + slices - 1] = path[k % dof * slices + slices - 1];
    return AD_OK;
}

enum ad_status phys_path_march(const struct phys_system *system,
                               const struct phys_path_settings *settings, double *path,
                               struct ad_error *error)
{
    phys_variational_step *stepper = NULL;
    double *work = malloc(3 * system->dof * sizeof *work);
    if (!work)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_variational_step_new(system, settings->rule, settings->dt, &stepper, error) ==
             AD_OK)
        step_slices(stepper, settings, system->dof, work, path, error);
    phys_variational_step_free(stepper);
    free(work);
    return error->status;
}

static enum ad_status solve(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    struct phys_path_program program = {0};
    size_t n = settings->rule->degree * system->dof * settings->slices;
    double *work = malloc(n * sizeof *work);
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(work, path, n * sizeof *work);
    if (phys_path_program_new(&program, system, settings, path, error) == AD_OK &&
        phys_path_march(system, settings, work, error) == AD_OK) {
        memcpy(program.x, work, n * sizeof *work);
        struct phys_path_step at = phys_path_program_run(&program, settings->slices - 2);
        if (phys_path_program_finite(&program, &at, error) == AD_OK) {
            phys_path_program_report(&program, &at);
            phys_path_program_end(&program, PHYS_STOP_STEPS, &at, path, info);
        }
    }
    phys_path_program_free(&program);
    free(work);
    return error->status;
}

const struct phys_solver phys_solver_march = {
    "march", "the motion from the first two slices, by the same discrete equations", solve, false};
