/* Checks that kinetic and potential energy of a scene are those of its Lagrangian: V does not
   depend on the velocities, T - V is L, and T + V is the energy v L_v - L. */
#include "internal.h"
#include "autodiff/sized.h"

#include <math.h>

static const double rounding = 1e-9; /* of the largest of T and V */

/* Records T and V, V_v, and the expressions that must vanish: T - V - L and T + V - (v L_v - L). */
struct energies {
    ad_var kinetic, potential, force, difference, sum;
};

static enum ad_status record(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                             struct energies *e, struct ad_error *error)
{
    ad_var momentum, L = phys_system_energies(system, q, v, t, &e->kinetic, &e->potential);
    if (ad_grad(L, 1, &v, &momentum) == AD_OK && ad_grad(e->potential, 1, &v, &e->force) == AD_OK) {
        ad_var energy = ad_sub(ad_sum_rows(ad_mul(momentum, v)), L);
        e->difference = ad_sub(ad_sub(e->kinetic, e->potential), L);
        e->sum = ad_sub(ad_add(e->kinetic, e->potential), energy);
    }
    return phys_tape_status(v.tape, error);
}

/* The largest of the absolute values of x, and where it is. */
static double largest(ad_program *program, ad_var x, size_t *at)
{
    const double *y = ad_data(program, x);
    double most = 0;
    *at = 0;
    for (size_t k = 0; k < ad_rows(x) * ad_cols(x); k++)
        if (!(fabs(y[k]) <= most)) { /* NaN, too */
            most = fabs(y[k]);
            *at = k;
        }
    return most;
}

static enum ad_status judge(const struct phys_system *system, ad_program *program, size_t n,
                            const struct energies *e, struct ad_error *error)
{
    size_t at;
    char name[32];
    double size = fmax(largest(program, e->kinetic, &at), largest(program, e->potential, &at));
    double off = largest(program, e->force, &at);
    if (off != 0) {
        phys_coordinate_name(system, at / n, name, sizeof name);
        return ad_fail(error, AD_E_ARGUMENT,
                       "potential: its derivative by v %s is %.3g at slice %zu, expected 0; give "
                       "lagrangian alone, as T + V is not the energy v L_v - L",
                       name, off, at % n);
    }
    if (!((off = largest(program, e->difference, &at)) <= rounding * size))
        return ad_fail(error, AD_E_ARGUMENT,
                       "kinetic - potential: differs from lagrangian by %.3g at slice %zu", off,
                       at);
    if (!((off = largest(program, e->sum, &at)) <= rounding * size))
        return ad_fail(error, AD_E_ARGUMENT,
                       "kinetic + potential: differs from the energy v L_v - L by %.3g at slice "
                       "%zu; expected a kinetic energy that is quadratic in v, or lagrangian alone",
                       off, at);
    return AD_OK;
}

enum ad_status phys_check_energies(const struct phys_system *system, const struct phys_points *at,
                                   struct ad_error *error)
{
    struct energies e = {0};
    ad_program *program = NULL;
    if (AD_LACKS(error, system, system->scene, at))
        return error->status;
    AD_OWN(phys_points, at, t, error);
    if (!system->scene->kinetic || !system->scene->potential)
        return AD_OK;
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_var q = ad_input(tape, system->dof, at->n, "q"), v = ad_input(tape, system->dof, at->n, "v");
    ad_var t = ad_input(tape, 1, at->n, "t");
    if (record(system, q, v, t, &e, error) == AD_OK) {
        ad_var out[] = {e.kinetic, e.potential, e.force, e.difference, e.sum};
        if (ad_compile(tape, LENGTH(out), out, &program) == AD_OK) {
            ad_set(program, q, at->q);
            ad_set(program, v, at->v);
            ad_set(program, t, at->t);
            ad_run(program);
            judge(system, program, at->n, &e, error);
        } else {
            phys_tape_status(tape, error);
        }
    }
    ad_program_free(program);
    ad_tape_free(tape);
    return error->status;
}
