/* Every motion of one coordinate between two places in a given time (energy_sweep.h).

   With direction, energy and number of turns a motion is given, and its time is a sum of integrals
   of dq / v between turning points. As a function of the energy it is smooth between the heights of
   the maxima of U that bound the motion; near such a height it grows like -log|E - height|. So
   energies are taken at equal steps of that logarithm, from either side. Roots are where the sign
   of T(E) - time changes, or where its size has a minimum that reaches zero; nearer to a height
   than rounding lets U tell, T grows on as that logarithm, and there is one root more, or none. */
#include "energy_sweep.h"
#include "physics/stability/stability.h"
#include "potential.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    POINTS = 8,
    PLACES = 1 << 13,
    DENSITY = 6,
    DOUBLINGS = 3,
    MOST_CELLS = 256,
    BISECTIONS = 60
};

static const double RANGE = 1e3;     /* of places and speeds, in natural sizes */
static const double NEAREST = 1e-11; /* to a height, of the potential's size */
static const double FLAT = 1e-3;     /* a time that grows less in an e-fold does not diverge */

static const double COARSE = 0.7, FINE = 0.1; /* cells of integrals: for times, for paths */

/* Gauss and Legendre on [-1, 1]. */
static const double gauss[POINTS / 2][2] = {{0.18343464249564980, 0.36268378337836198},
                                            {0.52553240991632899, 0.31370664587788729},
                                            {0.79666647741362674, 0.22238103445337447},
                                            {0.96028985649753623, 0.10122853629037626}};

struct place {
    double q, U, bend;
};

struct phys_energy_sweep {
    struct phys_energy_question ask;
    struct phys_potential U;
    double width;                    /* of a cell of an integral, in its variable */
    double size;                     /* of U: what its last digits are relative to */
    double low, high, low_U, high_U; /* the range that was looked at */
    size_t n_places;                 /* maxima and minima of U, by q */
    struct place *place;
    size_t n_levels;
    double *level; /* heights that bound the motion, ascending; the last is the highest energy */
    size_t n_roots;
    struct phys_energy_root *root;
    bool certified, limited, lost;
};

/* ---- the shape of the potential ---- */

/* The zero of U' (or of U - E, where `height`) between a and b, by sections of all lanes. */
static double bracket(struct phys_energy_sweep *s, double a, double b, bool height, double E)
{
    for (int round = 0; round < 9; round++) {
        double q[PHYS_POTENTIAL_LANES], U[PHYS_POTENTIAL_LANES];
        enum { LAST = PHYS_POTENTIAL_LANES - 1 };
        for (int k = 0; k <= LAST; k++)
            q[k] = k == LAST ? b : a + (b - a) * k / LAST;
        phys_potential_values(&s->U, LAST + 1, q, U);
        const double *f = height ? U : ad_data(s->U.of_place, s->U.slope);
        double from = f[0] - (height ? E : 0);
        int k = 1;
        while (k < LAST && (f[k] - (height ? E : 0) < 0) == (from < 0))
            k++;
        if (q[k - 1] == a && q[k] == b)
            break;
        a = q[k - 1];
        b = q[k];
    }
    return a; /* on the side of a */
}

static int by_place(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return (*x > *y) - (*x < *y);
}

/* Where to look: densely around both ends, then at growing distances. */
static size_t look_at(const struct phys_energy_sweep *s, size_t n, double *q)
{
    double a = fmin(s->ask.from, s->ask.to), b = fmax(s->ask.from, s->ask.to);
    double near = 2 * s->ask.span, far = RANGE * s->ask.span;
    size_t dense = n / 2, side = n / 4;
    for (size_t k = 0; k < dense; k++)
        q[k] = a - near + (b - a + 2 * near) * (double)k / (double)(dense - 1);
    for (size_t k = 0; k < side; k++) {
        double out = near * pow(far / near, (double)(k + 1) / (double)side);
        q[dense + k] = a - out;
        q[dense + side + k] = b + out;
    }
    q[dense + 2 * side] = a;
    q[dense + 2 * side + 1] = b;
    size_t count = dense + 2 * side + 2;
    qsort(q, count, sizeof *q, by_place);
    return count;
}

