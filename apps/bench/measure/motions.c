/* Test problems for integrators (motions.h). */
#include "motions.h"
#include "timing.h"
#include "physics/linear/vectors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pendulum_k = 0.9;

static void pendulum(double t, double *q, double *v) { exact_pendulum(pendulum_k, t, q, v); }
static void kepler_6(double t, double *q, double *v) { exact_kepler(0.6, t, q, v); }
static void kepler_99(double t, double *q, double *v) { exact_kepler(0.99, t, q, v); }

/* No time is a whole period: there symmetric methods are better than elsewhere. */
const struct motion_problem motion_problems[MOTION_PROBLEMS] = {
    {.name = "pendulum",
     .title = "Pendulum, swings to 128 degrees, 14 swings",
     .scene = "pendulum",
     .set = {{"l", 1}, {"theta0", 0}, {"rate0", 1.8}},
     .time = 100,
     .coarsest = 0.5,
     .exact = pendulum},
    {.name = "dblpend",
     .title = "Double pendulum, chaotic, to t = 12",
     .scene = "dblpend",
     .time = 12,
     .coarsest = 0.25},
    {.name = "kepler",
     .title = "Kepler orbit e = 0.6, ten orbits",
     .scene = "kepler",
     .set = {{"e", 0.6}},
     .time = 20 * M_PI + 1,
     .coarsest = 0.25,
     .exact = kepler_6},
    {.name = "kepler99",
     .title = "Kepler orbit e = 0.99, once past the centre",
     .scene = "kepler",
     .set = {{"e", 0.99}},
     .time = 2 * M_PI + 1,
     .coarsest = 0.05,
     .exact = kepler_99},
    {.name = "figure8",
     .title = "Figure eight of three bodies, three rounds",
     .scene = "figure8",
     .time = 20,
     .coarsest = 0.25},
    {.name = "ephemeris",
     .title = "Sun and inner planets, a year",
     .scene = "ephemeris",
     .time = 365 * 86400.0,
     .coarsest = 10 * 86400.0},
};

/* ---- cost of a run ---- */

/* The larger relative distance of coordinates and of velocities; x, y [2 dof]. */
static double distance(size_t dof, const double *x, const double *y)
{
    return fmax(phys_relative_distance(dof, x, y), phys_relative_distance(dof, x + dof, y + dof));
}

enum ad_status problem_field(const struct problem *motion, const struct phys_integrator *integrator,
                             struct phys_ode *ode, bool *suits, struct ad_error *error)
{
    if (phys_ode_for(&motion->system, integrator, ode, error) == AD_OK)
        *suits = (ode->kick || !integrator->separable) &&
                 (motion->system.scene->gm || !integrator->dominated) &&
                 strcmp(integrator->name, "rattle") != 0; /* without constraints, velocity-verlet */
    return error->status;
}

/* Runs to the end; y [ode->n] is the state there. */
static enum ad_status follow(const struct problem *motion, const struct phys_integrator *integrator,
                             const struct phys_ode *ode, double setting, double *y,
                             struct problem_cost *cost, struct ad_error *error)
{
    const struct phys_simulation settings = phys_simulation_of(integrator, setting, motion->time);
    struct phys_simulation_info info;
    struct ad_error lost = {0};
    if (phys_ode_enter(ode, 0, motion->q, motion->v, y, error) != AD_OK)
        return error->status;
    double start = processor_seconds();
    phys_simulate(&settings, ode, y, &info, &lost);
    cost->seconds = processor_seconds() - start;
    cost->steps = info.steps;
    cost->evaluations = info.evaluations;
    cost->complete = lost.status == AD_OK;
    if (!cost->complete && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        return ad_fail(error, lost.status, "%s", lost.message);
    return AD_OK;
}

/* x [2 dof]: where the motion is at the end. */
static enum ad_status run_to(const struct problem *motion, const struct phys_integrator *integrator,
                             const struct phys_ode *ode, double setting, struct problem_cost *cost,
                             double *x, struct ad_error *error)
{
    size_t dof = motion->system.dof;
    double *y = malloc(ode->n * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (follow(motion, integrator, ode, setting, y, cost, error) == AD_OK && cost->complete)
        phys_ode_leave(ode, motion->time, y, x, x + dof, error);
    free(y);
    return error->status;
}

enum ad_status problem_run(const struct problem *motion, const struct phys_integrator *integrator,
                           const struct phys_ode *ode, double setting, struct problem_cost *cost,
                           struct ad_error *error)
{
    size_t dof = motion->system.dof;
    double *x = malloc(2 * dof * sizeof *x);
    *cost = (struct problem_cost){.error = INFINITY};
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (run_to(motion, integrator, ode, setting, cost, x, error) == AD_OK && cost->complete)
        cost->error = distance(dof, x, motion->end);
    free(x);
    return error->status;
}

/* ---- opening ---- */

/* One method at one setting, for the answer of a problem that has no formula. */
static enum ad_status finest(const struct problem *motion, const char *name, double setting,
                             double *x, struct ad_error *error)
{
    const struct phys_integrator *integrator = phys_integrator_find(name, error);
    struct phys_ode ode = {0};
    struct problem_cost cost = {0};
    if (phys_ode_for(&motion->system, integrator, &ode, error) == AD_OK)
        run_to(motion, integrator, &ode, setting, &cost, x, error);
    phys_ode_free(&ode);
    if (error->status == AD_OK && !cost.complete)
        ad_fail(error, AD_E_ACCURACY, "%s is lost on the way of %s", name, motion->problem->name);
    return error->status;
}

/* Two methods whose errors have nothing in common. Both iterate to rounding, of which they have
   less than explicit ones, for they take fewer steps. */
static enum ad_status find_end(struct problem *motion, struct ad_error *error)
{
    size_t dof = motion->system.dof;
    double *other = malloc(2 * dof * sizeof *other), step = motion->problem->coarsest;
    if (!other)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (finest(motion, "gauss5", step / 16, motion->end, error) == AD_OK &&
        finest(motion, "gauss4", step / 27, other, error) == AD_OK)
        motion->doubt = distance(dof, other, motion->end);
    free(other);
    return error->status;
}

static enum ad_status set_parameters(struct problem *motion, struct ad_error *error)
{
    const struct phys_setting *set = motion->problem->set;
    for (size_t k = 0; k < sizeof motion->problem->set / sizeof *set && set[k].name; k++)
        if (phys_system_set(&motion->system, set[k].name, set[k].value, error) != AD_OK)
            return error->status;
    return AD_OK;
}

enum ad_status problem_open(const struct motion_problem *problem, struct problem *motion,
                            struct ad_error *error)
{
    *motion = (struct problem){.problem = problem, .time = problem->time};
    struct phys_system *system = &motion->system;
    if (phys_system_open(problem->scene, system, error) != AD_OK ||
        set_parameters(motion, error) != AD_OK)
        return error->status;
    size_t dof = system->dof;
    if (!(motion->q = malloc(4 * dof * sizeof(double))))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    motion->v = motion->q + dof;
    motion->end = motion->q + 2 * dof;
    if (system->scene->start(system->params, 0, motion->q, motion->v, error) != AD_OK)
        return error->status;
    if (!problem->exact)
        return find_end(motion, error);
    problem->exact(problem->time, motion->end, motion->end + dof);
    return AD_OK;
}

void problem_close(struct problem *motion)
{
    free(motion->q);
    phys_system_close(&motion->system);
}
