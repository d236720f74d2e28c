/* Scans the forces, and L, at a fixed state over time (time_scan.h), on a grid much finer than the
   steps of any motion. Where the fourth difference of five values is as large as these differ, the
   grid does not resolve the change there, and a finer one is laid over it, and so on: a pulse of
   which a few samples see the tail is followed to its peak, a switch to the resolution of t. On
   each grid the times returned have equal shares of the integral of |d4 f/dt4|^(1/4), as the nodes
   of an adapted mesh. */
#include "time_scan.h"
#include "autodiff/ascending.h"
#include "physics/lagrangian/conserved.h"
#include "physics/lagrangian/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum {
    COLUMNS = 4096, /* times of one run */
    GRID = 1 << 17, /* of the first grid */
    LANDINGS = 1000,
    LANDINGS_OF_ONE = 64, /* of one abrupt change */
    MOST_RUNS = 400,      /* of finer grids */
    MOST = LANDINGS + MOST_RUNS * LANDINGS_OF_ONE
};

static const double ABRUPT = 0.1; /* fourth difference, of the range of five values */
static const double WIDE = 0.25;  /* of a grid: as long a change is no single one */
static const double FINEST = 1e-12;

struct scan {
    ad_tape *tape;
    ad_program *program;
    ad_var q, v, t, seen[2]; /* forces, then L; which of these is searched */
    size_t which;
    double t0, t1;
    /* of a motion: its states x [2 dof][n] at times at [n], the interval last interpolated, and
       room [2 dof][COLUMNS]; NULL: one state */
    const double *at, *x;
    size_t dof, n, interval;
    double *states;
    size_t runs, most; /* of the times */
    struct phys_time_scan *to;
};

/* ---- the forces ---- */

static enum ad_status record(struct scan *s, const struct phys_system *system, const double *q,
                             const double *v, struct ad_error *error)
{
    size_t dof = s->dof = system->dof;
    double *x = s->states = malloc(2 * dof * COLUMNS * sizeof *x);
    s->tape = ad_tape_new(AD_F64);
    if (!x || !s->tape)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < 2 * dof * COLUMNS; k++) {
        double at = k / COLUMNS < dof ? q[k / COLUMNS] : v[k / COLUMNS - dof];
        x[k] = at + 0.1 * (fabs(at) + 1) * sin(1.7 * (double)(k / COLUMNS) + 0.3);
    }
    ad_var in[] = {s->q = ad_input(s->tape, dof, COLUMNS, "q"),
                   s->v = ad_input(s->tape, dof, COLUMNS, "v")};
    ad_var g[2];
    s->t = ad_input(s->tape, 1, COLUMNS, "t");
    s->seen[1] = phys_system_lagrangian(system, in[0], in[1], s->t);
    ad_grad(ad_sum(s->seen[1]), 2, in, g);
    g[0] = phys_system_add_forces(system, g[0], in[0], in[1], s->t);
    s->seen[0] = ad_add(phys_mixed(g[0], 0.3), phys_mixed(g[1], 0.7));
    if (ad_compile(s->tape, 2, s->seen, &s->program) == AD_OK) {
        ad_set(s->program, in[0], x);
        ad_set(s->program, in[1], x + dof * COLUMNS);
    }
    return phys_tape_status(s->tape, error);
}

static void end(struct scan *s)
{
    ad_program_free(s->program);
    ad_tape_free(s->tape);
    free(s->states);
}

/* The state at t into column j of the states: Hermite's cubic of q, and its rate. */
static void interpolate(struct scan *s, double t, size_t j)
{
    while (s->interval + 2 < s->n && s->at[s->interval + 1] < t)
        s->interval++;
    while (s->interval > 0 && s->at[s->interval] > t)
        s->interval--;
    const size_t i = s->interval;
    const double h = s->at[i + 1] - s->at[i], u = (t - s->at[i]) / h, w = 1 - u;
    for (size_t k = 0; k < s->dof; k++) {
        const double *q = s->x + k * s->n + i, *v = s->x + (s->dof + k) * s->n + i;
        const double slope = (q[1] - q[0]) / h;
        s->states[k * COLUMNS + j] =
            w * q[0] + u * q[1] + h * u * w * (w * (v[0] - slope) - u * (v[1] - slope));
        s->states[(s->dof + k) * COLUMNS + j] =
            w * v[0] + u * v[1] + 6 * u * w * (slope - (v[0] + v[1]) / 2);
    }
}

