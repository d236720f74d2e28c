/* Many Taylor steps at once (taylor_points.h). */
#include "taylor_points.h"
#include "autodiff/free.h"
#include "physics/ode/internal.h"
#include "taylor.h"

#include <stdlib.h>

enum { P = AD_SERIES_POINTS, ROWS = ORDER + 1 };

struct phys_taylor_points *phys_taylor_points_new(const struct phys_ode *model, bool build)
{
    const size_t n = model->n, each = ROWS * n * P, doubles = 2 * each + (2 * n + 3) * P;
    struct phys_motion_series *series = phys_ode_motion_series(model);
    struct phys_taylor_points *points = series ? calloc(1, sizeof *points) : NULL;
    if (!points)
        return NULL;
    points->n = n;
    points->code = phys_motion_points(series, build);
    points->memory = aligned_alloc(64, doubles * sizeof(double));
    if (!points->code || !points->memory) {
        phys_taylor_points_free(points);
        return NULL;
    }
    memset(points->memory, 0, doubles * sizeof(double));
    points->start = points->memory;
    points->end = points->start + each;
    points->sum = points->end + each;
    points->slope = points->sum + n * P;
    points->orders = points->slope + n * P;
    points->h = points->orders + P;
    points->work = points->h + P;
    return points;
}

void phys_taylor_points_free(struct phys_taylor_points *points)
{
    if (!points)
        return;
    ad_points_free(points->code);
    AD_FREE(points->memory, points);
}

bool phys_taylor_points_put(struct phys_taylor_points *points, size_t p, struct phys_stepper *s,
                            const struct phys_tolerance *tolerance)
{
    struct phys_motion_series *series = phys_ode_motion_series(s->ode);
    points->stepper[p] = NULL;
    points->order[p] = 0;
    if (!series || s->ode->n != points->n || !phys_motion_points_put(points->code, p, series))
        return false;
    points->stepper[p] = s;
    phys_taylor_tune(s, tolerance);
    return true;
}

double phys_taylor_points_longest(struct phys_taylor_points *points, size_t p,
                                  const struct phys_tolerance *tolerance)
{
    struct phys_stepper *s = points->stepper[p];
    weigh(s, tolerance);
    memory_of(s)->order = points->order[p];
    return phys_taylor_length(s, points->start + p, P);
}

static size_t most(const size_t *orders)
{
    size_t order = 0;
    for (size_t p = 0; p < P; p++)
        order = orders[p] > order ? orders[p] : order;
    return order;
}

/* The sums of the series, which are `next` for those under way. */
static void sum_steps(struct phys_taylor_points *points)
{
    for (size_t p = 0; p < P; p++) {
        const bool moves = points->stepper[p] && points->order[p];
        points->orders[p] = moves ? (double)points->order[p] : 0;
        points->h[p] = moves ? points->stepper[p]->h : 0;
    }
    if (most(points->order) > 0)
        ad_points_sum(points->code, most(points->order), points->start, points->orders, points->h,
                      points->sum, points->slope, points->work);
    for (size_t p = 0; p < P; p++) {
        struct phys_stepper *s = points->stepper[p];
        if (!s)
            continue;
        struct memory *m = memory_of(s);
        m->h = points->h[p];
        m->last_term = m->last * fabs(points->work[p]);
        for (size_t i = 0; i < s->n && points->order[p]; i++)
            phys_stepper_sum(s, i, points->sum[i * P + p]);
        if (!points->order[p]) {
            s->h = 0;
            s->end = s->t;
            memcpy(s->next, s->y, s->n * sizeof *s->y);
        }
    }
}

/* The series about one end by its own code, which knows what to do where it is not finite. */
static void expand_alone(struct phys_taylor_points *points, size_t p, struct ad_error *error)
{
    struct phys_stepper *s = points->stepper[p];
    if (phys_taylor_expand_end(s, error) != AD_OK)
        return;
    points->next_order[p] = memory_of(s)->about[memory_of(s)->here ^ 1].order;
    for (size_t k = 0; k < (points->next_order[p] + 1) * s->n; k++)
        points->end[k * P + p] = coefficients(s, true)[k];
}

static void expand_ends(struct phys_taylor_points *points, struct ad_error *errors)
{
    for (size_t p = 0; p < P; p++) {
        struct phys_stepper *s = points->stepper[p];
        points->next_order[p] = s ? memory_of(s)->usual : 0;
        points->orders[p] = (double)points->next_order[p];
        if (!s)
            continue;
        for (size_t i = 0; i < s->n; i++)
            points->end[i * P + p] = s->next[i];
        for (size_t i = 0; i < s->n; i++)
            points->end[(s->n + i) * P + p] = s->next_cut[i];
        phys_motion_points_begin(points->code, p, phys_ode_motion_series(s->ode), s->end);
        s->evaluations += memory_of(s)->usual;
    }
    ad_points_flow_cut(points->code, most(points->next_order), points->end);
    ad_points_finite(points->code, most(points->next_order), points->end, points->orders,
                     points->work);
    for (size_t p = 0; p < P; p++) {
        struct phys_stepper *s = points->stepper[p];
        errors[p].status = AD_OK;
        if (s && (!phys_motion_points_end(points->code, p, phys_ode_motion_series(s->ode)) ||
                  points->work[p] != 0))
            expand_alone(points, p, &errors[p]);
    }
}

void phys_taylor_points_step(struct phys_taylor_points *points, struct ad_error *errors)
{
    sum_steps(points);
    expand_ends(points, errors);
}

double phys_taylor_points_norm(struct phys_taylor_points *points, size_t p,
                               const struct phys_tolerance *tolerance)
{
    const double *rates = points->end + points->n * P + p;
    return phys_taylor_norm(points->stepper[p], tolerance, points->slope + p, rates, P);
}

void phys_taylor_points_fetch(const struct phys_taylor_points *points, size_t p)
{
    const struct phys_stepper *s = points->stepper[p];
    double *c = coefficients(s, false);
    for (size_t k = 0; k < (points->order[p] + 1) * s->n; k++)
        c[k] = points->start[k * P + p];
}

void phys_taylor_points_accept(struct phys_taylor_points *points, const bool *accepted)
{
    double *start = points->start;
    points->start = points->end;
    points->end = start;
    for (size_t p = 0; p < P; p++)
        if (accepted[p])
            points->order[p] = points->next_order[p];
        else if (points->stepper[p])
            for (size_t k = 0; k < (points->order[p] + 1) * points->n; k++)
                points->start[k * P + p] = points->end[k * P + p];
}
