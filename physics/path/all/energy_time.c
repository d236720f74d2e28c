/* The time of a motion of one coordinate at a given energy (energy_parts.h): integrals of dq / v
   between turning points and ends. */
#include "energy_parts.h"

#include <math.h>
#include <stdlib.h>

enum { POINTS = 8, MOST_CELLS = 256 };

/* Gauss and Legendre on [-1, 1]. */
static const double gauss[POINTS / 2][2] = {{0.18343464249564980, 0.36268378337836198},
                                            {0.52553240991632899, 0.31370664587788729},
                                            {0.79666647741362674, 0.22238103445337447},
                                            {0.96028985649753623, 0.10122853629037626}};

static bool grow(struct phys_energy_way *w, size_t n)
{
    if (n <= w->room)
        return true;
    struct phys_energy_knot *knot = realloc(w->knot, 2 * n * sizeof *knot);
    if (!knot)
        return false;
    w->knot = knot;
    w->room = 2 * n;
    return true;
}

/* dq / v is smooth in x, where l is the length over which v changes there. */
static double distance(double l, double x, bool turning)
{
    return turning ? 2 * l * sinh(0.5 * x) * sinh(0.5 * x) : l * sinh(x);
}

/* Half a cell, from `end` on towards `side` for a length: each knot the right end of a piece, with
   the times over that piece. */
static bool half_cell(struct phys_energy_sweep *s, double E, double end, int side, double length,
                      bool turning, struct phys_energy_way *w)
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
        double d = distance(l, x, turning);
        by_x[k] = 0.5 * g[1] * last / (double)cells * l * (turning ? sinh(x) : cosh(x));
        q[k] = end + side * d;
        over[k] = turning && d < 1e-7 * l ? fabs(slope) * d : 0;
    }
    double height[MOST_CELLS * POINTS];
    phys_potential_values(&s->U, n, q, height);
    for (size_t k = 0; k < n; k++)
        if (over[k] == 0) /* nearest to a turning point rounding cancels the difference */
            over[k] = fmax(E - height[k], turning ? 1e-16 * s->size : 1e-18 * s->size);
    phys_potential_speeds(&s->U, 1, n, q, over, speed[0]);
    phys_potential_speeds(&s->U, -1, n, q, over, speed[1]);
    for (size_t c = 0; c < cells; c++) {
        size_t to = side > 0 ? w->n + c : w->n + cells - 1 - c, end_of = side > 0 ? c + 1 : c;
        double x = last * (double)end_of / (double)cells;
        struct phys_energy_knot *knot = &w->knot[to];
        *knot = (struct phys_energy_knot){.q = end + side * distance(l, x, turning)};
        for (size_t k = c * POINTS; k < (c + 1) * POINTS; k++) {
            knot->there += by_x[k] / speed[0][k];
            knot->back += by_x[k] / speed[1][k];
        }
    }
    w->n += cells;
    return true;
}

bool phys_energy_way_find(struct phys_energy_sweep *s, double E, struct phys_energy_way *w)
{
    double a, b, at;
    w->left = phys_energy_turns(s, E, -1, &a);
    w->right = phys_energy_turns(s, E, 1, &b);
    if (!grow(w, 1))
        return false;
    w->knot[0] = (struct phys_energy_knot){.q = at = a};
    w->n = 1;
    for (size_t k = 0; at < b;) { /* cell by cell, none across a place or an end */
        while (k < s->n_places && s->place[k].q <= at)
            k++;
        double next = k < s->n_places ? fmin(s->place[k].q, b) : b;
        next = s->a > at ? fmin(next, s->a) : s->b > at ? fmin(next, s->b) : next;
        double half = 0.5 * (next - at);
        if (!half_cell(s, E, at, 1, half, w->left && at == a, w) ||
            !half_cell(s, E, next, -1, half, w->right && next == b, w))
            return false;
        at = next;
    }
    for (size_t k = 0; k < w->n; k++) {
        struct phys_energy_knot *knot = &w->knot[k];
        knot->there += k ? knot[-1].there : 0;
        knot->back += k ? knot[-1].back : 0;
        w->from = knot->q == s->ask.from ? *knot : w->from;
        w->to = knot->q == s->ask.to ? *knot : w->to;
    }
    return isfinite(w->knot[w->n - 1].there) && isfinite(w->knot[w->n - 1].back);
}

double phys_energy_way_time(const struct phys_energy_way *w, int direction, size_t turns_made)
{
    double right = w->knot[w->n - 1].there, left = w->knot[w->n - 1].back, time;
    bool last_right = (direction > 0) == (turns_made % 2 == 0);
    if (turns_made == 0) {
        time = direction > 0 ? w->to.there - w->from.there : w->from.back - w->to.back;
        return time > 0 ? time : (double)INFINITY;
    }
    if (!(direction > 0 ? w->right : w->left) || (turns_made > 1 && !(w->left && w->right)))
        return (double)INFINITY;
    time = direction > 0 ? right - w->from.there : w->from.back;
    time += last_right ? w->to.there : left - w->to.back;
    size_t legs = turns_made - 1, opposite = (legs + 1) / 2, same = legs / 2;
    return time + (double)opposite * (direction > 0 ? left : right) +
           (double)same * (direction > 0 ? right : left);
}
