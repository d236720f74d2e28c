/* What the error of a motion makes of the times of its crossings, and crossings that are rounding
   alone (solving.h). */
#include "solving.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double caution = 1.5; /* between two rows the error may be larger than at both */

/* ---- quantities that do not change ---- */

/* Whether the quantity stays at its value at all samples, but for rounding. */
static bool is_constant(const struct phys_motion_solution *m, const struct phys_crossing *c,
                        double *y)
{
    const double rounding = 1e-12;
    double most = 0, size = fabs(c->value);
    for (size_t i = 0; i < m->n; i++) {
        double g = phys_crossing_value(c, &m->ode, m->t[i], m->x + 2 * i * m->system->dof, y);
        most = fabs(g) <= most ? most : fabs(g);
        size = fmax(size, fabs(g + c->value));
    }
    return m->n > 2 && most <= rounding * size;
}

enum ad_status phys_crossings_settle(struct solving *s, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    struct phys_crossed *c = &m->crossed;
    size_t columns = 2 * m->system->dof, n = 0;
    double *y = malloc(columns * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < s->settings->n_crossings; k++)
        c->constant[k] = c->constant[k] || is_constant(m, &s->settings->crossings[k], y);
    for (size_t i = 0; i < c->n; i++) {
        if (c->constant[(size_t)c->which[i] - 1])
            continue;
        c->which[n] = c->which[i];
        c->touch[n] = c->touch[i];
        c->uncertainty[n] = c->uncertainty[i];
        memmove(c->x + n * columns, c->x + i * columns, columns * sizeof *c->x);
        c->t[n++] = c->t[i];
    }
    c->n = n;
    free(y);
    return error->status;
}

/* ---- times ---- */

/* Work space: [2 dof] each. */
struct place {
    const struct phys_motion_solution *m;
    double *error; /* of x near the crossing */
    double *size;  /* of x in the motion */
    double *x, *y, *z, *rate;
};

/* How far the quantity may be off: the error along its gradient, by central differences. */
static double error_of(const struct place *p, const struct phys_crossing *c, double t,
                       const double *x)
{
    const double share = 1e-6;
    size_t n = 2 * p->m->system->dof;
    double sum = 0;
    memcpy(p->x, x, n * sizeof *x);
    for (size_t k = 0; k < n; k++) {
        double d = fmax(p->error[k], share * p->size[k]), g[2];
        for (int side = 0; side < 2; side++) {
            p->x[k] = x[k] + (side ? d : -d);
            g[side] = phys_crossing_value(c, &p->m->ode, t, p->x, p->y);
        }
        p->x[k] = x[k];
        sum += d > 0 ? fabs(g[1] - g[0]) / (2 * d) * p->error[k] : 0;
    }
    return sum;
}

/* The quantity a time h later, by the midpoint rule; NaN where the motion does not go on. */
static double value_after(const struct place *p, const struct phys_crossing *c, double t,
                          const double *y, double h)
{
    const struct phys_ode *ode = &p->m->ode;
    struct ad_error outside = {0};
    size_t dof = p->m->system->dof;
    for (int half = 1; half >= 0; half--) {
        const double *at = half ? y : p->z;
        if (ode->field(ode->context, t + (half ? 0 : h / 2), at, p->rate, &outside) != AD_OK)
            return (double)NAN;
        for (size_t k = 0; k < 2 * dof; k++)
            p->z[k] = y[k] + (half ? h / 2 : h) * p->rate[k];
    }
    if (phys_ode_leave(ode, t + h, p->z, p->x, p->x + dof, &outside) != AD_OK)
        return (double)NAN;
    return phys_crossing_value(c, ode, t + h, p->x, p->z);
}

/* The shift of a root of g by an error: of g' t + g'' t^2 / 2, where that has no root as far as the
   extremum and back. */
static double shift_of_root(double slope, double curve, double error)
{
    double left = slope * slope - 2 * curve * error;
    if (left > 0)
        return 2 * error / (slope + sqrt(left));
    return (slope + sqrt(slope * slope + 2 * curve * error)) / curve;
}

static double uncertainty_of(const struct place *p, const struct phys_crossing *c, double t,
                             const double *x, double *y)
{
    const double share = 1e-3;
    const struct phys_ode *ode = &p->m->ode;
    struct ad_error outside = {0};
    size_t dof = p->m->system->dof;
    double h = INFINITY;
    if (phys_ode_enter(ode, t, x, x + dof, y, &outside) != AD_OK ||
        ode->field(ode->context, t, y, p->rate, &outside) != AD_OK)
        return (double)NAN;
    for (size_t k = 0; k < dof; k++) /* the shortest time in which a coordinate moves by its size */
        if (x[dof + k] != 0 && p->size[k] > 0)
            h = fmin(h, share * p->size[k] / fabs(x[dof + k]));
    for (size_t k = dof; k < 2 * dof; k++)
        if (p->rate[k] != 0 && p->size[k] > 0)
            h = fmin(h, share * p->size[k] / fabs(p->rate[k]));
    double error = error_of(p, c, t, x), before = value_after(p, c, t, y, -h),
           after = value_after(p, c, t, y, h), here = phys_crossing_value(c, ode, t, x, p->z);
    double curve = fabs(after - 2 * here + before) / (h * h);
    return shift_of_root(fabs(after - before) / (2 * h), curve, error) + 4 * DBL_EPSILON * fabs(t);
}

