/* The shape of the potential of one coordinate (energy_parts.h): its extrema, and the energies
   between which times are smooth functions of the energy. */
#include "autodiff/ascending.h"
#include "autodiff/free.h"
#include "energy_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 1 << 13, BISECTIONS = 60 };

static const double RANGE = 1e3; /* of places and speeds, in natural sizes */

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

/* Where to look: densely around both ends, then at growing distances. */
static size_t look_at(const struct phys_energy_sweep *s, size_t n, double *q)
{
    double a = s->a, b = s->b;
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
    qsort(q, count, sizeof *q, ad_ascending);
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
    while (q[middle] < s->a)
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
            struct phys_energy_place *p = &s->place[s->n_places++];
            double ignored;
            p->q = bracket(s, q[k], q[k + 1], false, 0);
            phys_potential_at(&s->U, p->q, &p->U, &ignored, &p->bend);
        }
    bool whole = s->high >= s->b;
    free(q);
    return whole;
}

static void add_level(struct phys_energy_sweep *s, double U)
{
    if (s->n_levels == 0 || U > s->level[s->n_levels - 1] + PHYS_ENERGY_NEAREST * s->size)
        s->level[s->n_levels++] = U;
}

/* The energy of the highest speed searched; where the speed has a limit, of one just below it. */
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
    double ends[2], at[2] = {s->a, s->b};
    double *heights = malloc((s->n_places + 3) * sizeof *heights);
    s->level = malloc((s->n_places + 3) * sizeof *s->level);
    if (!heights || !s->level) {
        free(heights);
        return false;
    }
    phys_potential_values(&s->U, 2, at, ends);
    double least = fmax(ends[0], ends[1]);
    size_t n = 0, inner = 0;
    for (size_t k = 0; k < s->n_places; k++)
        if (s->place[k].q > s->a && s->place[k].q < s->b)
            least = fmax(least, s->place[k].U);
    while (inner < s->n_places && s->place[inner].q <= s->a)
        inner++;
    double right = least, left = least;
    for (size_t k = inner; k < s->n_places; k++)
        if (s->place[k].U > right)
            heights[n++] = right = s->place[k].U;
    for (size_t k = inner; k-- > 0;)
        if (s->place[k].U > left)
            heights[n++] = left = s->place[k].U;
    double most = fmax(highest_energy(s), least);
    s->size = fmax(fabs(least), 0.5 * s->ask.speed * s->ask.speed * 1e-3);
    for (size_t k = 0; k < n; k++)
        s->size = fmax(s->size, heights[k] < most ? fabs(heights[k]) : 0);
    qsort(heights, n, sizeof *heights, ad_ascending);
    s->n_levels = 0;
    add_level(s, least);
    for (size_t k = 0; k < n && heights[k] < most; k++)
        add_level(s, heights[k]);
    add_level(s, fmax(most, s->level[s->n_levels - 1] + s->size));
    free(heights);
    return true;
}

bool phys_energy_levels(struct phys_energy_sweep *s, size_t density)
{
    AD_FREE(s->place, s->level);
    s->place = NULL;
    s->level = NULL;
    return find_places(s, density) && find_levels(s);
}

bool phys_energy_turns(struct phys_energy_sweep *s, double E, int side, double *q)
{
    double end = side > 0 ? s->b : s->a, before = end, height, slope, bend;
    phys_potential_at(&s->U, end, &height, &slope, &bend);
    *q = end;
    if (height >= E && side * slope > 0) /* it is at rest there */
        return true;
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
