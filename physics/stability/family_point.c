/* A point of a family: Newton's method to it on a plane across the family, and its tangent
   (family_parts.h). Rows of the equations: x(T) = x, the phase, what is held, the plane. */
#include "family_parts.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ITERATIONS = 8 };

static const double nearly = 1e-10, rounding = 1e-13, null = 1e-11;

bool phys_family_point_new(const struct family_run *run, struct family_point *point)
{
    const size_t d = run->d, n = run->columns;
    *point = (struct family_point){.u = calloc(2 * n + 3 * d, sizeof(double))};
    if (!point->u)
        return false;
    point->tangent = point->u + n;
    point->rate = point->tangent + n;
    point->re = point->rate + d;
    point->im = point->re + d;
    return true;
}

void phys_family_point_free(struct family_point *point)
{
    free(point->u);
    point->u = NULL;
}

void phys_family_point_copy(const struct family_run *run, const struct family_point *from,
                            struct family_point *to)
{
    const struct family_point room = *to;
    memcpy(room.u, from->u, (2 * run->columns + 3 * run->d) * sizeof *from->u);
    *to = *from;
    to->u = room.u;
    to->tangent = room.tangent;
    to->rate = room.rate;
    to->re = room.re;
    to->im = room.im;
}

static enum ad_status set_parameter(struct family_run *run, const double *u, struct ad_error *error)
{
    return run->along == ALONG_PARAMETER
               ? phys_system_set(&run->system, run->settings->along, u[run->d], error)
               : AD_OK;
}

double phys_family_energy(struct family_run *run, const double *u)
{
    return set_parameter(run, u, &(struct ad_error){0}) == AD_OK
               ? phys_motion_energy(run->motion, u, u + run->d / 2, 0)
               : (double)NAN;
}

enum ad_status phys_family_refuse_unused(struct family_run *run, const double *u,
                                         struct ad_error *error)
{
    const size_t d = run->d;
    struct ad_error outside = {0}; /* of where it is defined: it does depend on it */
    double *at = run->trial, *first = run->step, energy[2];
    memset(run->y, 0, run->ode.n * sizeof *run->y);
    for (size_t i = 0; i < d; i++) /* a state with no symmetry */
        run->y[i] = at[i] = u[i] + run->unit[i] / (double)(17 + 3 * i);
    for (size_t k = 0; k < 2 && outside.status == AD_OK; k++) {
        at[d] = k == 0 ? u[d] : run->settings->to;
        energy[k] = phys_family_energy(run, at);
        run->ode.field(run->ode.context, 0.37 * u[d + 1], run->y, run->slope, &outside);
        memcpy(k == 0 ? first : run->trial, run->slope, d * sizeof *at);
    }
    phys_family_energy(run, u);
    return outside.status != AD_OK || energy[0] != energy[1] ||
                   memcmp(first, run->trial, d * sizeof *first) != 0
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "%s: L does not depend on %s: no family in it",
                         run->system.scene->name, run->settings->along);
}

/* Differences of the energy by u, in units. */
static void energy_slope(struct family_run *run, const double *u, double *slope)
{
    const double h = 1e-5;
    const size_t n = run->columns;
    memcpy(run->trial, u, n * sizeof *u);
    for (size_t j = 0; j < n; j++) {
        double both[2] = {0, 0};
        for (int sign = 0; sign < 2 && j + 1 < n; sign++) {
            run->trial[j] = u[j] + (sign ? -h : h) * run->unit[j];
            both[sign] = phys_family_energy(run, run->trial);
        }
        run->trial[j] = u[j];
        slope[j] = (both[0] - both[1]) / (2 * h * run->power);
    }
    set_parameter(run, u, &(struct ad_error){0});
}

/* What is held, over its size, less 1 or so; and its change by u, in units. */
static double hold(struct family_run *run, const double *u, double *slope)
{
    const size_t T = run->columns - 1;
    memset(slope, 0, run->columns * sizeof *slope);
    switch (run->settings->hold) {
    case PHYS_HOLD_PERIOD:
        slope[T] = run->unit[T] / run->held;
        return u[T] / run->held - 1;
    case PHYS_HOLD_PRODUCT:
        slope[T] = run->unit[T] * u[run->d] / run->held;
        slope[run->d] = run->unit[run->d] * u[T] / run->held;
        return u[T] * u[run->d] / run->held - 1;
    case PHYS_HOLD_ENERGY:
        energy_slope(run, u, slope);
        return (phys_family_energy(run, u) - run->held) / run->power;
    case PHYS_HOLD_NOTHING:
        break;
    }
    return 0;
}

