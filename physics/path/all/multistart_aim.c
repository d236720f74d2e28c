/* Motions of two coordinates from the first end to the second (multistart.h). How far a motion ends
   from the second end is a function of its initial velocity, tabulated over directions and speeds.
   Newton's method begins at the zeros of its linear interpolant over triangles of the table and
   where it is least among neighbours. Tables get denser until one finds few other
   paths. */
#include "multistart.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DIRECTIONS = 20, PASSES = 3, ITERATIONS = 15, HALVINGS = 5, MAX_STEPS = 400 };

static const double RATIO = 1.06;                   /* of neighbouring speeds in the first table */
static const double SLOWEST = 1. / 16, FASTEST = 4; /* of the natural speed */
static const double ENOUGH =
    0.25; /* of all paths: as many as the last table may have found first */
static const double COARSE = 1e-4;     /* error of the motions of a table, relative ... */
static const double TIGHT = 1e-9;      /* ... and of those of Newton's method */
static const double HIT = 1e-6;        /* of the span: as near the end as a start need be */
static const double DIFFERENCE = 1e-5; /* of the speed, for derivatives by velocity */

struct table {
    size_t speeds, directions;
    double slowest, ratio;
    double unit[2]; /* velocities of the same kinetic energy */
    double *miss;   /* [speeds][directions][2]; NaN: lost */
};

/* ---- one motion ---- */

static enum ad_status simulate(struct phys_multistart *s, double tolerance)
{
    struct ad_error lost = {0};
    const struct phys_simulation how = {
        .integrator = phys_integrator_find(s->motion.series ? "taylor" : "dop853", &lost),
        .t1 = s->settings.dt * (double)(s->slices - 1),
        .rtol = tolerance,
        .max_steps = MAX_STEPS,
        .proceed = s->settings.proceed,
        .context = s->settings.context};
    struct phys_simulation_info info;
    memcpy(s->y, s->q, 2 * sizeof *s->y);
    memcpy(s->y + 2, s->v, 2 * sizeof *s->y);
    return phys_simulate(&how, &s->motion, s->y, &info, &lost);
}

/* Where the motion with initial velocity s->v ends beside the second end; NaN where it is lost. */
static void find_miss(struct phys_multistart *s, double tolerance, double *miss)
{
    bool lost = simulate(s, tolerance) != AD_OK;
    for (size_t k = 0; k < 2; k++)
        miss[k] = lost ? (double)NAN : s->y[k] - s->given[k * s->slices + s->slices - 1];
}

static double distance(const double *miss) { return hypot(miss[0], miss[1]); }

/* Solves x = -J^-1 r, J by differences of the miss at s->v. */
static bool newton_step(struct phys_multistart *s, const double *r, double speed, double *x)
{
    double J[2][2], other[2];
    for (size_t k = 0; k < 2; k++) {
        double v = s->v[k], h = DIFFERENCE * speed;
        s->v[k] = v + h;
        find_miss(s, TIGHT, other);
        s->v[k] = v;
        for (size_t i = 0; i < 2; i++)
            J[i][k] = (other[i] - r[i]) / h;
    }
    double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    x[0] = -(J[1][1] * r[0] - J[0][1] * r[1]) / det;
    x[1] = -(J[0][0] * r[1] - J[1][0] * r[0]) / det;
    return isfinite(x[0]) && isfinite(x[1]);
}

bool phys_multistart_aim(struct phys_multistart *s)
{
    double r[2], x[2], next[2], speed = hypot(s->v[0], s->v[1]) + s->speed;
    find_miss(s, TIGHT, r);
    for (int k = 0; k < ITERATIONS && distance(r) > HIT * s->span; k++) {
        double from[] = {s->v[0], s->v[1]}, length = 1;
        if (!newton_step(s, r, speed, x))
            return false;
        for (int h = 0; h < HALVINGS; h++, length *= 0.5) {
            s->v[0] = from[0] + length * x[0];
            s->v[1] = from[1] + length * x[1];
            find_miss(s, TIGHT, next);
            if (distance(next) < distance(r))
                break;
        }
        if (!(distance(next) < distance(r)))
            return false;
        memcpy(r, next, sizeof r);
    }
    return distance(r) <= HIT * s->span;
}

/* ---- the table ---- */

static const double *miss_at(const struct table *t, size_t i, size_t j)
{
    return t->miss + 2 * (i * t->directions + j % t->directions);
}

static void velocity_at(const struct table *t, size_t i, size_t j, double *v)
{
    double size = t->slowest * pow(t->ratio, (double)i);
    double angle = 2 * acos(-1) * ((double)j + 0.5) / (double)t->directions;
    v[0] = size * t->unit[0] * cos(angle);
    v[1] = size * t->unit[1] * sin(angle);
}

