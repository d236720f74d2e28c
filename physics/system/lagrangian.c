/* L and the energies of a system on a tape, from the callbacks that its scene has. */
#include "internal.h"

/* What a callback records, with its parameters. */
static ad_var call(const struct phys_system *system, phys_lagrangian *callback, ad_var q, ad_var v,
                   ad_var t)
{
    phys_recording_begin(system, q.tape);
    ad_var y = callback(q, v, t, system->params);
    phys_recording_end();
    return y;
}

/* So many values a slice, or a refusal that names the callback's mistake. */
static ad_var of_shape(const struct phys_system *system, const char *what, size_t rows, ad_var q,
                       ad_var y)
{
    if (!y.tape || y.tape != q.tape)
        return ad_refuse(q.tape, AD_E_TAPE, "%s: the %s is not on the tape of q",
                         system->scene->name, what);
    if (ad_tape_error(q.tape)->status == AD_OK && (ad_rows(y) != rows || ad_cols(y) != ad_cols(q)))
        return ad_refuse(q.tape, AD_E_SHAPE, "%s: the %s is %zu x %zu, expected %zu x %zu",
                         system->scene->name, what, ad_rows(y), ad_cols(y), rows, ad_cols(q));
    return y;
}

static ad_var checked(const struct phys_system *system, const char *what, ad_var q, ad_var y)
{
    return of_shape(system, what, 1, q, y);
}

static bool lacks_scene(const struct phys_system *system, ad_var q)
{
    struct ad_error error = {0};
    if (AD_LACKS(&error, system, system->scene))
        ad_refuse(q.tape, error.status, "%s", error.message);
    return error.status != AD_OK;
}

ad_var phys_system_lagrangian(const struct phys_system *system, ad_var q, ad_var v, ad_var t)
{
    if (lacks_scene(system, q))
        return q;
    const struct phys_scene *scene = system->scene;
    if (scene->lagrangian)
        return checked(system, "Lagrangian", q, call(system, scene->lagrangian, q, v, t));
    return ad_sub(checked(system, "kinetic energy", q, call(system, scene->kinetic, q, v, t)),
                  checked(system, "potential energy", q, call(system, scene->potential, q, v, t)));
}

ad_var phys_system_hamiltonian(const struct phys_system *system, ad_var q, ad_var p, ad_var t)
{
    if (lacks_scene(system, q))
        return q;
    return checked(system, "Hamiltonian", q, call(system, system->scene->hamiltonian, q, p, t));
}

ad_var phys_system_energies(const struct phys_system *system, ad_var q, ad_var v, ad_var t,
                            ad_var *kinetic, ad_var *potential)
{
    if (!kinetic || !potential)
        return q;
    *kinetic = *potential = q;
    if (lacks_scene(system, q))
        return q;
    const struct phys_scene *scene = system->scene;
    if (scene->kinetic && scene->potential) {
        *kinetic = checked(system, "kinetic energy", q, call(system, scene->kinetic, q, v, t));
        *potential =
            checked(system, "potential energy", q, call(system, scene->potential, q, v, t));
        return scene->lagrangian ? phys_system_lagrangian(system, q, v, t)
                                 : ad_sub(*kinetic, *potential);
    }
    ad_var L = phys_system_lagrangian(system, q, v, t), momentum;
    if (ad_grad(L, 1, &v, &momentum) != AD_OK)
        momentum = v; /* the tape keeps its error: whatever is recorded now passes through */
    ad_var energy = ad_sub(ad_sum_rows(ad_mul(momentum, v)), L);
    *kinetic = ad_mul(0.5, ad_add(energy, L));
    *potential = ad_mul(0.5, ad_sub(energy, L));
    return L;
}

bool phys_system_has_forces(const struct phys_system *system)
{
    return system && system->scene && (system->scene->dissipation || system->scene->forces);
}

ad_var phys_system_add_forces(const struct phys_system *system, ad_var force, ad_var q, ad_var v,
                              ad_var t)
{
    if (lacks_scene(system, q))
        return q;
    const struct phys_scene *scene = system->scene;
    if (scene->forces)
        force = ad_add(
            force, of_shape(system, "force", system->dof, q, call(system, scene->forces, q, v, t)));
    if (scene->dissipation) {
        ad_var D = checked(system, "dissipation", q, call(system, scene->dissipation, q, v, t)), by;
        if (ad_grad(ad_sum(D), 1, &v, &by) == AD_OK)
            force = ad_sub(force, by);
    }
    return force;
}

ad_var phys_system_constraint(const struct phys_system *system, ad_var q, ad_var t)
{
    if (lacks_scene(system, q) || !system->scene->constraint)
        return q;
    phys_recording_begin(system, q.tape);
    ad_var g = system->scene->constraint(q, t, system->params);
    phys_recording_end();
    return of_shape(system, "constraint", system->scene->n_constraints, q, g);
}

ad_var phys_system_observable(const struct phys_system *system, size_t k, ad_var q, ad_var v,
                              ad_var t)
{
    if (lacks_scene(system, q) || k >= system->scene->n_observables)
        return q;
    const struct phys_observable *o = &system->scene->observables[k];
    return checked(system, o->name, q, call(system, o->value, q, v, t));
}

enum ad_status phys_refuse_constraints(const struct phys_system *system, const char *what,
                                       struct ad_error *error)
{
    return system && system->scene && system->scene->constraint
               ? ad_fail(error, AD_E_ARGUMENT,
                         "%s has constraints, of which %s know nothing; try simulate",
                         system->scene->name, what)
               : AD_OK;
}

enum ad_status phys_refuse_forces(const struct phys_system *system, const char *what,
                                  struct ad_error *error)
{
    return phys_system_has_forces(system)
               ? ad_fail(error, AD_E_ARGUMENT,
                         "%s has forces that are not in L (dissipation, forces); %s are of L "
                         "alone; try simulate",
                         system->scene->name, what)
               : AD_OK;
}
