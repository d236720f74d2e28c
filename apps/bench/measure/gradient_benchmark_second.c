/* Times second derivatives of the action: Hessian times vector by the tape (the gradient of <g, u>)
   and by hand-written C; and the complete Hessian, blocks of neighbouring slices, as Newton's
   method uses it. */
#include "gradient_benchmark.h"
#include "apps/bench/hand/hand.h"
#include "physics/action/hessian.h"

#include <math.h>
#include <stdlib.h>

struct subject {
    const struct hand_kernel *hand;
    const struct race_values *values;
    double *h; /* room for two products */
    struct sized_gradient recorded;
    ad_var along, product;
    ad_program *tape, *native;
    struct phys_hessian hessian;
};

static void run_hand(void *context)
{
    struct subject *s = context;
    s->hand->product(s->values->x, s->values->u, s->h);
}

static void run_blocks(void *context)
{
    struct subject *s = context;
    phys_hessian_at(&s->hessian, s->values->x, 0);
}

static enum ad_status record(struct subject *s, struct ad_error *error)
{
    struct sized_gradient *r = &s->recorded;
    s->along = ad_input(r->tape, (size_t)s->hand->dof, HAND_SLICES, "u");
    ad_grad(ad_dot(r->gradient, s->along), 1, &r->path, &s->product);
    ad_compile(r->tape, 1, &s->product, &s->native);
    if (ad_compile(r->tape, 1, &s->product, &s->tape) != AD_OK)
        return ad_fail(error, ad_tape_error(r->tape)->status, "%s",
                       ad_tape_error(r->tape)->message);
    ad_native(s->native, INFINITY, NULL);
    ad_program *const programs[] = {s->tape, s->native};
    for (size_t k = 0; k < 2; k++) {
        ad_set(programs[k], r->path, s->values->x);
        ad_set(programs[k], s->along, s->values->u);
    }
    return AD_OK;
}

static enum ad_status subject_open(struct subject *s, int scene, const struct race_values *values,
                                   struct ad_error *error)
{
    *s = (struct subject){.hand = &hand_build(0)[scene], .values = values};
    s->h = race_rows(2 * values->n);
    if (!s->h)
        return ad_fail(error, AD_E_MEMORY, "no memory for scene %s", s->hand->scene);
    if (sized_gradient_open(scene, 0, HAND_SLICES, &s->recorded, error) != AD_OK ||
        record(s, error) != AD_OK)
        return error->status;
    return phys_hessian_new(&s->hessian, &s->recorded.system, phys_rule_find("left+repeat", error),
                            HAND_SLICES, s->hand->dt, NULL, error);
}

static void subject_close(struct subject *s)
{
    phys_hessian_free(&s->hessian);
    ad_program_free(s->tape);
    ad_program_free(s->native);
    sized_gradient_close(&s->recorded);
    free(s->h);
}

/* h = H u from the blocks: the action is dt times a sum over slices, the objective a mean over
   slices, and over bodies where scenes report so. */
static void multiply_blocks(const struct subject *s, double *h)
{
    const struct phys_hessian *of = &s->hessian;
    const struct phys_system *system = &s->recorded.system;
    double scale = 1 / (of->dt * HAND_SLICES);
    if (system->scene->per_body)
        scale /= (double)system->bodies;
    for (size_t k = 0; k < s->values->n; k++)
        h[k] = 0;
    for (size_t e = 0; e < of->elements; e++)
        for (size_t b = 0; b < of->side; b++) {
            const double *column = of->element + (e * of->side + b) * of->side;
            double u = s->values->u[b % of->dof * HAND_SLICES + e + b / of->dof];
            for (size_t a = 0; a < of->side; a++)
                h[a % of->dof * HAND_SLICES + e + a / of->dof] += scale * column[a] * u;
        }
}

static void compare(struct subject *s, struct race *race)
{
    const struct race_values *v = s->values;
    double *blocks = s->h + v->n;
    ad_run(s->tape);
    ad_run(s->native);
    run_blocks(s);
    ad_get(s->tape, s->product, v->product);
    multiply_blocks(s, blocks);
    race->second = fmax(race_disagreement(v->n, v->product, ad_data(s->native, s->product)),
                        race_disagreement(v->n, v->product, blocks));
    run_hand(s);
    race->second = fmax(race->second, race_disagreement(v->n, v->product, s->h));
}

/* All blocks of the gas take half a second: fewer rounds, of their own. */
enum ad_status race_second(int scene, bool quick, struct race *race, struct ad_error *error)
{
    struct subject s;
    if (subject_open(&s, scene, &race->values, error) == AD_OK) {
        struct timed products[] = {{.run = time_program, .context = s.tape, .processor = true},
                                   {.run = time_program, .context = s.native, .processor = true},
                                   {.run = run_hand, .context = &s, .processor = true}};
        struct timed blocks = {.run = run_blocks, .context = &s, .processor = true};
        compare(&s, race);
        race_time(3, products, quick ? TIMING_QUICK : TIMING_ROUNDS, TAPE_PRODUCT, race);
        race_time(1, &blocks, quick ? 1 : 5, HESSIAN_BLOCKS, race);
    }
    subject_close(&s);
    return error->status;
}
