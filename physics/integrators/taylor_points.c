/* Many Taylor steps at once (taylor_points.h): the arithmetic is machine code (ad_points_sum,
   _norm, _radius). */
#include "taylor_points.h"
#include "autodiff/free.h"
#include "physics/ode/internal.h"
#include "taylor.h"

#include <stdlib.h>

enum { P = AD_SERIES_POINTS, PARTS = sizeof(struct ad_points_steps) / sizeof(double *) };

#define EACH_PLACE for (size_t p = 0; p < P; p++)

struct phys_taylor_points *phys_taylor_points_new(const struct phys_ode *model, bool build)
{
    const size_t n = model->n, vectors = (2 * (ORDER + 1) + PARTS + 2) * n;
    struct phys_motion_series *series = phys_ode_motion_series(model);
    struct phys_taylor_points *points = series ? calloc(1, sizeof *points) : NULL;
    if (!points)
        return NULL;
    points->n = n;
    points->model = series;
    points->code = phys_motion_points(series, build);
    points->memory = aligned_alloc(64, vectors * P * sizeof(double));
    if (!points->code || !points->memory) {
        phys_taylor_points_free(points);
        return NULL;
    }
    memset(points->memory, 0, vectors * P * sizeof(double));
    double *next = points->memory;
#define PLACE(name)                                                                                \
    points->at.name = next;                                                                        \
    next += n * P;
    AD_POINTS_VECTORS(PLACE)
#undef PLACE
    points->zero = next;
    points->within = next + n * P;
    points->at.start = next + 2 * n * P;
    points->at.end = points->at.start + (ORDER + 1) * n * P;
    return points;
}

void phys_taylor_points_free(struct phys_taylor_points *points)
{
    if (!points)
        return;
    ad_points_free(points->code);
    AD_FREE(points->memory, points);
}

void phys_taylor_points_allow(struct phys_taylor_points *points, size_t p)
{
    for (size_t i = 0; i < points->n; i++)
        points->at.least[i * P + p] = phys_allowed(points->tolerance[p], i, 0);
}

void phys_taylor_points_take(struct phys_taylor_points *points, size_t p)
{
    points->stepper[p] = NULL;
    points->order[p] = 0;
}

bool phys_taylor_points_put(struct phys_taylor_points *points, size_t p, struct phys_stepper *s,
                            const struct phys_tolerance *tolerance)
{
    struct phys_motion_series *series = phys_ode_motion_series(s->ode);
    phys_taylor_points_take(points, p);
    if (!series || s->ode->n != points->n || !phys_motion_points_put(points->code, p, series))
        return false;
    phys_taylor_tune(s, tolerance);
    if (memory_of(s)->fine)
        return false;
    points->stepper[p] = s;
    points->tolerance[p] = tolerance;
    points->at.share[p] = tolerance->rtol;
    points->at.tolerance[p] = memory_of(s)->tol;
    points->at.worst[p] = (double)s->worst;
    for (size_t i = 0; i < points->n; i++) {
        points->at.y[i * P + p] = s->y[i];
        points->at.cut[i * P + p] = s->cut[i];
    }
    phys_taylor_points_allow(points, p);
    return true;
}

static size_t most(const size_t *orders)
{
    size_t order = 0;
    EACH_PLACE order = orders[p] > order ? orders[p] : order;
    return order;
}

void phys_taylor_points_look(struct phys_taylor_points *points)
{
    const size_t high = most(points->order);
    size_t low = high;
    EACH_PLACE
    {
        low = points->order[p] && points->order[p] < low ? points->order[p] : low;
        points->at.orders[p] = (double)points->order[p];
    }
    if (high > 0)
        ad_points_radius(points->code, &points->at, low, high);
}

double phys_taylor_points_longest(const struct phys_taylor_points *points, size_t p)
{
    points->stepper[p]->worst = (size_t)points->at.worst[p];
    return phys_taylor_within(points->stepper[p], points->at.radius[p], points->order[p]);
}

static void sum_steps(struct phys_taylor_points *points)
{
    EACH_PLACE
    {
        points->at.orders[p] = (double)points->order[p];
        points->at.h[p] = points->order[p] ? points->stepper[p]->h : 0;
    }
    ad_points_sum(points->code, &points->at, most(points->order));
    EACH_PLACE if (points->stepper[p])
    {
        struct phys_stepper *s = points->stepper[p];
        for (size_t i = 0; i < points->n; i++)
            s->next[i] = points->at.next[i * P + p];
        if (!points->order[p])
            s->end = s->t;
    }
}

