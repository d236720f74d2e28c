/* Hamilton's equations q' = H_p, p' = -H_q of a callback H, in y = (q, p), by the tape. */
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct context {
    size_t dof;
    ad_tape *tape;
    ad_var q, p, t, H;      /* inputs [dof x 1] each, t a scalar */
    ad_var velocity, force; /* H_p, -H_q [dof x 1] */
    ad_program *both, *for_velocity, *for_force, *for_energy;
};

static void set(const struct context *c, ad_program *program, double t, const double *q,
                const double *p)
{
    if (q)
        ad_set(program, c->q, q);
    if (p)
        ad_set(program, c->p, p);
    ad_set(program, c->t, &t);
    ad_run(program);
}

static enum ad_status check(const struct context *c, double t, size_t n, const double *rate,
                            const char *what, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++)
        if (!isfinite(rate[k]))
            return ad_fail(error, AD_E_NONFINITE, "the %s is not finite at coordinate %zu, t = %g",
                           k < c->dof ? what : "force", k % c->dof + 1, t);
    return AD_OK;
}

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const struct context *c = context;
    set(c, c->both, t, y, y + c->dof);
    ad_get(c->both, c->velocity, rate);
    ad_get(c->both, c->force, rate + c->dof);
    return check(c, t, 2 * c->dof, rate, "velocity", error);
}

static enum ad_status kick(void *context, double t, const double *q, double *rate,
                           struct ad_error *error)
{
    const struct context *c = context;
    set(c, c->for_force, t, q, NULL);
    ad_get(c->for_force, c->force, rate);
    return check(c, t, c->dof, rate, "force", error);
}

static enum ad_status drift(void *context, double t, const double *p, double *rate,
                            struct ad_error *error)
{
    const struct context *c = context;
    set(c, c->for_velocity, t, NULL, p);
    ad_get(c->for_velocity, c->velocity, rate);
    return check(c, t, c->dof, rate, "velocity", error);
}

static double energy(void *context, double t, const double *y)
{
    const struct context *c = context;
    double H;
    set(c, c->for_energy, t, y, y + c->dof);
    ad_get(c->for_energy, c->H, &H);
    return H;
}

static void component(const void *context, size_t k, char *name, size_t size)
{
    const struct context *c = context;
    snprintf(name, size, "%c%zu", k < c->dof ? 'q' : 'p', k % c->dof + 1);
}

static void release(void *context)
{
    struct context *c = context;
    ad_program_free(c->both);
    ad_program_free(c->for_velocity);
    ad_program_free(c->for_force);
    ad_program_free(c->for_energy);
    ad_tape_free(c->tape);
    free(c);
}

static const char *interpreted(const void *context)
{
    const struct context *c = context;
    return ad_native_note(c->both);
}

static enum ad_status record(struct context *c, phys_hamiltonian *H, const void *params,
                             struct ad_error *error)
{
    ad_var g[2];
    c->q = ad_input(c->tape, c->dof, 1, "q");
    c->p = ad_input(c->tape, c->dof, 1, "p");
    c->t = ad_input(c->tape, 1, 1, "t");
    c->H = H(c->q, c->p, c->t, params);
    if (phys_tape_status(c->tape, error) != AD_OK)
        return error->status;
    if (c->H.tape != c->tape || ad_rows(c->H) != 1 || ad_cols(c->H) != 1)
        return ad_fail(error, AD_E_SHAPE, "the Hamiltonian is not one row of values on q's tape");
    if (ad_grad(c->H, 2, (ad_var[]){c->q, c->p}, g) == AD_OK) {
        c->velocity = ad_label(ad_mul(1.0, g[1]), "velocity");
        c->force = ad_label(ad_neg(g[0]), "force");
        ad_compile(c->tape, 2, (ad_var[]){c->velocity, c->force}, &c->both);
        ad_compile(c->tape, 1, &c->velocity, &c->for_velocity);
        ad_compile(c->tape, 1, &c->force, &c->for_force);
        ad_compile(c->tape, 1, &c->H, &c->for_energy);
    }
    if (phys_tape_status(c->tape, error) == AD_OK) {
        ad_native_lazy(c->both);
        ad_native_lazy(c->for_velocity);
        ad_native_lazy(c->for_force);
    }
    return error->status;
}

enum ad_status phys_ode_hamiltonian(phys_hamiltonian *H, size_t dof, const void *params,
                                    struct phys_ode *ode, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, H))
        return error->status;
    struct context *c = calloc(1, sizeof *c);
    *ode = (struct phys_ode){.context = c, .free = c ? release : NULL};
    if (!c || !(c->tape = ad_tape_new(AD_F64)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    c->dof = dof;
    if (record(c, H, params, error) != AD_OK)
        return error->status;
    ode->n = 2 * dof;
    ode->field = field;
    if (phys_is_independent(c->tape, c->force, 1, &c->p, error) &&
        phys_is_independent(c->tape, c->velocity, 2, (ad_var[]){c->q, c->t}, error)) {
        ode->kick = kick;
        ode->drift = drift;
    }
    ode->canonical = true;
    ode->energy = energy;
    ode->component = component;
    ode->interpreted = interpreted;
    return error->status;
}
