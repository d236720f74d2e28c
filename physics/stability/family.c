/* Families of periodic motions by steps of arc length, and their marks (family.h). */
#include "family.h"
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "family_parts.h"
#include "physics/linear/vectors.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 500 };

static const double first_step = 0.02, longest = 0.1, shortest = 1e-7; /* in units */
static const double strayed = 0.3; /* of the step: as far as Newton's method may go from the line */
static const double shrunk = 0.3;  /* rates, in a step */
static const double rest = 0.05 * 0.05; /* square of what moves in a period */
static const char begins_there[] = "%s = %g: the family begins there";
static const double turned = 0.97; /* cosine of the angle from tangent to tangent */

/* ---- steps ---- */

/* Units as large as what was met; the tangent in them, without what only moves the phase. */
static enum ad_status settle(struct family_run *run, struct family_point *p, struct ad_error *error)
{
    struct phys_ode plain = {0};
    const size_t n = run->columns, d = run->d;
    double *size = run->trial, along = 0, squares = 0;
    if (phys_ode_lagrangian(&run->system, &plain, error) == AD_OK &&
        phys_typical_sizes(&plain, 0, p->u, size, error) == AD_OK) {
        size[n - 1] = p->u[n - 1];
        for (size_t j = 0; j < n; j++) {
            const double unit =
                j < d ? fmax(run->unit[j], size[j]) : (j == n - 1 ? size[j] : run->unit[j]);
            p->tangent[j] *= run->unit[j] / unit;
            run->unit[j] = unit;
        }
        for (size_t j = 0; j < d && run->timeless; j++) {
            along += p->tangent[j] * p->rate[j] / run->unit[j];
            squares += pow(p->rate[j] / run->unit[j], 2);
        }
        for (size_t j = 0; j < d && squares > 0; j++)
            p->tangent[j] -= along / squares * p->rate[j] / run->unit[j];
        const double length = phys_norm(n, p->tangent);
        for (size_t j = 0; j < n; j++)
            p->tangent[j] /= length;
    }
    phys_ode_free(&plain);
    return error->status;
}

/* The family ends for a reason; want of memory and interruption are errors. */
static enum ad_status lose(struct family_run *run, const struct ad_error *lost,
                           struct ad_error *error)
{
    const struct phys_family_settings *s = run->settings;
    if (s->proceed && !s->proceed(s->context))
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    if (lost->status != AD_E_ACCURACY && lost->status != AD_E_NONFINITE)
        return ad_fail(error, lost->status, "%s", lost->message);
    run->family->end = PHYS_FAMILY_LOST;
    snprintf(run->family->lost, sizeof run->family->lost, "%.250s", lost->message);
    return AD_OK;
}

/* Of the rates of two points over a period, the product, in units. */
static double swing(const struct family_run *run, const struct family_point *a,
                    const struct family_point *b)
{
    const size_t T = run->columns - 1;
    double sum = 0;
    for (size_t k = 0; k < run->d; k++)
        sum += a->rate[k] * b->rate[k] / (run->unit[k] * run->unit[k]);
    return sum * a->u[T] * b->u[T];
}

/* One step from a to b; false: it was too long. */
static bool try_step(struct family_run *run, const struct family_point *a, double length,
                     struct family_point *b, struct ad_error *lost)
{
    double moved;
    for (size_t j = 0; j < run->columns; j++)
        b->u[j] = a->u[j] + length * a->tangent[j] * run->unit[j];
    if (phys_family_correct(run, a, a->tangent, length, b, &moved, lost) != AD_OK)
        return false;
    if (run->timeless && !(swing(run, a, b) > shrunk * swing(run, a, a)))
        return ad_fail(lost, AD_E_ACCURACY, "the motion nearly rests"), false;
    if (moved > strayed * length || phys_dot(run->columns, a->tangent, b->tangent) < turned) {
        ad_fail(lost, AD_E_ACCURACY, "the family turns too sharply");
        return false;
    }
    return true;
}

