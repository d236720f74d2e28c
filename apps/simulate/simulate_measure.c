/* What is measured of the motion of `leastaction simulate`: cyclic coordinates, the work of forces,
   the forces of constraints, observables. */
#include "simulate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of L alone: a scene with equations of its own may have friction. */
static enum ad_status find_cyclic(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    const size_t dof = run->system.dof;
    if (m->n == 0 || run->system.scene->ode)
        return AD_OK;
    run->cyclic = calloc(dof, sizeof *run->cyclic);
    run->kept = calloc(2 * dof, sizeof *run->kept);
    if (!run->cyclic || !run->kept)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    return phys_cyclic(&run->system, m->n, m->x, m->t, run->cyclic, run->kept, run->kept + dof,
                       error);
}

/* The energy balance of forces outside of L; unknown where their work cannot be integrated. */
static enum ad_status find_work(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    struct ad_error cause = {0};
    run->work = run->balance = run->work_unknown = (double)NAN;
    if (m->n < 2 || !phys_system_has_forces(&run->system))
        return AD_OK;
    double *work = malloc(m->n * sizeof *work), off = 0;
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_motion_work(m, work, &run->work_unknown, &cause) == AD_OK) {
        for (size_t i = 0; i < m->n; i++)
            off = fmax(off, fabs(m->energy[i] - m->energy[0] - work[i]));
        run->work = work[m->n - 1];
        run->balance = off;
    } else {
        run->work_unknown = (double)NAN;
    }
    free(work);
    return cause.status == AD_E_MEMORY ? ad_fail(error, cause.status, "%s", cause.message) : AD_OK;
}

/* The forces of constraints. */
static enum ad_status find_reactions(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    const size_t dof = run->system.dof;
    run->residual[0] = run->residual[1] = (double)NAN;
    if (m->n == 0 || !run->system.scene->constraint)
        return AD_OK;
    run->reactions = malloc((m->n + 1) * dof * sizeof *run->reactions);
    if (!run->reactions)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *most = run->reaction_most = run->reactions + m->n * dof;
    memset(most, 0, dof * sizeof *most);
    phys_motion_reactions(m, run->reactions, run->residual, error);
    for (size_t k = 0; k < m->n * dof; k++)
        most[k % dof] = fmax(most[k % dof], fabs(run->reactions[k]));
    return error->status;
}

static enum ad_status observe(struct simulate_run *run, struct ad_error *error)
{
    const struct phys_motion_solution *m = &run->motion;
    const size_t n = run->system.scene->n_observables;
    if (m->n == 0 || n == 0)
        return AD_OK;
    if (!(run->observed = malloc(n * m->n * sizeof *run->observed)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    return phys_observe(&run->system, m->n, m->x, m->t, run->observed, error);
}

enum ad_status simulate_measure(struct simulate_run *run, struct ad_error *error)
{
    if (find_cyclic(run, error) == AD_OK && find_work(run, error) == AD_OK &&
        find_reactions(run, error) == AD_OK)
        observe(run, error);
    return error->status;
}
