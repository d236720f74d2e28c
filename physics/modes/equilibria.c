/* Equilibria by Newton's method from many starts: the sum of squares of the forces L_q(q, 0) is
   made less by steps of Levenberg's and Marquardt's kind, in coordinates measured by the box, along
   the eigenvectors of L_qq, so that directions without a force take no part. */
#include "autodiff/sized.h"
#include "internal.h"
#include "autodiff/free.h"
#include "physics/io/random.h"
#include "physics/lagrangian/internal.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STARTS = 200, STEPS = 300, DESCENTS = 100, PLACES = 3, SURVEY = 15 };

static const double longest_step = 0.5; /* all in units of the box's half width */
static const double escaped = 30;
static const double converged = 1e-9; /* Newton's next step */
static const double finest = 1e-15;   /* no reason to go on */
static const double same = 1e-6;
static const double cut = 1e-11; /* curvatures below this share of the largest are none */
static const double furthest_doubt = 1e-2;
static const double probe = 1e-4; /* of kinks */

struct search {
    const struct phys_system *system;
    const struct phys_equilibria_settings *settings;
    struct phys_curvature curvature;
    phys_motion *motion;
    size_t n;
    double *middle, *size;                        /* of the box: [n] each */
    double *y, *next;                             /* place in units of `size` [n] */
    double *q, *zero;                             /* [n] */
    double *force, *turn;                         /* [n], [n x n] at y */
    double *vector, *value, *unit, *along, *step; /* [n x n], [n], [n x n], [n], [n] */
    double typical;                               /* length of the force at places of the box */
    struct phys_equilibria *found;
    size_t room;
};

static enum ad_status no_memory(const struct search *s, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", s->n);
}

/* Forces and their derivatives at y. False: not finite, or L_vv is singular. */
static bool evaluate(struct search *s, const double *y)
{
    const size_t n = s->n;
    for (size_t i = 0; i < n; i++)
        s->q[i] = s->middle[i] + y[i] * s->size[i];
    if (!phys_curvature_at(&s->curvature, s->q, s->zero, 0))
        return false;
    for (size_t i = 0; i < n; i++) {
        s->force[i] = s->size[i] * s->curvature.q[i];
        for (size_t j = 0; j < n; j++)
            s->turn[i * n + j] = s->size[i] * s->size[j] * s->curvature.qq[i * n + j];
    }
    return true;
}

static double length(size_t n, const double *x)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

static double largest(size_t n, const double *x)
{
    double most = 0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* Eigenvectors of the derivatives, and the force along them. */
static bool decompose(struct search *s)
{
    const size_t n = s->n;
    memcpy(s->vector, s->turn, n * n * sizeof *s->vector);
    memset(s->unit, 0, n * n * sizeof *s->unit);
    for (size_t i = 0; i < n; i++)
        s->unit[i * n + i] = 1;
    if (phys_lapack_eigenvectors(n, s->vector, s->unit, s->value) != 0)
        return false;
    for (size_t k = 0; k < n; k++) {
        s->along[k] = 0;
        for (size_t i = 0; i < n; i++)
            s->along[k] += s->vector[k * n + i] * s->force[i];
    }
    return true;
}

/* The damped step; returns its largest component. */
static double set_step(struct search *s, double damping)
{
    const size_t n = s->n;
    const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1]));
    memset(s->step, 0, n * sizeof *s->step);
    for (size_t k = 0; k < n; k++) {
        const double value = s->value[k], share = damping * most;
        if (fabs(value) <= cut * most)
            continue;
        const double by = -value * s->along[k] / (value * value + share * share);
        for (size_t i = 0; i < n; i++)
            s->step[i] += by * s->vector[k * n + i];
    }
    return largest(n, s->step);
}

/* Of the force in directions in which it does not change. */
static bool force_remains(const struct search *s)
{
    const double most = fmax(fabs(s->value[0]), fabs(s->value[s->n - 1]));
    double sum = 0;
    for (size_t k = 0; k < s->n; k++)
        if (fabs(s->value[k]) <= cut * most)
            sum += s->along[k] * s->along[k];
    return sqrt(sum) > 64 * DBL_EPSILON * (s->typical + most);
}