static void note_errors(struct place *p, const struct phys_reference *r, size_t row, size_t sample)
{
    size_t dof = p->m->system->dof;
    for (size_t k = 0; k < 2 * dof; k++) {
        double u = r->uncertainty[k < dof ? row : r->n + row];
        double apart = fabs(p->m->x[2 * sample * dof + k] - r->x[2 * row * dof + k]);
        p->error[k] = fmax(p->error[k], caution * (apart + u));
    }
}

static bool is_found(const struct phys_crossed *c, size_t which, double from, double to)
{
    for (size_t i = 0; i < c->n; i++)
        if ((size_t)c->which[i] == which + 1 && c->t[i] >= from && c->t[i] <= to)
            return true;
    return false;
}

/* The extremum near the middle of five equally spaced values, by their polynomial; or of the inner
   three alone. */
static double extremum_of(const double *g, bool all)
{
    double d1 = (g[3] - g[1]) / 2, d2 = g[3] - 2 * g[2] + g[1];
    double d3 = all ? (g[4] - 2 * g[3] + 2 * g[1] - g[0]) / 2 : 0;
    double d4 = all ? g[4] - 4 * g[3] + 6 * g[2] - 4 * g[1] + g[0] : 0, s = 0;
    for (int k = 0; k < 4 && d2 != 0; k++) /* nearly a parabola: this converges fast */
        s = fmax(fmin(-(d1 + d3 * (3 * s * s - 1) / 6 + d4 * s * (2 * s * s - 1) / 12) / d2, 1),
                 -1);
    return g[2] + s * (d1 + s * d2 / 2 + (s * s - 1) * (d3 / 6 + s * d4 / 24));
}

/* Counts the extrema of a quantity, between rows where it has one sign, that are nearer to its
   value than the error is: the true motion may cross there. */
static void count_undecided(struct solving *s, struct place *p, const struct phys_reference *r,
                            const size_t *samples, size_t which)
{
    struct phys_motion_solution *m = s->solution;
    const struct phys_crossing *crossing = &s->settings->crossings[which];
    size_t n = 2 * m->system->dof, rows = 0;
    double g[5] = {0};
    while (rows < r->n && m->t[samples[rows]] < r->horizon)
        rows++;
    for (size_t i = 0; i <= rows; i++) {
        memmove(g, g + 1, 4 * sizeof *g);
        if (i < rows)
            g[4] = phys_crossing_value(crossing, &m->ode, m->t[samples[i]], m->x + samples[i] * n,
                                       p->y);
        if (i < 3 || !(g[1] * g[2] > 0 && g[2] * g[3] > 0) || fabs(g[2]) > fabs(g[1]) ||
            fabs(g[2]) > fabs(g[3]))
            continue;
        size_t middle = samples[i - 2];
        memset(p->error, 0, n * sizeof *p->error);
        for (size_t row = i - 3; row < i; row++)
            note_errors(p, r, row, samples[row]);
        if (fabs(extremum_of(g, i > 3 && i < rows)) <=
                error_of(p, crossing, m->t[middle], m->x + middle * n) &&
            !is_found(&m->crossed, which, m->t[samples[i - 3]], m->t[samples[i - 1]])) {
            m->crossed.undecided++;
            m->crossed.which_undecided = which;
        }
    }
}

enum ad_status phys_crossings_measure(struct solving *s, const struct phys_reference *reference,
                                      const size_t *samples, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    const struct phys_reference *r = reference;
    struct phys_crossed *c = &m->crossed;
    size_t n = 2 * m->system->dof;
    double *work = calloc(7 * n, sizeof *work);
    if (!work)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    struct place p = {m, work, work + n, work + 2 * n, work + 3 * n, work + 4 * n, work + 5 * n};
    for (size_t i = 0; i < r->n; i++)
        for (size_t k = 0; k < n; k++)
            p.size[k] = fmax(p.size[k], fabs(m->x[samples[i] * n + k]));
    for (size_t i = 0, row = 1; i < c->n; i++) {
        while (row + 1 < r->n && m->t[samples[row]] < c->t[i])
            row++;
        if (!(m->t[samples[row]] < r->horizon))
            break;
        memset(p.error, 0, n * sizeof *p.error);
        note_errors(&p, r, row - 1, samples[row - 1]);
        note_errors(&p, r, row, samples[row]);
        c->uncertainty[i] = uncertainty_of(&p, &s->settings->crossings[(size_t)c->which[i] - 1],
                                           c->t[i], c->x + i * n, work + 6 * n);
    }
    for (size_t k = 0; k < s->settings->n_crossings; k++)
        if (!c->constant[k])
            count_undecided(s, &p, r, samples, k);
    free(work);
    return error->status;
}