/* At n times from a to b, n a multiple of COLUMNS; `other`, where it is not NULL: what is not
   searched. */
static void sample(struct scan *s, double a, double b, size_t n, double *force, double *other)
{
    double t[COLUMNS];
    for (size_t i = 0; i < n; i += COLUMNS) {
        for (size_t j = 0; j < COLUMNS; j++)
            t[j] = a + (b - a) * (double)(i + j) / (double)(n - 1);
        for (size_t j = 0; s->at && j < COLUMNS; j++)
            interpolate(s, t[j], j);
        if (s->at) {
            ad_set(s->program, s->q, s->states);
            ad_set(s->program, s->v, s->states + s->dof * COLUMNS);
        }
        ad_set(s->program, s->t, t);
        ad_run(s->program);
        ad_get(s->program, s->seen[s->which], force + i);
        if (other)
            ad_get(s->program, s->seen[!s->which], other + i);
    }
}

/* ---- its changes ---- */

/* force [n] at equal steps from a to b becomes the density of times, negative where the change is
   not resolved. What is rounding of `largest` is none. */
static void measure_density(double a, double b, size_t n, double largest, double *force)
{
    double step = (b - a) / (double)(n - 1), rate = 1 / step;
    double last[2] = {0, 0}; /* densities of two times whose forces are still needed */
    for (size_t i = 2; i + 2 < n; i++) {
        const double *f = force + i - 2;
        double low = f[0], high = f[0], rough = fabs(f[0] - 4 * f[1] + 6 * f[2] - 4 * f[3] + f[4]);
        for (int k = 1; k < 5; k++) { /* without NaN, of which rough is one */
            low = f[k] < low ? f[k] : low;
            high = f[k] > high ? f[k] : high;
        }
        double clock = fabs(a + (double)i * step) * rate; /* rounding of t, in steps */
        double size = fabs(low) > fabs(high) ? fabs(low) : fabs(high);
        size = size > largest ? size : largest;
        double noise = DBL_EPSILON * (64 * size + clock * (high - low));
        double density = rough > 4 * noise ? sqrt(sqrt(rough)) : 0; /* NaN: 0 */
        force[i - 2] = last[0];
        last[0] = last[1];
        last[1] = rough > ABRUPT * (high - low) ? -density : density;
    }
    force[n - 4] = last[0];
    force[n - 3] = last[1];
    force[n - 2] = force[n - 1] = 0;
}

/* Adds the times that divide the density into `count` shares, where these are closer to each other
   than times at equal steps from t0 to t1. */
static void land(struct scan *s, double a, double b, size_t n, const double *density, size_t count)
{
    double all = 0, sum = 0, near = (s->t1 - s->t0) / (2 * LANDINGS), last = -INFINITY;
    size_t next = 1;
    for (size_t i = 0; i < n && count > 0; i++)
        all += fabs(density[i]);
    double share = all / (double)(count + 1);
    for (size_t i = 0; i < n && all > 0; i++) {
        sum += fabs(density[i]);
        if (sum < share)
            continue;
        while (sum >= share)
            share = all * (double)++next / (double)(count + 1);
        double t = a + (b - a) * (double)i / (double)(n - 1);
        if (t - last < near && t > s->t0 && t < s->t1 && s->to->n < s->most)
            s->to->times[s->to->n++] = t;
        last = t;
    }
}

/* Samples [n] from a to b, then every stretch that n times do not resolve. A finer grid has the
   peak of a change: beside that its tails, where a force such as 1 - tanh^2 is rounding, are
   nothing; a first one may have no more than a tail. */
