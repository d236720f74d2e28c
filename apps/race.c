/* The gradient of the action by the tape and by hand-written C, one thread, f64, in one process and
   in turn; beside it the value alone, and a whole step of Adam. */
#include "race.h"
#include "hand.h"
#include "timing.h"
#include "../physics/physics.h"

#include <math.h>
#include <stdlib.h>

struct subject {
    const struct hand_kernel *hand;
    size_t n; /* dof * HAND_SLICES */
    double *x, *g;
    struct phys_system system;
    ad_tape *tape;
    ad_program *gradient, *native, *primal;
    ad_var path, slope;
    ad_optimiser *adam;
    double sink; /* so that no call is without effect */
};

static void run_tape_gradient(void *context)
{
    struct subject *s = context;
    ad_run(s->gradient);
}

static void run_native_gradient(void *context)
{
    struct subject *s = context;
    ad_run(s->native);
}

static void run_hand_gradient(void *context)
{
    struct subject *s = context;
    s->sink += s->hand->gradient(s->x, s->g);
}

static void run_tape_primal(void *context)
{
    struct subject *s = context;
    ad_run(s->primal);
}

static void run_hand_primal(void *context)
{
    struct subject *s = context;
    s->sink += s->hand->primal(s->x);
}

static void run_adam_step(void *context)
{
    struct subject *s = context;
    ad_run(s->gradient);
    ad_optimiser_step(s->adam, ad_data(s->gradient, s->path), ad_data(s->gradient, s->slope));
}

static void (*const runs[RACE_JOBS])(void *) = {
    [TAPE_GRADIENT] = run_tape_gradient, [NATIVE_GRADIENT] = run_native_gradient,
    [HAND_GRADIENT] = run_hand_gradient, [TAPE_PRIMAL] = run_tape_primal,
    [HAND_PRIMAL] = run_hand_primal,     [ADAM_STEP] = run_adam_step,
};

/* Bodies around the points of a lattice (angles: around zero), wide enough that none collide. */
static void draw_path(int scene, int dof, double *x)
{
    static const double spacing[HAND_N] = {0.3, 0, 1e11, 0.06};
    static const double swing[HAND_N] = {0.05, 2, 1e10, 0.008};
    for (int c = 0; c < dof; c++) {
        int cell = c % 2 ? c / 2 / 8 : c / 2 % 8;
        for (int i = 0; i < HAND_SLICES; i++)
            x[c * HAND_SLICES + i] =
                spacing[scene] * cell + swing[scene] * sin(0.37 * i + 1.3 * c * c + 0.2);
    }
}

static void subject_close(struct subject *s)
{
    ad_optimiser_free(s->adam);
    ad_program_free(s->gradient);
    ad_program_free(s->native);
    ad_program_free(s->primal);
    ad_tape_free(s->tape);
    phys_system_close(&s->system);
    free(s->x);
    free(s->g);
}

static enum ad_status record(struct subject *s, struct ad_error *error)
{
    struct phys_action action;
    const struct phys_rule *rule = phys_rule_find("left+repeat", error);
    if (!rule)
        return error->status;
    phys_action_record(s->tape, &s->system, rule, HAND_SLICES, s->hand->dt, 0, &action);
    s->path = action.path;
    ad_grad(action.objective, 1, &s->path, &s->slope);
    ad_compile(s->tape, 1, &action.objective, &s->primal);
    ad_compile(s->tape, 2, (ad_var[]){action.objective, s->slope}, &s->native);
    if (ad_compile(s->tape, 2, (ad_var[]){action.objective, s->slope}, &s->gradient) != AD_OK)
        return ad_fail(error, ad_tape_error(s->tape)->status, "%s",
                       ad_tape_error(s->tape)->message);
    ad_native(s->native, INFINITY, NULL);
    ad_set(s->native, s->path, s->x);
    ad_set(s->primal, s->path, s->x);
    return ad_set(s->gradient, s->path, s->x);
}

static enum ad_status subject_open(struct subject *s, int scene, struct ad_error *error)
{
    *s = (struct subject){.hand = &hand_build(0)[scene]};
    s->n = (size_t)s->hand->dof * HAND_SLICES;
    struct ad_optimiser_settings adam = ad_optimiser_defaults(AD_ADAM);
    adam.learning_rate = 1e-12; /* does all the work, and leaves the path where it is */
    s->x = malloc(s->n * sizeof *s->x);
    s->g = malloc(s->n * sizeof *s->g);
    s->tape = ad_tape_new(AD_F64);
    s->adam = ad_optimiser_new(&adam, AD_F64, s->n);
    if (!s->x || !s->g || !s->tape || !s->adam)
        return ad_fail(error, AD_E_MEMORY, "no memory for scene %s", s->hand->scene);
    draw_path(scene, s->hand->dof, s->x);
    if (phys_system_open(s->hand->scene, &s->system, error) != AD_OK)
        return error->status;
    return record(s, error);
}

/* Largest difference of the tape's gradients to the one by hand, relative to the largest entry. */
static double disagreement(struct subject *s)
{
    double largest = 0, difference = 0;
    ad_run(s->gradient);
    ad_run(s->native);
    const double *tape = ad_data(s->gradient, s->slope);
    const double *native = ad_data(s->native, s->slope);
    s->hand->gradient(s->x, s->g);
    for (size_t k = 0; k < s->n; k++) {
        largest = fmax(largest, fabs(s->g[k]));
        difference = fmax(difference, fabs(s->g[k] - tape[k]));
        difference = fmax(difference, fabs(s->g[k] - native[k]));
    }
    return difference / largest;
}

enum ad_status race_run(int scene, bool quick, struct race *race, struct ad_error *error)
{
    struct subject s;
    struct timed jobs[RACE_JOBS];
    size_t rounds = quick ? TIMING_QUICK : TIMING_ROUNDS;
    if (subject_open(&s, scene, error) == AD_OK) {
        for (size_t j = 0; j < RACE_JOBS; j++)
            jobs[j] = (struct timed){.run = runs[j], .context = &s};
        race->disagreement = disagreement(&s);
        time_in_turn(RACE_JOBS, jobs, rounds);
        for (size_t j = 0; j < RACE_JOBS; j++) {
            race->ns[j] = jobs[j].nanoseconds;
            for (size_t k = 0; k < RACE_JOBS; k++)
                race->ratio[j][k] = time_ratio(&jobs[j], &jobs[k], rounds);
        }
    }
    subject_close(&s);
    return error->status;
}
