/* Times the gradient of the action by the tape and by hand-written C, one thread, f64, alternating
   in one process; also the value alone, and a complete Adam step. */
#include "physics/linear/vectors.h"
#include "gradient_benchmark.h"
#include "apps/bench/hand/hand.h"

#include <math.h>
#include <stdlib.h>

struct subject {
    const struct hand_kernel *hand;
    hand_gradient *limit;
    const struct race_values *values;
    double *g;
    struct sized_gradient recorded;
    ad_program *gradient, *native, *primal;
    ad_optimiser *adam;
    double sink; /* so that no call is without effect */
};

static void run_hand_gradient(void *context)
{
    struct subject *s = context;
    s->sink += s->hand->gradient(s->values->x, s->g);
}

static void run_limit_gradient(void *context)
{
    struct subject *s = context;
    s->sink += s->limit(s->values->x, s->g);
}

static void run_hand_primal(void *context)
{
    struct subject *s = context;
    s->sink += s->hand->primal(s->values->x);
}

static void step(const struct subject *s, ad_optimiser *adam, ad_program *program)
{
    ad_run(program);
    ad_optimiser_step(adam, ad_data(program, s->recorded.path),
                      ad_data(program, s->recorded.gradient));
}

static void run_adam_step(void *context)
{
    struct subject *s = context;
    step(s, s->adam, s->gradient);
}

static void run_native_adam_step(void *context)
{
    struct subject *s = context;
    step(s, s->adam, s->native);
}

/* ---- where ---- */

double *race_rows(size_t n)
{
    enum { LINE = 64 };
    return aligned_alloc(LINE, (n * sizeof(double) + LINE - 1) / LINE * LINE);
}

static enum ad_status values_new(int scene, struct race_values *values, struct ad_error *error)
{
    size_t dof = (size_t)hand_build(0)[scene].dof;
    values->n = dof * HAND_SLICES;
    values->x = race_rows(5 * values->n);
    if (!values->x)
        return ad_fail(error, AD_E_MEMORY, "no memory for a path");
    values->u = values->x + values->n;
    values->gradient = values->u + values->n;
    values->product = values->gradient + values->n;
    values->adam = values->product + values->n;
    values->adam_rate = 1e-3 * sized_gradient_swing(scene);
    sized_gradient_path(scene, dof, HAND_SLICES, values->x);
    for (size_t k = 0; k < values->n; k++)
        values->u[k] = sin(1.7 * (double)k + 0.4);
    return AD_OK;
}

double race_disagreement(size_t n, const double *a, const double *b)
{
    return phys_farthest(n, a, b) / phys_largest(n, a);
}

/* ---- jobs ---- */

static void subject_close(struct subject *s)
{
    ad_optimiser_free(s->adam);
    ad_program_free(s->gradient);
    ad_program_free(s->native);
    ad_program_free(s->primal);
    sized_gradient_close(&s->recorded);
    free(s->g);
}

static enum ad_status compile(struct subject *s, struct ad_error *error)
{
    const struct sized_gradient *r = &s->recorded;
    ad_compile(r->tape, 1, &r->objective, &s->primal);
    ad_compile(r->tape, 2, (ad_var[]){r->objective, r->gradient}, &s->native);
    if (ad_compile(r->tape, 2, (ad_var[]){r->objective, r->gradient}, &s->gradient) != AD_OK)
        return ad_fail(error, ad_tape_error(r->tape)->status, "%s",
                       ad_tape_error(r->tape)->message);
    ad_native(s->native, INFINITY, NULL);
    ad_set(s->native, r->path, s->values->x);
    ad_set(s->primal, r->path, s->values->x);
    return ad_set(s->gradient, r->path, s->values->x);
}

