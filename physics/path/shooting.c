/* Multiple shooting (Stoer, Bulirsch, Introduction to Numerical Analysis, section 7.3.5): the
   states s_i at nodes t_i are changed until the motion from each meets the next, f_i(s_i) = s_i+1,
   with q given at the first and the last. Newton's method solves F_i ds_i - ds_i+1 = s_i+1 -
   f_i(s_i), where F_i is the flow of the linearised equations in (q, p), dq' = dv = L_vv^-1 (dp -
   L_vq dq), dp' = L_qq dq + L_qv dv. Nodes are close enough that variations grow little from one to
   the next: a long unstable path is found to rounding, where single shooting would lose it. */
#include "shooting.h"
#include "autodiff/free.h"
#include "path_nodes.h"
#include "autodiff/blas.h"
#include "physics/linear/linear.h"
#include "physics/motion/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SEGMENTS = 6, MOST_SEGMENTS = 4000, MOST_ITERATIONS = 20, HALVINGS = 6 };

static const double ROUNDING = 1e-9; /* of the size of states */
static const double ANGLE = 0.5;     /* rate of the linearised motion times a segment */
static const double FIRST = 0.618; /* length of the first segment: keeps nodes off even fractions */
static const double CLOSED = 100;  /* a gap of this many tolerances counts as closed */

/* ---- nodes ---- */

/* Largest rate of the linearised motion at the place evaluated: bounds of its matrix. */
static double rate(struct phys_shooting *s, double *room)
{
    size_t n = s->dof;
    double gyration = 0, oscillation = 0, *unit = room, *zero = room + n, *dv = room + 2 * n;
    double *force = room + 3 * n;
    memset(unit, 0, 2 * n * sizeof *unit);
    for (size_t k = 0; k < n; k++) {
        unit[k] = 1 / sqrt(fabs(s->at.vv[k * n + k])); /* lengths in which the masses are one */
        phys_curvature_vary(&s->at, unit, zero, dv, force);
        phys_curvature_vary(&s->at, zero, force, force, NULL);
        unit[k] = 0;
        double turned = 0, pulled = 0;
        for (size_t i = 0; i < n; i++) {
            double root = sqrt(fabs(s->at.vv[i * n + i]));
            turned += fabs(dv[i]) * root;
            pulled += fabs(force[i]) * root;
        }
        gyration = fmax(gyration, turned);
        oscillation = fmax(oscillation, pulled);
    }
    return gyration + sqrt(oscillation);
}

/* The rates at the slices, summed over time: growth [slices]. False: not finite somewhere. */
static bool measure_rates(struct phys_shooting *s, const struct phys_path_nodes *nodes,
                          double *growth, double *room)
{
    double *q = room, *v = room + s->dof, before = 0;
    for (size_t i = 0; i < nodes->slices; i++) {
        double t = nodes->time[i * nodes->degree];
        phys_path_nodes_at(nodes, t, q, v);
        if (!phys_curvature_at(&s->at, q, v, t))
            return false;
        double here = rate(s, room + 2 * s->dof);
        growth[i] = i == 0 ? 0
                           : growth[i - 1] +
                                 fmax(before, here) * (t - nodes->time[(i - 1) * nodes->degree]);
        before = here;
    }
    return isfinite(growth[nodes->slices - 1]);
}

/* Times that divide the integral of the rates into equal parts; the first part is shorter. */
static void place_nodes(struct phys_shooting *s, const struct phys_path_nodes *nodes,
                        const double *growth)
{
    size_t degree = nodes->degree, slices = nodes->slices;
    const double *times = nodes->time;
    double end = times[nodes->n - 1], least = growth[slices - 1] / (double)s->n + 1e-300;
    double all = growth[slices - 1] + least; /* and a share in proportion to the time */
    for (size_t k = 1, i = 1; k < s->n; k++) {
        double wanted = all * ((double)k - 1 + FIRST) / ((double)s->n - 1 + FIRST), a, b;
        for (;; i++) {
            a = growth[i - 1] + least * times[(i - 1) * degree] / end;
            b = growth[i] + least * times[i * degree] / end;
            if (b >= wanted || i + 1 == slices)
                break;
        }
        double share = fmin(1, (wanted - a) / (b - a));
        s->time[k] =
            times[(i - 1) * degree] + share * (times[i * degree] - times[(i - 1) * degree]);
    }
    s->time[0] = 0;
    s->time[s->n] = end;
}

