/* The work that forces outside of L do along a motion (solve.h): the energy E = v L_v - L changes
   at the rate Q v - D_v v - L_t. From each sample to the next the motion is followed anew, with the
   work as one more component, so that what is left of E is the method's own error. */
#include "physics/lagrangian/constraints.h"
#include "physics/ode/internal.h"
#include "solve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double tolerance = 1e-13;

struct worker {
    size_t dof, steps, most; /* a body that sticks would need steps without end */
    struct phys_ode motion;  /* in (q, v) */
    ad_tape *tape;
    ad_program *program;
    ad_var q, v, t, power;
};

static enum ad_status record(struct worker *w, const struct phys_system *system,
                             struct ad_error *error)
{
    ad_var by_t;
    if (!(w->tape = ad_tape_new(AD_F64)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    w->q = ad_input(w->tape, w->dof, 1, "q");
    w->v = ad_input(w->tape, w->dof, 1, "v");
    w->t = ad_input(w->tape, 1, 1, "t");
    ad_var none = ad_mul(w->v, 0.0), L = phys_system_lagrangian(system, w->q, w->v, w->t);
    ad_var force = phys_system_add_forces(system, none, w->q, w->v, w->t);
    if (ad_grad(L, 1, &w->t, &by_t) == AD_OK)
        w->power = ad_label(ad_sub(ad_dot(force, w->v), by_t), "power");
    if (ad_compile(w->tape, 1, &w->power, &w->program) == AD_OK)
        ad_native_lazy(w->program);
    return phys_tape_status(w->tape, error);
}

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    struct worker *w = context;
    if (w->motion.field(w->motion.context, t, y, rate, error) != AD_OK)
        return error->status;
    ad_set(w->program, w->q, y);
    ad_set(w->program, w->v, y + w->dof);
    ad_set(w->program, w->t, &t);
    ad_run(w->program);
    ad_get(w->program, w->power, rate + 2 * w->dof);
    return AD_OK;
}

/* Sizes [2 dof + 1] of the coordinates, the velocities and the energy along the motion. */
static void measure_sizes(const struct phys_motion_solution *m, double *size)
{
    const size_t n = 2 * m->system->dof;
    for (size_t k = 0; k <= n; k++)
        size[k] = 0;
    for (size_t i = 0; i < m->n; i++) {
        for (size_t k = 0; k < n; k++)
            size[k] = fmax(size[k], fabs(m->x[i * n + k]));
        size[n] = fmax(size[n], fabs(m->energy[i]));
    }
    for (size_t k = 0; k <= n; k++)
        size[k] = size[k] > 0 ? size[k] : 1;
}

/* From sample i to the next: the work is added to y[2 dof]; returns by how much it is not the
   change of E on that motion. */
static double advance(struct worker *w, const struct phys_motion_solution *m, size_t i,
                      const double *size, double *y, struct ad_error *error)
{
    const size_t n = 2 * w->dof;
    const struct phys_ode ode = {
        .name = m->system->scene->name, .n = n + 1, .field = field, .context = w};
    struct phys_simulation how =
        phys_simulation_of(phys_integrator_find("dop853", error), tolerance, m->t[i + 1]);
    how.t0 = m->t[i];
    how.max_steps = w->most - w->steps;
    how.atol = tolerance;
    how.scale = size;
    memcpy(y, m->x + i * n, n * sizeof *y);
    const double work = y[n], energy = w->motion.energy(w->motion.context, how.t0, y);
    struct phys_simulation_info info = {0};
    phys_simulate(&how, &ode, y, &info, error);
    w->steps += info.steps;
    if (w->steps >= w->most && error->status == AD_OK)
        ad_fail(error, AD_E_ACCURACY, "the work takes more than %zu steps", w->most);
    return fabs(w->motion.energy(w->motion.context, how.t1, y) - energy - (y[n] - work));
}

/* Constraints that move do work, too. */
static enum ad_status refuse_moving(const phys_motion *motion, struct ad_error *error)
{
    return motion && phys_constraints_move(phys_motion_constraints(motion), error)
               ? ad_fail(error, AD_E_ARGUMENT, "%s: constraints that depend on time do work",
                         phys_motion_system(motion)->scene->name)
               : error->status;
}

enum ad_status phys_motion_work(const struct phys_motion_solution *motion, double *work,
                                double *unknown, struct ad_error *error)
{
    if (AD_LACKS(error, motion, work, unknown) || AD_LACKS(error, motion->system))
        return error->status;
    const size_t n = 2 * motion->system->dof;
    struct worker w = {.dof = n / 2, .most = 100000 + 50 * motion->info.steps};
    double *y = calloc(2 * n + 2, sizeof *y);
    *unknown = 0;
    if (!y)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_ode_lagrangian(motion->system, &w.motion, error) == AD_OK &&
             refuse_moving(phys_ode_constrained_motion(&w.motion), error) == AD_OK &&
             record(&w, motion->system, error) == AD_OK) {
        measure_sizes(motion, y + n + 1);
        for (size_t i = 0; i < motion->n && error->status == AD_OK; i++) {
            work[i] = y[n];
            if (i + 1 < motion->n)
                *unknown += advance(&w, motion, i, y + n + 1, y, error);
        }
    }
    free(y);
    phys_ode_free(&w.motion);
    ad_program_free(w.program);
    ad_tape_free(w.tape);
    return error->status;
}
