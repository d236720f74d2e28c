/* Recording and linear algebra of constraints (constraints.h). */
#include "constraints.h"
#include "autodiff/derivatives.h"
#include "autodiff/free.h"
#include "mass.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ITERATIONS = 30 };

/* ---- evaluation ---- */

static enum ad_status record(struct phys_constraints *c, struct ad_error *error)
{
    const size_t n = c->n, dof = c->dof;
    ad_var q = c->x[0] = ad_input(c->tape, dof, 1, "q"), v = ad_input(c->tape, dof, 1, "v"),
           t = c->x[2] = ad_input(c->tape, 1, 1, "t"), lanes = ad_broadcast(q, dof, n);
    const ad_var place[] = {q, t}, along[] = {c->x[1] = v, ad_scalar(c->tape, 1)};
    ad_var each = phys_system_constraint(c->system, lanes, ad_broadcast(t, 1, n));
    c->out[0] = phys_system_constraint(c->system, q, t);
    if (ad_tape_error(c->tape)->status == AD_OK &&
        ad_jvp(c->out[0], 2, place, along, &c->out[1]) == AD_OK &&
        ad_jvp(c->out[1], 2, place, along, &c->out[2]) == AD_OK &&
        ad_grad(ad_dot(each, phys_unit_matrix(c->tape, n)), 1, &lanes, &c->out[3]) == AD_OK &&
        ad_compile(c->tape, LENGTH(c->out), c->out, &c->program) == AD_OK)
        ad_native_lazy(c->program);
    return phys_tape_status(c->tape, error);
}

enum ad_status phys_constraints_new(const struct phys_system *system,
                                    struct phys_constraints **constraints, struct ad_error *error)
{
    const size_t n = system->scene->n_constraints, dof = system->dof;
    *constraints = NULL;
    if (!system->scene->constraint)
        return AD_OK;
    struct phys_constraints *c = calloc(1, sizeof *c);
    if (!c)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *c = (struct phys_constraints){
        .system = system, .n = n, .dof = dof, .tape = ad_tape_new(AD_F64)};
    c->g = calloc(n * (2 * n + 3 * dof + 6) + dof, sizeof *c->g);
    c->pivots = calloc(n, sizeof *c->pivots);
    if (!c->tape || !c->g || !c->pivots) {
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu constraints", n);
    } else {
        c->rate = c->g + n;
        c->bias = c->rate + n;
        c->size = c->bias + n;
        c->lambda = c->size + n;
        c->G = c->lambda + n;
        c->W = c->G + n * dof;
        c->S = c->W + n * dof;
        c->by_coordinate = c->S + n * n;
        c->room = c->by_coordinate + n * dof;
        record(c, error);
    }
    if (error->status == AD_OK)
        *constraints = c;
    else
        phys_constraints_free(c);
    return error->status;
}

void phys_constraints_free(struct phys_constraints *c)
{
    if (!c)
        return;
    ad_program_free(c->program);
    ad_tape_free(c->tape);
    AD_FREE(c->g, c->pivots, c);
}

void phys_constraints_evaluate(struct phys_constraints *c, const double *q, const double *v,
                               double t)
{
    memset(c->by_coordinate, 0, c->dof * sizeof *c->by_coordinate);
    ad_set(c->program, c->x[0], q);
    ad_set(c->program, c->x[1], v ? v : c->by_coordinate);
    ad_set(c->program, c->x[2], &t);
    ad_run(c->program);
    ad_get(c->program, c->out[0], c->g);
    ad_get(c->program, c->out[1], c->rate);
    ad_get(c->program, c->out[2], c->bias);
    ad_get(c->program, c->out[3], c->by_coordinate);
    for (size_t i = 0; i < c->n; i++)
        for (size_t k = 0; k < c->dof; k++)
            c->G[i * c->dof + k] = c->by_coordinate[k * c->n + i];
}

bool phys_constraints_move(const struct phys_constraints *c, struct ad_error *error)
{
    return c && !phys_is_independent(c->tape, c->out[0], 1, &c->x[2], error);
}

