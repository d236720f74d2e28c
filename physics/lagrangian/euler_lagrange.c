/* Accelerations of any Lagrangian. With p = L_v the Euler-Lagrange equation dp/dt = L_q is
       M a = L_q - L_vq v - L_vt + Q - D_v,   M = L_vv.
   Constraints add their forces (constraints.h).
   L_vq v + L_vt is the derivative of p along (v, 1) in (q, t). M comes from one run over lanes with
   the same state: column c of the gradient of sum_c p(lane c) s_c with respect to the lanes' v is M
   s_c, the columns of colour c where s_c is 1 for these. A constant M is folded at compile time,
   and is evaluated and factored once. */
#include "autodiff/free.h"
#include "constraints.h"
#include "mass.h"

#include "autodiff/derivatives.h"
#include "autodiff/series.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct phys_motion {
    const struct phys_system *system;
    struct phys_constraints *constraints; /* NULL: none */
    ad_tape *tape;
    ad_var q, v, t;     /* inputs: [dof x 1] each, t a scalar */
    ad_var p, energy;   /* L_v [dof x 1], v p - L */
    ad_var mass, force; /* M by its colours [dof x colours], right side [dof x 1] */
    size_t n_params;    /* variables: inputs [1 x 1], by their places in the scene's table */
    size_t *which;
    ad_var *params;
    ad_program *mass_program;
    ad_program *energy_program; /* NULL until needed */
    ad_series *energy_series;   /* the same; NULL: many coordinates, or none */
    bool constant;              /* M is, and is known */
    ad_program *force_program;
    struct phys_mass M;
    double rounding; /* relative changes of M's entries; 0: none */
};

