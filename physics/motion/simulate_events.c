/* Finds events within a step. Coarse events are searched at a few points of the step. For the
   others every root is isolated (roots.h), on the interpolating polynomial of adaptive methods.
   That of fixed steps is too crude: it only tells which steps are far from a root, the others are
   run again (simulate_within.c). */
#include "autodiff/free.h"
#include "run.h"
#include "physics/io/grow.h"
#include "physics/system/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LOOKS = 4 }; /* points of an adaptive step that are looked at for coarse events */

/* The largest defect of a polynomial that tells how far a step is from a root, relative to the
   change of a component; and how often more than it changes in the step a function must be away
   from 0. */
static const double follows = 0.1, far = 2;

static size_t n_values(const struct run *run)
{
    size_t n = 0;
    for (size_t e = 0; e < run->settings->n_events; e++)
        n = run->settings->events[e].n > n ? run->settings->events[e].n : n;
    return n;
}

static size_t n_signs(const struct run *run)
{
    size_t n = 0;
    for (size_t e = 0; e < run->settings->n_events; e++)
        n += run->settings->events[e].n;
    return n;
}

static void evaluate(const struct phys_events *events, double t, const double *y, double *values)
{
    events->values(events->context, t, y, values);
}

static int sign(double x) { return (x > 0) - (x < 0); }

static void note_signs(const struct phys_events *events, double t, const double *y, double *values,
                       int *signs)
{
    if (events->n > 0)
        evaluate(events, t, y, values);
    for (size_t k = 0; k < events->n; k++)
        signs[k] = sign(values[k]) ? sign(values[k]) : signs[k];
}

enum ad_status phys_run_events_begin(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    size_t n = n_values(run);
    if (n == 0)
        return AD_OK;
    run->values = calloc(n, sizeof *run->values);
    run->signs = calloc(2 * n_signs(run), sizeof *run->signs);
    run->table = malloc(sizeof *run->table);
    if (!run->values || !run->signs || !run->table)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu events", n);
    phys_roots_fill(run->table);
    int *signs = run->signs;
    for (size_t e = 0; e < s->n_events; signs += s->events[e++].n) {
        if (s->events[e].signs)
            memcpy(signs, s->events[e].signs, s->events[e].n * sizeof *signs);
        note_signs(&s->events[e], run->stepper.t, run->stepper.y, run->values, signs);
    }
    return AD_OK;
}

void phys_run_events_end(struct run *run)
{
    const int *signs = run->signs;
    for (size_t e = 0; e < run->settings->n_events && signs; signs += run->settings->events[e++].n)
        if (run->settings->events[e].signs)
            memcpy(run->settings->events[e].signs, signs,
                   run->settings->events[e].n * sizeof *signs);
    for (size_t i = 0; i < run->n_found; i++)
        free(run->found[i].y);
    AD_FREE(run->found, run->values, run->signs, run->table);
}

enum ad_status phys_run_dense(struct run *run, double theta, struct ad_error *error)
{
    if (!run->dense && phys_stepper_dense(&run->stepper, error) != AD_OK)
        return error->status;
    run->dense = true;
    phys_stepper_at(&run->stepper, theta, run->point);
    return AD_OK;
}

enum ad_status phys_run_found(struct run *run, const struct found_event *event,
                              struct ad_error *error)
{
    if (!phys_grow(&run->found, run->n_found, sizeof *run->found))
        return ad_fail(error, AD_E_MEMORY, "out of memory for events");
    run->found[run->n_found++] = *event;
    return AD_OK;
}

/* One event function on the polynomial of the step. */
struct on_polynomial {
    struct run *run;
    const struct phys_events *events;
    size_t which;
};

static double value_at(void *context, double theta)
{
    const struct on_polynomial *p = context;
    const struct phys_stepper *m = &p->run->stepper;
    phys_stepper_at(m, theta, p->run->point);
    evaluate(p->events, m->t + theta * m->h, p->run->point, p->run->values);
    return p->run->values[p->which];
}

