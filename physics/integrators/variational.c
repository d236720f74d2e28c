/* The variational integrator of an action rule: the discrete action S(X_0 ... X_s) of one element,
   X_0 = q and X_s the next q, generates the step by
       p = -dS/dX_0,   dS/dX_k = 0 inside,   next p = dS/dX_s
   (Marsden, West, Discrete mechanics and variational integrators, Acta Numerica 2001, sections 1.5
   and 2.2). Marched so, the q are the stationary path of the rule whose first two slices are given.
   The equations are solved by Newton's method with the exact Hessian, until rounding stops it. */
#include "stepper.h"
#include "../hessian.h"
#include "../../autodiff/blas.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ITERATIONS = 50 };

static const double settled = 1e-9; /* a change that no longer shrinks below this is rounding */

struct element {
    struct phys_hessian hessian;
    size_t dof, degree;
    double *path;         /* [degree*dof x 2]: as rules lay out a path of two slices */
    double *matrix, *b;   /* Newton's equations for nodes 1 ... degree, and their solution */
    double *displacement; /* [dof] of the last step */
    double last_h;        /* 0: there was none */
};

static const struct phys_rule *rule_of(const struct phys_integrator *integrator)
{
    return integrator->coefficients;
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    size_t unknowns = rule_of(integrator)->degree * n / 2;
    return 2 * unknowns + unknowns * unknowns + unknowns + n / 2;
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    struct element *e = s->state = calloc(1, sizeof *e);
    if (!e)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    e->dof = s->n / 2;
    e->degree = rule_of(s->integrator)->degree;
    size_t unknowns = e->degree * e->dof;
    e->path = s->work;
    e->matrix = e->path + 2 * unknowns;
    e->b = e->matrix + unknowns * unknowns;
    e->displacement = e->b + unknowns;
    return phys_hessian_new(&e->hessian, s->ode->system, rule_of(s->integrator), 2, 1, error);
}

static void end(struct phys_stepper *s)
{
    struct element *e = s->state;
    if (e)
        phys_hessian_free(&e->hessian);
    free(e);
}

/* Coordinate d of node k: the last node is in the second column of row d. */
static double *node(const struct element *e, size_t k, size_t d)
{
    return k < e->degree ? &e->path[2 * (k * e->dof + d)] : &e->path[2 * d + 1];
}

/* Nodes to begin with: on a line as far as the last step went, or along the velocity. */
static enum ad_status guess(struct phys_stepper *s, struct element *e, double h,
                            struct ad_error *error)
{
    if (e->last_h != h) {
        if (phys_stepper_need_rate(s, error) != AD_OK)
            return error->status;
        for (size_t d = 0; d < e->dof; d++)
            e->displacement[d] = h * s->rate[d];
    }
    for (size_t k = 0; k <= e->degree; k++)
        for (size_t d = 0; d < e->dof; d++)
            *node(e, k, d) = s->y[d] + e->hessian.table.node[k] * e->displacement[d];
    return AD_OK;
}

/* One Newton step for nodes 1 ... degree from the equations of nodes 0 ... degree-1. */
static bool newton_step(struct phys_stepper *s, struct element *e)
{
    const struct phys_hessian *H = &e->hessian;
    size_t n = e->degree * e->dof;
    phys_hessian_at(&e->hessian, e->path, s->t);
    s->evaluations++;
    for (size_t i = 0; i < n; i++) {
        e->b[i] = -H->gradient[i] - (i < e->dof ? s->y[e->dof + i] : 0);
        for (size_t j = 0; j < n; j++)
            e->matrix[i * n + j] = H->element[(j + e->dof) * H->side + i];
    }
    if (ad_blas_solve(n, e->matrix, e->b) != 0)
        return false;
    for (size_t i = 0; i < n; i++)
        *node(e, 1 + i / e->dof, i % e->dof) += e->b[i];
    return true;
}

/* Length of the last correction in units of the step's displacement and place. */
static double change(struct phys_stepper *s, const struct element *e)
{
    double most = 0;
    for (size_t i = 0; i < e->degree * e->dof; i++) {
        size_t d = i % e->dof;
        double size = fmax(fabs(s->y[d]), fabs(*node(e, e->degree, d) - s->y[d]));
        double x = e->b[i] == 0 ? 0 : fabs(e->b[i]) / size;
        if (!(x <= most)) {
            most = x;
            s->worst = d;
        }
    }
    return most;
}

static bool solve(struct phys_stepper *s, struct element *e)
{
    double last = INFINITY;
    for (int k = 0; k < MOST_ITERATIONS; k++) {
        if (!newton_step(s, e))
            return false;
        double now = change(s, e);
        if (!isfinite(now))
            return false;
        if (now <= DBL_EPSILON / 4 || (now >= 0.25 * last && now < settled))
            return true;
        last = now;
    }
    return false;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct element *e = s->state;
    e->hessian.dt = h;
    if (guess(s, e, h, error) != AD_OK)
        return error->status;
    if (!solve(s, e)) {
        char name[64];
        phys_stepper_name(s, s->worst, name, sizeof name);
        return ad_fail(error, AD_E_ACCURACY,
                       "no discrete path was found at t = %.9g, worst in %s: take a smaller step "
                       "than %.3g",
                       s->t, name, fabs(h));
    }
    phys_hessian_gradient_at(&e->hessian, e->path, s->t);
    s->evaluations++;
    for (size_t d = 0; d < e->dof; d++) {
        s->next[d] = *node(e, e->degree, d);
        s->next[e->dof + d] = e->hessian.gradient[e->degree * e->dof + d];
        e->displacement[d] = s->next[d] - s->y[d];
    }
    e->last_h = h;
    return AD_OK;
}

static const struct phys_scheme scheme = {.work = work, .begin = begin, .end = end, .step = step};

#define METHOD(id, rule, ORDER, SYMMETRIC)                                                         \
    const struct phys_integrator phys_variational_##id = {                                         \
        .name = "variational-" #id,                                                                \
        .what = "the discrete motion of action rule " #id,                                         \
        .order = ORDER,                                                                            \
        .symplectic = true,                                                                        \
        .symmetric = SYMMETRIC,                                                                    \
        .lagrangian = true,                                                                        \
        .scheme = &scheme,                                                                         \
        .coefficients = &rule,                                                                     \
    };

METHOD(left, phys_rule_left, 1, false)
METHOD(midpoint, phys_rule_midpoint, 2, true)
METHOD(trapezoid, phys_rule_trapezoid, 2, true)
METHOD(gauss2, phys_rules_gauss[0], 4, true)
METHOD(gauss3, phys_rules_gauss[1], 6, true)
METHOD(gauss4, phys_rules_gauss[2], 8, true)