/* The sums of the unit vectors of each colour [n x colours]; `colour` NULL: each has its own. */
static ad_var colour_vectors(ad_tape *tape, size_t n, size_t colours, const uint32_t *colour)
{
    double *values = calloc(n * colours, sizeof *values);
    if (!values)
        return ad_refuse(tape, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    for (size_t k = 0; k < n; k++)
        values[k * colours + (colour ? colour[k] : k)] = 1;
    ad_var vectors = ad_const(tape, n, colours, values);
    free(values);
    return vectors;
}

ad_var phys_unit_matrix(ad_tape *tape, size_t n) { return colour_vectors(tape, n, n, NULL); }

static void record_force(phys_motion *m)
{
    const ad_var by[2] = {m->q, m->v}, place[2] = {m->q, m->t};
    const ad_var rate[2] = {m->v, ad_scalar(m->tape, 1)};
    ad_var L = phys_system_lagrangian(m->system, m->q, m->v, m->t), L_by[2], along;
    if (ad_grad(L, 2, by, L_by) == AD_OK && ad_jvp(L_by[1], 2, place, rate, &along) == AD_OK)
        m->force =
            ad_label(ad_sub(phys_system_add_forces(m->system, L_by[0], m->q, m->v, m->t), along),
                     "generalised force");
    m->p = L_by[1];
    m->energy = ad_sub(ad_dot(m->p, m->v), L);
}

/* M seed [dof x lanes], where p is L_v. */
static ad_var record_product(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                             ad_var p, ad_var seed)
{
    const size_t n = system->dof, lanes = ad_cols(seed);
    ad_var lanes_q = ad_broadcast(q, n, lanes), lanes_v = ad_broadcast(v, n, lanes), product = v;
    if (lanes > 1) { /* else there is one lane, the state itself */
        ad_var L = phys_system_lagrangian(system, lanes_q, lanes_v, ad_broadcast(t, 1, lanes));
        ad_grad(L, 1, &lanes_v, &p);
    }
    if (ad_tape_error(q.tape)->status == AD_OK)
        ad_grad(ad_dot(p, seed), 1, &lanes_v, &product);
    return product;
}

ad_var phys_record_mass(const struct phys_system *system, ad_var q, ad_var v, ad_var t, ad_var p)
{
    return record_product(system, q, v, t, p, phys_unit_matrix(q.tape, system->dof));
}

ad_var phys_record_colours(const struct phys_system *system, ad_var q, ad_var v, ad_var t, ad_var p,
                           const struct phys_pattern *pattern)
{
    return record_product(system, q, v, t, p,
                          colour_vectors(q.tape, pattern->n, pattern->colours, pattern->colour));
}

/* Masses that vary, of few coordinates, once more by their pattern. */
static enum ad_status narrow_mass(phys_motion *m, struct ad_error *error)
{
    ad_program_free(m->mass_program);
    m->mass_program = NULL;
    phys_mass_free(&m->M);
    if (!phys_mass_new(&m->M, m->system, PHYS_MASS_VARYING))
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", m->system->dof);
    m->mass = phys_record_colours(m->system, m->q, m->v, m->t, m->p, &m->M.pattern);
    ad_compile(m->tape, 1, &m->mass, &m->mass_program);
    return phys_tape_status(m->tape, error);
}

static enum ad_status record(phys_motion *m, struct ad_error *error)
{
    size_t n = m->system->dof;
    bool *taken = m->params ? calloc(m->n_params, sizeof *taken) : NULL;
    if (m->params && !taken)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    m->q = ad_input(m->tape, n, 1, "q");
    m->v = ad_input(m->tape, n, 1, "v");
    m->t = ad_input(m->tape, 1, 1, "t");
    for (size_t k = 0; k < m->n_params; k++)
        m->params[k] = ad_input(m->tape, 1, 1, m->system->scene->params[m->which[k]].name);
    const struct phys_variables before = phys_variables_bind(
        (struct phys_variables){m->system, m->n_params, m->which, m->params, taken});
    record_force(m);
    m->mass = phys_record_colours(m->system, m->q, m->v, m->t, m->p, &m->M.pattern);
    phys_variables_bind(before);
    free(taken);
    if (phys_tape_status(m->tape, error) != AD_OK)
        return error->status;
    if (ad_compile(m->tape, 1, &m->force, &m->force_program) != AD_OK ||
        ad_compile(m->tape, 1, &m->mass, &m->mass_program) != AD_OK)
        return phys_tape_status(m->tape, error);
    return AD_OK;
}

static void set_inputs(const phys_motion *m, ad_program *program, const double *q, const double *v,
                       const double *t)
{
    ad_set(program, m->q, q);
    ad_set(program, m->v, v);
    ad_set(program, m->t, t);
}

static void evaluate_mass(phys_motion *m)
{
    ad_run(m->mass_program);
    ad_get(m->mass_program, m->mass, m->M.values);
    phys_mass_factor(&m->M, m->rounding);
}

void phys_motion_round_mass(phys_motion *motion, double share)
{
    motion->rounding = share;
    if (motion->constant)
        evaluate_mass(motion);
}

/* One that is a coordinate or a parameter takes no instruction either: it shows where these are not
   numbers. */
static bool has_inputs(phys_motion *m)
{
    const size_t n = m->system->dof;
    double none = NAN, sum = 0, *x = m->M.values;
    for (size_t k = 0; k < n; k++)
        x[k] = NAN;
    set_inputs(m, m->mass_program, x, x, &none);
    for (size_t k = 0; k < m->n_params; k++)
        ad_set(m->mass_program, m->params[k], &none);
    ad_run(m->mass_program);
    ad_get(m->mass_program, m->mass, x);
    for (size_t k = 0; k < n * m->M.pattern.colours; k++)
        sum += 0 * x[k];
    return sum != 0;
}

/* One that is constant is evaluated for good. */
static enum ad_status settle_mass(phys_motion *m, struct ad_error *error)
{
    m->constant = ad_program_info(m->mass_program).instructions == 0 && !has_inputs(m);
    if (m->constant)
        evaluate_mass(m);
    else if (m->n_params == 0 && phys_mass_is_whole(&m->M, PHYS_MASS_VARYING))
        narrow_mass(m, error);
    ad_native_lazy(m->force_program);
    ad_native_lazy(m->mass_program);
    return error->status;
}

enum ad_status phys_motion_new(const struct phys_system *system, phys_motion **motion,
                               struct ad_error *error)
{
    return phys_motion_new_of(system, 0, NULL, motion, error);
}

enum ad_status phys_motion_new_of(const struct phys_system *system, size_t n_params,
                                  const size_t which[], phys_motion **motion,
                                  struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, motion) || AD_LACKS(error, system, system->scene) ||
        (n_params && phys_refuse_constraints(system, "derivatives by parameters", error) != AD_OK))
        return error->status;
    const size_t n = system->dof;
    const bool whole = n_params > 0; /* a parameter may be 0 now that couples */
    phys_motion *m = *motion = calloc(1, sizeof *m);
    if (!m)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *m = (phys_motion){.system = system, .tape = ad_tape_new(AD_F64), .n_params = n_params};
    if (n_params) {
        m->which = malloc(n_params * sizeof *m->which);
        m->params = malloc(n_params * sizeof *m->params);
    }
    if (m->which)
        memcpy(m->which, which, n_params * sizeof *which);
    if (!m->tape || (n_params && (!m->which || !m->params)) ||
        !phys_mass_new(&m->M, system, whole ? n : PHYS_MASS_FEW))
        ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    else if (record(m, error) == AD_OK &&
             phys_constraints_new(system, &m->constraints, error) == AD_OK)
        settle_mass(m, error);
    if (error->status != AD_OK) {
        phys_motion_free(m);
        *motion = NULL;
    }
    return error->status;
}

