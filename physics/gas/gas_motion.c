/* The equations of motion of a gas of many bodies in y = (q, v). Accelerations come from a list of
   the pairs that can come nearer than the cutoff before any body has moved by half the skin; then
   the list is made anew (cell_list.h) and the program recorded again. Without a cutoff, or with few
   bodies, it is recorded once over all pairs. */
#include "autodiff/free.h"
#include "cell_list.h"
#include "physics/motion/motion.h"
#include "physics/scenes/scenes.h"
#include "physics/scenes/gas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FEW = 30,         /* bodies; fewer are faster with all pairs: leastaction chart gas */
    MOST_UNCUT = 4096 /* bodies whose pairs all fit in memory */
};

/* Wider skins are listed less often, and carry more pairs that do nothing. */
static const double skin_share = 0.12; /* of the cutoff */

struct context {
    const struct phys_system *system;
    const struct gas *gas;
    ad_tape *tape;
    ad_var q, potential, acceleration; /* q, acceleration [dof x 1] */
    ad_program *for_acceleration, *for_potential;
    bool listed; /* near pairs; else all */
    double reach, skin;
    struct phys_near near;
    double *q_listed; /* [dof] where the pairs were listed */
};

/* ---- the program ---- */

static ad_var pair_squares(const struct context *c)
{
    return c->listed ? phys_listed_squares(c->q, PHYS_GAS_DIMS, c->near.n, c->near.first,
                                           c->near.second, 0)
                     : phys_pair_squares(c->q, c->system->bodies, PHYS_GAS_DIMS, 0);
}

static void forget(struct context *c)
{
    ad_program_free(c->for_acceleration);
    ad_program_free(c->for_potential);
    c->for_acceleration = c->for_potential = NULL;
    ad_tape_reset(c->tape);
}

/* There may be no near pairs, and no walls. Pairs are columns, which the tape processes in long
   loops. */
static enum ad_status record(struct context *c, struct ad_error *error)
{
    ad_var V, gradient;
    forget(c);
    c->q = ad_input(c->tape, c->system->dof, 1, "q");
    V = ad_mul(0, ad_sum(c->q));
    phys_recording_begin(c->system, c->tape);
    if (!c->listed || c->near.n > 0)
        V = ad_sum(phys_gas_interaction(ad_label(pair_squares(c), "squared distance"), c->gas));
    if (c->gas->walls > 0)
        V = ad_add(V, phys_gas_walls(c->q, c->gas));
    phys_recording_end();
    c->potential = ad_label(V, "potential energy");
    if (ad_grad(V, 1, &c->q, &gradient) == AD_OK) {
        c->acceleration = ad_label(ad_mul(-1 / c->gas->m, gradient), "acceleration");
        if (ad_compile(c->tape, 1, &c->acceleration, &c->for_acceleration) == AD_OK && !c->listed)
            ad_native_lazy(c->for_acceleration);
    }
    return phys_tape_status(c->tape, error);
}

static bool has_moved(const struct context *c, const double *q)
{
    double most = 0.25 * c->skin * c->skin;
    for (size_t k = 0; k < c->system->dof; k += PHYS_GAS_DIMS) {
        double dx = q[k] - c->q_listed[k], dy = q[k + 1] - c->q_listed[k + 1];
        if (!(dx * dx + dy * dy <= most))
            return true;
    }
    return false;
}

static enum ad_status list(struct context *c, const double *q, struct ad_error *error)
{
    if (phys_near_pairs(c->system->bodies, q, c->reach + c->skin, &c->near, error) != AD_OK)
        return error->status;
    memcpy(c->q_listed, q, c->system->dof * sizeof *q);
    return record(c, error);
}

static enum ad_status ready(struct context *c, const double *q, struct ad_error *error)
{
    return c->listed && (!c->for_acceleration || has_moved(c, q)) ? list(c, q, error) : AD_OK;
}

static const char *interpreted(const void *context)
{
    const struct context *c = context;
    return c->listed              ? "lists of near pairs change before compiling would pay"
           : !c->for_acceleration ? ""
                                  : ad_native_note(c->for_acceleration);
}

/* ---- the field ---- */

