/* The Legendre transformation of a Lagrangian: momenta p = L_v, energy v p - L, and velocities from
   momenta. */
#include "autodiff/free.h"
#include "mass.h"
#include "internal.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NEWTON_STEPS = 60, HALVINGS = 100 };

struct phys_legendre {
    const struct phys_system *system;
    ad_tape *tape;
    ad_var q, v, t;                /* inputs: [dof x 1] each, t a scalar */
    ad_var energy, p, force, mass; /* p, force [dof x 1]; L_vv by its colours */
    ad_program *for_energy, *for_momentum, *for_velocity;
    struct phys_mass M;
    double *b, *step; /* [dof]; [dof] of Newton's method */
    bool quadratic;   /* M does not depend on v: one Newton step is exact */
};

static void record(phys_legendre *l)
{
    size_t n = l->system->dof;
    ad_var by[2];
    l->q = ad_input(l->tape, n, 1, "q");
    l->v = ad_input(l->tape, n, 1, "v");
    l->t = ad_input(l->tape, 1, 1, "t");
    ad_var L = phys_system_lagrangian(l->system, l->q, l->v, l->t);
    if (ad_grad(L, 2, (ad_var[]){l->q, l->v}, by) != AD_OK)
        return;
    l->force = phys_system_add_forces(l->system, by[0], l->q, l->v, l->t);
    l->p = ad_label(by[1], "momentum");
    l->energy = ad_sub(ad_dot(l->p, l->v), L);
    l->mass = phys_record_colours(l->system, l->q, l->v, l->t, l->p, &l->M.pattern);
}

enum ad_status phys_legendre_new(const struct phys_system *system, phys_legendre **legendre,
                                 struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, legendre) || AD_LACKS(error, system, system->scene))
        return error->status;
    size_t n = system->dof;
    phys_legendre *l = *legendre = calloc(1, sizeof *l);
    if (!l)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    l->system = system;
    l->tape = ad_tape_new(AD_F64);
    l->b = malloc(2 * n * sizeof *l->b);
    if (!l->tape || !l->b || !phys_mass_new(&l->M, system, PHYS_MASS_FEW)) {
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    } else {
        l->step = l->b + n;
        record(l);
        ad_compile(l->tape, 1, &l->energy, &l->for_energy);
        ad_compile(l->tape, 2, (ad_var[]){l->p, l->force}, &l->for_momentum);
        ad_compile(l->tape, 2, (ad_var[]){l->p, l->mass}, &l->for_velocity);
        l->quadratic = phys_is_independent(l->tape, l->mass, 1, &l->v, error);
        phys_tape_status(l->tape, error);
    }
    if (error->status != AD_OK) {
        phys_legendre_free(l);
        *legendre = NULL;
    }
    return error->status;
}

void phys_legendre_free(phys_legendre *legendre)
{
    if (!legendre)
        return;
    ad_program_free(legendre->for_energy);
    ad_program_free(legendre->for_momentum);
    ad_program_free(legendre->for_velocity);
    ad_tape_free(legendre->tape);
    phys_mass_free(&legendre->M);
    AD_FREE(legendre->b, legendre);
}

static void run(phys_legendre *l, ad_program *program, const double *q, const double *v, double t)
{
    ad_set(program, l->q, q);
    ad_set(program, l->v, v);
    ad_set(program, l->t, &t);
    ad_run(program);
}

double phys_legendre_energy(phys_legendre *legendre, const double *q, const double *v, double t)
{
    double energy;
    if (!legendre || !q || !v)
        return (double)NAN;
    run(legendre, legendre->for_energy, q, v, t);
    ad_get(legendre->for_energy, legendre->energy, &energy);
    return energy;
}

static void unknown(size_t n, double *x)
{
    for (size_t k = 0; x && k < n; k++)
        x[k] = NAN;
}

void phys_legendre_momentum(phys_legendre *legendre, const double *q, const double *v, double t,
                            double *p, double *force)
{
    if (legendre && !(q && v)) {
        unknown(legendre->system->dof, p);
        unknown(legendre->system->dof, force);
    }
    if (!legendre || !q || !v)
        return;
    run(legendre, legendre->for_momentum, q, v, t);
    if (p)
        ad_get(legendre->for_momentum, legendre->p, p);
    if (force)
        ad_get(legendre->for_momentum, legendre->force, force);
}

/* L_v and M at a state. */
static void evaluate(phys_legendre *l, const double *q, const double *v, double t)
{
    run(l, l->for_velocity, q, v, t);
    ad_get(l->for_velocity, l->p, l->b);
    ad_get(l->for_velocity, l->mass, l->M.values);
}

double phys_legendre_condition(phys_legendre *legendre, const double *q, const double *v, double t)
{
    if (!legendre || !q || !v)
        return (double)NAN;
    evaluate(legendre, q, v, t);
    phys_mass_factor(&legendre->M, 0);
    return legendre->M.condition;
}

size_t phys_legendre_negative(phys_legendre *legendre, const double *q, const double *v, double t)
{
    if (!legendre || !q || !v)
        return SIZE_MAX;
    size_t n = legendre->system->dof, negative = SIZE_MAX;
    if (!(phys_legendre_condition(legendre, q, v, t) <= PHYS_MASS_SINGULAR))
        return negative;
    if (legendre->M.diagonal) {
        negative = 0;
        for (size_t k = 0; k < n; k++)
            negative += legendre->M.factor[k] < 0;
        return negative;
    }
    double unused = 0, *whole = calloc((n + 64) * n, sizeof *whole);
    for (size_t k = 0; whole && k < n * n; k++)
        whole[k] = phys_mass_entry(&legendre->M, k / n, k % n);
    if (whole && phys_lapack_symmetric_factor(n, whole, legendre->M.pivots, whole + n * n) == 0)
        negative = phys_lapack_symmetric_inertia(n, n, whole, legendre->M.pivots, &unused);
    free(whole);
    return negative;
}