/* ---- independence ---- */

/* The combination u of constraints in units of their sizes whose gradient is least, of length 1. */
static void find_least(const struct phys_constraints *c, double *u)
{
    const size_t n = c->n;
    double *C = c->room, *unit = c->S, *values = c->room + n * n;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            C[i * n + j] =
                phys_dot(c->dof, c->G + i * c->dof, c->W + j * c->dof) / (c->size[i] * c->size[j]);
            unit[i * n + j] = i == j;
        }
    if (phys_lapack_eigenvectors(n, C, unit, values) == 0)
        memcpy(u, C, n * sizeof *u);
    else
        for (size_t i = 0; i < n; i++)
            u[i] = 1;
}

static enum ad_status refuse_dependent(struct phys_constraints *c, double t, struct ad_error *error)
{
    char names[128] = "";
    double gap = 0, rate_gap = 0, most = 0, *u = c->lambda;
    find_least(c, u);
    for (size_t i = 0; i < c->n; i++) {
        gap += u[i] * c->g[i] / c->size[i];
        rate_gap += u[i] * c->rate[i] / c->size[i];
        most = fmax(most, fmax(fabs(c->g[i]), fabs(c->rate[i])) / c->size[i]);
    }
    for (size_t i = 0; i < c->n; i++)
        if (fabs(u[i]) > 0.05 && strlen(names) < sizeof names - 48)
            snprintf(names + strlen(names), sizeof names - strlen(names), "%s%.40s",
                     *names ? ", " : "", c->system->scene->constraints[i]);
    const bool against = fmax(fabs(gap), fabs(rate_gap)) > 1e-6 * most && most > 1e-12;
    return ad_fail(error, AD_E_NONFINITE,
                   "%s: constraints %s at t = %g: %s; expected independent ones; leave one out",
                   c->system->scene->name, names, t,
                   against ? "they contradict each other (inconsistent): their gradients depend on "
                             "each other, their values do not"
                           : "they depend on each other (redundant), or lose their gradients");
}

