/* Every motion of one coordinate between two positions in a given time (energy_sweep.h).

   Direction, energy and number of turns determine a motion, and its time is a sum of integrals of
   dq / v between turning points. As a function of the energy it is smooth between the maxima of U
   that bound the motion; near such a maximum it grows like -log|E - height|. Energies are therefore
   sampled at equal steps of that logarithm, from either side. Roots lie where the sign of T(E) -
   time changes, or where its magnitude has a minimum that reaches zero; closer to a maximum than
   the rounding of U, T keeps growing as that logarithm, which leaves one more root or none. Of a
   given energy the times T(E) are those of the motions. */
#include "autodiff/free.h"
#include "energy_parts.h"
#include "physics/io/grow.h"
#include "physics/lagrangian/conserved.h"

#include <math.h>
#include <stdlib.h>

enum { DENSITY = 6, DOUBLINGS = 3, BISECTIONS = 60 };

static const double FLAT = 1e-3; /* a time that grows less in an e-fold does not diverge */
static const double SMALL =
    1e-8; /* oscillations smaller than that are rounding, not other motions */
static const double COARSE = 0.7; /* cells of integrals */

double phys_energy_of(const struct phys_energy_root *r)
{
    return r->level + (r->side != 0 ? r->side * exp(r->log_gap) : 0);
}

/* Duration minus the given one; NaN where the motion is lost. */
static double excess(struct phys_energy_sweep *s, struct phys_energy_root *r, double log_gap,
                     struct phys_energy_way *w)
{
    r->log_gap = log_gap;
    if (!phys_energy_way_find(s, phys_energy_of(r), w)) {
        s->lost = true;
        return (double)NAN;
    }
    return phys_energy_way_time(w, r->direction, r->turns) - s->ask.time;
}

static void add_root(struct phys_energy_sweep *s, const struct phys_energy_root *r)
{
    if (phys_grow(&s->root, s->n_roots, sizeof *s->root))
        s->root[s->n_roots++] = *r;
    else
        s->lost = true;
}

static void bisect(struct phys_energy_sweep *s, struct phys_energy_root r, double a, double b,
                   double at_a, struct phys_energy_way *w)
{
    for (int k = 0; k < BISECTIONS && fabs(b - a) > 1e-14 * fabs(a); k++) {
        double middle = 0.5 * (a + b), here = excess(s, &r, middle, w);
        if (isnan(here))
            return;
        if ((here < 0) == (at_a < 0))
            a = middle;
        else
            b = middle;
    }
    r.log_gap = 0.5 * (a + b);
    add_root(s, &r);
}

/* Two roots between neighbours where the size of f has a minimum (golden section). */
static void touch(struct phys_energy_sweep *s, struct phys_energy_root r, const double x[3],
                  const double f[3], struct phys_energy_way *w)
{
    static const double golden = 0.38196601125010515;
    double a = x[0], b = x[2], m = x[1], at_m = f[1];
    for (int k = 0; k < 40 && fabs(b - a) > 1e-7; k++) {
        double t = fabs(b - m) > fabs(m - a) ? m + golden * (b - m) : m - golden * (m - a);
        double here = excess(s, &r, t, w);
        if (isnan(here))
            return;
        if ((here < 0) != (f[1] < 0)) {
            bisect(s, r, x[0], t, f[0], w);
            bisect(s, r, t, x[2], here, w);
            return;
        }
        if (fabs(here) < fabs(at_m)) {
            *(t > m ? &a : &b) = m;
            m = t;
            at_m = here;
        } else {
            *(t > m ? &b : &a) = t;
        }
    }
}

/* A motion that rests at its start or end has two names: with the turn there, and without. */
static bool has_other_name(const struct phys_energy_sweep *s, const struct phys_energy_root *r)
{
    for (size_t k = 0; k < s->n_roots; k++) {
        const struct phys_energy_root *a = &s->root[k];
        if (a->level == r->level && a->side == r->side && a->log_gap == r->log_gap &&
            a->dwell == 0 && (a->turns == r->turns + 1 || r->turns == a->turns + 1))
            return true;
    }
    return false;
}

/* Roots of one function from its values at equal steps of the logarithm, nearest to the level
 * first.
 */