/* From s->y: true if it ends at an equilibrium; *off: the next step there. */
static bool approach(struct search *s, double *off)
{
    const size_t n = s->n;
    double damping = 0, before = INFINITY;
    if (!evaluate(s, s->y))
        return false;
    const bool flat = largest(n * n, s->turn) == 0;
    for (size_t count = 0; count < STEPS; count++) {
        if (!decompose(s))
            return false;
        const double newton = set_step(s, 0), size = length(n, s->force);
        const bool near = newton <= converged && (flat || largest(n * n, s->turn) > 0);
        if (near && (newton <= finest || newton > 0.9 * before)) {
            *off = newton;
            return !force_remains(s);
        }
        before = newton;
        for (size_t tries = 0;; tries++) {
            const double step = set_step(s, damping),
                         share = step > longest_step ? longest_step / step : 1;
            for (size_t i = 0; i < n; i++)
                s->next[i] = s->y[i] + share * s->step[i];
            if (evaluate(s, s->next) && (length(n, s->force) < size || near))
                break;
            if (step == 0 || tries == 60)
                return false;
            damping = fmax(4 * damping, 1e-3);
        }
        damping = damping < 1e-6 ? 0 : 0.2 * damping;
        memcpy(s->y, s->next, n * sizeof *s->y);
        if (largest(n, s->y) > escaped)
            return false;
    }
    return false;
}

static double energy(struct search *s, const double *y)
{
    for (size_t i = 0; i < s->n; i++)
        s->q[i] = s->middle[i] + y[i] * s->size[i];
    return phys_motion_energy(s->motion, s->q, s->zero, 0);
}

/* Makes the energy at rest less, with curvatures taken as positive: to where clusters are bound,
   which few steps towards small forces reach. */
static void descend(struct search *s)
{
    const size_t n = s->n;
    double damping = 1e-3, now = energy(s, s->y);
    for (size_t count = 0; count < DESCENTS && evaluate(s, s->y) && decompose(s); count++) {
        const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1]));
        memset(s->step, 0, n * sizeof *s->step);
        for (size_t k = 0; k < n; k++)
            for (size_t i = 0; i < n; i++)
                s->step[i] += s->vector[k * n + i] * s->along[k] /
                              (fabs(s->value[k]) + damping * most + DBL_MIN);
        const double step = largest(n, s->step),
                     share = step > longest_step / 5 ? longest_step / 5 / step : 1;
        for (size_t i = 0; i < n; i++)
            s->next[i] = s->y[i] + share * s->step[i];
        const double next = energy(s, s->next);
        if (next < now) {
            memcpy(s->y, s->next, n * sizeof *s->y);
            damping *= 0.3;
            now = next;
        } else {
            damping *= 8;
        }
        if (step < 1e-4 || damping > 1e6 || largest(n, s->y) > escaped)
            return;
    }
}

/* Whether force and derivatives at y agree with those beside it: not where L has kinks. */
static bool is_smooth(struct search *s)
{
    const size_t n = s->n, square = n * n;
    double *room = malloc((3 * n + 4 * square) * sizeof *room), most = 0, off = 0, curved = 0,
           jump = 0, closer = 0, forces = 0;
    bool smooth = room && evaluate(s, s->y);
    double *force = room, *turn = room ? room + 3 * n : NULL;
    for (size_t k = 0; smooth && k < 4; k++) { /* before, after, close before, close after; there */
        if (k == 0)
            memcpy(turn, s->turn, square * sizeof *turn);
        const double h = (k % 2 ? 1 : -1) * (k < 2 ? probe : probe / 100);
        for (size_t i = 0; i < n; i++)
            s->next[i] = s->y[i] + (i % 3 == 1 ? -h : h) / (1 + 0.1 * (double)(i % 7));
        smooth = evaluate(s, s->next);
        if (k < 2) {
            memcpy(force + k * n, s->force, n * sizeof *force);
            memcpy(turn + (1 + k) * square, s->turn, square * sizeof *turn);
        } else {
            for (size_t i = 0; i < square; i++)
                closer = fmax(closer, fabs(s->turn[i] - turn[i]));
        }
    }
    for (size_t i = 0; smooth && i < n; i++) {
        double change = 0;
        for (size_t j = 0; j < n; j++) {
            const double *t = turn + i * n + j;
            change += t[0] * (j % 3 == 1 ? -2 : 2) * probe / (1 + 0.1 * (double)(j % 7));
            most = fmax(most, fabs(t[0]));
            jump = fmax(jump, fmax(fabs(t[square] - t[0]), fabs(t[2 * square] - t[0])));
            curved = fmax(curved, fabs(t[square] - 2 * t[0] + t[2 * square]));
        }
        forces = fmax(forces, fabs(force[n + i]) + fabs(force[i]));
        off = fmax(off, fabs(force[n + i] - force[i] - change));
    }
    free(room);
    return smooth && off <= (double)n * probe * (curved + 1e-5 * most) + 1e-9 * forces &&
           closer <= 0.1 * jump + 1e-7 * most;
}