/* Maxima and minima of U; the range ends where U ceases to be finite. */
static bool find_places(struct phys_energy_sweep *s, size_t density)
{
    size_t n = density * PLACES, middle = 0;
    double *q = malloc(3 * (n + 2) * sizeof *q), *U = q ? q + n + 2 : NULL;
    double *slope = q ? U + n + 2 : NULL;
    s->place = q ? malloc((n + 2) * sizeof *s->place) : NULL;
    if (!s->place) {
        free(q);
        return false;
    }
    n = look_at(s, n, q);
    for (size_t k = 0; k < n; k += PHYS_POTENTIAL_LANES) {
        size_t m = n - k < PHYS_POTENTIAL_LANES ? n - k : PHYS_POTENTIAL_LANES;
        phys_potential_values(&s->U, m, q + k, U + k);
        memcpy(slope + k, ad_data(s->U.of_place, s->U.slope), m * sizeof *slope);
    }
    while (q[middle] < fmin(s->ask.from, s->ask.to))
        middle++;
    size_t first = middle, last = middle;
    while (first > 0 && isfinite(U[first - 1]) && isfinite(slope[first - 1]))
        first--;
    while (last + 1 < n && isfinite(U[last + 1]) && isfinite(slope[last + 1]))
        last++;
    s->low = q[first], s->low_U = U[first];
    s->high = q[last], s->high_U = U[last];
    s->n_places = 0;
    for (size_t k = first; k < last; k++)
        if ((slope[k] < 0) != (slope[k + 1] < 0)) {
            struct place *p = &s->place[s->n_places++];
            double ignored;
            p->q = bracket(s, q[k], q[k + 1], false, 0);
            phys_potential_at(&s->U, p->q, &p->U, &ignored, &p->bend);
        }
    bool whole = s->high >= fmax(s->ask.from, s->ask.to);
    free(q);
    return whole;
}

static void add_level(struct phys_energy_sweep *s, double U)
{
    if (s->n_levels == 0 || U > s->level[s->n_levels - 1] + NEAREST * s->size)
        s->level[s->n_levels++] = U;
}

static int by_height(const void *a, const void *b) { return by_place(a, b); }

/* Of the highest speed that is looked at; where a speed has a limit, of one just below it. */
static double highest_energy(struct phys_energy_sweep *s)
{
    double low = 0, high = RANGE * s->ask.speed;
    double most = phys_potential_energy(&s->U, s->ask.from, high);
    if (isfinite(most))
        return most;
    most = phys_potential_energy(&s->U, s->ask.from, low);
    for (int k = 0; k < BISECTIONS; k++) {
        double middle = 0.5 * (low + high);
        double here = phys_potential_energy(&s->U, s->ask.from, middle);
        bool below = here >= most && isfinite(here); /* it grows with the speed */
        *(below ? &low : &high) = middle;
        most = below ? here : most;
    }
    return most;
}

/* The least energy that leads from end to end, and the heights of the maxima outside, each above
   all that are nearer; then the highest energy. */
static bool find_levels(struct phys_energy_sweep *s)
{
    double a = fmin(s->ask.from, s->ask.to), b = fmax(s->ask.from, s->ask.to), ends[2],
           at[2] = {a, b};
    double *heights = malloc((s->n_places + 3) * sizeof *heights);
    s->level = malloc((s->n_places + 3) * sizeof *s->level);
    if (!heights || !s->level) {
        free(heights);
        return false;
    }
    phys_potential_values(&s->U, 2, at, ends);
    double least = fmax(ends[0], ends[1]), record;
    size_t n = 0, inner = 0;
    for (size_t k = 0; k < s->n_places; k++)
        if (s->place[k].q > a && s->place[k].q < b)
            least = fmax(least, s->place[k].U);
    while (inner < s->n_places && s->place[inner].q <= a)
        inner++;
    record = least;
    for (size_t k = inner; k < s->n_places; k++)
        if (s->place[k].U > record)
            heights[n++] = record = s->place[k].U;
    record = least;
    for (size_t k = inner; k-- > 0;)
        if (s->place[k].U > record)
            heights[n++] = record = s->place[k].U;
    double most = fmax(highest_energy(s), least);
    s->size = fmax(fabs(least), 0.5 * s->ask.speed * s->ask.speed * 1e-3);
    for (size_t k = 0; k < n; k++)
        s->size = fmax(s->size, heights[k] < most ? fabs(heights[k]) : 0);
    qsort(heights, n, sizeof *heights, by_height);
    s->n_levels = 0;
    add_level(s, least);
    for (size_t k = 0; k < n && heights[k] < most; k++)
        add_level(s, heights[k]);
    add_level(s, fmax(most, s->level[s->n_levels - 1] + s->size));
    free(heights);
    return true;
}

