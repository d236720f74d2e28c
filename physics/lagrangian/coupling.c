/* Patterns of derivatives of L (coupling.h). */
#include "coupling.h"

/* The Jacobian by (q, v) of all that rates are made of: L_v, and L_q with the forces beside L. */
static void by_rates(const struct phys_system *system, ad_var L, const ad_var x[3],
                     ad_jacobian **jacobian)
{
    ad_var g[2];
    if (ad_grad(L, 2, (ad_var[]){x[1], x[0]}, g) != AD_OK)
        return;
    g[0] = phys_system_add_forces(system, g[0], x[1], x[0], x[2]);
    ad_jacobian_new(ad_concat_rows(2, g), 2, x, jacobian);
}

bool phys_coupling_new(struct phys_pattern *coupling, const struct phys_system *system,
                       enum phys_coupling_by by, size_t few)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_jacobian *found = NULL;
    if (tape && system->dof > few) {
        const size_t n = system->dof;
        const ad_var x[3] = {ad_input(tape, n, 1, "v"), ad_input(tape, n, 1, "q"),
                             ad_input(tape, 1, 1, "t")};
        ad_var L = phys_system_lagrangian(system, x[1], x[0], x[2]);
        if (by == PHYS_COUPLING_RATES)
            by_rates(system, L, x, &found);
        else
            ad_hessian_new(L, by == PHYS_COUPLING_MASSES ? 1 : 2, x, &found);
    }
    ad_tape_free(tape);
    bool done = phys_pattern_new(coupling, system->dof, ad_jacobian_matrix(found));
    ad_jacobian_free(found);
    return done;
}