static void find_roots(struct phys_energy_sweep *s, struct phys_energy_root r, size_t n,
                       const double *x, const double *f, struct phys_energy_way *w)
{
    double slope = f[0] - f[1]; /* as the level comes nearer by a step */
    double fold = x[1] - x[0];
    struct phys_energy_root rest = r;
    rest.log_gap = x[0];
    if (f[0] < 0 && isfinite(f[1]) && slope / fold > FLAT * (f[0] + s->ask.time)) {
        rest.dwell = -f[0];
        add_root(s, &rest);
    } else if (fabs(f[0]) < 1e-5 * s->ask.time && !has_other_name(s, &rest)) {
        add_root(s, &rest); /* at the level itself: a start or end at rest */
    }
    for (size_t k = 0; k + 1 < n; k++) {
        if (!isfinite(f[k]) || !isfinite(f[k + 1]))
            continue;
        if ((f[k] < 0) != (f[k + 1] < 0))
            bisect(s, r, x[k], x[k + 1], f[k], w);
        else if (k > 0 && isfinite(f[k - 1]) && (f[k - 1] < 0) == (f[k] < 0) &&
                 fabs(f[k]) <= fabs(f[k - 1]) && fabs(f[k]) <= fabs(f[k + 1]) &&
                 fabs(f[k]) <= 2 * fmax(fabs(f[k - 1] - f[k]), fabs(f[k + 1] - f[k])))
            touch(s, r, x + k - 1, f + k - 1, w);
    }
}

static bool goes_on(struct phys_energy_sweep *s)
{
    s->ended = s->ended || (s->ask.proceed && !s->ask.proceed(s->ask.context));
    return !s->ended;
}

/* Whether a level is that of minima alone: above it times are smooth, down to small oscillations.
 */
static bool is_bottom(const struct phys_energy_sweep *s, double level)
{
    bool any = false;
    for (size_t k = 0; k < s->n_places; k++)
        if (fabs(s->place[k].U - level) <= 2 * PHYS_ENERGY_NEAREST * s->size) {
            if (!(s->place[k].bend > 0))
                return false;
            any = true;
        }
    return any;
}

/* Energies on one side of a level, up to a gap. */
static bool sweep_side(struct phys_energy_sweep *s, double level, double side, double gap,
                       size_t density)
{
    double nearest = side > 0 && is_bottom(s, level) ? SMALL : PHYS_ENERGY_NEAREST;
    double least = log(nearest * s->size), most = log(gap);
    size_t n = 3 + (size_t)(fmax(most - least, 0) * (double)(DENSITY * density));
    size_t functions = 2 * (s->ask.most_turns + 2);
    double *x = malloc((n + functions * n) * sizeof *x), *f = x ? x + n : NULL;
    struct phys_energy_way w = {0};
    if (!x)
        return false;
    for (size_t k = 0; k < n && goes_on(s); k++) {
        x[k] = least + (most - least) * (double)k / (double)(n - 1);
        bool found = phys_energy_way_find(s, level + side * exp(x[k]), &w);
        for (size_t j = 0; j < functions; j++)
            f[j * n + k] =
                found ? phys_energy_way_time(&w, j % 2 ? 1 : -1, j / 2) - s->ask.time : (double)NAN;
        s->lost = s->lost || !found;
    }
    for (size_t j = 0; j < functions && goes_on(s); j++) {
        struct phys_energy_root r = {.level = level, .side = side};
        size_t before = s->n_roots;
        r.direction = j % 2 ? 1 : -1;
        r.turns = j / 2;
        find_roots(s, r, n, x, f + j * n, &w);
        if (r.turns > s->ask.most_turns) {
            s->limited = s->limited || s->n_roots > before;
            s->n_roots = before;
        }
    }
    AD_FREE(w.knot, x);
    return !s->ended;
}

static bool sweep(struct phys_energy_sweep *s, size_t density)
{
    s->n_roots = 0;
    s->lost = s->limited = false;
    if (!phys_energy_levels(s, density))
        return false;
    for (size_t k = 0; k + 1 < s->n_levels; k++) {
        double gap = s->level[k + 1] - s->level[k];
        bool last = k + 2 == s->n_levels;
        if (!sweep_side(s, s->level[k], 1, last ? gap : 0.5 * gap, density) ||
            (!last && !sweep_side(s, s->level[k + 1], -1, 0.5 * gap, density)))
            return false;
    }
    return true;
}

