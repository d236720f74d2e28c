/* Gradients of actions of any size (sized_gradient.h). */
#include "sized_gradient.h"
#include "apps/bench/hand/hand.h"

#include <math.h>
#include <stdlib.h>

static const struct {
    double spacing, swing;
} lattice[HAND_N] = {
    [HAND_THREEBODY] = {0.3, 0.05},
    [HAND_DBLPEND] = {0, 2},
    [HAND_EPHEMERIS] = {1e11, 1e10},
    [HAND_GAS] = {0.06, 0.008},
};

double sized_gradient_swing(int scene) { return lattice[scene].swing; }

void sized_gradient_path(int scene, size_t dof, size_t slices, double *x)
{
    for (size_t c = 0; c < dof; c++) {
        size_t cell = c % 2 ? c / 2 / 8 : c / 2 % 8;
        for (size_t i = 0; i < slices; i++)
            x[c * slices + i] =
                lattice[scene].spacing * (double)cell +
                lattice[scene].swing * sin(0.37 * (double)i + 1.3 * (double)(c * c) + 0.2);
    }
}

enum ad_status sized_gradient_open(int scene, size_t bodies, size_t slices,
                                   struct sized_gradient *s, struct ad_error *error)
{
    const struct hand_kernel *hand = &hand_build(0)[scene];
    const struct phys_rule *rule = phys_rule_find("left+repeat", error);
    struct phys_action action;
    *s = (struct sized_gradient){.scene = scene, .slices = slices, .tape = ad_tape_new(AD_F64)};
    if (!s->tape)
        return ad_fail(error, AD_E_MEMORY, "no memory for a tape");
    if (phys_system_open(hand->scene, &s->system, error) != AD_OK ||
        (bodies && phys_system_set(&s->system, "bodies", (double)bodies, error) != AD_OK))
        return error->status;
    phys_action_record(s->tape, &s->system, rule, slices, hand->dt, 0, &action);
    s->path = action.path;
    s->objective = action.objective;
    if (ad_grad(action.objective, 1, &s->path, &s->gradient) != AD_OK)
        ad_fail(error, ad_tape_error(s->tape)->status, "%s", ad_tape_error(s->tape)->message);
    return error->status;
}

void sized_gradient_close(struct sized_gradient *s)
{
    ad_tape_free(s->tape);
    phys_system_close(&s->system);
}

enum ad_status sized_gradient_compile(struct sized_gradient *s, ad_program **program,
                                      struct ad_error *error)
{
    if (ad_compile(s->tape, 1, &s->gradient, program) != AD_OK)
        ad_fail(error, ad_tape_error(s->tape)->status, "%s", ad_tape_error(s->tape)->message);
    return error->status;
}

enum ad_status sized_gradient_set(const struct sized_gradient *s, size_t n,
                                  ad_program *const programs[n], struct ad_error *error)
{
    double *x = malloc(s->system.dof * s->slices * sizeof *x);
    if (!x)
        return ad_fail(error, AD_E_MEMORY, "no memory for %zu slices", s->slices);
    sized_gradient_path(s->scene, s->system.dof, s->slices, x);
    for (size_t k = 0; k < n; k++)
        ad_set(programs[k], s->path, x);
    free(x);
    return AD_OK;
}