static bool allocate(struct phys_shooting *s)
{
    size_t n = s->n, d = 2 * s->dof, state = d + d * d;
    s->time = calloc((n + 1) + 2 * (n + 1) * d + n * d * d + 2 * d + 2 * state, sizeof *s->time);
    if (!s->time)
        return false;
    s->state = s->time + n + 1;
    s->begun = s->state + (n + 1) * d;
    s->flow = s->begun + (n + 1) * d;
    s->scale = s->flow + n * d * d;
    s->size = s->scale + d;
    s->y = s->size + d;
    return true;
}

static void find_sizes(struct phys_shooting *s)
{
    size_t dof = s->dof;
    double largest[2] = {0, 0}, rate_of_nodes = (double)s->n / s->time[s->n];
    for (size_t i = 0; i <= s->n; i++)
        for (size_t k = 0; k < 2 * dof; k++) {
            double size = fabs(s->state[i * 2 * dof + k] - (k < dof ? s->state[k] : 0));
            s->size[k] = fmax(s->size[k], size);
            largest[k / dof] = fmax(largest[k / dof], size);
        }
    double place = 0;
    for (size_t k = 0; k < dof; k++)
        place = fmax(place, fabs(s->state[k]));
    bool rests = largest[0] <= ROUNDING * place; /* only rounding moves */
    for (size_t k = 0; k < 2 * dof; k++)         /* at rest: the scale of the others, or one */
        if (rests)
            s->size[k] = k < dof ? 1 : rate_of_nodes;
        else if (!(s->size[k] > ROUNDING * largest[k / dof]))
            s->size[k] = largest[k / dof];
    phys_curvature_at(&s->at, s->state, s->state + dof, 0);
    for (size_t k = 0; k < dof; k++) {
        double mass = fabs(s->at.vv[k * dof + k]);
        s->scale[k] = mass > 0 ? 1 / sqrt(mass * rate_of_nodes) : 1;
        s->scale[dof + k] = 1 / s->scale[k];
    }
}

/* Nodes and the states there; room [slices + 7 dof]. */
static bool begin(struct phys_shooting *s, const struct phys_path_nodes *nodes, double *room,
                  struct ad_error *error)
{
    double *growth = room, *last = growth + nodes->slices - 1;
    if (!measure_rates(s, nodes, growth, last + 1) || !(*last < ANGLE * MOST_SEGMENTS))
        return false;
    s->n = LEAST_SEGMENTS + (size_t)(*last / ANGLE);
    if (!allocate(s))
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu segments", s->n) == AD_OK;
    place_nodes(s, nodes, growth);
    for (size_t i = 0; i <= s->n; i++)
        phys_path_nodes_at(nodes, s->time[i], s->state + 2 * i * s->dof,
                           s->state + (2 * i + 1) * s->dof);
    find_sizes(s);
    memcpy(s->begun, s->state, (s->n + 1) * 2 * s->dof * sizeof *s->begun);
    return true;
}

bool phys_shooting_new(struct phys_shooting *s, const struct phys_system *system,
                       const struct phys_path_settings *settings, const double *path,
                       struct ad_error *error)
{
    struct phys_path_nodes nodes;
    const struct phys_grid grid = phys_grid_of(settings);
    *s = (struct phys_shooting){.system = system, .dof = system->dof};
    if (s->dof > PHYS_SHOOTING_DOF || phys_curvature_new(&s->at, system, error) != AD_OK)
        return false;
    double *room = malloc((settings->slices + 7 * s->dof) * sizeof *room);
    if (!room)
        return ad_fail(error, AD_E_MEMORY, "out of memory") == AD_OK;
    bool begun = phys_path_nodes_new(&nodes, s->dof, &grid, 3, path, error) == AD_OK &&
                 begin(s, &nodes, room, error);
    phys_path_nodes_free(&nodes);
    free(room);
    return begun;
}

void phys_shooting_free(struct phys_shooting *s)
{
    phys_curvature_free(&s->at);
    free(s->time);
}

/* ---- motion and flow ---- */