/* ---- a given energy ---- */

/* Whether the first or the last leg is none, which makes it a motion with one turn less. */
static bool turns_at_once(const struct phys_energy_way *w, int direction, size_t turns)
{
    const struct phys_energy_knot *right = &w->knot[w->n - 1], *left = &w->knot[0];
    const bool last_right = (direction > 0) == (turns % 2 == 0);
    return w->from.q == (direction > 0 ? right : left)->q ||
           (turns > 0 && w->to.q == (last_right ? left : right)->q);
}

/* Whether a motion comes to rest on top of the potential between two places. */
static bool rests_on_top(const struct phys_energy_sweep *s, double E, double from, double to)
{
    for (size_t k = 0; k < s->n_places; k++)
        if (s->place[k].bend <= 0 && s->place[k].q >= from && s->place[k].q <= to &&
            fabs(s->place[k].U - E) <= PHYS_ENERGY_NEAREST * s->size)
            return true;
    return false;
}

/* Its motions, up to the longest. Where a motion would rest on top of the potential, only those
   that do not come there. */
static bool list(struct phys_energy_sweep *s, size_t density)
{
    struct phys_energy_way w = {0};
    double E = s->ask.energy;
    s->n_roots = 0;
    s->lost = s->limited = false;
    if (!phys_energy_levels(s, density))
        return false;
    if (rests_on_top(s, E, s->low, s->high))
        E -= 2 * PHYS_ENERGY_NEAREST * s->size;
    else if (fabs(E - s->level[0]) <= PHYS_ENERGY_NEAREST * s->size)
        E = s->level[0]; /* it begins or ends at rest */
    const bool leads = E >= s->level[0], found = leads && phys_energy_way_find(s, E, &w);
    const double first = found ? w.knot[0].q : 0, last = found ? w.knot[w.n - 1].q : 0;
    const double reach = 1e-3 * (last - first);
    const bool top = found && rests_on_top(s, s->ask.energy, first - reach, last + reach);
    s->lost = top || (leads && !found);
    for (size_t j = 0; found && j < 2 * (s->ask.most_turns + 2); j++) {
        struct phys_energy_root r = {.level = E, .direction = j % 2 ? 1 : -1, .turns = j / 2};
        r.time = phys_energy_way_time(&w, r.direction, r.turns);
        if (!(r.time <= s->ask.time) || turns_at_once(&w, r.direction, r.turns) ||
            (top && r.turns > 0))
            continue;
        if (r.turns > s->ask.most_turns)
            s->limited = true;
        else
            add_root(s, &r);
    }
    free(w.knot);
    return goes_on(s);
}

/* ---- the search ---- */

enum ad_status phys_energy_sweep_new(const struct phys_system *system,
                                     const struct phys_energy_question *question,
                                     struct phys_energy_sweep **sweep_made, struct ad_error *error)
{
    *sweep_made = NULL;
    if (system->dof != 1 || !phys_keeps_energy(system, error))
        return error->status;
    struct phys_energy_sweep *s = calloc(1, sizeof *s);
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the energies");
    s->ask = *question;
    s->a = fmin(question->from, question->to);
    s->b = fmax(question->from, question->to);
    s->width = COARSE;
    size_t before = SIZE_MAX;
    bool begun = phys_potential_new(&s->U, system, error) == AD_OK;
    for (size_t k = 0, density = 1; begun && !s->certified && k <= DOUBLINGS; k++, density *= 2) {
        begun = question->of_energy ? list(s, density) : sweep(s, density);
        s->certified = begun && !s->lost && s->n_roots == before;
        before = s->n_roots;
    }
    if (begun)
        *sweep_made = s;
    else
        phys_energy_sweep_free(s);
    return error->status;
}

void phys_energy_sweep_free(struct phys_energy_sweep *sweep)
{
    if (!sweep)
        return;
    phys_potential_free(&sweep->U);
    AD_FREE(sweep->place, sweep->level, sweep->root, sweep);
}

size_t phys_energy_sweep_roots(const struct phys_energy_sweep *sweep,
                               const struct phys_energy_root **roots, bool *certified,
                               bool *limited)
{
    *roots = sweep->root;
    *certified = sweep->certified;
    *limited = sweep->limited;
    return sweep->n_roots;
}
