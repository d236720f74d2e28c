/* Members of a family, and the marks between two of them, located (family_parts.h). */
#include "family_parts.h"
#include "physics/io/grow.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LOCATING = 60, COVERS = 5 };

static const double together = 1e-5; /* arc length */
static const double near = 0.01;     /* multipliers of a mark: four that merge are off by that */
static const double merged = 1e-6;   /* of two that are 1 */
static const double known = 0.1;     /* a multiplier to more than that is not */
static const double covered = 1e-4;  /* of its size: closer, a motion repeats itself */
static const double coarse = 1e-13;  /* another tolerance of motions */

/* ---- members ---- */

enum ad_status phys_family_add(struct family_run *run, const struct family_point *p,
                               enum phys_family_mark mark, double uncertainty,
                               struct ad_error *error)
{
    struct phys_family *family = run->family;
    const size_t d = run->d;
    const bool conserves = run->timeless && run->symplectic;
    struct phys_family_member one = {.mark = mark, .uncertainty = uncertainty};
    const struct phys_periodic_settings how = {.size = sizeof how,
                                               .x = p->u,
                                               .period = p->u[run->columns - 1],
                                               .hold_period = !run->timeless,
                                               .hold_energy = conserves,
                                               .proceed = run->settings->proceed,
                                               .context = run->settings->context};
    one.energy = phys_family_energy(run, p->u);
    if (mark == PHYS_MARK_REST || mark == PHYS_MARK_HALVING) { /* Newton's method is singular */
        one.motion = (struct phys_periodic){.x = malloc(d * sizeof(double)),
                                            .period = how.period,
                                            .uncertainty = NAN,
                                            .closure = NAN};
        if (one.motion.x)
            memcpy(one.motion.x, p->u, d * sizeof *p->u);
        else
            ad_fail(error, AD_E_MEMORY, "out of memory");
    } else {
        phys_periodic_find(&run->system, &how, &one.motion, error);
    }
    one.value = run->along == ALONG_ENERGY   ? one.energy
                : run->along == ALONG_PERIOD ? one.motion.period
                                             : p->u[d];
    if (error->status == AD_OK && !phys_grow(&family->member, family->n, sizeof one))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    if (error->status == AD_OK)
        family->member[family->n++] = one;
    else
        phys_periodic_free(&one.motion);
    return error->status;
}

size_t phys_family_trivial(const struct phys_periodic *motion)
{
    size_t n = 0;
    for (size_t k = 0; k < motion->n; k++) {
        const struct phys_multiplier *m = &motion->multiplier[k];
        n += hypot(m->re - 1, m->im) <= 4 * m->uncertainty + merged;
    }
    return n;
}

size_t phys_family_outside(const struct phys_periodic *motion)
{
    size_t n = 0;
    for (size_t k = 0; k < motion->n; k++) {
        const struct phys_multiplier *m = &motion->multiplier[k];
        n += hypot(m->re, m->im) - 1 > fmax(4 * m->uncertainty, 1e-4);
    }
    return n;
}

/* Whether the multipliers of the last member, found apart from what located it, are those of its
   mark; else it is removed. */
static void confirm(struct family_run *run)
{
    struct phys_family *family = run->family;
    const struct phys_family_member *last = &family->member[family->n - 1];
    size_t met = 0;
    if (last->mark != PHYS_MARK_BRANCH && last->mark != PHYS_MARK_DOUBLING &&
        last->mark != PHYS_MARK_TORUS)
        return;
    for (size_t k = 0; k < last->motion.n; k++) {
        const struct phys_multiplier *m = &last->motion.multiplier[k];
        const double off = last->mark == PHYS_MARK_TORUS
                               ? fabs(hypot(m->re, m->im) - 1)
                               : hypot(m->re - (last->mark == PHYS_MARK_BRANCH ? 1 : -1), m->im);
        met += off <= 4 * m->uncertainty + near && m->uncertainty < known;
    }
    if (met <= (last->mark == PHYS_MARK_DOUBLING ? 0 : run->trivial))
        phys_periodic_free(&family->member[--family->n].motion);
}

/* ---- marks between two points ---- */

struct located {
    enum family_test test;
    double at; /* arc length from the first of both points */
    struct family_point point;
    double uncertainty, period_uncertainty; /* of value and period */
};

/* The point at a share of the way from a to b, which are `length` apart. */
static enum ad_status between(struct family_run *run, const struct family_point *a,
                              const struct family_point *b, double length, double at,
                              struct family_point *to, struct ad_error *error)
{
    double moved;
    for (size_t j = 0; j < run->columns; j++)
        to->u[j] = a->u[j] + at / length * (b->u[j] - a->u[j]);
    return phys_family_correct(run, a, a->tangent, at, to, &moved, error);
}

/* How much value and period depend on the tolerance of the motions and on rounding: seen beside the
   mark, where branches may cross. */