/* True if a root of this kind is wanted; `before` is the sign of the values before it. */
static bool wanted(const struct run *run, const struct phys_events *events, int kind)
{
    int direction = run->direction > 0 ? events->direction : -events->direction;
    return kind == 0 ? events->touched != NULL : direction == 0 || direction == kind;
}

/* All roots between a and b. `before`: the last sign that was not 0, for a zero at the end of the
   step before. */
static enum ad_status isolate(struct run *run, struct on_polynomial *p, double a, double b,
                              int *before, struct ad_error *error)
{
    struct phys_root roots[PHYS_ROOTS_MOST];
    size_t n = phys_roots(run->table, value_at, p, a, b, roots);
    double at_a = value_at(p, a), at_b = value_at(p, b);
    int inside = sign(at_a), after = sign(at_b);
    for (size_t i = n; i-- > 0;)
        inside = roots[i].kind ? -roots[i].kind : inside;
    if (sign(at_a) == 0 && n == 0)
        inside = after;
    struct found_event event = {.events = p->events, .which = p->which};
    if (*before && inside && *before != inside && wanted(run, p->events, inside)) {
        event.theta = a;
        event.kind = inside;
        phys_run_found(run, &event, error);
    }
    for (size_t i = 0; i < n && error->status == AD_OK; i++) {
        event.theta = roots[i].x;
        event.kind = roots[i].kind;
        if (wanted(run, p->events, event.kind))
            phys_run_found(run, &event, error);
        inside = roots[i].kind ? roots[i].kind : inside;
    }
    *before = after ? after : inside;
    return error->status;
}

/* Coarse: roots between two looks with values of different sign. */
static enum ad_status look(struct run *run, struct on_polynomial *p, int *signs, int *now,
                           struct ad_error *error)
{
    const struct phys_stepper *m = &run->stepper;
    size_t looks = m->integrator->adaptive ? LOOKS : 1;
    for (size_t i = 1; i <= looks; i++) {
        double theta = (double)i / (double)looks, from = (double)(i - 1) / (double)looks;
        if (i < looks && phys_run_dense(run, theta, error) != AD_OK)
            return error->status;
        evaluate(p->events, m->t + theta * m->h, i < looks ? run->point : m->next, run->values);
        for (size_t k = 0; k < p->events->n; k++)
            now[k] = sign(run->values[k]) ? sign(run->values[k]) : signs[k];
        for (p->which = 0; p->which < p->events->n; p->which++) {
            int *before = &signs[p->which];
            if (now[p->which] != *before && *before && wanted(run, p->events, now[p->which]) &&
                (phys_run_dense(run, theta, error) != AD_OK ||
                 isolate(run, p, from, theta, before, error) != AD_OK))
                return error->status;
            *before = now[p->which];
        }
    }
    return AD_OK;
}

/* Whether the polynomial follows the motion: its slope against the field, between its ends. */
static bool polynomial_follows(struct run *run, double *slope)
{
    static const double at[] = {0.25, 0.5, 0.75};
    const double tiny = 1e-4;
    struct phys_stepper *m = &run->stepper;
    double *rate = slope + m->n;
    struct ad_error outside = {0};
    for (size_t i = 0; i < LENGTH(at); i++) {
        phys_stepper_at(m, at[i] + tiny, slope);
        phys_stepper_at(m, at[i] - tiny, run->point);
        for (size_t k = 0; k < m->n; k++)
            slope[k] = (slope[k] - run->point[k]) / (2 * tiny);
        phys_stepper_at(m, at[i], run->point);
        m->interpolations++;
        if (m->ode->field(m->ode->context, m->t + at[i] * m->h, run->point, rate, &outside) !=
            AD_OK)
            return false;
        for (size_t k = 0; k < m->n; k++) {
            double change = fabs(m->next[k] - m->y[k]) +
                            fabs(m->h) * (fabs(m->rate[k]) + fabs(rate[k]) + fabs(m->next_rate[k]));
            if (!(fabs(slope[k] - m->h * rate[k]) <= follows * change))
                return false;
        }
    }
    return true;
}