/* ---- the time of a motion ---- */

/* The way between the turning points at an energy, or to the ends where there are none: knots by q,
   with the times from the first on to the right, and back from each to the first. */
struct way {
    bool left, right; /* there is a turning point */
    size_t n, room;
    double *q, *there, *back; /* [n] each, one allocation */
    double from[2], to[2];    /* times at the two ends: there, back */
};

static bool turns(struct phys_energy_sweep *s, double E, int side, double *q)
{
    double end = side > 0 ? fmax(s->ask.from, s->ask.to) : fmin(s->ask.from, s->ask.to);
    double before = end;
    for (size_t i = 0; i <= s->n_places; i++) {
        size_t k = side > 0 ? i : s->n_places - 1 - i;
        double here = i < s->n_places ? s->place[k].q : side > 0 ? s->high : s->low;
        double U = i < s->n_places ? s->place[k].U : side > 0 ? s->high_U : s->low_U;
        if (side * (here - end) <= 0)
            continue;
        if (U >= E) {
            *q = bracket(s, before, here, true, E);
            return true;
        }
        before = here;
    }
    *q = end;
    return false;
}

static bool grow(struct way *w, size_t n)
{
    if (n <= w->room)
        return true;
    size_t room = 2 * n;
    double *q = malloc(3 * room * sizeof *q);
    if (!q)
        return false;
    for (size_t k = 0; k < w->n; k++) {
        q[k] = w->q[k];
        q[room + k] = w->there[k];
        q[2 * room + k] = w->back[k];
    }
    free(w->q);
    w->q = q;
    w->there = q + room;
    w->back = q + 2 * room;
    w->room = room;
    return true;
}

/* Half a cell, from `end` on towards `side` for a length: with d = l (cosh x - 1) from a turning
   point, l sinh x else, dq / v is smooth in x where l is the length over which v changes there. */
static bool half_cell(struct phys_energy_sweep *s, double E, double end, int side, double length,
                      bool turning, struct way *w)
{
    double U, slope, bend, l = length;
    phys_potential_at(&s->U, end, &U, &slope, &bend);
    double K = fmax(E - U, 0);
    if (turning)
        l = fmin(l, fabs(slope) / fmax(fabs(bend), 1e-300));
    else if (K > 0)
        l = fmin(l, fmin(K / fmax(fabs(slope), 1e-300), sqrt(2 * K / fmax(fabs(bend), 1e-300))));
    l = fmax(l, 1e-9 * length);
    double last = turning ? acosh(1 + length / l) : asinh(length / l);
    size_t cells = (size_t)ceil(last / s->width), n = cells * POINTS;
    double q[MOST_CELLS * POINTS], over[MOST_CELLS * POINTS], speed[2][MOST_CELLS * POINTS];
    double by_x[MOST_CELLS * POINTS];
    if (cells > MOST_CELLS || !grow(w, w->n + cells + 1))
        return false;
    for (size_t k = 0; k < n; k++) {
        const double *g = gauss[k % POINTS / 2];
        double x =
            last * ((double)(k / POINTS) + 0.5 + (k % 2 ? 0.5 : -0.5) * g[0]) / (double)cells;
        double d = turning ? 2 * l * sinh(0.5 * x) * sinh(0.5 * x) : l * sinh(x);
        by_x[k] = 0.5 * g[1] * last / (double)cells * l * (turning ? sinh(x) : cosh(x));
        q[k] = end + side * d;
        over[k] = turning && d < 1e-7 * l ? fabs(slope) * d : 0;
    }
    double height[MOST_CELLS * POINTS];
    phys_potential_values(&s->U, n, q, height);
    for (size_t k = 0; k < n; k++)
        if (over[k] == 0) /* nearest to a turning point the difference is lost to rounding */
            over[k] = fmax(E - height[k], turning ? 1e-16 * s->size : 1e-18 * s->size);
    phys_potential_speeds(&s->U, 1, n, q, over, speed[0]);
    phys_potential_speeds(&s->U, -1, n, q, over, speed[1]);
    for (size_t c = 0; c < cells; c++) {
        double time[2] = {0, 0};
        for (size_t k = c * POINTS; k < (c + 1) * POINTS; k++)
            for (size_t j = 0; j < 2; j++)
                time[j] += by_x[k] / speed[j][k];
        double x = last * (double)(c + 1) / (double)cells;
        double d = turning ? 2 * l * sinh(0.5 * x) * sinh(0.5 * x) : l * sinh(x);
        w->q[w->n] = end + side * d;
        w->there[w->n] = time[0];
        w->back[w->n++] = time[1];
    }
    return true;
}