static void search(struct scan *s, double a, double b, size_t n, size_t count, double largest,
                   double *room)
{
    for (size_t i = 0; i < n && n < GRID; i++)
        largest = fmax(largest, fabs(room[i]));
    measure_density(a, b, n, largest, room);
    land(s, a, b, n, room, count);
    double step = (b - a) / (double)(n - 1), finer[COLUMNS];
    for (size_t i = 2, to; i + 2 < n; i = to + 1) {
        to = i;
        if (!(room[i] < 0))
            continue;
        for (size_t k = i; k + 2 < n && k <= to + 2; k++) /* one change, or several close ones */
            to = room[k] < 0 ? k : to;
        double from = a + (double)(i - 2) * step, until = a + (double)(to + 2) * step;
        if ((double)(to - i) > WIDE * (double)n || s->runs == MOST_RUNS) {
            s->to->unresolved = fmin(s->to->unresolved, from);
        } else if (until - from > FINEST * (s->t1 - s->t0)) {
            s->runs++;
            sample(s, from, until, COLUMNS, finer, NULL);
            search(s, from, until, COLUMNS, LANDINGS_OF_ONE, largest, finer);
        }
    }
}

/* The forces; and L, where a front that passes in less than a step of the grid leaves another
   value. What L changes without forces need not be resolved. room [2 GRID] */
static void search_all(struct scan *s, double *room)
{
    sample(s, s->t0, s->t1, GRID, room, room + GRID);
    search(s, s->t0, s->t1, GRID, LANDINGS, 0, room);
    const double unresolved = s->to->unresolved;
    s->which = 1;
    search(s, s->t0, s->t1, GRID, 0, 0, room + GRID);
    s->to->unresolved = unresolved;
}

/* Steps are no shorter than the finest grid. */
static void sort(struct phys_time_scan *scan, double span)
{
    size_t n = 0;
    qsort(scan->times, scan->n, sizeof *scan->times, ad_ascending);
    for (size_t k = 0; k < scan->n; k++)
        if (n == 0 || scan->times[k] - scan->times[n - 1] > FINEST / COLUMNS * span)
            scan->times[n++] = scan->times[k];
    scan->n = n;
}

enum ad_status phys_time_scan(const struct phys_system *system, const double *q, const double *v,
                              double t0, double t1, struct phys_time_scan *scan,
                              struct ad_error *error)
{
    struct scan s = {.t0 = t0, .t1 = t1, .most = MOST, .to = scan};
    *scan = (struct phys_time_scan){.unresolved = INFINITY};
    if (phys_keeps_energy(system, error) || error->status != AD_OK)
        return error->status;
    scan->times = malloc(2 * (MOST + GRID) * sizeof *scan->times);
    if (!scan->times)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (record(&s, system, q, v, error) == AD_OK)
        search_all(&s, scan->times + 2 * MOST);
    sort(scan, t1 - t0);
    scan->resolution = (t1 - t0) / (GRID - 1);
    end(&s);
    return error->status;
}

enum ad_status phys_time_scan_along(const struct phys_system *system, size_t n, const double *t,
                                    const double *x, struct phys_time_scan *scan,
                                    struct ad_error *error)
{
    struct phys_time_scan found = {.times = scan->times + scan->n, .unresolved = INFINITY};
    struct scan s = {.t0 = t[0], .t1 = t[n - 1], .most = 2 * MOST - scan->n, .to = &found};
    if (record(&s, system, x, x, error) == AD_OK) {
        s.at = t;
        s.x = x;
        s.n = n;
        search_all(&s, scan->times + 2 * MOST);
    }
    end(&s);
    if (error->status == AD_OK && isinf(found.unresolved)) {
        scan->n += found.n;
        sort(scan, s.t1 - s.t0);
    }
    return error->status;
}

void phys_time_scan_free(struct phys_time_scan *scan)
{
    free(scan->times);
    *scan = (struct phys_time_scan){0};
}