static bool is_first_again(const struct family_run *run, const struct family_point *first,
                           const struct family_point *a, const struct family_point *b)
{
    double before = 0, after = 0, apart = 0;
    for (size_t j = 0; j < run->columns; j++) {
        const double to = (a->u[j] - first->u[j]) / run->unit[j],
                     from = (b->u[j] - first->u[j]) / run->unit[j];
        before += to * first->tangent[j];
        after += from * first->tangent[j];
        apart += from * from;
    }
    return before < 0 && after >= 0 && sqrt(apart) < 2 * longest;
}

/* Of the motion along itself, and of the energy. */
static size_t sure_trivial(const struct family_run *run)
{
    return run->timeless ? 1 + run->symplectic : 0;
}

/* Stability that changes with no mark near: said, not explained. */
static void note_change(struct phys_family *family)
{
    const size_t last = family->n - 1;
    struct phys_family_member *m = family->member;
    for (size_t k = 0; k < 3 && k <= last; k++)
        if (m[last - k].mark != PHYS_MARK_NONE)
            return;
    if (phys_family_outside(&m[last].motion) == phys_family_outside(&m[last - 1].motion))
        return;
    m[last].mark = PHYS_MARK_CHANGE;
    m[last].uncertainty = fabs(m[last].value - m[last - 1].value);
}

/* The longest step from a to b; false: none is short enough. */
static bool find_step(struct family_run *run, const struct family_point *a, double *length,
                      struct family_point *b, struct ad_error *lost)
{
    for (; *length >= shortest; *length /= 2) {
        *lost = (struct ad_error){0};
        if (try_step(run, a, *length, b, lost))
            return true;
        if (lost->status != AD_E_ACCURACY && lost->status != AD_E_NONFINITE)
            return false;
    }
    return false;
}

static enum ad_status follow(struct family_run *run, struct family_point *a, struct family_point *b,
                             struct family_point *first, struct ad_error *error)
{
    struct phys_family *family = run->family;
    const size_t most = run->settings->steps ? run->settings->steps : STEPS;
    const double begin = a->value, way = run->settings->to - begin;
    double length = first_step;
    bool crossed = run->crossed;
    phys_family_point_copy(run, a, first);
    family->end = PHYS_FAMILY_STEPS;
    for (size_t k = 0; k < most && error->status == AD_OK; k++) {
        struct ad_error lost = {0};
        if (!find_step(run, a, &length, b, &lost))
            return lose(run, &lost, error);
        phys_family_test(run, a);
        const bool ends = phys_family_mark_between(run, a, b, length, &lost);
        if (!run->crossed && lost.status == AD_OK && phys_family_cross(run, a, &lost) != AD_OK)
            return lose(run, &lost, error);
        if (run->crossed && !crossed) {
            crossed = true;
            settle(run, a, error);
            phys_family_point_copy(run, a, first);
            family->end = PHYS_FAMILY_STEPS;
            length = first_step;
            continue;
        }
        if (ends)
            return AD_OK;
        const bool returned = (b->value - begin) * way < -1e-9 * way * way;
        if (returned || is_first_again(run, first, a, b)) {
            family->end = returned ? PHYS_FAMILY_RETURNED : PHYS_FAMILY_CLOSED;
            return AD_OK;
        }
        if (lost.status != AD_OK || phys_family_add(run, b, PHYS_MARK_NONE, NAN, &lost) != AD_OK)
            return lose(run, &lost, error);
        note_change(family);
        if (run->timeless && swing(run, b, b) < fmin(rest, swing(run, a, a)) &&
            phys_family_is_small(run, b, &lost)) {
            family->end = PHYS_FAMILY_ENDS;
            return phys_family_rest(run, b, &lost) == AD_OK ? AD_OK : lose(run, &lost, error);
        }
        const size_t trivial = phys_family_trivial(&family->member[family->n - 1].motion);
        if (trivial < run->trivial && trivial >= sure_trivial(run))
            run->trivial = trivial;
        const double bend = 1 - phys_dot(run->columns, a->tangent, b->tangent);
        phys_family_point_copy(run, b, a);
        settle(run, a, error);
        length = fmin(longest, length * (bend < 0.1 * (1 - turned) ? 1.5 : 1));
    }
    return error->status;
}