/* ---- what there is ---- */

/* L is unchanged by a turn of 2 pi, and not by others. */
static bool is_angle(struct search *s, size_t i)
{
    static const double turns[] = {0, 2 * M_PI, 1};
    const size_t n = s->n;
    double kept[3][2];
    bool changes = false;
    for (size_t place = 0; place < PLACES; place++) {
        for (size_t k = 0; k < 3; k++) {
            for (size_t j = 0; j < n; j++)
                s->next[j] = sin((double)(3 * j + 5 * place) + 1);
            s->next[i] += turns[k] / s->size[i];
            if (!evaluate(s, s->next))
                return false;
            kept[k][0] = length(n, s->force) + s->force[i];
            kept[k][1] = length(n * n, s->turn) + s->turn[i * n + i];
        }
        const double scale = fabs(kept[0][0]) + fabs(kept[0][1]) + fabs(kept[2][0]);
        for (size_t k = 0; k < 2; k++) {
            if (!(fabs(kept[1][k] - kept[0][k]) <= 1e-9 * scale))
                return false;
            changes = changes || fabs(kept[2][k] - kept[0][k]) > 1e-6 * scale;
        }
    }
    return changes;
}

static double apart(const struct search *s, const double *a, const double *b)
{
    double most = 0;
    for (size_t i = 0; i < s->n; i++) {
        double d = a[i] - b[i];
        if (s->found->angle[i])
            d = remainder(d, 2 * M_PI);
        most = fmax(most, fabs(d) / s->size[i]);
    }
    return most;
}

/* The same energy and the same modes, of which some have no frequency: one is moved into the other
   along them. */
static bool are_family(const struct phys_equilibrium *a, const struct phys_equilibrium *b, size_t n)
{
    bool zero = false;
    double scale = 0;
    if (a->n_modes != n || b->n_modes != n ||
        fabs(a->energy - b->energy) > 1e-9 * (fabs(a->energy) + fabs(b->energy)) + DBL_MIN)
        return false;
    for (size_t k = 0; k < n; k++)
        scale = fmax(scale, hypot(a->mode[k].growth, a->mode[k].frequency));
    for (size_t k = 0; k < n; k++) {
        const struct phys_mode *x = &a->mode[k], *y = &b->mode[k];
        const double off = 1e-6 * scale + x->uncertainty + y->uncertainty;
        zero = zero || (x->growth == 0 && x->frequency == 0);
        if (fabs(x->growth - y->growth) > off || fabs(x->frequency - y->frequency) > off)
            return false;
    }
    return zero;
}

/* How far the place may be off, in s->step: Newton's next step, and the rounding of the forces
   against their change, which is little where the equilibrium is degenerate. */
static void doubt_place(struct search *s, double off)
{
    const size_t n = s->n;
    const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1])),
                 noise = 8 * DBL_EPSILON * (s->typical + most);
    for (size_t i = 0; i < n; i++)
        s->step[i] = 4 * off + DBL_EPSILON;
    for (size_t k = 0; k < n; k++) {
        const double far = fmin(noise / fmax(fabs(s->value[k]), DBL_MIN), furthest_doubt);
        for (size_t i = 0; i < n && fabs(s->value[k]) > cut * most; i++)
            s->step[i] += far * fabs(s->vector[k * n + i]);
    }
}

static void drop(struct phys_equilibrium *one) { AD_FREE(one->q, one->mode, one->shapes); }