/* A cell: both halves as knots with the times since the first. */
static bool cell(struct phys_energy_sweep *s, double E, double a, double b, bool left, bool right,
                 struct way *w)
{
    size_t first = w->n, half;
    if (!half_cell(s, E, a, 1, 0.5 * (b - a), left, w))
        return false;
    for (size_t k = first; k < w->n; k++) {
        w->there[k] += w->there[k - 1];
        w->back[k] += w->back[k - 1];
    }
    half = w->n;
    if (!half_cell(s, E, b, -1, 0.5 * (b - a), right, w))
        return false;
    /* the second half came from its end: knots b - d, last one the middle */
    size_t cells = w->n - half;
    for (size_t k = 0; k < cells / 2; k++)
        for (size_t j = 0; j < 3; j++) {
            double *x = (j == 0 ? w->q : j == 1 ? w->there : w->back) + half;
            double swap = x[k];
            x[k] = x[cells - 1 - k];
            x[cells - 1 - k] = swap;
        }
    for (size_t k = half; k < w->n; k++) { /* knot k becomes the outer end of its piece */
        w->q[k] = k + 1 < w->n ? w->q[k + 1] : b;
        w->there[k] += w->there[k - 1];
        w->back[k] += w->back[k - 1];
    }
    return true;
}

static bool find_way(struct phys_energy_sweep *s, double E, struct way *w)
{
    double ends[2] = {fmin(s->ask.from, s->ask.to), fmax(s->ask.from, s->ask.to)}, a, b;
    w->n = 0;
    w->left = turns(s, E, -1, &a);
    w->right = turns(s, E, 1, &b);
    if (!grow(w, 1))
        return false;
    w->q[0] = a;
    w->there[0] = w->back[0] = 0;
    w->n = 1;
    double at = a;
    for (size_t k = 0; at < b;) {
        while (k < s->n_places && s->place[k].q <= at)
            k++;
        double next = k < s->n_places ? fmin(s->place[k].q, b) : b;
        for (size_t j = 0; j < 2; j++)
            if (ends[j] > at)
                next = fmin(next, ends[j]);
        if (!cell(s, E, at, next, w->left && at == a, w->right && next == b, w))
            return false;
        at = next;
    }
    for (size_t k = 0; k < w->n; k++) {
        if (w->q[k] == s->ask.from)
            w->from[0] = w->there[k], w->from[1] = w->back[k];
        if (w->q[k] == s->ask.to)
            w->to[0] = w->there[k], w->to[1] = w->back[k];
    }
    return isfinite(w->there[w->n - 1]) && isfinite(w->back[w->n - 1]);
}

/* The time of a motion that begins in a direction and turns so often; infinite where there is none.
 */
