/* The discretised action on a tape: S = dt sum w L(q, v, t) over the points of a rule, and the
   means that the paper prints (Greydanus et al., arXiv 2303.02115, table 2). */
#include "internal.h"

/* Sum over the points of a rule, weighted; over elements it is a mean. */
static ad_var weighted(const struct phys_action *action, ad_var x)
{
    ad_var w = action->points.weight;
    return ad_cols(w) == 1 ? ad_sum(x) : ad_dot(w, x);
}

/* weight * mean over the points of (E0 - E_i)^2, with the published scale of E (physics.h). */
static ad_var energy_penalty(struct phys_action *action, double weight)
{
    ad_var squares = ad_square(ad_sub(action->start_energy, action->energy));
    return ad_mul(weight / (double)action->points.elements, weighted(action, squares));
}

void phys_action_hold_energy(struct phys_action *action, double weight)
{
    if (!action || action->points.elements < 2)
        return;
    size_t n = action->points.elements, runs = ad_cols(action->energy) / n;
    double share = weight / (double)(runs * (n - 1));
    for (size_t j = 0; j < runs; j++) {
        ad_var change = ad_diff(ad_slice_cols(action->energy, j * n, n), 1, false);
        action->objective = ad_add(action->objective, ad_mul(share, ad_sum(ad_square(change))));
    }
    ad_label(action->objective, "objective");
}

/* v L_v - L at the points, which is conserved for any L without explicit time; T + V is that only
   where T is quadratic in the velocities and V does not depend on them. */
static ad_var record_energy(const struct phys_rule_points *at, ad_var L)
{
    ad_var momentum;
    if (ad_grad(L, 1, &at->v, &momentum) != AD_OK)
        momentum = at->v; /* the tape keeps its error: whatever is recorded now passes through */
    return ad_sub(ad_sum_rows(ad_mul(momentum, at->v)), L);
}

enum ad_status phys_action_record(ad_tape *tape, const struct phys_system *system,
                                  const struct phys_rule *rule, size_t slices, double dt,
                                  double energy_weight, struct phys_action *action)
{
    struct ad_error none = {0};
    if (AD_LACKS(&none, action))
        return ad_refuse(tape, none.status, "%s", none.message), none.status;
    if (AD_LACKS(&none, system, system->scene, rule)) {
        *action = (struct phys_action){0};
        ad_refuse(tape, none.status, "%s", none.message);
        return none.status;
    }
    if (phys_refuse_forces(system, "paths", &none) != AD_OK) {
        *action = (struct phys_action){0};
        ad_refuse(tape, none.status, "%s", none.message);
        return none.status;
    }
    double bodies = system->scene->per_body ? (double)system->bodies : 1;
    double share = 1 / ((double)slices * bodies); /* of one slice and body in a mean */
    ad_var kinetic, potential;
    struct phys_rule_points *at = &action->points;

    action->path = ad_input(tape, rule->degree * system->dof, slices, "path");
    phys_rule_points(rule, action->path, dt, at);
    ad_label(at->v, "velocity");
    ad_var L = phys_system_energies(system, at->q, at->v, at->t, &kinetic, &potential);
    action->L = ad_label(L, "L");
    ad_label(kinetic, "kinetic energy");
    ad_label(potential, "potential energy");
    ad_var sum = weighted(action, L);

    action->kinetic_mean = ad_mul(share, weighted(action, kinetic));
    action->potential_mean = ad_mul(share, weighted(action, potential));
    action->action_mean = ad_mul(share, sum);
    action->action = ad_mul(dt, sum);
    action->start_energy = ad_input(tape, 1, 1, "energy of the start");
    ad_var energy = ad_label(record_energy(at, L), "energy");
    action->energy = ad_mul(share, energy);
    action->energy_mean = ad_mul(1 / (double)at->elements, weighted(action, energy));
    action->first_energy = ad_col(action->energy, 0);
    action->objective = action->action_mean;
    if (energy_weight != 0)
        action->objective = ad_add(action->objective, energy_penalty(action, energy_weight));
    ad_label(action->objective, "objective");
    return ad_tape_error(tape)->status;
}
