/* Series of many points at once: vectors across the points, by code that does for each of them what
   the code for one point does (emit.c). */
#include "autodiff/free.h"
#include "internal.h"

#include <dlfcn.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { P = AD_SERIES_POINTS, CHECKED = 12 /* orders, by one loop as all */ };

struct ad_points {
    void *library;
    ad_flow_code *run;
    ad_steps_code *sum, *norm;
    ad_radius_code *radius;
    const ad_series *model;
    size_t n;
    double *values, *numbers, *packs; /* [jets][P] twice, and of the code */
};

void ad_points_free(ad_points *points)
{
    if (!points)
        return;
    if (points->library)
        dlclose(points->library);
    AD_FREE(points->values, points->numbers, points->packs, points);
}

static double *vectors(size_t n) { return aligned_alloc(64, (n + 1) * P * sizeof(double)); }

double *ad_points_input(ad_points *points, size_t k, size_t i)
{
    return points ? points->values + (points->model->first_input[k] + i) * P : NULL;
}

const double *ad_points_output(const ad_points *points, size_t k, size_t i)
{
    const ad_series *s = points ? points->model : NULL;
    return s ? points->values + s->output[s->first_output[k] + i] * P : NULL;
}

void ad_points_flow_cut(ad_points *points, size_t order, double *c)
{
    if (!points || !c)
        return;
    points->run(ad_jet_evaluate, points->model->jets, points->values, points->numbers,
                points->packs, c, order);
}

void ad_points_sum(const ad_points *points, const struct ad_points_steps *steps, size_t most)
{
    if (points && steps)
        points->sum(steps, most);
}

void ad_points_norm(const ad_points *points, const struct ad_points_steps *steps, size_t most)
{
    if (points && steps)
        points->norm(steps, most);
}

void ad_points_radius(const ad_points *points, const struct ad_points_steps *steps, size_t least,
                      size_t most)
{
    enum { LOOKS = 4 };
    if (points && steps)
        points->radius(steps, least < LOOKS ? 1 : least - LOOKS + 1, most);
}

/* Whether the code for `a` is that for b: numbers that the text depends on are equal. */
static bool is_alike(const struct jet *a, const struct jet *b)
{
    const bool unit = fabs(a->number) == 1 || fabs(b->number) == 1,
               written = a->kind == JET_POWER || (a->kind == JET_COMBINE && unit);
    return a->kind == b->kind && a->op == b->op && a->a == b->a && a->b == b->b && a->da == b->da &&
           a->db == b->db && a->ea == b->ea && a->eb == b->eb &&
           (!written || a->number == b->number);
}

bool ad_points_put(ad_points *points, size_t p, const ad_series *s)
{
    if (!points || !s || p >= P)
        return false;
    const ad_series *m = points->model;
    bool alike = s->n == m->n && s->n_input == m->n_input && s->n_output == m->n_output &&
                 memcmp(s->output, m->output, s->n_output * sizeof *s->output) == 0;
    for (size_t k = 0; alike && s != m && k < s->n; k++)
        alike = is_alike(&m->jets[k], &s->jets[k]);
    for (size_t k = 0; alike && k < s->n; k++)
        points->numbers[k * P + p] = s->jets[k].number;
    return alike;
}

/* Numbers of point p unlike those of the others, near the model's point. */
static double beside(double x, size_t p) { return x * (1 + 0x1p-12 * (double)p); }

static size_t checked(const ad_series *s) { return s->order < CHECKED ? s->order : CHECKED; }

static bool same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