void phys_motion_free(phys_motion *motion)
{
    if (!motion)
        return;
    phys_constraints_free(motion->constraints);
    ad_program_free(motion->mass_program);
    ad_program_free(motion->force_program);
    ad_program_free(motion->energy_program);
    ad_series_free(motion->energy_series);
    ad_tape_free(motion->tape);
    phys_mass_free(&motion->M);
    AD_FREE(motion->which, motion->params, motion);
}

static void set_state(phys_motion *m, ad_program *program, const double *q, const double *v,
                      double t)
{
    set_inputs(m, program, q, v, &t);
    for (size_t k = 0; k < m->n_params; k++)
        ad_set(program, m->params[k], phys_param_value(m->system, m->which[k]));
}

static enum ad_status refuse(const phys_motion *m, const char *what, size_t k, double t,
                             struct ad_error *error)
{
    char name[64];
    phys_coordinate_name(m->system, k, name, sizeof name);
    return ad_fail(error, AD_E_NONFINITE, "%s: %s at coordinate %s, t = %g", m->system->scene->name,
                   what, name, t);
}

static enum ad_status refuse_mass(const phys_motion *m, double t, struct ad_error *error)
{
    char what[160];
    if (m->M.largest == 0)
        snprintf(what, sizeof what,
                 "no mass; expected a positive one: the mass matrix is singular");
    else
        snprintf(what, sizeof what,
                 "L is degenerate (condition number %.2g): the mass matrix is singular",
                 m->M.condition);
    return refuse(m, what, m->M.worst, t, error);
}

enum ad_status phys_motion_mass(phys_motion *motion, const double *q, const double *v, double t,
                                struct ad_error *error)
{
    if (!motion->constant) {
        set_state(motion, motion->mass_program, q, v, t);
        evaluate_mass(motion);
    }
    return phys_motion_is_singular(motion) ? refuse_mass(motion, t, error) : AD_OK;
}

enum ad_status phys_motion_free_acceleration(phys_motion *motion, const double *q, const double *v,
                                             double t, double *a, struct ad_error *error)
{
    phys_motion *m = motion;
    set_state(m, m->force_program, q, v, t);
    ad_run(m->force_program);
    ad_get(m->force_program, m->force, a);
    if (phys_motion_mass(m, q, v, t, error) == AD_OK)
        phys_mass_solve(&m->M, a);
    return error->status;
}

enum ad_status phys_motion_acceleration(phys_motion *motion, const double *q, const double *v,
                                        double t, double *a, struct ad_error *error)
{
    if (AD_LACKS(error, motion, q, v, a))
        return error->status;
    phys_motion *m = motion;
    if (phys_motion_free_acceleration(m, q, v, t, a, error) != AD_OK)
        return error->status;
    if (m->constraints) {
        if (phys_motion_constrain(m, q, v, t, error) != AD_OK)
            return error->status;
        phys_constraints_push(m->constraints, a);
    }
    for (size_t k = 0; k < m->system->dof; k++)
        if (!isfinite(a[k]))
            return refuse(m, "the acceleration is not finite", k, t, error);
    return AD_OK;
}

