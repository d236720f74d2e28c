/* Potential and mass of L = m v^2/2 - V(q), derived from the Lagrangian, for methods that start
   from Schroedinger's equation. */
#include "internal.h"

#include <math.h>
#include <stdlib.h>

/* L, L_v and L_vv at all places, first with velocity 0, then with another one: [2 n] each. */
struct look {
    size_t n;
    double *q, *v, *L, *p, *m;
};

static enum ad_status evaluate(const struct phys_system *system, struct look *at,
                               struct ad_error *error)
{
    size_t n = 2 * at->n;
    ad_program *program = NULL;
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    ad_var q = ad_input(tape, 1, n, "q"), v = ad_input(tape, 1, n, "v"), p, m;
    ad_var L = phys_system_lagrangian(system, q, v, ad_broadcast(ad_scalar(tape, 0), 1, n));
    if (ad_grad(L, 1, &v, &p) == AD_OK && ad_grad(p, 1, &v, &m) == AD_OK) {
        ad_var out[] = {L, p, ad_broadcast(m, 1, n)};
        ad_compile(tape, 3, out, &program);
        if (program) {
            ad_set(program, q, at->q);
            ad_set(program, v, at->v);
            if (ad_run_checked(program, error) == AD_OK) {
                ad_get(program, out[0], at->L);
                ad_get(program, out[1], at->p);
                ad_get(program, out[2], at->m);
            }
        }
    }
    phys_tape_status(tape, error);
    ad_program_free(program);
    ad_tape_free(tape);
    return error->status;
}

static bool separates(const struct look *at)
{
    double mass = at->m[0];
    for (size_t k = 0; k < 2 * at->n; k++)
        if (!(mass > 0) || fabs(at->m[k] - mass) > 1e-12 * mass ||
            fabs(at->p[k] - mass * at->v[k]) > 1e-12 * mass)
            return false;
    return true;
}

/* On the grid with one velocity, then with another. Free at.q. */
static enum ad_status look_at(const struct phys_system *system, const struct qm_grid *grid,
                              double first, double second, struct look *at, struct ad_error *error)
{
    size_t n = grid->n;
    *at = (struct look){.n = n, .q = malloc(10 * n * sizeof *at->q)};
    if (!at->q)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", n);
    at->v = at->q + 2 * n;
    at->L = at->v + 2 * n;
    at->p = at->L + 2 * n;
    at->m = at->p + 2 * n;
    for (size_t k = 0; k < 2 * n; k++) {
        at->q[k] = qm_x(grid, k % n);
        at->v[k] = k < n ? first : second;
    }
    return evaluate(system, at, error);
}

enum ad_status qm_check_mirror(const struct qm_slice *slice, struct ad_error *error)
{
    struct look at;
    double speed = qm_dx(&slice->grid) / slice->dt, most = 0, odd = 0;
    if (look_at(slice->system, &slice->grid, speed, -speed, &at, error) == AD_OK)
        for (size_t k = 0; k < at.n; k++) {
            most = fmax(most, fabs(at.L[k]));
            odd = fmax(odd, fabs(at.L[k] - at.L[at.n + k]));
        }
    if (odd > 1e-11 * most)
        ad_fail(error, AD_E_ARGUMENT,
                "walls: L of %s changes with the sign of v, and mirrored paths have another "
                "action; expected open walls or a ring",
                slice->system->scene->name);
    free(at.q);
    return error->status;
}

enum ad_status qm_potential(const struct phys_system *system, const struct qm_grid *grid, double *V,
                            double *mass, struct ad_error *error)
{
    if (AD_LACKS(error, system, system->scene, grid, grid->n, V, mass))
        return error->status;
    if (system->dof != 1)
        return ad_fail(error, AD_E_ARGUMENT, "%s has %zu coordinates; expected a scene of one",
                       system->scene->name, system->dof);
    size_t n = grid->n;
    struct look at;
    if (look_at(system, grid, 0, 1, &at, error) == AD_OK && !separates(&at))
        ad_fail(error, AD_E_ARGUMENT,
                "L of %s is not m v^2/2 - V(q) with a constant mass; expected method kernel",
                system->scene->name);
    if (!at.q)
        return error->status;
    *mass = at.m[0];
    for (size_t a = 0; a < n; a++)
        V[a] = -at.L[a];
    free(at.q);
    return error->status;
}