static double time_of(const struct way *w, int direction, size_t turns_made)
{
    double right = w->there[w->n - 1], left = w->back[w->n - 1], time;
    bool last_right = (direction > 0) == (turns_made % 2 == 0);
    if (turns_made == 0) {
        time = direction > 0 ? w->to[0] - w->from[0] : w->from[1] - w->to[1];
        return time > 0 ? time : (double)INFINITY;
    }
    if (!(direction > 0 ? w->right : w->left) || (turns_made > 1 && !(w->left && w->right)))
        return (double)INFINITY;
    time = direction > 0 ? right - w->from[0] : w->from[1];
    time += last_right ? w->to[0] : left - w->to[1];
    size_t legs = turns_made - 1, opposite = (legs + 1) / 2, same = legs / 2;
    return time + (double)opposite * (direction > 0 ? left : right) +
           (double)same * (direction > 0 ? right : left);
}

/* ---- roots ---- */

static double energy_of(const struct phys_energy_root *r)
{
    return r->level + r->side * exp(r->log_gap);
}

/* Time minus that wanted; NaN where the way is lost. */
static double excess(struct phys_energy_sweep *s, struct phys_energy_root *r, double log_gap,
                     struct way *w)
{
    r->log_gap = log_gap;
    if (!find_way(s, energy_of(r), w)) {
        s->lost = true;
        return (double)NAN;
    }
    return time_of(w, r->direction, r->turns) - s->ask.time;
}

static void add_root(struct phys_energy_sweep *s, const struct phys_energy_root *r)
{
    struct phys_energy_root *grown = realloc(s->root, (s->n_roots + 1) * sizeof *grown);
    s->lost = s->lost || !grown;
    if (!grown)
        return;
    s->root = grown;
    s->root[s->n_roots++] = *r;
}

static void bisect(struct phys_energy_sweep *s, struct phys_energy_root r, double a, double b,
                   double at_a, struct way *w)
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
                  const double f[3], struct way *w)
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

/* Roots of one function from its values at equal steps of the logarithm, nearest to the level
 * first.
 */