/* W and S from M as motion has factored it. */
static enum ad_status factor(struct phys_constraints *c, const phys_motion *motion, double t,
                             struct ad_error *error)
{
    const size_t n = c->n, dof = c->dof;
    size_t worst;
    bool good = true;
    memcpy(c->W, c->G, n * dof * sizeof *c->W);
    for (size_t i = 0; i < n; i++) {
        phys_motion_solve_constant(motion, c->W + i * dof);
        c->size[i] = sqrt(fabs(phys_dot(dof, c->G + i * dof, c->W + i * dof)));
        good = good && isfinite(c->g[i]) && isfinite(c->size[i]);
        if (!good)
            return ad_fail(error, AD_E_NONFINITE, "%s: constraint %s is not finite at t = %g",
                           c->system->scene->name, c->system->scene->constraints[i], t);
        if (c->size[i] == 0)
            return ad_fail(error, AD_E_NONFINITE,
                           "%s: constraint %s has no gradient at t = %g; expected one that changes "
                           "with the coordinates, as r - l does where r^2 - l^2 = 0 does not at 0",
                           c->system->scene->name, c->system->scene->constraints[i], t);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            c->S[i * n + j] =
                phys_dot(dof, c->G + i * dof, c->W + j * dof) / (c->size[i] * c->size[j]);
    phys_mass_columns(n, c->S, c->room);
    phys_lapack_lu_factor(n, c->S, c->pivots);
    if (!(phys_mass_condition(n, c->room, c->S, n + 1, &worst) <= PHYS_MASS_SINGULAR))
        return refuse_dependent(c, t, error);
    return AD_OK;
}

enum ad_status phys_motion_constrain(phys_motion *motion, const double *q, const double *v,
                                     double t, struct ad_error *error)
{
    struct phys_constraints *c = phys_motion_constraints(motion);
    if (phys_motion_mass(motion, q, v, t, error) != AD_OK)
        return error->status;
    phys_constraints_evaluate(c, q, v, t);
    return factor(c, motion, t, error);
}

/* ---- forces and projections ---- */

/* lambda: S lambda = b. */
static void solve(struct phys_constraints *c, const double *b)
{
    for (size_t i = 0; i < c->n; i++)
        c->lambda[i] = b[i] / c->size[i];
    phys_lapack_lu_solve(c->n, c->S, c->pivots, c->lambda);
    for (size_t i = 0; i < c->n; i++)
        c->lambda[i] /= c->size[i];
}

/* to += sign W^T lambda. */
static void add(const struct phys_constraints *c, const double *W, double sign, double *to)
{
    for (size_t i = 0; i < c->n; i++)
        for (size_t k = 0; k < c->dof; k++)
            to[k] += sign * c->lambda[i] * W[i * c->dof + k];
}

void phys_constraints_push(struct phys_constraints *c, double *a)
{
    for (size_t i = 0; i < c->n; i++)
        c->room[i] = -c->bias[i] - phys_dot(c->dof, c->G + i * c->dof, a);
    solve(c, c->room);
    add(c, c->W, 1, a);
}

void phys_constraints_turn(struct phys_constraints *c, double *v)
{
    solve(c, c->rate);
    add(c, c->W, -1, v);
}

/* Newton's method. At rounding its steps no longer shrink. */
enum ad_status phys_constraints_meet(struct phys_constraints *c, const double *W, double t,
                                     double *q, double *moved, struct ad_error *error)
{
    const size_t n = c->n, dof = c->dof;
    double *A = c->room, *step = c->room + n * n + n, last = INFINITY;
    for (size_t k = 0; k < dof && moved; k++)
        moved[k] = 0;
    for (int iteration = 0; iteration < ITERATIONS; iteration++) {
        phys_constraints_evaluate(c, q, NULL, t);
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                A[i * n + j] = phys_dot(dof, c->G + i * dof, W + j * dof);
        memcpy(c->lambda, c->g, n * sizeof *c->g);
        if (phys_lapack_lu_solve_once(n, A, c->lambda) != 0)
            break;
        memset(step, 0, dof * sizeof *step);
        add(c, W, -1, step);
        const double length = phys_norm(dof, step), size = phys_norm(dof, q);
        if (!isfinite(length))
            break;
        for (size_t k = 0; k < dof; k++) {
            q[k] += step[k];
            if (moved)
                moved[k] += step[k];
        }
        if (length <= DBL_EPSILON * size || (length <= 1e-12 * size && length > 0.1 * last))
            return AD_OK;
        last = length;
    }
    return ad_fail(error, AD_E_NONFINITE, "%s: the constraints cannot be met at t = %g",
                   c->system->scene->name, t);
}

enum ad_status phys_motion_project(phys_motion *motion, double t, double *q, double *v,
                                   struct ad_error *error)
{
    struct phys_constraints *c = phys_motion_constraints(motion);
    double *W = malloc(c->n * c->dof * sizeof *W);
    if (!W)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_motion_constrain(motion, q, v, t, error) == AD_OK) {
        memcpy(W, c->W, c->n * c->dof * sizeof *W);
        if (phys_constraints_meet(c, W, t, q, NULL, error) == AD_OK &&
            phys_motion_constrain(motion, q, v, t, error) == AD_OK)
            phys_constraints_turn(c, v);
    }
    free(W);
    return error->status;
}

/* ---- residuals ---- */

/* The length of W^T S^-1 b. */
static double distance(struct phys_constraints *c, const double *b)
{
    double *step = c->room;
    solve(c, b);
    memset(step, 0, c->dof * sizeof *step);
    add(c, c->W, -1, step);
    return phys_norm(c->dof, step);
}

enum ad_status phys_motion_residual(phys_motion *motion, const double *q, const double *v, double t,
                                    double residual[2], struct ad_error *error)
{
    struct phys_constraints *c = phys_motion_constraints(motion);
    if (phys_motion_constrain(motion, q, v, t, error) == AD_OK) {
        residual[0] = distance(c, c->g);
        residual[1] = distance(c, c->rate);
    }
    return error->status;
}
