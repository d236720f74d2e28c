/* Quantities that a Lagrangian conserves (conserved.h). */
#include "physics/linear/vectors.h"
#include "conserved.h"
#include "constraints.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 64 }; /* states at which the rates of totals are looked at */

static const double rounding = 1e-9; /* of the forces or torques that add up to a rate */

/* Instructions of L with its constraints, or of the derivative by t, t being an input or fixed. */
static size_t instructions(const struct phys_system *system, bool moves, bool derivative,
                           struct ad_error *error)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_program *program = NULL;
    size_t n = SIZE_MAX;
    if (!tape) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return n;
    }
    ad_var t = moves ? ad_input(tape, 1, 1, "t") : phys_irregular(tape, 1, 1, 0.9);
    ad_var q = ad_input(tape, system->dof, 1, "q"), v = ad_input(tape, system->dof, 1, "v");
    ad_var L = phys_system_lagrangian(system, q, v, t);
    if (system->scene->constraint)
        L = ad_add(L, phys_mixed(phys_system_constraint(system, q, t), 0.5));
    if (derivative)
        ad_grad(L, 1, &t, &L);
    if (ad_compile(tape, 1, &L, &program) == AD_OK)
        n = ad_program_info(program).instructions;
    phys_keep_memory(ad_tape_error(tape), error);
    ad_program_free(program);
    ad_tape_free(tape);
    return n;
}

/* L has no t if it has no derivative by t, and no instruction more than where t is fixed: the
   derivative would not show switches such as step(sin(t)), which are folded there. */
bool phys_keeps_energy(const struct phys_system *system, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene) || phys_system_has_forces(system))
        return false;
    const size_t n = instructions(system, true, false, error);
    return n != SIZE_MAX && n == instructions(system, false, false, error) &&
           instructions(system, true, true, error) == 0;
}

/* Rates of the totals at one state, and the sums of their parts' sizes. */
struct rates {
    double momentum[3], forces, angular[3], torques;
};

static struct rates measure_rates(const struct phys_system *system, const double *q,
                                  const double *v, const double *p, const double *force)
{
    struct rates r = {0};
    size_t dims = system->dims, row = dims * sizeof(double);
    for (size_t k = 0; k < system->dof; k += dims) {
        double x[3] = {0}, u[3] = {0}, m[3] = {0}, f[3] = {0};
        memcpy(x, q + k, row);
        memcpy(u, v + k, row);
        memcpy(m, p + k, row);
        memcpy(f, force + k, row);
        for (size_t axis = 0; axis < 3; axis++) {
            size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
            double part[] = {x[a] * f[b], -x[b] * f[a], u[a] * m[b], -u[b] * m[a]};
            r.momentum[axis] += f[axis];
            r.forces += fabs(f[axis]);
            for (size_t j = 0; j < LENGTH(part); j++) {
                r.angular[axis] += part[j];
                r.torques += fabs(part[j]);
            }
        }
    }
    return r;
}

static bool is_zero(const double rate[3], double parts)
{
    return !(hypot(hypot(rate[0], rate[1]), rate[2]) > rounding * parts);
}

/* A state beside x: every coordinate and velocity is moved by some tenth of the largest. */
static void move_aside(size_t dof, size_t place, const double *x, double *y)
{
    for (size_t half = 0; half < 2; half++) {
        const double size = phys_largest(dof, x + half * dof);
        for (size_t k = half * dof; k < (half + 1) * dof; k++)
            y[k] = x[k] + 0.1 * (size > 0 ? size : 1) * sin(1.7 * (double)(k + 31 * place) + 0.3);
    }
}

/* Forces of constraints act along their gradients; room [dof]. */
static void judge_constraints(struct phys_constraints *g, const struct phys_system *system,
                              const double *x, double t, double *room, struct phys_conserved *c)
{
    if (!g)
        return;
    memset(room, 0, system->dof * sizeof *room);
    phys_constraints_evaluate(g, x, NULL, t);
    for (size_t i = 0; i < g->n; i++) {
        struct rates r = measure_rates(system, x, room, room, g->G + i * g->dof);
        c->momentum = c->momentum && is_zero(r.momentum, r.forces);
        c->angular = c->angular && is_zero(r.angular, r.torques);
    }
}

