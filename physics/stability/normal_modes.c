/* Frequencies of small oscillations about a point, from the second derivatives of L on the tape. */
#include "stability.h"
#include "physics/ode/internal.h"
#include "physics/linear/linear.h"

#include <math.h>
#include <stdlib.h>

struct matrices {
    const struct phys_system *system;
    ad_tape *tape;
    ad_var q, v, t, w;      /* inputs: [dof x 1] each, t a scalar */
    ad_var stiffness, mass; /* -L_qq w [dof x 1]; L_vv [dof x dof] */
    ad_program *for_stiffness, *for_mass;
    double *K, *M, *values, *unit; /* [dof x dof] twice, [dof] twice */
};

static void record(struct matrices *m)
{
    size_t n = m->system->dof;
    ad_var by[2], by_q_again;
    m->q = ad_input(m->tape, n, 1, "q");
    m->v = ad_input(m->tape, n, 1, "v");
    m->t = ad_input(m->tape, 1, 1, "t");
    m->w = ad_input(m->tape, n, 1, "direction");
    ad_var L = phys_system_lagrangian(m->system, m->q, m->v, m->t);
    if (ad_grad(L, 2, (ad_var[]){m->q, m->v}, by) != AD_OK ||
        ad_grad(ad_dot(phys_system_add_forces(m->system, by[0], m->q, m->v, m->t), m->w), 1, &m->q,
                &by_q_again) != AD_OK)
        return;
    m->stiffness = ad_label(ad_neg(by_q_again), "stiffness");
    m->mass = phys_record_mass(m->system, m->q, m->v, m->t, by[1]);
    ad_compile(m->tape, 1, &m->stiffness, &m->for_stiffness);
    ad_compile(m->tape, 1, &m->mass, &m->for_mass);
}

static enum ad_status begin(struct matrices *m, const struct phys_system *system,
                            struct ad_error *error)
{
    size_t n = system->dof;
    *m = (struct matrices){.system = system};
    if (n > PHYS_NORMAL_MODES_DOF)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: frequencies of %zu coordinates, expected at most %d",
                       system->scene->name, n, PHYS_NORMAL_MODES_DOF);
    m->tape = ad_tape_new(AD_F64);
    m->K = calloc(2 * n * n + 2 * n, sizeof *m->K);
    if (!m->tape || !m->K)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", n);
    m->M = m->K + n * n;
    m->values = m->M + n * n;
    m->unit = m->values + n;
    record(m);
    return phys_tape_status(m->tape, error);
}

static void release(struct matrices *m)
{
    ad_program_free(m->for_stiffness);
    ad_program_free(m->for_mass);
    ad_tape_free(m->tape);
    free(m->K);
}

static void set_place(const struct matrices *m, ad_program *program, const double *x, double t)
{
    ad_set(program, m->q, x);
    ad_set(program, m->v, x + m->system->dof);
    ad_set(program, m->t, &t);
}

/* K by columns, which are its rows, and M. */
static enum ad_status evaluate(struct matrices *m, const double *x, double t,
                               struct ad_error *error)
{
    size_t n = m->system->dof;
    set_place(m, m->for_mass, x, t);
    ad_run(m->for_mass);
    ad_get(m->for_mass, m->mass, m->M);
    set_place(m, m->for_stiffness, x, t);
    for (size_t k = 0; k < n; k++) {
        m->unit[k] = 1;
        ad_set(m->for_stiffness, m->w, m->unit);
        ad_run(m->for_stiffness);
        ad_get(m->for_stiffness, m->stiffness, m->K + k * n);
        m->unit[k] = 0;
    }
    for (size_t i = 0; i < n * n; i++)
        if (!isfinite(m->K[i]) || !isfinite(m->M[i])) {
            char name[64];
            phys_coordinate_name(m->system, i / n, name, sizeof name);
            return ad_fail(
                error, AD_E_NONFINITE,
                "%s: the second derivatives of L are not finite at coordinate %s, t = %g",
                m->system->scene->name, name, t);
        }
    return AD_OK;
}

static size_t largest(size_t n, const double *x)
{
    size_t most = 0;
    for (size_t k = 1; k < n; k++)
        if (fabs(x[k]) > fabs(x[most]))
            most = k;
    return most;
}

/* The eigenvalues of M^-1 K are squares of frequencies, or, negative, of rates of growth. */
static enum ad_status compare(struct matrices *m, double t, struct phys_normal_modes *motion,
                              struct ad_error *error)
{
    size_t n = m->system->dof;
    int info = phys_lapack_eigenvectors(n, m->K, m->M, m->values);
    if (info > (int)n)
        return ad_fail(error, AD_E_ARGUMENT, "%s: the mass matrix is not positive",
                       m->system->scene->name);
    if (info != 0)
        return ad_fail(error, AD_E_ACCURACY, "%s: the eigenvalues of M^-1 K do not converge",
                       m->system->scene->name);
    double frequency = sqrt(fmax(m->values[n - 1], 0));
    motion->growth = fmax(motion->growth, sqrt(fmax(-m->values[0], 0)));
    if (frequency > motion->frequency) {
        motion->frequency = frequency;
        motion->t = t;
        motion->coordinate = largest(n, m->K + (n - 1) * n);
    }
    return AD_OK;
}

enum ad_status phys_normal_modes(const struct phys_system *system, size_t n, const double *x,
                                 const double *t, struct phys_normal_modes *motion,
                                 struct ad_error *error)
{
    struct matrices m;
    if (AD_LACKS_RESULT(error, motion) || AD_LACKS(error, system, system->scene) ||
        (n > 0 && AD_LACKS(error, x, t)) ||
        phys_refuse_constraints(system, "modes", error) != AD_OK)
        return error->status;
    begin(&m, system, error);
    for (size_t i = 0; i < n && error->status == AD_OK; i++)
        if (evaluate(&m, x + 2 * i * system->dof, t[i], error) == AD_OK)
            compare(&m, t[i], motion, error);
    release(&m);
    return error->status;
}