static enum ad_status fill(struct phys_multistart *s, struct table *t, struct ad_error *error)
{
    t->miss = malloc(2 * t->speeds * t->directions * sizeof *t->miss);
    if (!t->miss)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a table of motions");
    for (size_t k = 0; k < t->speeds * t->directions && phys_multistart_goes_on(s); k++) {
        velocity_at(t, k / t->directions, k % t->directions, s->v);
        find_miss(s, COARSE, t->miss + 2 * k);
    }
    return AD_OK;
}

/* Weights of the corners at which the linear interpolant of three misses is zero; false: outside.
 */
static bool encloses(const double *const miss[3], double *weight)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = miss[(k + 1) % 3], *b = miss[(k + 2) % 3];
        weight[k] = a[0] * b[1] - a[1] * b[0];
        sum += weight[k];
    }
    for (int k = 0; k < 3; k++)
        weight[k] /= sum;
    return weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0;
}

/* Triangle 0 or 1 of the cell of speeds i, i + 1 and directions j, j + 1: s->v where its
   interpolant is zero. */
static bool triangle(struct phys_multistart *s, const struct table *t, size_t i, size_t j,
                     int which)
{
    const size_t at[3][2] = {{i, j}, {i + 1, j + 1}, {which ? i : i + 1, which ? j + 1 : j}};
    const double *miss[3];
    double weight[3], v[2];
    for (int k = 0; k < 3; k++)
        miss[k] = miss_at(t, at[k][0], at[k][1]);
    if (!encloses(miss, weight))
        return false;
    s->v[0] = s->v[1] = 0;
    for (int k = 0; k < 3; k++) {
        velocity_at(t, at[k][0], at[k][1], v);
        s->v[0] += weight[k] * v[0];
        s->v[1] += weight[k] * v[1];
    }
    return true;
}

/* It ends within the span, and no neighbour nearer. */
static bool is_least(const struct table *t, double span, size_t i, size_t j)
{
    double here = distance(miss_at(t, i, j));
    for (size_t a = i ? i - 1 : 0; a <= i + 1 && a < t->speeds; a++)
        for (size_t b = j + t->directions - 1; b <= j + t->directions + 1; b++)
            if (distance(miss_at(t, a, b)) < here)
                return false;
    return here <= span;
}

static enum ad_status look(struct phys_multistart *s, const struct table *t, struct ad_error *error)
{
    for (size_t i = 0; i < t->speeds; i++)
        for (size_t j = 0; j < t->directions; j++) {
            if (!phys_multistart_goes_on(s))
                return AD_OK;
            for (int which = 0; which < 2 && i + 1 < t->speeds; which++)
                if (triangle(s, t, i, j, which) && phys_multistart_start(s, error) != AD_OK)
                    return error->status;
            velocity_at(t, i, j, s->v);
            if (is_least(t, s->span, i, j) && phys_multistart_start(s, error) != AD_OK)
                return error->status;
        }
    return AD_OK;
}

/* ---- all tables ---- */

/* The natural speed is the given path's, or that which the force gives along its span. */
static void choose_speeds(struct phys_multistart *s, struct table *t)
{
    double rate[4] = {0}, most = 0, natural = s->speed;
    const double *mass = s->newton.hessian.stiffness;
    memcpy(s->y, s->q, 2 * sizeof *s->y);
    s->y[2] = s->y[3] = 0;
    struct ad_error lost = {0};
    if (s->motion.field(s->motion.context, 0, s->y, rate, &lost) == AD_OK && distance(rate + 2) > 0)
        natural = fmax(natural, sqrt(distance(rate + 2) * s->span));
    for (size_t k = 0; k < 2; k++)
        most = fmax(most, mass[k]);
    for (size_t k = 0; k < 2; k++)
        t->unit[k] = mass[k] > 0 && isfinite(mass[k]) ? sqrt(most / mass[k]) : 1;
    s->speed = natural;
    t->slowest = SLOWEST * natural;
    t->speeds = 1 + (size_t)(log(FASTEST / SLOWEST) / log(RATIO));
    t->directions = DIRECTIONS;
    t->ratio = pow(FASTEST / SLOWEST, 1 / (double)(t->speeds - 1));
}

enum ad_status phys_multistart_directions(struct phys_multistart *s, struct ad_error *error)
{
    struct table t = {0};
    choose_speeds(s, &t);
    for (int pass = 0; pass < PASSES && phys_multistart_goes_on(s); pass++) {
        size_t known = s->solutions->n;
        if (fill(s, &t, error) == AD_OK)
            look(s, &t, error);
        free(t.miss);
        double found = (double)(s->solutions->n - known);
        if (error->status != AD_OK || (pass > 0 && found <= ENOUGH * (double)s->solutions->n))
            break;
        t.speeds += t.speeds / 2;
        t.directions += t.directions / 2;
        t.ratio = pow(FASTEST / SLOWEST, 1 / (double)(t.speeds - 1));
    }
    return error->status;
}