static void find_roots(struct phys_energy_sweep *s, struct phys_energy_root r, size_t n,
                       const double *x, const double *f, struct way *w)
{
    double slope = f[0] - f[1]; /* as the level comes nearer by a step */
    double fold = x[1] - x[0];
    if (f[0] < 0 && isfinite(f[1]) && slope / fold > FLAT * (f[0] + s->ask.time)) {
        r.log_gap = x[0];
        r.dwell = -f[0];
        add_root(s, &r);
        r.dwell = 0;
    } else if (fabs(f[0]) < 1e-5 * s->ask.time) { /* at the level itself: a start or end at rest */
        r.log_gap = x[0];
        add_root(s, &r);
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

/* Energies on one side of a level, up to a gap. */
static bool sweep_side(struct phys_energy_sweep *s, double level, double side, double gap,
                       size_t density)
{
    double least = log(NEAREST * s->size), most = log(gap);
    size_t n = 3 + (size_t)(fmax(most - least, 0) * (double)(DENSITY * density));
    size_t functions = 2 * (s->ask.most_turns + 2);
    double *x = malloc((n + functions * n) * sizeof *x), *f = x ? x + n : NULL;
    struct way w = {0};
    if (!x)
        return false;
    for (size_t k = 0; k < n; k++) {
        x[k] = least + (most - least) * (double)k / (double)(n - 1);
        bool found = find_way(s, level + side * exp(x[k]), &w);
        for (size_t j = 0; j < functions; j++)
            f[j * n + k] = found ? time_of(&w, j % 2 ? 1 : -1, j / 2) - s->ask.time : (double)NAN;
        s->lost = s->lost || !found;
    }
    for (size_t j = 0; j < functions; j++) {
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
    free(w.q);
    free(x);
    return true;
}

static bool sweep(struct phys_energy_sweep *s, size_t density)
{
    free(s->place);
    free(s->level);
    s->place = NULL;
    s->level = NULL;
    s->n_roots = 0;
    s->lost = s->limited = false;
    if (!find_places(s, density) || !find_levels(s))
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

/* ---- what is asked ---- */

enum ad_status phys_energy_sweep_new(const struct phys_system *system,
                                     const struct phys_energy_question *question,
                                     struct phys_energy_sweep **sweep_made, struct ad_error *error)
{
    *sweep_made = NULL;
    if (system->dof != 1 || !phys_keeps_energy(system))
        return AD_OK;
    struct phys_energy_sweep *s = calloc(1, sizeof *s);
    if (!s)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the energies");
    s->ask = *question;
    s->width = COARSE;
    size_t before = SIZE_MAX;
    bool begun = phys_potential_new(&s->U, system, error) == AD_OK;
    for (size_t k = 0, density = 1; begun && !s->certified && k <= DOUBLINGS; k++, density *= 2) {
        begun = sweep(s, density);
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
    free(sweep->place);
    free(sweep->level);
    free(sweep->root);
    free(sweep);
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

/* ---- its path ---- */

/* The motion as knots in time: it is followed from place to place. */
struct track {
    size_t n, room;
    double *t, *q;
};

static bool add_knot(struct track *track, double t, double q)
{
    if (track->n == track->room) {
        size_t room = 2 * track->room + 64;
        double *times = realloc(track->t, room * sizeof *times);
        if (!times)
            return false;
        track->t = times;
        double *places = realloc(track->q, room * sizeof *places);
        if (!places)
            return false;
        track->q = places;
        track->room = room;
    }
    track->t[track->n] = t;
    track->q[track->n++] = q;
    return true;
}

/* Whether knot k of the way is where the motion lingers: by a maximum at the level. */
static bool lingers(const struct phys_energy_sweep *s, const struct way *w, size_t k, double level)
{
    double reach = 1e-3 * (w->q[w->n - 1] - w->q[0]);
    for (size_t i = 0; i < s->n_places; i++)
        if (s->place[i].bend < 0 && fabs(s->place[i].U - level) <= 2 * NEAREST * s->size &&
            fabs(s->place[i].q - w->q[k]) <= reach &&
            (k == 0 || k + 1 == w->n || s->place[i].q == w->q[k]))
            return true;
    return false;
}

/* Knots until the motion ends; `stay` at each place where it lingers. Returns how many there were.
 */
static size_t follow(const struct phys_energy_sweep *s, const struct phys_energy_root *r,
                     const struct way *w, double stay, struct track *track)
{
    size_t at = 0, goal = 0, made = 0, visits = 0;
    int direction = r->direction;
    double t = 0;
    while (w->q[at] != s->ask.from)
        at++;
    while (w->q[goal] != s->ask.to)
        goal++;
    track->n = 0;
    add_knot(track, 0, w->q[at]);
    for (;;) {
        if (made == r->turns && at == goal && (track->n > 1 || r->turns > 0))
            return visits;
        if (at == (direction > 0 ? w->n - 1 : 0)) {
            if (made++ == r->turns)
                return visits;
            direction = -direction;
            if (made == r->turns && at == goal)
                return visits;
        }
        size_t next = direction > 0 ? at + 1 : at - 1;
        t += direction > 0 ? w->there[next] - w->there[at] : w->back[at] - w->back[next];
        if (!add_knot(track, t, w->q[next]))
            return visits;
        if (lingers(s, w, next, r->level)) {
            visits++;
            if (stay > 0 && !add_knot(track, t += stay, w->q[next]))
                return visits;
        }
        at = next;
    }
}

bool phys_energy_sweep_path(struct phys_energy_sweep *s, const struct phys_energy_root *root,
                            size_t n, const double *times, double *q)
{
    struct way w = {0};
    struct track track = {0};
    s->width = FINE;
    bool found = find_way(s, energy_of(root), &w);
    s->width = COARSE;
    if (found) {
        size_t visits = follow(s, root, &w, 0, &track);
        if (root->dwell > 0 && visits > 0)
            follow(s, root, &w, root->dwell / (double)visits, &track);
        double scale = track.t[track.n - 1] > 0 ? s->ask.time / track.t[track.n - 1] : 1;
        for (size_t i = 0, k = 0; i < n; i++) {
            while (k + 2 < track.n && scale * track.t[k + 1] < times[i])
                k++;
            double width = scale * (track.t[k + 1] - track.t[k]);
            double share = width > 0 ? (times[i] - scale * track.t[k]) / width : 0;
            q[i] = track.q[k] + fmin(1, fmax(0, share)) * (track.q[k + 1] - track.q[k]);
        }
    }
    free(w.q);
    free(track.t);
    free(track.q);
    return found;
}
