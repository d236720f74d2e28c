/* All checks of a Lagrangian along the motion of its scene (checks.h). */
#include "checks.h"
#include "autodiff/sized.h"
#include "motion.h"
#include "physics/ode/internal.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_FOR_JUMPS = 64 }; /* coordinates */

/* The motion from q and v, accurate or else by the published equations; if it cannot be solved, a
   line, with the reason in `no_path`. */
static void follow(const struct phys_system *system, const double *q, const double *v,
                   size_t slices, double dt, double *path, struct ad_error *no_path)
{
    const struct phys_simulation closely = {
        .size = sizeof closely, .rtol = 1e-10, .max_steps = PHYS_MOTION_STEPS};
    struct ad_error lost = {0};
    phys_motion *motion = NULL;
    if (phys_motion_new(system, &motion, no_path) == AD_OK &&
        phys_motion_path(system, &closely, q, v, slices, dt, path, &lost) != AD_OK) {
        phys_first_slices(motion, q, v, slices, dt, true, path, no_path);
        phys_ode_path(motion, slices, dt, 1, path, no_path);
    }
    phys_motion_free(motion);
    for (size_t k = 0; k < system->dof && no_path->status != AD_OK; k++)
        for (size_t i = 0; i < slices; i++)
            path[k * slices + i] = q[k] + (double)i * dt * v[k];
}

/* q, v, t [2 dof + 1 x slices - 1] along the motion; to be freed. */
static double *find_points(const struct phys_system *system, uint64_t seed, size_t slices,
                           double dt, struct ad_error *no_path, struct ad_error *error)
{
    size_t dof = system->dof, n = slices - 1;
    double *values = calloc((2 * dof + 1) * n + dof * slices + 2 * dof, sizeof *values);
    if (!values) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return NULL;
    }
    double *v = values + dof * n, *t = v + dof * n, *path = t + n, *q0 = path + dof * slices;
    if (system->scene->start(system->params, seed, q0, q0 + dof, no_path) == AD_OK)
        follow(system, q0, q0 + dof, slices, dt, path, no_path);
    for (size_t i = 0; i < n; i++) {
        t[i] = (double)i * dt;
        for (size_t k = 0; k < dof; k++) {
            const double *x = path + k * slices + i;
            values[k * n + i] = x[0];
            v[k * n + i] = (x[1] - x[0]) / dt;
        }
    }
    return values;
}

/* Condition and definiteness of L_vv at all points. */
static void examine_mass(const struct phys_system *system, const struct phys_points *at,
                         struct phys_checks *c, struct ad_error *error)
{
    size_t dof = system->dof;
    phys_legendre *legendre = NULL;
    double *x = malloc(2 * dof * sizeof *x);
    c->mass_condition = 0;
    c->negative_most = 0;
    if (!x)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_legendre_new(system, &legendre, error) == AD_OK)
        for (size_t i = 0; i < at->n; i++) {
            for (size_t k = 0; k < dof; k++) {
                x[k] = at->q[k * at->n + i];
                x[dof + k] = at->v[k * at->n + i];
            }
            double condition = phys_legendre_condition(legendre, x, x + dof, at->t[i]);
            size_t negative = phys_legendre_negative(legendre, x, x + dof, at->t[i]);
            c->mass_condition = fmax(c->mass_condition, condition);
            c->negative_least = negative < c->negative_least ? negative : c->negative_least;
            c->negative_most = negative > c->negative_most ? negative : c->negative_most;
        }
    phys_legendre_free(legendre);
    free(x);
}

/* A failed check is recorded; a failure of another status is an error. */
static bool is_error(const struct ad_error *found, enum ad_status finding, struct ad_error *error)
{
    if (found->status == AD_OK || found->status == finding)
        return false;
    ad_fail(error, found->status, "%s", found->message);
    return true;
}

/* Only a finite Lagrangian can be compared with differences. */
static void examine(const struct phys_system *system, const struct phys_points *at,
                    double tolerance, size_t entries, struct phys_checks *c, struct ad_error *error)
{
    if (phys_check_finite(system, at, &c->not_finite) != AD_OK) {
        is_error(&c->not_finite, AD_E_NONFINITE, error);
        return;
    }
    phys_check_gradient(system, at, 1, tolerance, entries, &c->gradient, error);
    phys_check_gradient(system, at, 2, tolerance, entries, &c->second, error);
    phys_check_locality(system, at, &c->locality, error);
    phys_check_energies(system, at, &c->energies);
    if (!is_error(&c->energies, AD_E_ARGUMENT, error) && c->locality.passed)
        examine_mass(system, at, c, error); /* it is recorded at one slice */
    if (c->locality.passed)
        c->kink = phys_check_kinks(system);
    if (c->locality.passed && !c->kink && system->dof <= MOST_FOR_JUMPS &&
        phys_check_jumps(system, at))
        c->kink = "forces that jump along the motion";
    c->passed = c->no_path.status == AD_OK && c->gradient.passed && c->second.passed &&
                c->locality.passed && c->energies.status == AD_OK;
}

static enum ad_status begin(const struct phys_system *system, double tolerance,
                            struct phys_checks *checks, struct ad_error *error)
{
    if (AD_LACKS(error, checks))
        return error->status;
    *checks = (struct phys_checks){
        .mass_condition = (double)NAN, .negative_least = SIZE_MAX, .negative_most = SIZE_MAX};
    if (AD_LACKS(error, system, system->scene))
        return error->status;
    if (!(tolerance > 0))
        return ad_fail(error, AD_E_ARGUMENT, "tol: expected more than 0, such as 1e-6, got %g",
                       tolerance);
    return AD_OK;
}

enum ad_status phys_check_scene(const struct phys_system *system, uint64_t seed, size_t slices,
                                double dt, double tolerance, size_t entries,
                                struct phys_checks *checks, struct ad_error *error)
{
    if (begin(system, tolerance, checks, error) != AD_OK)
        return error->status;
    if (slices < 3)
        return ad_fail(error, AD_E_ARGUMENT, "slices: expected at least 3, got %zu", slices);
    if (!(dt > 0))
        return ad_fail(error, AD_E_ARGUMENT, "dt: expected more than 0, such as 0.01, got %g", dt);
    size_t n = slices - 1;
    double *q = find_points(system, seed, slices, dt, &checks->no_path, error);
    if (q)
        examine(system,
                &(struct phys_points){.size = sizeof(struct phys_points),
                                      n,
                                      q,
                                      q + system->dof * n,
                                      q + 2 * system->dof * n},
                tolerance, entries, checks, error);
    free(q);
    return error->status;
}

enum ad_status phys_check_all(const struct phys_system *system, const struct phys_points *at,
                              double tolerance, struct phys_checks *checks, struct ad_error *error)
{
    tolerance = tolerance == 0 ? 1e-6 : tolerance;
    if (begin(system, tolerance, checks, error) != AD_OK)
        return error->status;
    if (!at)
        return phys_check_scene(system, 1, system->scene->slices, system->scene->dt, tolerance, 200,
                                checks, error);
    if (AD_LACKS(error, at->q, at->v, at->t))
        return error->status;
    AD_OWN(phys_points, at, t, error);
    if (at->n < 2)
        return ad_fail(error, AD_E_ARGUMENT, "points: expected at least 2, got %zu", at->n);
    examine(system, at, tolerance, 0, checks, error);
    return error->status;
}