static enum ad_status add(struct search *s, double off, struct ad_error *error)
{
    struct phys_equilibria *found = s->found;
    struct phys_equilibrium one = {.uncertainty = off, .reached = 1};
    evaluate(s, s->y); /* s->q */
    for (size_t i = 0; i < s->n; i++) {
        if (found->angle[i])
            s->q[i] = remainder(s->q[i], 2 * M_PI);
        if (found->angle[i] && s->q[i] <= -M_PI + same)
            s->q[i] += 2 * M_PI;
        if (fabs(s->q[i]) <= 2 * off * s->size[i] + DBL_EPSILON * s->size[i])
            s->q[i] = 0;
    }
    for (size_t k = 0; k < found->n; k++)
        if (apart(s, s->q, found->one[k].q) <= same + 10 * found->one[k].uncertainty) {
            found->one[k].reached++;
            return AD_OK;
        }
    if (found->n == s->room) {
        const size_t room = s->room ? 2 * s->room : 8;
        struct phys_equilibrium *more = realloc(found->one, room * sizeof *more);
        if (!more)
            return no_memory(s, error);
        found->one = more;
        s->room = room;
    }
    if (!(one.q = malloc(s->n * sizeof *one.q)))
        return no_memory(s, error);
    memcpy(one.q, s->q, s->n * sizeof *one.q);
    one.energy = phys_motion_energy(s->motion, one.q, s->zero, 0);
    one.kind = PHYS_EQUILIBRIUM_UNDECIDED;
    if (is_smooth(s) && evaluate(s, s->y) && decompose(s)) {
        doubt_place(s, off);
        phys_modes_at(&s->curvature, s->size, s->step, &one, error);
    }
    for (size_t k = 0; k < found->n; k++)
        if (are_family(&found->one[k], &one, s->n)) {
            found->one[k].reached++;
            found->one[k].family = true;
            drop(&one);
            return error->status;
        }
    found->one[found->n++] = one;
    return error->status;
}

/* ---- starts ---- */

static bool has_box(const struct phys_equilibria_settings *how, size_t i)
{
    return how->low && !(isnan(how->low[i]) && isnan(how->high[i]));
}

