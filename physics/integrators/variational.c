/* The variational integrator of an action rule as an integrator: solves the discrete equations
   element by element (variational_step.h). Its q are the stationary path of the rule with the same
   first two slices. */
#include "stepper.h"
#include "physics/action/variational_step.h"

#include <stdlib.h>
#include <string.h>

struct element {
    phys_variational_step *stepper;
    size_t dof;
    double last_h; /* 0: there was none */
};

static const struct phys_rule *rule_of(const struct phys_integrator *integrator)
{
    return integrator->coefficients;
}

static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator, (void)n;
    return 0;
}

static enum ad_status begin(struct phys_stepper *s, struct ad_error *error)
{
    struct element *e = s->state = calloc(1, sizeof *e);
    if (!e)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    e->dof = s->n / 2;
    return phys_variational_step_new(s->ode->system, rule_of(s->integrator), 1, &e->stepper, error);
}

static void end(struct phys_stepper *s)
{
    struct element *e = s->state;
    if (e)
        phys_variational_step_free(e->stepper);
    free(e);
}

/* The first element of a length begins along the velocity, later ones as the last one went. */
static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    struct element *e = s->state;
    struct ad_error lost = {0};
    size_t before = phys_variational_step_evaluations(e->stepper);
    if (e->last_h != h) {
        if (phys_stepper_need_rate(s, error) != AD_OK)
            return error->status;
        phys_variational_step_go(e->stepper, h, s->rate);
        e->last_h = h;
    }
    memcpy(s->next, s->y, s->n * sizeof *s->next);
    phys_variational_step_next(e->stepper, s->t, s->next, s->next + e->dof, &lost);
    s->evaluations += phys_variational_step_evaluations(e->stepper) - before;
    return lost.status == AD_OK ? AD_OK : ad_fail(error, AD_E_ACCURACY, "%s", lost.message);
}

static const struct phys_scheme scheme = {.work = work, .begin = begin, .end = end, .step = step};

#define METHOD(id, rule, ORDER, SYMMETRIC)                                                         \
    const struct phys_integrator phys_variational_##id = {                                         \
        .name = "variational-" #id,                                                                \
        .what = "the discrete motion of action rule " #id,                                         \
        .order = ORDER,                                                                            \
        .symplectic = true,                                                                        \
        .symmetric = SYMMETRIC,                                                                    \
        .lagrangian = true,                                                                        \
        .scheme = &scheme,                                                                         \
        .coefficients = &rule,                                                                     \
    };

METHOD(left, phys_rule_left, 1, false)
METHOD(midpoint, phys_rule_midpoint, 2, true)
METHOD(trapezoid, phys_rule_trapezoid, 2, true)
METHOD(gauss2, phys_rules_gauss[0], 4, true)
METHOD(gauss3, phys_rules_gauss[1], 6, true)
METHOD(gauss4, phys_rules_gauss[2], 8, true)
