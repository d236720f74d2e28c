/* Roots of event functions within a step, by its polynomial: a change of sign between a few points
   of the step, then Brent's method (Algorithms for Minimization without Derivatives, 1973, ch. 4).
 */
#include "simulate.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LOOKS = 4, BRENT_STEPS = 100 }; /* points of an adaptive step that are looked at */

static size_t n_values(const struct run *run)
{
    size_t n = 0;
    for (size_t e = 0; e < run->settings->n_events; e++)
        n += run->settings->events[e].n;
    return n;
}

static void evaluate(const struct run *run, double t, const double *y, double *values)
{
    for (size_t e = 0; e < run->settings->n_events; e++) {
        const struct phys_events *events = &run->settings->events[e];
        if (events->n > 0)
            events->values(events->context, t, y, values);
        values += events->n;
    }
}

enum ad_status phys_run_events_begin(struct run *run, struct ad_error *error)
{
    size_t n = n_values(run);
    if (n == 0)
        return AD_OK;
    if (!(run->values = calloc(4 * n, sizeof *run->values)))
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu events", n);
    run->next_values = run->values + n;
    run->roots = run->values + 2 * n;
    run->scratch = run->values + 3 * n;
    evaluate(run, run->stepper.t, run->stepper.y, run->values);
    return AD_OK;
}

enum ad_status phys_run_dense(struct run *run, double theta, struct ad_error *error)
{
    if (!run->dense && phys_stepper_dense(&run->stepper, error) != AD_OK)
        return error->status;
    run->dense = true;
    phys_stepper_at(&run->stepper, theta, run->point);
    return AD_OK;
}

/* Value `which` of the events at t + theta h; the polynomial is prepared. */
static double value_at(struct run *run, size_t which, double theta)
{
    const struct phys_stepper *m = &run->stepper;
    phys_stepper_at(m, theta, run->point);
    evaluate(run, m->t + theta * m->h, run->point, run->scratch);
    return run->scratch[which];
}

/* The root between a and b, where the values fa and fb differ in sign. */
static double brent(struct run *run, size_t which, double a, double b, double fa, double fb)
{
    double c = a, fc = fa, d = b - a, e = d;
    for (int k = 0; k < BRENT_STEPS; k++) {
        if ((fb > 0) == (fc > 0)) {
            c = a, fc = fa;
            d = e = b - a;
        }
        if (fabs(fc) < fabs(fb)) {
            a = b, b = c, c = a;
            fa = fb, fb = fc, fc = fa;
        }
        double tolerance = 2 * DBL_EPSILON * fabs(b), m = 0.5 * (c - b);
        if (fabs(m) <= tolerance || fb == 0)
            break;
        if (fabs(e) < tolerance || fabs(fa) <= fabs(fb)) {
            d = e = m;
        } else {
            double s = fb / fa, p, q;
            if (a == c) { /* secant */
                p = 2 * m * s;
                q = 1 - s;
            } else { /* inverse quadratic */
                double r = fb / fc, u = fa / fc;
                p = s * (2 * m * u * (u - r) - (b - a) * (r - 1));
                q = (u - 1) * (r - 1) * (s - 1);
            }
            q = p > 0 ? -q : q;
            p = fabs(p);
            bool good = 2 * p < fmin(3 * m * q - fabs(tolerance * q), fabs(e * q));
            e = good ? d : m;
            d = good ? p / q : m;
        }
        a = b, fa = fb;
        b += fabs(d) > tolerance ? d : copysign(tolerance, m);
        fb = value_at(run, which, b);
    }
    return b;
}

static bool crosses(double before, double after, int direction)
{
    return (direction >= 0 && before < 0 && after >= 0) ||
           (direction <= 0 && before > 0 && after <= 0);
}

/* Roots between a and b into run->roots (NaN: none); whether there are any. */
static bool find_roots(struct run *run, double a, double b)
{
    bool any = false;
    size_t first = 0;
    for (size_t e = 0; e < run->settings->n_events; e++) {
        const struct phys_events *events = &run->settings->events[e];
        int direction = run->direction > 0 ? events->direction : -events->direction;
        for (size_t k = first; k < first + events->n; k++) {
            bool found = crosses(run->values[k], run->next_values[k], direction);
            run->roots[k] =
                found ? brent(run, k, a, b, run->values[k], run->next_values[k]) : (double)NAN;
            any |= found;
        }
        first += events->n;
    }
    return any;
}

/* The events function and number behind value k. */
static const struct phys_events *owner(const struct run *run, size_t *k)
{
    const struct phys_events *events = run->settings->events;
    for (; *k >= events->n; events++)
        *k -= events->n;
    return events;
}

/* The simulation ends at theta: the step is cut there. */
static void cut(struct run *run, double theta)
{
    struct phys_stepper *m = &run->stepper;
    phys_stepper_at(m, theta, run->point);
    memcpy(m->next, run->point, m->n * sizeof *m->next);
    memset(m->next_cut, 0, m->n * sizeof *m->next_cut);
    m->has_next_rate = false;
    m->h *= theta;
    run->stop = true;
    run->info->stop = PHYS_SIMULATION_EVENT;
}

/* Tells of the roots in their order. */
static void report(struct run *run, size_t n)
{
    const struct phys_stepper *m = &run->stepper;
    while (!run->stop) {
        size_t next = n;
        for (size_t k = 0; k < n; k++)
            if (!isnan(run->roots[k]) && (next == n || run->roots[k] < run->roots[next]))
                next = k;
        if (next == n)
            return;
        double theta = run->roots[next];
        run->roots[next] = (double)NAN;
        const struct phys_events *events = owner(run, &next);
        phys_stepper_at(m, theta, run->point);
        if (events->found && !events->found(events->context, next, m->t + theta * m->h, run->point))
            cut(run, theta);
    }
}

enum ad_status phys_run_events(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    size_t n = n_values(run), looks = m->integrator->adaptive ? LOOKS : 1;
    if (n == 0)
        return AD_OK;
    for (size_t i = 1; i <= looks && !run->stop; i++) {
        double theta = (double)i / (double)looks;
        const double *y = m->next;
        if (i < looks) {
            if (phys_run_dense(run, theta, error) != AD_OK)
                return error->status;
            y = run->point;
        }
        evaluate(run, m->t + theta * m->h, y, run->next_values);
        bool change = false;
        for (size_t k = 0; k < n; k++)
            change |= crosses(run->values[k], run->next_values[k], 0);
        if (change) {
            if (phys_run_dense(run, theta, error) != AD_OK)
                return error->status;
            if (find_roots(run, (double)(i - 1) / (double)looks, theta))
                report(run, n);
        }
        memcpy(run->values, run->next_values, n * sizeof *run->values);
    }
    return AD_OK;
}