static enum ad_status set_box(struct search *s, struct ad_error *error)
{
    const struct phys_equilibria_settings *how = s->settings;
    const size_t n = s->n;
    double width = 1;
    struct ad_error none = {0};
    if ((how->low == NULL) != (how->high == NULL))
        return ad_fail(error, AD_E_ARGUMENT, "low and high: one of both is NULL");
    /* a start that the parameters do not have leaves the box about 0 */
    if (s->system->scene->start &&
        s->system->scene->start(s->system->params, how->seed, s->middle, s->next, &none) == AD_OK &&
        isfinite(largest(n, s->middle)))
        width = largest(n, s->middle) > 0 ? 1.5 * largest(n, s->middle) : 1;
    else
        memset(s->middle, 0, n * sizeof *s->middle);
    for (size_t i = 0; i < n; i++) {
        s->size[i] = width;
        if (has_box(how, i) &&
            !(how->high[i] > how->low[i] && isfinite(how->high[i] - how->low[i])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "coordinate %zu: a box from %g to %g; expected low < high", i,
                           how->low[i], how->high[i]);
    }
    memcpy(s->y, s->middle, n * sizeof *s->y);
    memset(s->middle, 0, n * sizeof *s->middle);
    for (size_t i = 0; i < n; i++)
        s->found->angle[i] = is_angle(s, i);
    for (size_t i = 0; i < n; i++) {
        if (s->found->angle[i])
            s->size[i] = M_PI;
        if (has_box(how, i)) {
            s->middle[i] = 0.5 * (how->low[i] + how->high[i]);
            s->size[i] = 0.5 * (how->high[i] - how->low[i]);
        }
        s->y[i] = (s->y[i] - s->middle[i]) / s->size[i];
    }
    return AD_OK;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The median of the forces' lengths at places of the box. */
static void survey(struct search *s)
{
    struct phys_random random;
    double forces[SURVEY];
    size_t n = 0;
    phys_random_seed(&random, 1);
    for (size_t k = 0; k < SURVEY; k++) {
        for (size_t i = 0; i < s->n; i++)
            s->next[i] = 2 * phys_random_uniform(&random) - 1;
        if (evaluate(s, s->next))
            forces[n++] = length(s->n, s->force);
    }
    qsort(forces, n, sizeof *forces, ascending);
    s->typical = n ? forces[n / 2] : 0;
}

static enum ad_status prepare(struct search *s, struct ad_error *error)
{
    const size_t n = s->n;
    if (n > PHYS_MODES_DOF)
        return ad_fail(error, AD_E_ARGUMENT, "%s: modes of %zu coordinates; expected at most %d",
                       s->system->scene->name, n, PHYS_MODES_DOF);
    if (s->system->scene->free_time)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: modes of a scene whose time is free; expected one that moves in time",
                       s->system->scene->name);
    if (!phys_keeps_energy(s->system, error))
        return error->status != AD_OK
                   ? error->status
                   : ad_fail(error, AD_E_ARGUMENT,
                             "%s: L depends on time (damping, a drive): it has no equilibria",
                             s->system->scene->name);
    double *room = calloc(10 * n + 3 * n * n, sizeof *room);
    s->middle = room;
    s->found->angle = calloc(n, sizeof *s->found->angle);
    if (!room || !s->found->angle)
        return no_memory(s, error);
    double **const parts[] = {&s->size,  &s->y,     &s->next,  &s->q,   &s->zero,
                              &s->force, &s->value, &s->along, &s->step};
    for (size_t k = 0; k < LENGTH(parts); k++)
        *parts[k] = room + (k + 1) * n;
    s->turn = room + 10 * n;
    s->vector = s->turn + n * n;
    s->unit = s->vector + n * n;
    if (phys_curvature_new(&s->curvature, s->system, error) != AD_OK ||
        phys_motion_new(s->system, &s->motion, error) != AD_OK || set_box(s, error) != AD_OK)
        return error->status;
    survey(s);
    return AD_OK;
}

static int by_energy(const void *a, const void *b)
{
    const struct phys_equilibrium *x = a, *y = b;
    return (x->energy > y->energy) - (x->energy < y->energy);
}

static enum ad_status try_starts(struct search *s, struct ad_error *error)
{
    const size_t starts = s->settings->starts ? s->settings->starts : STARTS;
    size_t usable = 0;
    struct phys_random random;
    phys_random_seed(&random, s->settings->seed);
    for (size_t k = 0; k < starts && error->status == AD_OK; k++) {
        double off;
        for (size_t i = 0; k > 0 && i < s->n; i++)
            s->y[i] = 2 * phys_random_uniform(&random) - 1;
        if (s->settings->proceed && !s->settings->proceed(s->settings->context))
            return ad_fail(error, AD_E_ACCURACY, "ended on request after %zu starts", k);
        usable += evaluate(s, s->y);
        s->found->starts++;
        if (k % 2)
            descend(s);
        if (approach(s, &off))
            add(s, off, error);
        else
            s->found->lost++;
    }
    if (error->status == AD_OK && usable == 0)
        return ad_fail(error, AD_E_NONFINITE,
                       "%s: at none of %zu places has L finite derivatives, and a mass matrix that "
                       "is not singular, at rest",
                       s->system->scene->name, starts);
    qsort(s->found->one, s->found->n, sizeof *s->found->one, by_energy);
    return error->status;
}

enum ad_status phys_equilibria_find(const struct phys_system *system,
                                    const struct phys_equilibria_settings *settings,
                                    struct phys_equilibria *found, struct ad_error *error)
{
    static const struct phys_equilibria_settings defaults = {.size = sizeof defaults};
    if (AD_LACKS_RESULT(error, found) || AD_LACKS(error, system, system->scene))
        return error->status;
    settings = settings ? settings : &defaults;
    AD_OWN(phys_equilibria_settings, settings, context, error);
    struct search s = {.system = system, .settings = settings, .n = system->dof, .found = found};
    if (prepare(&s, error) == AD_OK)
        try_starts(&s, error);
    phys_curvature_free(&s.curvature);
    phys_motion_free(s.motion);
    free(s.middle);
    return error->status;
}

void phys_equilibria_free(struct phys_equilibria *found)
{
    for (size_t k = 0; found && k < found->n; k++)
        drop(&found->one[k]);
    if (found)
        AD_FREE(found->one, found->angle);
}

const char *phys_equilibrium_word(enum phys_equilibrium_kind kind)
{
    static const char *const words[] = {
        [PHYS_EQUILIBRIUM_LEAST] = "stable: least energy",
        [PHYS_EQUILIBRIUM_NEUTRAL] = "not decided: modes of frequency 0",
        [PHYS_EQUILIBRIUM_GYROSCOPIC] = "stable by the linear equations, energy not least",
        [PHYS_EQUILIBRIUM_UNSTABLE] = "unstable",
        [PHYS_EQUILIBRIUM_UNDECIDED] = "not decided: no second derivatives of L",
    };
    return (size_t)kind < LENGTH(words) ? words[kind] : "unknown";
}