/* y: q, v [dof each], then columns of the flow [2 dof]. */
static enum ad_status field(void *context, double t, const double *y, double *out,
                            struct ad_error *error)
{
    struct phys_shooting *s = context;
    size_t n = s->dof;
    if (!phys_curvature_at(&s->at, y, y + n, t))
        return ad_fail(error, AD_E_NONFINITE, "second derivatives of L at t = %g", t);
    memcpy(out, y + n, n * sizeof *out);
    phys_curvature_acceleration(&s->at, y + n, out + n);
    for (size_t c = 1; c <= 2 * n; c++) {
        const double *from = y + 2 * n * c;
        double varied[2 * PHYS_SHOOTING_DOF], *to = out + 2 * n * c;
        for (size_t k = 0; k < 2 * n; k++)
            varied[k] = from[k] * s->scale[k];
        phys_curvature_vary(&s->at, varied, varied + n, to, to + n);
        for (size_t k = 0; k < 2 * n; k++)
            to[k] /= s->scale[k];
    }
    return AD_OK;
}

/* s->y at time t, from node i. */
static bool integrate(struct phys_shooting *s, size_t i, double t)
{
    size_t d = 2 * s->dof, n = d + d * d;
    struct ad_error error = {0};
    struct phys_simulation_info info;
    struct phys_ode ode = {.n = n, .field = field, .context = s};
    double *y = s->y, *units = s->y + d + d * d;
    memcpy(y, s->state + i * d, d * sizeof *y);
    memset(y + d, 0, d * d * sizeof *y);
    for (size_t k = 0; k < d; k++) {
        y[d + k * d + k] = 1;
        units[k] = s->size[k];
    }
    for (size_t k = d; k < n; k++)
        units[k] = 1;
    struct phys_simulation run = {.size = sizeof run,
                                  .integrator = phys_integrator_find("dop853", &error),
                                  .t0 = s->time[i],
                                  .t1 = t,
                                  .rtol = s->tolerance,
                                  .atol = s->tolerance,
                                  .scale = units,
                                  .dt = t - s->time[i],
                                  .max_steps = 1000};
    return t == s->time[i] || phys_simulate(&run, &ode, y, &info, &error) == AD_OK;
}

bool phys_shooting_flow(struct phys_shooting *s, size_t i, double t, double *flow, double *state)
{
    size_t d = 2 * s->dof;
    if (!integrate(s, i, t))
        return false;
    memcpy(state, s->y, d * sizeof *state);
    memcpy(flow, s->y + d, d * d * sizeof *flow);
    return true;
}

/* ---- Newton's method ---- */

/* Rows of gap i and columns of ds_i, ds_i+1 in the band: column c counts from p of node 0. */
struct gaps {
    size_t n, width;
    double *band, *right; /* [n]: the gaps s_i+1 - f_i(s_i), then ds */
    int *pivots;
};

static bool gaps_new(struct gaps *g, const struct phys_shooting *s)
{
    g->n = 2 * s->dof * s->n;
    g->width = 3 * s->dof;
    g->band = malloc(PHYS_BAND_ROWS(g->width) * g->n * sizeof *g->band);
    g->right = malloc(g->n * sizeof *g->right);
    g->pivots = malloc(g->n * sizeof *g->pivots);
    return g->band && g->right && g->pivots;
}

static void gaps_free(struct gaps *g) { AD_FREE(g->band, g->right, g->pivots); }

static void momentum(struct phys_shooting *s, size_t i, const double *state, double *p)
{
    phys_curvature_at(&s->at, state, state + s->dof, s->time[i]);
    memcpy(p, s->at.v, s->dof * sizeof *p);
}

/* Follows all segments; the largest gap against the size of the states, infinite where lost. */
static double follow(struct phys_shooting *s, struct gaps *g)
{
    size_t dof = s->dof, d = 2 * dof;
    double most = 0, size[2] = {0, 0};
    for (size_t i = 0; i < s->n; i++) {
        double here[PHYS_SHOOTING_DOF], next[PHYS_SHOOTING_DOF], *state = s->state + (i + 1) * d;
        double reached[2 * PHYS_SHOOTING_DOF];
        if (!phys_shooting_flow(s, i, s->time[i + 1], s->flow + i * d * d, reached))
            return (double)INFINITY;
        momentum(s, i + 1, reached, here);
        momentum(s, i + 1, state, next);
        for (size_t k = 0; k < dof; k++) {
            double gap[2] = {(state[k] - reached[k]) / s->scale[k],
                             (next[k] - here[k]) / s->scale[dof + k]};
            g->right[i * d + k] = gap[0];
            g->right[i * d + dof + k] = gap[1];
            size[0] = fmax(size[0], s->size[k] / s->scale[k]);
            size[1] = fmax(size[1], fabs(next[k]) / s->scale[dof + k]);
            most = fmax(most, fmax(fabs(gap[0]), fabs(gap[1])));
        }
    }
    return isfinite(most) ? most / fmax(size[0], size[1]) : (double)INFINITY;
}