/* ---- the beginning ---- */

static enum ad_status open(struct family_run *run, const struct phys_system *system,
                           struct ad_error *error)
{
    const struct phys_family_settings *s = run->settings;
    const bool of = run->along == ALONG_PARAMETER;
    struct phys_ode plain = {0};
    const size_t which = of ? phys_param_find(system, s->along, error) : 0;
    if (error->status != AD_OK)
        return error->status;
    run->system = *system;
    if (!(run->system.params = malloc(system->scene->params_bytes + 1)))
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    memcpy(run->system.params, system->params, system->scene->params_bytes);
    run->timeless = phys_orbit_is_timeless(&run->system, error);
    run->symplectic = !phys_system_has_forces(&run->system);
    if (error->status != AD_OK || phys_family_check(run, error) != AD_OK)
        return error->status;
    const size_t d = run->d = 2 * system->dof;
    run->columns = d + 1 + of;
    run->rows = d + 1 + run->timeless + (s->hold != PHYS_HOLD_NOTHING);
    if (phys_ode_parameters(&run->system, d, of, &s->along, &run->ode, error) != AD_OK ||
        phys_motion_new_of(&run->system, of, &which, &run->motion, error) != AD_OK)
        return error->status;
    const size_t n = run->columns, m = run->rows;
    run->unit = calloc(2 * run->ode.n + 2 * m * n + n * n + m + 5 * n, sizeof *run->unit);
    if (!run->unit)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    run->y = run->unit + n;
    run->slope = run->y + run->ode.n;
    run->J = run->slope + run->ode.n;
    run->U = run->J + m * n;
    run->V = run->U + m * n;
    run->s = run->V + n * n;
    run->left = run->s + n;
    run->step = run->left + m;
    run->trial = run->step + n;
    if (phys_ode_lagrangian(&run->system, &plain, error) == AD_OK)
        phys_typical_sizes(&plain, 0, s->x, run->unit, error);
    phys_ode_free(&plain);
    run->unit[n - 1] = s->period;
    if (of && (run->unit[d] = fabs(s->to - phys_system_get(system, s->along))) == 0)
        ad_fail(error, AD_E_ARGUMENT, begins_there, s->along, s->to);
    return error->status;
}

/* The first motion, which is `motion`, with a tangent towards the value asked for. */
static enum ad_status begin(struct family_run *run, struct family_point *p,
                            struct family_point *base, struct ad_error *error)
{
    const struct phys_family_settings *s = run->settings;
    const size_t d = run->d, n = run->columns, T = n - 1;
    const bool conserves = run->timeless && run->symplectic;
    double moved;
    struct phys_periodic found;
    const struct phys_periodic_settings how = {.size = sizeof how,
                                               .x = s->x,
                                               .period = s->period,
                                               .hold_period = !run->timeless,
                                               .hold_energy = conserves,
                                               .proceed = s->proceed,
                                               .context = s->context};
    if (phys_periodic_find(&run->system, &how, &found, error) == AD_OK) {
        memcpy(p->u, found.x, d * sizeof *p->u);
        p->u[T] = run->unit[T] = found.period;
        const size_t trivial = phys_family_trivial(&found), sure = sure_trivial(run);
        run->trivial = trivial > sure ? trivial : sure;
    }
    phys_periodic_free(&found);
    if (error->status != AD_OK)
        return error->status;
    if (run->along == ALONG_PARAMETER)
        p->u[d] = phys_system_get(&run->system, s->along);
    run->power = fabs(phys_family_energy(run, p->u));
    run->power = run->power > 0 ? run->power : 1;
    run->held = s->hold == PHYS_HOLD_ENERGY    ? phys_family_energy(run, p->u)
                : s->hold == PHYS_HOLD_PRODUCT ? p->u[T] * p->u[d]
                                               : p->u[T];
    phys_family_point_copy(run, p, base);
    memset(run->y, 0, run->ode.n * sizeof *run->y);
    memcpy(run->y, p->u, d * sizeof *p->u);
    if (run->ode.field(run->ode.context, 0, run->y, run->slope, error) != AD_OK)
        return error->status;
    memcpy(base->rate, run->slope, d * sizeof *base->rate);
    double *row = calloc(n, sizeof *row);
    if (!row)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    phys_family_value_slope(run, p->u, row);
    if (phys_family_correct(run, base, row, 0, p, &moved, error) == AD_OK) {
        const double way = s->to - p->value;
        if (way == 0)
            ad_fail(error, AD_E_ARGUMENT, begins_there, s->along, s->to);
        if (error->status == AD_OK && run->along == ALONG_PARAMETER)
            phys_family_refuse_unused(run, p->u, error);
        for (size_t j = 0; j < n && way < 0; j++)
            p->tangent[j] = -p->tangent[j];
        p->slope = way < 0 ? -p->slope : p->slope;
        if (error->status == AD_OK && phys_family_add(run, p, PHYS_MARK_NONE, NAN, error) == AD_OK)
            settle(run, p, error);
    }
    free(row);
    return error->status;
}