/* Whether the functions stay far from 0 in the step. */
static bool are_far(struct run *run, const struct phys_events *events)
{
    struct on_polynomial p = {.run = run, .events = events};
    for (; p.which < events->n; p.which++) {
        double low = INFINITY, high = -INFINITY, least = INFINITY;
        for (int i = 0; i <= LOOKS; i++) {
            double g = value_at(&p, (double)i / LOOKS);
            low = fmin(low, g);
            high = fmax(high, g);
            least = fabs(g) <= least ? fabs(g) : isnan(g) ? -1 : least;
        }
        if (!(least > far * (high - low)))
            return false;
    }
    return true;
}

/* Whether a fixed step may have roots. */
static bool may_have_roots(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    double *work = malloc(2 * run->stepper.n * sizeof *work);
    if (!work) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return false;
    }
    bool none = phys_run_dense(run, 0.5, error) == AD_OK && polynomial_follows(run, work);
    for (size_t e = 0; e < s->n_events && none; e++)
        none = s->events[e].coarse || are_far(run, &s->events[e]);
    free(work);
    return !none && error->status == AD_OK;
}

/* ---- reporting ---- */

static int by_time(const void *a, const void *b)
{
    double x = ((const struct found_event *)a)->theta, y = ((const struct found_event *)b)->theta;
    return (x > y) - (x < y);
}

/* The simulation ends at theta: the step is cut there. */
static void cut(struct run *run, double theta, const double *y)
{
    struct phys_stepper *m = &run->stepper;
    memcpy(m->next, y, m->n * sizeof *m->next);
    memset(m->next_cut, 0, m->n * sizeof *m->next_cut);
    m->has_next_rate = false;
    m->h *= theta;
    run->stop = true;
    run->info->stop = PHYS_SIMULATION_EVENT;
}

/* Calls the events' functions for the roots, in order. */
static void report(struct run *run)
{
    const struct phys_stepper *m = &run->stepper;
    double t = m->t, h = m->h;
    if (run->n_found)
        qsort(run->found, run->n_found, sizeof *run->found, by_time);
    for (size_t i = 0; i < run->n_found; i++) {
        const struct found_event *f = &run->found[i];
        bool (*tell)(void *, size_t, double, const double *) =
            f->kind ? f->events->found : f->events->touched;
        if (!f->y)
            phys_stepper_at(m, f->theta, run->point);
        const double *y = f->y ? f->y : run->point;
        if (!run->stop && tell && !tell(f->events->context, f->which, t + f->theta * h, y))
            cut(run, f->theta, y);
        free(f->y);
    }
    run->n_found = 0;
}

enum ad_status phys_run_events(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    if (n_signs(run) == 0)
        return AD_OK;
    int *signs = run->signs, *now = run->signs + n_signs(run);
    bool any = false, adaptive = s->integrator->adaptive;
    for (size_t e = 0; e < s->n_events; e++)
        any |= !s->events[e].coarse && s->events[e].n > 0;
    if (any && !adaptive && may_have_roots(run, error))
        phys_run_within(run, error);
    for (size_t e = 0; e < s->n_events && error->status == AD_OK; signs += s->events[e++].n) {
        struct on_polynomial p = {.run = run, .events = &s->events[e]};
        if (p.events->coarse)
            look(run, &p, signs, now, error);
        else if (adaptive && p.events->n > 0 && phys_run_dense(run, 1, error) == AD_OK)
            for (; p.which < p.events->n && error->status == AD_OK; p.which++)
                isolate(run, &p, 0, 1, &signs[p.which], error);
    }
    report(run);
    return error->status;
}
