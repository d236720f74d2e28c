/* RATTLE: kick, drift, kick with constraints. The first kick has the constraint forces that bring
   the coordinates onto g = 0 after the drift, the second those that bring the velocities onto
   G v + g_t = 0: symplectic and symmetric on the constraints (Andersen 1983; Hairer, Lubich,
   Wanner, Geometric Numerical Integration, section VII.1.4). Without constraints it is
   velocity-verlet. */
#include "physics/lagrangian/constraints.h"
#include "physics/ode/internal.h"
#include "stepper.h"

#include <stdlib.h>
#include <string.h>

struct rattle {
    phys_motion *motion;
    double *at, *a, *moved, *W; /* coordinates [dof] of a and W; [constraints][dof] */
    bool known;
};

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    return phys_splitting.work(integrator, n);
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    phys_motion *motion = phys_ode_constrained_motion(s->ode);
    const size_t dof = s->n / 2;
    if (!motion)
        return AD_OK;
    struct rattle *r = s->state =
        calloc(1, sizeof *r + (3 + phys_motion_constraints(motion)->n) * dof * sizeof *r->a);
    if (!r)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    r->motion = motion;
    r->at = (double *)(r + 1);
    r->a = r->at + dof;
    r->moved = r->a + dof;
    r->W = r->moved + dof;
    return AD_OK;
}

static void end(struct phys_stepper *s) { free(s->state); }

/* a and W at q. */
static enum ad_status look(struct phys_stepper *s, struct rattle *r, double t, const double *q,
                           const double *v, struct ad_error *error)
{
    const struct phys_constraints *c = phys_motion_constraints(r->motion);
    s->evaluations++;
    if (phys_motion_free_acceleration(r->motion, q, v, t, r->a, error) != AD_OK ||
        phys_motion_constrain(r->motion, q, v, t, error) != AD_OK)
        return error->status;
    memcpy(r->W, c->W, c->n * c->dof * sizeof *r->W);
    memcpy(r->at, q, c->dof * sizeof *q);
    r->known = true;
    return AD_OK;
}

static void move(struct phys_stepper *s, size_t first, double h, const double *rate)
{
    for (size_t k = first; k < first + s->n / 2; k++)
        phys_add_with_cut(s->next[k], h * rate[k - first], s->next_cut[k], &s->next[k],
                          &s->next_cut[k]);
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct rattle *r = s->state;
    const size_t dof = s->n / 2;
    double *q = s->next, *v = q + dof;
    if (!r)
        return phys_splitting.step(s, h, error);
    struct phys_constraints *c = phys_motion_constraints(r->motion);
    memcpy(s->next, s->y, s->n * sizeof *s->y);
    memcpy(s->next_cut, s->cut, s->n * sizeof *s->cut);
    const bool kept = r->known && memcmp(r->at, q, dof * sizeof *q) == 0;
    if (!kept && look(s, r, s->t, q, v, error) != AD_OK)
        return error->status;
    move(s, dof, h / 2, r->a);
    move(s, 0, h, v);
    if (phys_constraints_meet(c, r->W, s->t + h, q, r->moved, error) != AD_OK)
        return error->status;
    move(s, dof, 1 / h, r->moved);
    if (look(s, r, s->t + h, q, v, error) != AD_OK)
        return error->status;
    move(s, dof, h / 2, r->a);
    phys_constraints_evaluate(c, q, v, s->t + h);
    phys_constraints_turn(c, v);
    return AD_OK;
}

const struct phys_scheme phys_constrained_splitting = {
    .constrains = true, .work = work, .begin = begin, .end = end, .step = step};

static const double drift[] = {0, 1}, kick[] = {0.5, 0.5};
static const struct phys_kicks kicks = {2, drift, kick};

const struct phys_integrator phys_rattle = {
    .name = "rattle",
    .what = "kick, drift, kick on constraints",
    .order = 2,
    .symplectic = true,
    .symmetric = true,
    .separable = true,
    .scheme = &phys_constrained_splitting,
    .coefficients = &kicks,
};
