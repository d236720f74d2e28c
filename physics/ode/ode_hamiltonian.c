/* Hamilton's equations q' = H_p, p' = -H_q + Q of a callback H, in y = (q, p), by the tape. */
#include "autodiff/free.h"
#include "internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct context {
    size_t dof;
    const struct phys_system *system; /* whose H it is, or NULL */
    phys_legendre *legendre;          /* of its L, NULL until velocities are given */
    double *room;                     /* [3 dof], the same */
    ad_tape *tape;
    ad_var q, p, t, H;      /* inputs [dof x 1] each, t a scalar */
    ad_var velocity, force; /* H_p, -H_q + Q [dof x 1] */
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

/* Of a scene's H, whether its rates at y are v and `force`, those of L. */
static enum ad_status compare(struct context *c, double t, const double *y, const double *v,
                              const double *force, struct ad_error *error)
{
    const double allowed = 1e-6;
    double *rate = c->room + c->dof, size[2] = {0};
    if (field(c, t, y, rate, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < c->dof; k++) {
        size[0] = fmax(size[0], fabs(v[k]));
        size[1] = fmax(size[1], fabs(force[k]));
    }
    for (size_t k = 0; k < 2 * c->dof; k++) {
        const bool second = k >= c->dof;
        const double of_L = second ? force[k - c->dof] : v[k];
        if (!(fabs(rate[k] - of_L) <= allowed * (1 + size[second])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "%s: H is not that of L: at coordinate %zu, t = %g, the %s is %g by H "
                           "and %g by L",
                           c->system->scene->name, k % c->dof + 1, t, second ? "force" : "velocity",
                           rate[k], of_L);
    }
    return AD_OK;
}

static enum ad_status enter(void *context, double t, const double *q, const double *v, double *y,
                            struct ad_error *error)
{
    struct context *c = context;
    if (!c->legendre && phys_legendre_new(c->system, &c->legendre, error) != AD_OK)
        return error->status;
    if (!c->room && !(c->room = malloc(3 * c->dof * sizeof *c->room)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(y, q, c->dof * sizeof *y);
    phys_legendre_momentum(c->legendre, q, v, t, y + c->dof, c->room);
    if (check(c, t, c->dof, y + c->dof, "momentum", error) != AD_OK)
        return error->status;
    return compare(c, t, y, v, c->room, error);
}

static enum ad_status leave(void *context, double t, const double *y, double *q, double *v,
                            struct ad_error *error)
{
    const struct context *c = context;
    memcpy(q, y, c->dof * sizeof *q);
    set(c, c->for_velocity, t, y, y + c->dof);
    ad_get(c->for_velocity, c->velocity, v);
    return check(c, t, c->dof, v, "velocity", error);
}

static void component(const void *context, size_t k, char *name, size_t size)
{
    const struct context *c = context;
    if (c->system)
        phys_state_name(c->system, k, "momentum", name, size);
    else
        snprintf(name, size, "%c%zu", k < c->dof ? 'q' : 'p', k % c->dof + 1);
}

static void release(void *context)
{
    struct context *c = context;
    ad_program_free(c->both);
    ad_program_free(c->for_velocity);
    ad_program_free(c->for_force);
    ad_program_free(c->for_energy);
    phys_legendre_free(c->legendre);
    ad_tape_free(c->tape);
    AD_FREE(c->room, c);
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
    c->H = c->system ? phys_system_hamiltonian(c->system, c->q, c->p, c->t)
                     : H(c->q, c->p, c->t, params);
    if (phys_tape_status(c->tape, error) != AD_OK)
        return error->status;
    if (c->H.tape != c->tape || ad_rows(c->H) != 1 || ad_cols(c->H) != 1)
        return ad_fail(error, AD_E_SHAPE, "the Hamiltonian is not one row of values on q's tape");
    if (ad_grad(c->H, 2, (ad_var[]){c->q, c->p}, g) == AD_OK) {
        c->velocity = ad_label(ad_mul(1.0, g[1]), "velocity");
        c->force = ad_neg(g[0]);
        if (c->system)
            c->force = phys_system_add_forces(c->system, c->force, c->q, c->velocity, c->t);
        c->force = ad_label(c->force, "force");
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

/* Of a system's H, or of the callback's. */
static enum ad_status make(const struct phys_system *system, phys_hamiltonian *H, size_t dof,
                           const void *params, struct phys_ode *ode, struct ad_error *error)
{
    struct context *c = calloc(1, sizeof *c);
    *ode = (struct phys_ode){.context = c, .free = c ? release : NULL};
    if (!c || !(c->tape = ad_tape_new(AD_F64)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    c->dof = dof;
    c->system = system;
    if (record(c, H, params, error) != AD_OK)
        return error->status;
    ode->n = 2 * dof;
    ode->field = field;
    if (phys_is_independent(c->tape, c->force, 1, &c->p, error) &&
        phys_is_independent(c->tape, c->velocity, 2, (ad_var[]){c->q, c->t}, error)) {
        ode->kick = kick;
        ode->drift = drift;
    }
    ode->canonical = !phys_system_has_forces(system);
    ode->energy = energy;
    ode->component = component;
    ode->interpreted = interpreted;
    return error->status;
}

enum ad_status phys_ode_hamiltonian(phys_hamiltonian *H, size_t dof, const void *params,
                                    struct phys_ode *ode, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, H))
        return error->status;
    return make(NULL, H, dof, params, ode, error);
}

enum ad_status phys_ode_scene_hamiltonian(const struct phys_system *system, struct phys_ode *ode,
                                          struct ad_error *error)
{
    if (make(system, NULL, system->dof, NULL, ode, error) != AD_OK)
        return error->status;
    ode->name = system->scene->name;
    ode->enter = enter;
    ode->leave = leave;
    ode->system = system;
    return AD_OK;
}