/* The series about one end by its own code, which knows what to do where it is not finite. */
static void expand_alone(struct phys_taylor_points *points, size_t p, struct ad_error *error)
{
    struct phys_stepper *s = points->stepper[p];
    for (size_t i = 0; i < s->n; i++)
        s->next_cut[i] = points->at.next_cut[i * P + p];
    if (phys_taylor_expand_end(s, error) != AD_OK)
        return;
    points->next_order[p] = memory_of(s)->about[memory_of(s)->here ^ 1].order;
    for (size_t k = 0; k < (points->next_order[p] + 1) * s->n; k++)
        points->at.end[k * P + p] = coefficients(s, true)[k];
}

static void expand_ends(struct phys_taylor_points *points)
{
    const size_t n = points->n;
    double *times = phys_motion_points_times(points->code, points->model);
    EACH_PLACE
    {
        struct phys_stepper *s = points->stepper[p];
        points->next_order[p] = s ? memory_of(s)->usual : 0;
        points->at.next_orders[p] = (double)points->next_order[p];
        if (s)
            times[p] = s->end;
    }
    memcpy(points->at.end, points->at.next, n * P * sizeof(double));
    memcpy(points->at.end + n * P, points->at.next_cut, n * P * sizeof(double));
    ad_points_flow_cut(points->code, most(points->next_order), points->at.end);
}

void phys_taylor_points_step(struct phys_taylor_points *points, struct ad_error *errors)
{
    bool alone = false;
    sum_steps(points);
    expand_ends(points);
    memcpy(points->within, points->at.worst, P * sizeof(double));
    ad_points_norm(points->code, &points->at, most(points->next_order));
    phys_motion_points_end(points->code, points->model, points->at.lost);
    EACH_PLACE
    {
        errors[p].status = AD_OK;
        if (!points->stepper[p])
            continue;
        if (points->at.lost[p] == 0) {
            points->stepper[p]->evaluations += memory_of(points->stepper[p])->usual;
            continue;
        }
        expand_alone(points, p, &errors[p]);
        alone = true;
    }
    if (alone) {
        memcpy(points->at.worst, points->within, P * sizeof(double));
        ad_points_norm(points->code, &points->at, most(points->next_order));
    }
    EACH_PLACE if (points->order[p]) points->stepper[p]->worst = (size_t)points->at.worst[p];
}

void phys_taylor_points_fetch(const struct phys_taylor_points *points, size_t p)
{
    const struct phys_stepper *s = points->stepper[p];
    double *c = coefficients(s, false);
    memory_of(s)->order = points->order[p];
    memory_of(s)->h = points->at.h[p];
    for (size_t k = 0; k < (points->order[p] + 1) * s->n; k++)
        c[k] = points->at.start[k * P + p];
}

const double *phys_taylor_points_at(const struct phys_taylor_points *points, const double *theta)
{
    double h[P] __attribute__((aligned(64))), power[P] __attribute__((aligned(64)));
    struct ad_points_steps within = points->at;
    EACH_PLACE h[p] = theta[p] * points->at.h[p];
    within.h = h;
    within.power = power;
    within.cut = points->zero;
    within.next = points->within;
    within.next_cut = within.slope;
    ad_points_sum(points->code, &within, most(points->order));
    return points->within;
}

static void swap(double **a, double **b)
{
    double *c = *a;
    *a = *b;
    *b = c;
}

void phys_taylor_points_accept(struct phys_taylor_points *points, const bool *accepted)
{
    struct ad_points_steps *at = &points->at;
    swap(&at->start, &at->end);
    swap(&at->y, &at->next);
    swap(&at->cut, &at->next_cut);
    EACH_PLACE
    {
        if (!points->stepper[p])
            continue;
        if (accepted[p]) {
            points->order[p] = points->next_order[p];
            continue;
        }
        for (size_t k = 0; k < points->n; k++) {
            at->y[k * P + p] = at->next[k * P + p];
            at->cut[k * P + p] = at->next_cut[k * P + p];
        }
        for (size_t k = 0; k < (points->order[p] + 1) * points->n; k++)
            at->start[k * P + p] = at->end[k * P + p];
    }
}