/* ds in g->right. */
static bool newton_step(const struct phys_shooting *s, struct gaps *g)
{
    size_t dof = s->dof, d = 2 * dof;
    memset(g->band, 0, PHYS_BAND_ROWS(g->width) * g->n * sizeof *g->band);
    for (size_t i = 0; i < s->n; i++)
        for (size_t r = 0; r < d; r++) {
            size_t row = i * d + r;
            for (size_t c = 0; c < d; c++) { /* q of node 0 is given */
                size_t col = i * d + c - dof;
                if (col < g->n)
                    g->band[PHYS_BAND(g->width, row, col)] += s->flow[i * d * d + c * d + r];
            }
            size_t col = (i + 1) * d + r - dof;
            if (i + 1 < s->n) /* and that of the last */
                g->band[PHYS_BAND(g->width, row, col)] -= 1;
            else if (r >= dof)
                g->band[PHYS_BAND(g->width, row, col - dof)] -= 1;
        }
    if (phys_lapack_band_factor(g->n, g->width, g->band, g->pivots) != 0)
        return false;
    phys_lapack_band_solve(g->n, g->width, g->band, g->pivots, g->right);
    return true;
}

/* state = before + length ds; v by its linear part. */
static void move(struct phys_shooting *s, const struct gaps *g, const double *before,
                 const double *ds, double length)
{
    size_t dof = s->dof, d = 2 * dof;
    for (size_t i = 0; i <= s->n; i++) {
        double by[2 * PHYS_SHOOTING_DOF], dv[PHYS_SHOOTING_DOF];
        for (size_t k = 0; k < d; k++) {
            size_t u = i * d + k - dof;
            if (i == s->n)
                u = k < dof ? SIZE_MAX : u - dof;
            by[k] = u < g->n ? length * ds[u] * s->scale[k] : 0;
        }
        const double *from = before + i * d;
        phys_curvature_at(&s->at, from, from + dof, s->time[i]);
        phys_curvature_vary(&s->at, by, by + dof, dv, NULL);
        for (size_t k = 0; k < dof; k++) {
            s->state[i * d + k] = from[k] + by[k];
            s->state[i * d + dof + k] = from[dof + k] + dv[k];
        }
    }
}

static bool iterate(struct phys_shooting *s, struct gaps *g, double *before, double *ds)
{
    size_t states = (s->n + 1) * 2 * s->dof;
    double gap = follow(s, g);
    for (int k = 0; k < MOST_ITERATIONS && isfinite(gap); k++) {
        bool closed = gap <= CLOSED * s->tolerance;
        if (closed)
            return true;
        if (!newton_step(s, g))
            return false;
        memcpy(ds, g->right, g->n * sizeof *ds);
        memcpy(before, s->state, states * sizeof *before);
        double length = 1, from = gap;
        for (int j = 0; j <= HALVINGS; j++, length *= 0.5) {
            move(s, g, before, ds, length);
            gap = follow(s, g);
            if (gap < from)
                break;
        }
        if (!(gap < from))
            return false;
    }
    return false;
}

bool phys_shooting_solve(struct phys_shooting *s, double tolerance)
{
    struct gaps g = {0};
    size_t states = (s->n + 1) * 2 * s->dof;
    double *room = malloc((states + 2 * s->dof * s->n) * sizeof *room);
    s->tolerance = tolerance;
    ad_blas_single_thread();
    bool found = gaps_new(&g, s) && room && iterate(s, &g, room, room + states);
    ad_blas_threads();
    gaps_free(&g);
    free(room);
    return found;
}

double phys_shooting_moved(const struct phys_shooting *s)
{
    double moved = 0, extent = 0;
    for (size_t k = 0; k < s->dof; k++) {
        /* a path at rest extends only by rounding */
        extent = fmax(extent, ROUNDING * fmax(fabs(s->begun[k]), s->size[k]));
        double low = s->begun[k], high = low;
        for (size_t i = 0; i <= s->n; i++) {
            double q = s->begun[i * 2 * s->dof + k];
            low = fmin(low, q);
            high = fmax(high, q);
            moved = fmax(moved, fabs(s->state[i * 2 * s->dof + k] - q));
        }
        extent = fmax(extent, high - low);
    }
    return moved > 0 ? moved / extent : 0;
}
