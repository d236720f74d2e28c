/* Whether a Lagrangian keeps its energy, from its derivative by the time. */
#include "physics/stability/stability.h"
#include "physics/internal.h"

bool phys_keeps_energy(const struct phys_system *system)
{
    ad_tape *tape = ad_tape_new(AD_F64);
    if (!tape)
        return false;
    ad_var q = ad_input(tape, system->dof, 1, "q"), v = ad_input(tape, system->dof, 1, "v");
    ad_var t = ad_input(tape, 1, 1, "t");
    bool keeps = phys_is_independent(tape, phys_system_lagrangian(system, q, v, t), 1, &t);
    ad_tape_free(tape);
    return keeps;
}