static enum ad_status doubt(struct family_run *run, const struct family_point *a,
                            const struct family_point *b, double length, struct located *found,
                            struct ad_error *error)
{
    const enum family_test test = found->test;
    const size_t T = run->columns - 1;
    const struct family_point *p = &found->point;
    const double beside = 0.99 * found->at;
    struct family_point fine = {0}, other = {0};
    if (!phys_family_point_new(run, &fine) || !phys_family_point_new(run, &other))
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (between(run, a, b, length, beside, &fine, error) == AD_OK) {
        run->tolerance = coarse;
        between(run, a, b, length, beside, &other, error);
        run->tolerance = FAMILY_FINE;
    }
    if (error->status == AD_OK) {
        double off = fabs(p->test[test]) + fabs(other.test[test] - fine.test[test]);
        const double before = other.test[test], value = other.value;
        if (phys_family_multipliers(run, 4 * DBL_EPSILON, &other, error) == AD_OK)
            phys_family_test(run, &other);
        off += fabs(other.test[test] - before) + (test == TEST_FOLD ? p->noise[test] : 0);
        off /= fabs(b->test[test] - a->test[test]);
        found->uncertainty = fabs(value - fine.value) + fine.doubt +
                             (test == TEST_FOLD ? 0 : off * fabs(b->value - a->value));
        found->period_uncertainty =
            fabs(other.u[T] - fine.u[T]) + fine.doubt_period + off * fabs(b->u[T] - a->u[T]);
    }
    phys_family_point_free(&fine);
    phys_family_point_free(&other);
    return error->status;
}

/* Where a test that differs in sign at a and b is 0, by false position (Illinois). */
static enum ad_status locate(struct family_run *run, const struct family_point *a,
                             const struct family_point *b, double length, struct located *found,
                             struct ad_error *error)
{
    const enum family_test test = found->test;
    struct family_point *p = &found->point;
    double low = 0, high = length, f = a->test[test], g = b->test[test];
    int side = 0;
    for (size_t k = 0; k < LOCATING && high - low > 4 * DBL_EPSILON * length; k++) {
        struct ad_error lost = {0};
        double at = low - f * (high - low) / (g - f);
        at = at > low && at < high ? at : 0.5 * (low + high);
        if (between(run, a, b, length, at, p, &lost) != AD_OK) {
            if (k == 0 || lost.status != AD_E_ACCURACY)
                return ad_fail(error, lost.status, "%s", lost.message);
            if (between(run, a, b, length, found->at, p, error) != AD_OK)
                return error->status;
            break; /* branches cross there: as near as can be */
        }
        found->at = at;
        const double now = p->test[test];
        if (fabs(now) <= 1e-3 * p->noise[test] || now == 0)
            break;
        if ((now > 0) == (f > 0)) {
            low = at;
            f = now;
            g /= side < 0 ? 2 : 1;
            side = -1;
        } else {
            high = at;
            g = now;
            f /= side > 0 ? 2 : 1;
            side = 1;
        }
    }
    return doubt(run, a, b, length, found, error);
}

/* A fold where the equations are singular: another family of half the period crosses. The test is
   odd about it, the value even; both are seen from a share of the way to it. */
static enum ad_status approach(struct family_run *run, const struct family_point *a,
                               const struct family_point *b, double length, double small,
                               struct located *found, struct ad_error *error)
{
    const size_t n = run->columns, T = n - 1;
    struct family_point *p = &found->point, far;
    const enum family_test test = found->test;
    double f = a->test[test], g = b->test[test], from = 0, to = length;
    if (!phys_family_point_new(run, &far))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < 2 && error->status == AD_OK; k++) {
        found->at = from + f * (to - from) / (f - g);
        from = (1 - 2 * small) * found->at;
        to = (1 - small) * found->at;
        if (between(run, a, b, length, from, &far, error) == AD_OK)
            between(run, a, b, length, to, p, error);
        f = far.test[test];
        g = p->test[test];
    }
    const double share = g / (f - g), even = g * g / (f * f - g * g);
    found->uncertainty = fabs(p->value - far.value) + (1 + even) * p->doubt;
    found->period_uncertainty = fabs(p->u[T] - far.u[T]) + (1 + even) * p->doubt_period;
    for (size_t j = 0; j < n && error->status == AD_OK; j++)
        p->u[j] += (p->u[j] - far.u[j]) * (j < run->d ? share : even);
    p->value += (p->value - far.value) * even;
    phys_family_point_free(&far);
    return error->status;
}