/* Beyond, the columns of a program are worth the overhead of a run. */
enum { ENERGY_DOF = 12 };

/* By columns, and, of few coordinates, as a series of order 0: numbers one by one, in a fifth of
   the time. A recording without series is refused for good, so that the program comes first. */
void phys_motion_record_energy(phys_motion *motion)
{
    phys_motion *m = motion;
    const ad_var x[] = {m->q, m->v, m->t};
    if (!m->energy_program && ad_compile(m->tape, 1, &m->energy, &m->energy_program) == AD_OK &&
        m->system->dof <= ENERGY_DOF && m->n_params == 0)
        ad_series_new(1, &m->energy, LENGTH(x), x, 0, &m->energy_series);
}

static double energy_by_series(ad_series *s, size_t dof, const double *q, const double *v, double t)
{
    for (size_t k = 0; k < dof; k++) {
        *ad_series_input(s, 0, k) = q[k];
        *ad_series_input(s, 1, k) = v[k];
    }
    *ad_series_input(s, 2, 0) = t;
    ad_series_advance(s, 0);
    return *ad_series_output(s, 0, 0);
}

double phys_motion_energy(phys_motion *motion, const double *q, const double *v, double t)
{
    double energy = NAN;
    phys_motion *m = motion;
    phys_motion_record_energy(m);
    if (m->energy_series)
        return energy_by_series(m->energy_series, m->system->dof, q, v, t);
    set_state(m, m->energy_program, q, v, t);
    ad_run(m->energy_program);
    ad_get(m->energy_program, m->energy, &energy);
    return energy;
}

bool phys_motion_separates(phys_motion *motion, struct ad_error *error)
{
    phys_motion *m = motion;
    return m->constant && phys_is_independent(m->tape, m->force, 1, &m->v, error);
}

bool phys_motion_has_plain_momenta(phys_motion *motion, struct ad_error *error)
{
    phys_motion *m = motion;
    return m->constant && phys_is_independent(m->tape, m->p, 2, (ad_var[]){m->q, m->t}, error);
}

const char *phys_motion_interpreted(const phys_motion *motion)
{
    return ad_native_note(motion->force_program);
}

struct phys_constraints *phys_motion_constraints(const phys_motion *motion)
{
    return motion->constraints;
}

const struct phys_system *phys_motion_system(const phys_motion *motion) { return motion->system; }

bool phys_motion_recorded(const phys_motion *motion, ad_var x[3], ad_var y[2])
{
    const ad_var inputs[] = {motion->q, motion->v, motion->t};
    memcpy(x, inputs, sizeof inputs);
    y[0] = motion->force;
    y[1] = motion->mass;
    return motion->constant;
}

size_t phys_motion_mass_place(const phys_motion *motion, size_t i, size_t j)
{
    const struct phys_pattern *p = &motion->M.pattern;
    return p->colours == p->n || phys_pattern_has(p, i, j) ? i * p->colours + p->colour[j]
                                                           : SIZE_MAX;
}

size_t phys_motion_parameters(const phys_motion *motion) { return motion->n_params; }

ad_var phys_motion_parameter(const phys_motion *motion, size_t k, double *value)
{
    *value = *phys_param_value(motion->system, motion->which[k]);
    return motion->params[k];
}

bool phys_motion_is_diagonal(phys_motion *motion)
{
    phys_motion *m = motion;
    const size_t n = m->system->dof;
    double *x = malloc(2 * n * sizeof *x);
    bool diagonal = x;
    for (int place = 0; place < 2 && diagonal; place++) {
        for (size_t k = 0; k < 2 * n; k++)
            x[k] = 1 + sin(1.7 * (double)k + place) / 3;
        set_state(m, m->mass_program, x, x + n, 0.7 + place);
        ad_run(m->mass_program);
        ad_get(m->mass_program, m->mass, m->M.values);
        diagonal = phys_mass_is_diagonal(&m->M);
    }
    free(x);
    return diagonal;
}

void phys_motion_solve_constant(const phys_motion *motion, double *b)
{
    phys_mass_solve(&motion->M, b);
}

bool phys_motion_is_singular(const phys_motion *motion)
{
    return motion->M.condition > PHYS_MASS_SINGULAR;
}
