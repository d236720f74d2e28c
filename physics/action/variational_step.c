/* Variational integrators of the action rules (variational_step.h). Each element's equations are
   solved by Newton's method with the element's own second derivatives; where they are linear, as
   for rule `left` and a separable L, one step solves them. */
#include "variational_step.h"
#include "autodiff/free.h"
#include "physics/linear/lu.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 50 }; /* of Newton's method; an element of reasonable length needs five */

struct phys_variational_step {
    const struct phys_system *system;
    struct phys_hessian hessian; /* of one element */
    size_t dof, degree, evaluations;
    double *x;        /* [degree*dof x 2] */
    double *velocity; /* [dof] mean velocity of the last element */
    double *right, *zero;
    struct phys_lu matrix; /* of the nodes' unknowns, by coordinate, then node */
};

enum ad_status phys_variational_step_new(const struct phys_system *system,
                                         const struct phys_rule *rule, double dt,
                                         phys_variational_step **stepper, struct ad_error *error)
{
    size_t n = rule->degree * system->dof;
    phys_variational_step *m = *stepper = calloc(1, sizeof *m);
    if (!m)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    m->system = system;
    m->dof = system->dof;
    m->degree = rule->degree;
    if (rule->repeat)
        ad_fail(error, AD_E_ARGUMENT, "rule %s cannot be stepped in time: its last slice differs",
                rule->name);
    else if (!(m->x = calloc(2 * n + 2 * m->dof + n, sizeof *m->x)))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else
        phys_hessian_new(&m->hessian, system, rule, 2, dt, NULL, error);
    if (error->status == AD_OK &&
        !phys_lu_new(&m->matrix, n, m->degree * (m->hessian.around + 1) - 1))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (error->status != AD_OK) {
        phys_variational_step_free(m);
        *stepper = NULL;
        return error->status;
    }
    m->velocity = m->x + 2 * n;
    m->zero = m->velocity + m->dof;
    m->right = m->zero + m->dof;
    return AD_OK;
}

void phys_variational_step_free(phys_variational_step *stepper)
{
    if (!stepper)
        return;
    phys_hessian_free(&stepper->hessian);
    phys_lu_free(&stepper->matrix);
    AD_FREE(stepper->x, stepper);
}

const double *phys_variational_step_element(const phys_variational_step *stepper)
{
    return stepper->x;
}

size_t phys_variational_step_evaluations(const phys_variational_step *stepper)
{
    return stepper->evaluations;
}

void phys_variational_step_go(phys_variational_step *stepper, double dt, const double *velocity)
{
    stepper->hessian.dt = dt;
    memcpy(stepper->velocity, velocity, stepper->dof * sizeof *velocity);
}

/* ---- solving ---- */

/* Coordinate i of the nodes in the order of time: node i / dof. */
static double *coordinate(phys_variational_step *m, size_t i)
{
    size_t node = i / m->dof, d = i % m->dof;
    return node < m->degree ? &m->x[2 * i] : &m->x[2 * d + 1];
}

static enum ad_status refuse(const phys_variational_step *m, size_t i, double t, const char *what,
                             struct ad_error *error)
{
    char name[64];
    phys_coordinate_name(m->system, i % m->dof, name, sizeof name);
    return ad_fail(error, AD_E_NONFINITE,
                   "%s: %s from t = %g to %g, coordinate %s; try a smaller time step",
                   m->system->scene->name, what, t, t + m->hessian.dt, name);
}

/* Coordinate i of n, whole nodes, as an unknown of the matrix, and back. */
static size_t unknown(const struct phys_variational_step *m, size_t i, size_t n)
{
    return m->hessian.of->coupling.place[i % m->dof] * (n / m->dof) + i / m->dof;
}

static size_t coordinate_at(const struct phys_variational_step *m, size_t unknown, size_t n)
{
    const size_t nodes = n / m->dof;
    return unknown % nodes * m->dof + m->hessian.of->coupling.order[unknown / nodes];
}

/* Second derivatives by coordinates row ... row + n - 1 and first ... first + n - 1, factored. */
static int factor(phys_variational_step *m, size_t row, size_t first, size_t n)
{
    const struct phys_hessian *h = &m->hessian;
    const size_t nodes = n / m->dof;
    phys_lu_clear(&m->matrix, n, nodes * (h->around + 1) - 1);
    for (size_t j = 0; j < m->dof; j++) {
        size_t from, to;
        phys_hessian_coupled(h, j, &from, &to);
        for (size_t i = from; i < to; i++)
            for (size_t a = 0; a < nodes; a++)
                for (size_t b = 0; b < nodes; b++)
                    *phys_lu_at(&m->matrix, i * nodes + a, j * nodes + b) =
                        phys_hessian_entry(h, 0, row / h->dof + a, i, first / h->dof + b, j);
    }
    return phys_lu_factor(&m->matrix);
}