static void judge_state(phys_legendre *legendre, struct phys_constraints *g,
                        const struct phys_system *system, const double *x, double t, double *p,
                        struct phys_conserved *c)
{
    size_t dof = system->dof;
    phys_legendre_momentum(legendre, x, x + dof, t, p, p + dof);
    struct rates r = measure_rates(system, x, x + dof, p, p + dof);
    if (!isfinite(r.forces) || !isfinite(r.torques))
        return; /* a place beside the motion may lie where L is not defined */
    c->momentum = c->momentum && is_zero(r.momentum, r.forces);
    c->angular = c->angular && is_zero(r.angular, r.torques);
    judge_constraints(g, system, x, t, p, c);
}

static double distance(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

enum ad_status phys_conserved(const struct phys_system *system, size_t n, const double *x,
                              const double *t, struct phys_conserved *conserved,
                              struct ad_error *error)
{
    struct phys_totals start, now;
    phys_legendre *legendre;
    struct phys_constraints *g = NULL;
    struct phys_conserved *c = conserved;
    if (AD_LACKS(error, conserved))
        return error->status;
    *c = (struct phys_conserved){.momentum = true, .angular = true};
    if (AD_LACKS(error, n ? x : NULL, t) || phys_legendre_new(system, &legendre, error) != AD_OK)
        return error->status;
    size_t dof = system->dof, stride = (n + PLACES - 1) / PLACES;
    double *aside = malloc(4 * dof * sizeof *aside), *p = aside ? aside + 2 * dof : NULL;
    if (!aside)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_constraints_new(system, &g, error) == AD_OK)
        phys_totals(legendre, x, x + dof, t[0], &start);
    c->bodies = error->status == AD_OK && start.mass != 0;
    for (size_t i = 0; c->bodies && i < n; i++) {
        const double *state = x + 2 * i * dof;
        phys_totals(legendre, state, state + dof, t[i], &now);
        c->momentum_change = fmax(c->momentum_change, distance(now.momentum, start.momentum));
        c->angular_change = fmax(c->angular_change, distance(now.angular, start.angular));
        if (i % stride)
            continue;
        judge_state(legendre, g, system, state, t[i], p, c);
        move_aside(dof, i, state, aside);
        judge_state(legendre, g, system, aside, t[i], p, c);
    }
    free(aside);
    phys_constraints_free(g);
    phys_legendre_free(legendre);
    return error->status;
}

/* Keeps of `cyclic` the coordinates without a force at x. */
static void judge_cyclic(phys_legendre *legendre, struct phys_constraints *g, size_t dof,
                         const double *x, double t, double *force, bool *cyclic)
{
    phys_legendre_momentum(legendre, x, x + dof, t, NULL, force);
    for (size_t k = 0; k < dof; k++)
        if (!isfinite(force[k]))
            return; /* as above */
    for (size_t k = 0; k < dof; k++)
        cyclic[k] = cyclic[k] && force[k] == 0;
    if (g)
        phys_constraints_evaluate(g, x, NULL, t);
    for (size_t i = 0; g && i < g->n * dof; i++)
        cyclic[i % dof] = cyclic[i % dof] && g->G[i] == 0;
}

enum ad_status phys_cyclic(const struct phys_system *system, size_t n, const double *x,
                           const double *t, bool *cyclic, double *value, double *change,
                           struct ad_error *error)
{
    phys_legendre *legendre;
    struct phys_constraints *g = NULL;
    if (AD_LACKS(error, system, cyclic, value, change) ||
        AD_LACKS(error, n ? x : NULL, n ? t : NULL) ||
        phys_legendre_new(system, &legendre, error) != AD_OK)
        return error->status;
    const size_t dof = system->dof, stride = (n + PLACES - 1) / PLACES;
    double *aside = malloc(3 * dof * sizeof *aside), *p = aside ? aside + 2 * dof : NULL;
    if (!aside)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        phys_constraints_new(system, &g, error);
    for (size_t k = 0; k < dof; k++) {
        cyclic[k] = error->status == AD_OK;
        change[k] = 0;
    }
    if (aside)
        phys_legendre_momentum(legendre, x, x + dof, t[0], value, NULL);
    for (size_t i = 0; aside && i < n; i++) {
        const double *state = x + 2 * i * dof;
        phys_legendre_momentum(legendre, state, state + dof, t[i], p, NULL);
        for (size_t k = 0; k < dof; k++)
            change[k] = fmax(change[k], fabs(p[k] - value[k]));
        if (i % stride)
            continue;
        judge_cyclic(legendre, g, dof, state, t[i], p, cyclic);
        move_aside(dof, i, state, aside);
        judge_cyclic(legendre, g, dof, aside, t[i], p, cyclic);
    }
    free(aside);
    phys_constraints_free(g);
    phys_legendre_free(legendre);
    return error->status;
}