/* Follows u over its period, and fills what is left and J by columns, in units. */
static enum ad_status fill(struct family_run *run, const struct family_point *base,
                           const double *row, double along, struct family_point *p,
                           struct ad_error *error)
{
    const size_t d = run->d, rows = run->rows, T = run->columns - 1;
    const double *u = p->u, *unit = run->unit;
    const struct phys_orbit orbit = {d, unit, run->tolerance, run->settings->proceed,
                                     run->settings->context};
    double plane = -along;
    if (!(u[T] > 0))
        return ad_fail(error, AD_E_ACCURACY, "the period falls to 0");
    if (set_parameter(run, u, error) != AD_OK ||
        phys_orbit_follow(&orbit, &run->ode, "taylor", u, 0, u[T], run->y, error) != AD_OK ||
        run->ode.field(run->ode.context, u[T], run->y, run->slope, error) != AD_OK)
        return error->status;
    memset(run->J, 0, rows * run->columns * sizeof *run->J);
    for (size_t i = 0; i < d; i++) {
        run->left[i] = (run->y[i] - u[i]) / unit[i];
        for (size_t j = 0; j < T; j++)
            run->J[j * rows + i] = (run->y[d + j * d + i] - (i == j)) * unit[j] / unit[i];
        run->J[T * rows + i] = run->slope[i] * unit[T] / unit[i];
        p->rate[i] = run->slope[i];
    }
    size_t i = d;
    if (run->timeless) {
        double size = 0;
        for (size_t j = 0; j < d; j++)
            size += pow(base->rate[j] / unit[j], 2);
        size = size > 0 ? sqrt(size) : 1;
        run->left[i] = 0;
        for (size_t j = 0; j < d; j++) {
            run->J[j * rows + i] = base->rate[j] / unit[j] / size;
            run->left[i] += run->J[j * rows + i] * (u[j] - base->u[j]) / unit[j];
        }
        i++;
    }
    if (run->settings->hold != PHYS_HOLD_NOTHING) {
        run->left[i] = hold(run, u, run->slope);
        for (size_t j = 0; j <= T; j++)
            run->J[j * rows + i] = run->slope[j];
        i++;
    }
    for (size_t j = 0; j <= T; j++) {
        run->J[j * rows + i] = row[j];
        plane += row[j] * (u[j] - base->u[j]) / unit[j];
    }
    run->left[i] = plane;
    return AD_OK;
}

/* step [columns] = the least x of J x = right, J factored; damped. */
static void solve(const struct family_run *run, const double *right, double damping, double *step)
{
    const size_t m = run->rows, n = run->columns;
    memset(step, 0, n * sizeof *step);
    for (size_t j = 0; j < n && run->s[j] > null * run->s[0]; j++) {
        const double along =
            phys_dot(m, run->U + j * m, right) * run->s[j] / (run->s[j] * run->s[j] + damping);
        for (size_t i = 0; i < n; i++)
            step[i] += run->V[i * n + j] * along;
    }
}

static enum ad_status factor(struct family_run *run, struct ad_error *error)
{
    return phys_lapack_singular_values(run->rows, run->columns, run->J, run->s, run->U, run->V) == 0
               ? AD_OK
               : ad_fail(error, AD_E_ACCURACY, "the steps of a period have no singular values");
}

void phys_family_value_slope(struct family_run *run, const double *u, double *slope)
{
    memset(slope, 0, run->columns * sizeof *slope);
    if (run->along == ALONG_ENERGY)
        energy_slope(run, u, slope);
    else
        slope[run->along == ALONG_PERIOD ? run->columns - 1 : run->d] = 1;
}

/* By how much the product of `slope` and u may be off, `closed` of the equations left, J factored;
   in units. */
static double doubt(const struct family_run *run, double closed, const double *slope)
{
    const size_t n = run->columns;
    double sum = 0;
    for (size_t j = 0; j < n && run->s[j] > null * run->s[0]; j++) {
        double along = 0;
        for (size_t i = 0; i < n; i++)
            along += run->V[i * n + j] * slope[i];
        sum += fabs(along) * closed / run->s[j];
    }
    return sum;
}

/* Value, tangent and multipliers of u, of which J and y are, and `closed` is what is left. */
static enum ad_status describe(struct family_run *run, struct family_point *p, double closed,
                               struct ad_error *error)
{
    const size_t d = run->d, n = run->columns, T = n - 1;
    phys_family_multipliers(run, 0, p, error);
    if (error->status != AD_OK || factor(run, error) != AD_OK)
        return error->status;
    memset(run->left, 0, run->rows * sizeof *run->left);
    run->left[run->rows - 1] = 1;
    solve(run, run->left, 0, p->tangent);
    const double length = phys_norm(n, p->tangent);
    for (size_t j = 0; j < n; j++)
        p->tangent[j] /= length;
    p->value = run->along == ALONG_PERIOD      ? p->u[T]
               : run->along == ALONG_PARAMETER ? p->u[d]
                                               : phys_family_energy(run, p->u);
    memset(run->slope, 0, n * sizeof *run->slope);
    run->slope[T] = run->unit[T];
    p->doubt_period = doubt(run, closed, run->slope);
    phys_family_value_slope(run, p->u, run->slope);
    p->doubt = 4 * DBL_EPSILON * fabs(p->value) +
               doubt(run, closed, run->slope) *
                   (run->along == ALONG_ENERGY ? run->power
                                               : run->unit[run->along == ALONG_PERIOD ? T : d]);
    p->slope = phys_dot(n, run->slope, p->tangent);
    phys_family_test(run, p);
    return isfinite(length) && length > 0
               ? AD_OK
               : ad_fail(error, AD_E_ACCURACY, "the family has no direction there");
}

enum ad_status phys_family_correct(struct family_run *run, const struct family_point *base,
                                   const double *row, double along, struct family_point *p,
                                   double *moved, struct ad_error *error)
{
    const size_t n = run->columns, d = run->d;
    double last = INFINITY;
    *moved = 0;
    for (size_t k = 0; k <= ITERATIONS; k++) {
        if (fill(run, base, row, along, p, error) != AD_OK)
            return error->status;
        const double left = phys_norm(run->rows, run->left), grown = phys_norm(d * d, run->y + d);
        if (left < 4 * DBL_EPSILON ||
            (left < fmax(nearly, rounding * grown) && !(left < 0.25 * last)))
            return describe(run, p, fmax(left, 4 * DBL_EPSILON * (1 + grown)), error);
        if (!(left < 10 * last) || factor(run, error) != AD_OK)
            break;
        solve(run, run->left, fmin(left * left, 1e-2), run->step);
        for (size_t j = 0; j < n; j++)
            p->u[j] -= run->step[j] * run->unit[j];
        *moved += phys_norm(n, run->step);
        last = left;
    }
    return ad_fail(error, AD_E_ACCURACY, "Newton's method does not converge");
}