/* Whether point p of the flow and of its sums is what the interpreter makes of it. */
static bool agrees_at(const ad_points *points, ad_series *s, size_t p,
                      const struct ad_points_steps *steps, double *c)
{
    const size_t n = points->n, order = checked(s);
    const double *got = steps->start, *sum = steps->next, *slope = steps->slope, h = steps->h[p];
    double power[2] = {0};
    bool agrees = true;
    for (size_t i = 0; i < s->n_input; i++)
        s->coefficients[i * s->stride] = i < n ? got[i * P + p] : points->values[i * P + p];
    for (size_t i = 0; i < n; i++)
        c[n + i] = ad_series_example_cut(c[i] = got[i * P + p]);
    ad_series_interpret(s, n, order, c);
    for (size_t k = n; k < (order + 1) * n; k++)
        agrees = agrees && same(c[k], got[k * P + p]);
    for (size_t i = s->n_input; i < s->n_output; i++)
        agrees = agrees && same(s->coefficients[s->output[i] * s->stride],
                                points->values[s->output[i] * P + p]);
    for (size_t i = 0; i < n; i++) {
        power[0] = power[1] = 0;
        for (size_t k = order; k > 0; k--) {
            power[0] += c[k * n + i] * pow(h, (double)k);
            power[1] += c[k * n + i] * (double)k * pow(h, (double)k);
        }
        agrees = agrees && same(power[0], sum[i * P + p]) && same(power[1], slope[i * P + p]);
    }
    return agrees;
}

/* Compilers err: the first results are compared, at h = 1/2, whose powers are exact. */
static bool agrees(ad_points *points, ad_series *s)
{
    const size_t n = points->n, order = checked(s), rows = order + 1;
    double *c = malloc(rows * n * sizeof *c), *memory = vectors(rows * n + 5 * n + 3);
    bool agrees = c && memory;
    if (agrees)
        memset(memory, 0, (rows * n + 5 * n + 3) * P * sizeof *memory);
    double *got = memory, *work = memory + (rows + 5) * n * P;
    const struct ad_points_steps steps = {.start = got,
                                          .y = got + rows * n * P,
                                          .cut = got + (rows + 1) * n * P,
                                          .next = got + (rows + 2) * n * P,
                                          .next_cut = got + (rows + 3) * n * P,
                                          .slope = got + (rows + 4) * n * P,
                                          .orders = work,
                                          .h = work + P,
                                          .power = work + 2 * P};
    for (size_t i = 0; agrees && i < s->n_input; i++)
        for (size_t p = 0; p < P; p++)
            (i < n ? got : points->values)[i * P + p] = beside(s->coefficients[i * s->stride], p);
    for (size_t k = 0; agrees && k < n * P; k++)
        got[n * P + k] = ad_series_example_cut(got[k]);
    for (size_t p = 0; agrees && p < P; p++) {
        steps.orders[p] = (double)order;
        steps.h[p] = 0.5;
    }
    if (agrees) {
        ad_points_flow_cut(points, order, got);
        ad_points_sum(points, &steps, order);
        for (size_t p = P; p-- > 0;) /* the model's point last, where it was */
            agrees = agrees && agrees_at(points, s, p, &steps, c);
    }
    AD_FREE(c, memory);
    return agrees;
}

ad_points *ad_points_new(ad_series *model, size_t n, bool build, struct ad_error *note)
{
    struct ad_error own = {0};
    ad_segment_code *functions[4] = {NULL};
    size_t packs = 0;
    ad_points *points = calloc(1, sizeof *points);
    if (!note)
        note = &own;
    if (!points || !model || n > model->n_input || (model->n_flow && model->n_flow != n)) {
        ad_fail(note, points ? AD_E_ARGUMENT : AD_E_MEMORY, "no points of a series");
        free(points);
        return NULL;
    }
    model->n_flow = n;
    *points = (ad_points){.model = model,
                          .n = n,
                          .library = ad_series_load(model, true, build, &packs, functions, note),
                          .values = vectors(model->n),
                          .numbers = vectors(model->n),
                          .packs = vectors(packs)};
    points->run = (ad_flow_code *)(void (*)(void))functions[0];
    points->sum = (ad_steps_code *)(void (*)(void))functions[1];
    points->norm = (ad_steps_code *)(void (*)(void))functions[2];
    points->radius = (ad_radius_code *)(void (*)(void))functions[3];
    bool good = points->library && points->values && points->numbers && points->packs;
    for (size_t p = 0; good && p < P; p++)
        good = ad_points_put(points, p, model);
    if (good && agrees(points, model))
        return points;
    ad_fail(note, AD_E_ACCURACY, "its machine code for many points does not agree");
    ad_points_free(points);
    return NULL;
}