enum ad_status phys_family_follow(const struct phys_system *system,
                                  const struct phys_family_settings *settings,
                                  struct phys_family *family, struct ad_error *error)
{
    if (AD_LACKS(error, family))
        return error->status;
    *family = (struct phys_family){0};
    if (AD_LACKS(error, system, system->scene, settings))
        return error->status;
    AD_OWN(phys_family_settings, settings, context, error);
    if (AD_LACKS(error, settings->x, settings->along) ||
        phys_refuse_constraints(system, "families of periodic motions", error) != AD_OK ||
        phys_family_check_numbers(system, settings, error) != AD_OK)
        return error->status;
    struct family_run run = {.settings = settings,
                             .family = family,
                             .tolerance = FAMILY_FINE,
                             .crossed = settings->cross == 0};
    struct family_point a = {0}, b = {0}, first = {0};
    run.along = strcmp(settings->along, "energy") == 0   ? ALONG_ENERGY
                : strcmp(settings->along, "period") == 0 ? ALONG_PERIOD
                                                         : ALONG_PARAMETER;
    if (open(&run, system, error) == AD_OK) {
        if (!phys_family_point_new(&run, &a) || !phys_family_point_new(&run, &b) ||
            !phys_family_point_new(&run, &first))
            ad_fail(error, AD_E_MEMORY, "out of memory");
        else if (begin(&run, &a, &b, error) == AD_OK)
            follow(&run, &a, &b, &first, error);
        if (error->status == AD_OK && !run.crossed && family->end != PHYS_FAMILY_LOST) {
            family->end = PHYS_FAMILY_LOST;
            snprintf(family->lost, sizeof family->lost,
                     "fewer than %d branch points and doublings to cross at", abs(settings->cross));
        }
    }
    phys_family_point_free(&a);
    phys_family_point_free(&b);
    phys_family_point_free(&first);
    phys_motion_free(run.motion);
    phys_ode_free(&run.ode);
    AD_FREE(run.unit, run.system.params);
    return error->status;
}

void phys_family_free(struct phys_family *family)
{
    if (!family)
        return;
    for (size_t k = 0; k < family->n; k++)
        phys_periodic_free(&family->member[k].motion);
    free(family->member);
    *family = (struct phys_family){0};
}

const char *phys_family_mark_word(enum phys_family_mark mark)
{
    static const char *const words[] = {
        [PHYS_MARK_NONE] = "",
        [PHYS_MARK_FOLD] = "fold: it turns back",
        [PHYS_MARK_BRANCH] = "branch point: a multiplier passes 1",
        [PHYS_MARK_DOUBLING] = "period doubling: a multiplier passes -1",
        [PHYS_MARK_TORUS] = "a pair of multipliers leaves the unit circle",
        [PHYS_MARK_HALVING] = "end: its half, or less, is a period",
        [PHYS_MARK_REST] = "end: a point at rest",
        [PHYS_MARK_CHANGE] = "stability changed before it: cause unknown"};
    return mark < sizeof words / sizeof *words ? words[mark] : NULL;
}
