/* The discretised action on a tape: S = dt sum L(q_i, v_i, t_i) over the points of a rule, and the
   means that the paper prints (Greydanus et al., arXiv 2303.02115, table 2). */
#include "internal.h"

/* weight * mean over slices of (E0 - E_i)^2, with the published scale of E (physics.h). */
static ad_var energy_penalty(struct phys_action *action, ad_var energy, double share, double weight)
{
    ad_var change = ad_sub(action->start_energy, ad_mul(share, energy));
    return ad_mul(weight, ad_mean(ad_square(change)));
}

enum ad_status phys_action_record(ad_tape *tape, const struct phys_system *system,
                                  const struct phys_rule *rule, size_t slices, double dt,
                                  double energy_weight, struct phys_action *action)
{
    double bodies = system->scene->per_body ? (double)system->bodies : 1;
    double share = 1 / ((double)slices * bodies); /* of one slice and body in a mean */
    ad_var q, v, t, kinetic, potential;

    action->path = ad_input(tape, system->dof, slices, "path");
    rule->points(action->path, dt, &q, &v, &t);
    ad_label(v, "velocity");
    ad_var L = ad_label(phys_system_lagrangian(system, q, v, t), "L");
    phys_system_energies(system, q, v, t, &kinetic, &potential);
    ad_label(kinetic, "kinetic energy");
    ad_label(potential, "potential energy");
    ad_var energy = ad_add(kinetic, potential), sum = ad_sum(L);

    action->kinetic_mean = ad_mul(share, ad_sum(kinetic));
    action->potential_mean = ad_mul(share, ad_sum(potential));
    action->action_mean = ad_mul(share, sum);
    action->action = ad_mul(dt, sum);
    action->start_energy = ad_input(tape, 1, 1, "energy of the start");
    action->first_energy = ad_mul(share, ad_col(energy, 0));
    action->objective = action->action_mean;
    if (energy_weight != 0)
        action->objective =
            ad_add(action->objective, energy_penalty(action, energy, share, energy_weight));
    ad_label(action->objective, "objective");
    return ad_tape_error(tape)->status;
}