/* One Newton step for coordinates first ... first + n - 1 so that the gradient with respect to
   coordinates row ... row + n - 1 becomes minus `momentum` (of the first dof, where row is 0). The
   largest change relative to the largest coordinate and to the element's length is returned; a
   negative number: singular. */
static double newton_step(phys_variational_step *m, double t, const double *momentum, size_t row,
                          size_t first, size_t n, size_t *worst)
{
    const struct phys_hessian *h = &m->hessian;
    double size = DBL_MIN, change = 0;
    phys_hessian_at(&m->hessian, m->x, t);
    m->evaluations++;
    int singular = factor(m, row, first, n);
    if (singular) {
        *worst = first + coordinate_at(m, (size_t)singular - 1, n);
        return -1;
    }
    for (size_t i = 0; i < n; i++)
        m->right[unknown(m, i, n)] =
            h->gradient[row + i] + (row + i < m->dof ? momentum[row + i] : 0);
    phys_lu_solve(&m->matrix, m->right);
    for (size_t i = 0; i < n; i++) {
        double *x = coordinate(m, first + i);
        const double step = m->right[unknown(m, i, n)];
        *x -= step;
        size = fmax(size, fabs(*x));
        if (!(fabs(step) <= change)) { /* NaN, too */
            change = fabs(step);
            *worst = first + i;
        }
    }
    return change / size;
}

/* Newton's method, until a step is as small as rounding or no longer smaller than the one before
   and small at that. */
static enum ad_status solve(phys_variational_step *m, double t, const double *momentum, size_t row,
                            size_t first, size_t n, struct ad_error *error)
{
    double before = (double)INFINITY;
    size_t worst = first;
    for (int step = 0; step < STEPS; step++) {
        double change = newton_step(m, t, momentum, row, first, n, &worst);
        if (change < 0)
            return refuse(m, worst, t, "the discrete equations are singular", error);
        if (!isfinite(change))
            return refuse(m, worst, t, "the motion is not finite", error);
        if (change <= 4 * DBL_EPSILON || (change < 1e-10 && change >= 0.5 * before))
            break;
        if (step == STEPS - 1)
            return refuse(m, worst, t, "the discrete equations have no solution near", error);
        before = change;
    }
    phys_hessian_gradient_at(&m->hessian, m->x, t);
    m->evaluations++;
    return AD_OK;
}

/* Nodes on a line through q with the velocity kept. */
static void place_nodes(phys_variational_step *m, const double *q)
{
    for (size_t k = 0; k <= m->degree; k++)
        for (size_t d = 0; d < m->dof; d++)
            *coordinate(m, k * m->dof + d) =
                q[d] + m->hessian.table.node[k] * m->hessian.dt * m->velocity[d];
}

static void end_momentum(const phys_variational_step *m, double *p)
{
    memcpy(p, m->hessian.gradient + m->degree * m->dof, m->dof * sizeof *p);
}

enum ad_status phys_variational_step_start(phys_variational_step *stepper, double t,
                                           const double *q0, const double *q1, double *p,
                                           struct ad_error *error)
{
    phys_variational_step *m = stepper;
    size_t inner = (m->degree - 1) * m->dof;
    for (size_t d = 0; d < m->dof; d++)
        m->velocity[d] = (q1[d] - q0[d]) / m->hessian.dt;
    place_nodes(m, q0);
    for (size_t d = 0; d < m->dof; d++)
        *coordinate(m, m->degree * m->dof + d) = q1[d];
    if (inner && solve(m, t, m->zero, m->dof, m->dof, inner, error) != AD_OK)
        return error->status;
    phys_hessian_gradient_at(&m->hessian, m->x, t);
    end_momentum(m, p);
    return AD_OK;
}

enum ad_status phys_variational_step_next(phys_variational_step *stepper, double t, double *q,
                                          double *p, struct ad_error *error)
{
    phys_variational_step *m = stepper;
    place_nodes(m, q);
    if (solve(m, t, p, 0, m->dof, m->degree * m->dof, error) != AD_OK)
        return error->status;
    for (size_t d = 0; d < m->dof; d++) {
        double end = *coordinate(m, m->degree * m->dof + d);
        m->velocity[d] = (end - q[d]) / m->hessian.dt;
        q[d] = end;
    }
    end_momentum(m, p);
    return AD_OK;
}
