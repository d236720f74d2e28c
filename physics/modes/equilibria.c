/* Equilibria from many starts: the box they are drawn in, what each leads to, and which are the
   same (modes.h). */
#include "physics/linear/vectors.h"
#include "autodiff/sized.h"
#include "search.h"
#include "autodiff/ascending.h"
#include "autodiff/free.h"
#include "physics/io/random.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STARTS = 200, PLACES = 3, SURVEY = 15 };

static const double same = 1e-6; /* in units of the box */

static enum ad_status no_memory(const struct search *s, struct ad_error *error)
{
    return ad_fail(error, AD_E_MEMORY, "out of memory for %zu coordinates", s->n);
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
            if (!phys_equilibrium_evaluate(s, s->next))
                return false;
            kept[k][0] = phys_scaled_norm(n, s->force, 1) + s->force[i];
            kept[k][1] = phys_scaled_norm(n * n, s->turn, 1) + s->turn[i * n + i];
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

static void drop(struct phys_equilibrium *one) { AD_FREE(one->q, one->mode, one->shapes); }

static enum ad_status add(struct search *s, double off, struct ad_error *error)
{
    struct phys_equilibria *found = s->found;
    struct phys_equilibrium one = {.uncertainty = off, .reached = 1};
    phys_equilibrium_evaluate(s, s->y); /* s->q */
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
    if (phys_equilibrium_is_smooth(s) && phys_equilibrium_evaluate(s, s->y) &&
        phys_equilibrium_decompose(s)) {
        phys_equilibrium_doubt(s, off);
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
        isfinite(phys_largest(n, s->middle)))
        width = phys_largest(n, s->middle) > 0 ? 1.5 * phys_largest(n, s->middle) : 1;
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
        s->found->low[i] = s->middle[i] - s->size[i];
        s->found->high[i] = s->middle[i] + s->size[i];
    }
    return AD_OK;
}

/* The median of the forces' lengths at places of the box. */
static void survey(struct search *s)
{
    struct phys_random random;
    double forces[SURVEY] = {0};
    size_t n = 0;
    phys_random_seed(&random, 1);
    for (size_t k = 0; k < SURVEY; k++) {
        for (size_t i = 0; i < s->n; i++)
            s->next[i] = 2 * phys_random_uniform(&random) - 1;
        if (phys_equilibrium_evaluate(s, s->next))
            forces[n++] = phys_scaled_norm(s->n, s->force, 1);
    }
    qsort(forces, n, sizeof *forces, ad_ascending);
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
    if (phys_refuse_forces(s->system, "equilibria and modes", error) != AD_OK ||
        phys_refuse_constraints(s->system, "equilibria and modes", error) != AD_OK)
        return error->status;
    if (!phys_keeps_energy(s->system, error))
        return error->status != AD_OK
                   ? error->status
                   : ad_fail(error, AD_E_ARGUMENT,
                             "%s: L depends on time (damping, a drive): it has no equilibria",
                             s->system->scene->name);
    double *room = calloc(10 * n + 3 * n * n, sizeof *room);
    s->middle = room;
    s->found->angle = calloc(n, sizeof *s->found->angle);
    s->found->low = calloc(2 * n, sizeof *s->found->low);
    if (!room || !s->found->angle || !s->found->low)
        return no_memory(s, error);
    s->found->high = s->found->low + n;
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
    size_t usable = 0, once = 0;
    struct phys_random random;
    phys_random_seed(&random, s->settings->seed);
    for (size_t k = 0; k < starts && error->status == AD_OK; k++) {
        double off;
        for (size_t i = 0; k > 0 && i < s->n; i++)
            s->y[i] = 2 * phys_random_uniform(&random) - 1;
        if (s->settings->proceed && !s->settings->proceed(s->settings->context))
            return ad_fail(error, AD_E_ACCURACY, "interrupted after %zu starts", k);
        usable += phys_equilibrium_evaluate(s, s->y);
        s->found->starts++;
        if (k % 2)
            phys_equilibrium_descend(s);
        if (phys_equilibrium_approach(s, &off))
            add(s, off, error);
        else
            s->found->lost++;
    }
    if (error->status == AD_OK && usable == 0)
        return ad_fail(error, AD_E_NONFINITE,
                       "%s: at none of %zu places has L finite derivatives, and a mass matrix that "
                       "is not singular, at rest",
                       s->system->scene->name, starts);
    for (size_t k = 0; k < s->found->n; k++)
        once += s->found->one[k].reached == 1;
    s->found->unseen =
        phys_random_unseen(once, s->found->starts - s->found->lost, &s->found->unseen_limit);
    if (s->found->n > 1)
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
        AD_FREE(found->one, found->angle, found->low);
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