/* Whether the motion is, at a fold, another one that is gone round more often. */
static enum ad_status is_halved(struct family_run *run, const struct family_point *p, bool *is,
                                struct ad_error *error)
{
    const struct phys_orbit orbit = {run->d, run->unit, FAMILY_FINE, run->settings->proceed,
                                     run->settings->context};
    *is = false;
    for (size_t k = 2; k <= COVERS && run->timeless; k++) {
        double apart = 0;
        if (phys_orbit_follow(&orbit, &run->ode, "taylor", p->u, 0,
                              p->u[run->columns - 1] / (double)k, run->y, error) != AD_OK)
            return error->status;
        for (size_t i = 0; i < run->d; i++)
            apart += pow((run->y[i] - p->u[i]) / run->unit[i], 2);
        *is = *is || sqrt(apart) < covered;
    }
    return error->status;
}

static int by_place(const void *a, const void *b)
{
    const struct located *x = a, *y = b;
    return (x->at > y->at) - (x->at < y->at);
}

/* The mark of what was located; a multiplier passes 1 where the value turns back, too. */
static enum ad_status judge(struct family_run *run, const struct located *found, size_t n, size_t k,
                            enum phys_family_mark *mark, struct ad_error *error)
{
    static const enum phys_family_mark marks[TESTS] = {
        PHYS_MARK_NONE, PHYS_MARK_FOLD, PHYS_MARK_BRANCH, PHYS_MARK_DOUBLING, PHYS_MARK_TORUS};
    bool halved = false;
    *mark = marks[found[k].test];
    if (found[k].test == TEST_TORUS && !phys_family_is_torus(run, &found[k].point))
        *mark = PHYS_MARK_NONE;
    for (size_t j = 0; j < n && found[k].test == TEST_ONE; j++)
        if (found[j].test == TEST_FOLD && fabs(found[j].at - found[k].at) < together)
            *mark = PHYS_MARK_NONE;
    if (*mark == PHYS_MARK_FOLD && run->family->member[0].motion.turns == 1 &&
        is_halved(run, &found[k].point, &halved, error) == AD_OK && halved)
        *mark = PHYS_MARK_HALVING;
    return error->status;
}

/* What cannot be located is at b, known to the step. */
static enum ad_status locate_or_bound(struct family_run *run, const struct family_point *a,
                                      const struct family_point *b, double length,
                                      struct located *found, struct ad_error *error)
{
    struct ad_error lost = {0};
    if (locate(run, a, b, length, found, &lost) == AD_OK)
        return AD_OK;
    run->tolerance = FAMILY_FINE;
    for (double small = 0.01;
         small < 0.2 && found->test == TEST_FOLD && lost.status == AD_E_ACCURACY; small *= 3) {
        lost = (struct ad_error){0};
        if (approach(run, a, b, length, small, found, &lost) == AD_OK)
            return AD_OK;
    }
    if (lost.status != AD_E_ACCURACY && lost.status != AD_E_NONFINITE)
        return ad_fail(error, lost.status, "%s", lost.message);
    phys_family_point_copy(run, b, &found->point);
    found->at = length;
    found->uncertainty = fabs(b->value - a->value);
    found->period_uncertainty = fabs(b->u[run->columns - 1] - a->u[run->columns - 1]);
    return AD_OK;
}

bool phys_family_mark_between(struct family_run *run, const struct family_point *a,
                              const struct family_point *b, double length, struct ad_error *error)
{
    struct located found[TESTS] = {{0}};
    size_t n = 0;
    bool ends = false;
    for (size_t k = 0; k < TESTS && error->status == AD_OK; k++) {
        struct located *one = &found[n];
        if (!(a->test[k] * b->test[k] < 0) || fabs(a->test[k]) < a->noise[k] ||
            fabs(b->test[k]) < b->noise[k])
            continue;
        one->test = (enum family_test)k;
        n++;
        if (!phys_family_point_new(run, &one->point))
            ad_fail(error, AD_E_MEMORY, "out of memory");
        else
            locate_or_bound(run, a, b, length, one, error);
    }
    qsort(found, n, sizeof *found, by_place);
    for (size_t k = 0; k < n && error->status == AD_OK && !ends; k++) {
        enum phys_family_mark is;
        if (judge(run, found, n, k, &is, error) != AD_OK)
            break;
        if (found[k].test == TEST_TARGET) {
            ends = phys_family_add(run, &found[k].point, PHYS_MARK_NONE, NAN, error) == AD_OK;
            run->family->end = PHYS_FAMILY_REACHED;
        } else if (is != PHYS_MARK_NONE) {
            if (phys_family_add(run, &found[k].point, is, found[k].uncertainty, error) != AD_OK)
                break;
            run->family->member[run->family->n - 1].motion.uncertainty =
                found[k].period_uncertainty;
            confirm(run);
            ends = is == PHYS_MARK_HALVING;
            run->family->end = PHYS_FAMILY_ENDS;
        }
    }
    for (size_t k = 0; k < TESTS; k++)
        phys_family_point_free(&found[k].point);
    return ends;
}