/* Largest entry of p - L_v at v, infinite where M is singular there; *worst: the coordinate
   whose column of M cancels most. */
static double residual(phys_legendre *l, const double *q, const double *p, double t,
                       const double *v, size_t *worst)
{
    double most = 0;
    evaluate(l, q, v, t);
    phys_mass_factor(&l->M, 0);
    *worst = l->M.worst;
    for (size_t k = 0; k < l->system->dof; k++) {
        l->b[k] = p[k] - l->b[k];
        most = fabs(l->b[k]) <= most ? most : fabs(l->b[k]);
    }
    return l->M.condition <= PHYS_MASS_SINGULAR && isfinite(most) ? most : (double)INFINITY;
}

/* One Newton step v += M^-1 (p - L_v); returns its length in units of |v|. */
static double newton_step(phys_legendre *l, double *v)
{
    double step = 0, size = 0;
    phys_mass_solve(&l->M, l->b);
    for (size_t k = 0; k < l->system->dof; k++) {
        v[k] += l->step[k] = l->b[k];
        step = fmax(step, fabs(l->b[k]));
        size = fmax(size, fabs(v[k]));
    }
    return size > 0 ? step / size : 0;
}

/* The residual after a step, which is halved until that is no larger than before: Newton's steps
   may leave where L is defined, such as the speeds below that of light. */
static double settle(phys_legendre *l, const double *q, const double *p, double t, double before,
                     double *v, size_t *worst)
{
    double now = residual(l, q, p, t, v, worst);
    for (int k = 0; k < HALVINGS && !(now <= before); k++) {
        for (size_t i = 0; i < l->system->dof; i++) {
            l->step[i] *= 0.5;
            v[i] -= l->step[i];
        }
        now = residual(l, q, p, t, v, worst);
    }
    return now;
}

enum ad_status phys_legendre_velocity(phys_legendre *legendre, const double *q, const double *p,
                                      double t, double *v, struct ad_error *error)
{
    phys_legendre *l = legendre;
    const double rounding = 1e-6; /* shorter steps are not judged by their residuals */
    double length = INFINITY, before, left;
    size_t worst;
    char name[64];
    if (AD_LACKS(error, l, q, p, v))
        return error->status;
    memset(v, 0, l->system->dof * sizeof *v);
    left = residual(l, q, p, t, v, &worst);
    for (int k = 0; k < NEWTON_STEPS && isfinite(left); k++) {
        before = length;
        length = newton_step(l, v);
        if (l->quadratic || length <= DBL_EPSILON || (length >= before && length < 1e-10))
            return AD_OK;
        left = length > rounding ? settle(l, q, p, t, left, v, &worst)
                                 : residual(l, q, p, t, v, &worst);
    }
    phys_coordinate_name(l->system, worst, name, sizeof name);
    if (l->M.condition > PHYS_MASS_SINGULAR)
        return ad_fail(
            error, AD_E_NONFINITE,
            "%s: L is degenerate (condition number %.2g): the mass matrix is singular at "
            "coordinate %s, t = %g",
            l->system->scene->name, l->M.condition, name, t);
    if (!isfinite(left))
        return ad_fail(error, AD_E_NONFINITE,
                       "%s: no velocity belongs to the momentum of coordinate %s, t = %g",
                       l->system->scene->name, name, t);
    return ad_fail(error, AD_E_NONFINITE,
                   "%s: no velocities belong to these momenta, t = %g; Newton's method stays at a "
                   "relative change of %.1e",
                   l->system->scene->name, t, length);
}

void phys_totals(phys_legendre *legendre, const double *q, const double *v, double t,
                 struct phys_totals *totals)
{
    phys_legendre *l = legendre;
    if (!totals)
        return;
    if (!l || !q || !v) {
        *totals = (struct phys_totals){NAN, {NAN, NAN, NAN}, {NAN, NAN, NAN}, {NAN, NAN, NAN}, NAN};
        return;
    }
    const struct phys_system *system = l->system;
    size_t dims = system->dims, n = system->dof;
    *totals = (struct phys_totals){.energy = phys_legendre_energy(l, q, v, t)};
    if (system->scene->picture != PHYS_PICTURE_PLANE || dims < 2 || dims > 3)
        return;
    evaluate(l, q, v, t);
    for (size_t k = 0; k < n; k += dims) {
        double x[3] = {0}, p[3] = {0}, m = phys_mass_entry(&l->M, k, k);
        memcpy(x, q + k, dims * sizeof *x);
        memcpy(p, l->b + k, dims * sizeof *p);
        totals->mass += m;
        for (size_t axis = 0; axis < 3; axis++) {
            size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
            totals->momentum[axis] += p[axis];
            totals->angular[axis] += x[a] * p[b] - x[b] * p[a];
            totals->centre[axis] += m * x[axis];
        }
    }
    for (size_t axis = 0; axis < 3; axis++)
        totals->centre[axis] /= totals->mass;
}