static enum ad_status kick(void *context, double t, const double *q, double *rate,
                           struct ad_error *error)
{
    struct context *c = context;
    size_t dof = c->system->dof;
    if (ready(c, q, error) != AD_OK)
        return error->status;
    ad_set(c->for_acceleration, c->q, q);
    ad_run(c->for_acceleration);
    ad_get(c->for_acceleration, c->acceleration, rate);
    for (size_t k = 0; k < dof; k++)
        if (!isfinite(rate[k])) {
            char name[64];
            phys_coordinate_name(c->system, k, name, sizeof name);
            return ad_fail(error, AD_E_NONFINITE,
                           "%s: the acceleration is not finite at coordinate %s, t = %g",
                           c->system->scene->name, name, t);
        }
    return AD_OK;
}

static enum ad_status field(void *context, double t, const double *y, double *rate,
                            struct ad_error *error)
{
    const struct context *c = context;
    size_t dof = c->system->dof;
    memcpy(rate, y + dof, dof * sizeof *rate);
    if (kick(context, t, y, rate + dof, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < dof && c->gas->friction != 0; k++)
        rate[dof + k] -= c->gas->friction * y[dof + k];
    return AD_OK;
}

/* T + V of the bodies, without the energy lost to friction. */
static double energy(void *context, double t, const double *y)
{
    struct context *c = context;
    struct ad_error error = {0};
    double T = 0, V;
    (void)t;
    if (ready(c, y, &error) != AD_OK ||
        (!c->for_potential && ad_compile(c->tape, 1, &c->potential, &c->for_potential) != AD_OK))
        return (double)NAN;
    ad_set(c->for_potential, c->q, y);
    ad_run(c->for_potential);
    ad_get(c->for_potential, c->potential, &V);
    for (size_t k = 0; k < c->system->dof; k++)
        T += y[c->system->dof + k] * y[c->system->dof + k];
    return 0.5 * c->gas->m * T + V;
}

static void release(void *context)
{
    struct context *c = context;
    if (c->tape)
        forget(c);
    ad_tape_free(c->tape);
    phys_near_free(&c->near);
    AD_FREE(c->q_listed, c);
}

static enum ad_status begin(struct context *c, const struct phys_system *system,
                            enum phys_gas_pairs pairs, struct ad_error *error)
{
    const struct gas *gas = system->params;
    c->system = system;
    c->gas = gas;
    c->reach = gas->cutoff * gas->sigma;
    c->skin = skin_share * c->reach;
    c->listed =
        pairs == PHYS_GAS_AUTO ? gas->cutoff > 0 && system->bodies > FEW : pairs == PHYS_GAS_NEAR;
    if (!c->listed && system->bodies > MOST_UNCUT)
        return ad_fail(error, AD_E_ARGUMENT,
                       "gas: all pairs of %zu bodies are too many; set a cutoff, say --set "
                       "cutoff=3",
                       system->bodies);
    if (c->listed && !(gas->cutoff > 0))
        return ad_fail(error, AD_E_ARGUMENT, "gas: near pairs need a cutoff");
    c->tape = ad_tape_new(AD_F64);
    c->q_listed = malloc(system->dof * sizeof *c->q_listed);
    if (!c->tape || !c->q_listed)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu bodies", system->bodies);
    return c->listed ? AD_OK : record(c, error);
}

enum ad_status phys_ode_gas(const struct phys_system *system, enum phys_gas_pairs pairs,
                            struct phys_ode *ode, struct ad_error *error)
{
    if (AD_LACKS_RESULT(error, ode) || AD_LACKS(error, system, system->scene))
        return error->status;
    struct context *c = calloc(1, sizeof *c);
    *ode = (struct phys_ode){.context = c, .free = c ? release : NULL};
    if (!c)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (system->scene != &phys_scene_gas)
        return ad_fail(error, AD_E_ARGUMENT, "%s: not the gas", system->scene->name);
    if (begin(c, system, pairs, error) != AD_OK)
        return error->status;
    *ode = (struct phys_ode){
        .name = system->scene->name,
        .n = 2 * system->dof,
        .field = field,
        .kick = kick,
        .friction = c->gas->friction,
        .canonical = c->gas->friction == 0,
        .energy = energy,
        .interpreted = interpreted,
        .system = system,
        .context = c,
        .free = release,
    };
    return AD_OK;
}

enum ad_status phys_gas_ode(const struct phys_system *system, struct phys_ode *ode,
                            struct ad_error *error)
{
    return phys_ode_gas(system, PHYS_GAS_AUTO, ode, error);
}
