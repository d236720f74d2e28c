/* The pattern of the second derivatives of L (coupling.h). */
#include "coupling.h"

bool phys_coupling_new(struct phys_pattern *coupling, const struct phys_system *system, bool masses,
                       size_t few)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    ad_jacobian *hessian = NULL;
    if (tape && system->dof > few) {
        ad_var q = ad_input(tape, system->dof, 1, "q"), v = ad_input(tape, system->dof, 1, "v");
        ad_var L = phys_system_lagrangian(system, q, v, ad_input(tape, 1, 1, "t"));
        ad_hessian_new(L, masses ? 1 : 2, (ad_var[]){v, q}, &hessian);
    }
    ad_tape_free(tape);
    bool done = phys_pattern_new(coupling, system->dof, ad_jacobian_matrix(hessian));
    ad_jacobian_free(hessian);
    return done;
}