static enum ad_status subject_open(struct subject *s, int scene, const struct race_values *values,
                                   struct ad_error *error)
{
    *s = (struct subject){
        .hand = &hand_build(0)[scene], .limit = hand_limit(scene), .values = values};
    struct ad_optimiser_settings adam = ad_optimiser_defaults(AD_ADAM);
    adam.learning_rate = 1e-12; /* does all the work, and leaves the path where it is */
    s->g = race_rows(values->n);
    s->adam = ad_optimiser_new(&adam, AD_F64, values->n, NULL);
    if (!s->g || !s->adam)
        return ad_fail(error, AD_E_MEMORY, "no memory for scene %s", s->hand->scene);
    if (sized_gradient_open(scene, 0, HAND_SLICES, &s->recorded, error) != AD_OK)
        return error->status;
    return compile(s, error);
}

/* Where Adam leads from the path, which is put back. */
static enum ad_status descend(struct subject *s, struct ad_error *error)
{
    const struct race_values *v = s->values;
    struct ad_optimiser_settings settings = ad_optimiser_defaults(AD_ADAM);
    settings.learning_rate = v->adam_rate;
    ad_optimiser *adam = ad_optimiser_new(&settings, AD_F64, v->n, NULL);
    if (!adam)
        return ad_fail(error, AD_E_MEMORY, "no memory for Adam");
    for (int k = 0; k < RACE_ADAM_STEPS; k++)
        step(s, adam, s->gradient);
    ad_get(s->gradient, s->recorded.path, v->adam);
    ad_set(s->gradient, s->recorded.path, v->x);
    ad_optimiser_free(adam);
    return AD_OK;
}

static void compare(struct subject *s, struct race *race)
{
    const struct race_values *v = s->values;
    ad_run(s->gradient);
    ad_run(s->native);
    ad_get(s->gradient, s->recorded.gradient, v->gradient);
    s->hand->gradient(v->x, s->g);
    race->disagreement =
        fmax(race_disagreement(v->n, s->g, v->gradient),
             race_disagreement(v->n, s->g, ad_data(s->native, s->recorded.gradient)));
    double value = s->hand->gradient(v->x, s->g), limit = s->limit(v->x, s->g);
    race->disagreement = fmax(race->disagreement, race_disagreement(v->n, s->g, v->gradient));
    race->disagreement = fmax(race->disagreement, fabs(limit / value - 1));
}

void race_time(size_t n, struct timed jobs[], size_t rounds, size_t first, struct race *race)
{
    time_in_turn(n, jobs, rounds);
    for (size_t j = 0; j < n; j++) {
        race->ns[first + j] = jobs[j].nanoseconds;
        for (size_t k = 0; k < n; k++)
            race->ratio[first + j][first + k] = time_ratio(&jobs[j], &jobs[k], rounds);
    }
}

enum ad_status race_run(int scene, bool quick, struct race *race, struct ad_error *error)
{
    struct subject s = {0};
    *race = (struct race){0};
    if (values_new(scene, &race->values, error) == AD_OK &&
        subject_open(&s, scene, &race->values, error) == AD_OK && descend(&s, error) == AD_OK) {
        struct timed jobs[RACE_FIRST] = {
            [TAPE_GRADIENT] = {.run = time_program, .context = s.gradient},
            [NATIVE_GRADIENT] = {.run = time_program, .context = s.native},
            [HAND_GRADIENT] = {.run = run_hand_gradient, .context = &s},
            [LIMIT_GRADIENT] = {.run = run_limit_gradient, .context = &s},
            [TAPE_PRIMAL] = {.run = time_program, .context = s.primal},
            [HAND_PRIMAL] = {.run = run_hand_primal, .context = &s},
            [ADAM_STEP] = {.run = run_adam_step, .context = &s},
            [NATIVE_ADAM_STEP] = {.run = run_native_adam_step, .context = &s},
        };
        for (size_t j = 0; j < RACE_FIRST; j++)
            jobs[j].processor = true;
        compare(&s, race);
        race_time(RACE_FIRST, jobs, quick ? TIMING_QUICK : TIMING_ROUNDS, 0, race);
        race_second(scene, quick, race, error);
        race->ratio[NATIVE_PRODUCT][NATIVE_GRADIENT] =
            race->ns[NATIVE_PRODUCT] / race->ns[NATIVE_GRADIENT];
    }
    subject_close(&s);
    return error->status;
}

void race_free(struct race *race)
{
    free(race->values.x);
    *race = (struct race){0};
}
