/* How the motion of a point of an end map begins (end_map.h). */
#include "end_map.h"
#include "physics/path/ends.h"

#include <math.h>
#include <string.h>

enum { DOF = PHYS_END_MAP_DOF, ITERATIONS = 60 };

/* v = unit w. */
static void times_unit(const struct phys_end_map *m, const double *w, double *v)
{
    for (size_t i = 0; i < m->dof; i++) {
        v[i] = 0;
        for (size_t k = 0; k < m->dof; k++)
            v[i] += m->unit[i * m->dof + k] * w[k];
    }
}

/* ---- free end time ---- */

/* s with which s u has the energy asked for, which grows with s where L_vv is positive definite:
   Newton's method between a speed too low and one too high. Leaves L_vv there. */
static bool find_speed(struct phys_end_map *m, const double *q, const double *u, double *speed)
{
    const size_t n = m->dof;
    double y[2 * DOF], s = m->speed, low = 0, high = (double)INFINITY;
    memcpy(y, q, n * sizeof *q);
    for (int i = 0; i < ITERATIONS; i++) {
        double grows = 0, next;
        for (size_t k = 0; k < n; k++)
            y[n + k] = s * u[k];
        const double over = phys_curvature_at(&m->at, q, y + n, 0)
                                ? m->motion.energy(m->motion.context, 0, y) - m->ends->energy
                                : (double)INFINITY; /* a speed beyond a limit */
        for (size_t k = 0; k < n * n; k++)
            grows += u[k / n] * m->at.vv[k] * s * u[k % n];
        *(over <= 0 ? &low : &high) = s;
        next = s - over / grows;
        if (!(next > low && next < high))
            next = isinf(high) ? 2 * s : 0.5 * (low + high);
        *speed = s;
        if (fabs(next - s) <= 1e-15 * s)
            return true;
        s = next;
    }
    return isfinite(s);
}

/* w = |w| e is the direction e, and the time. At w = 0 the map is that of free motions. */
static bool by_direction(struct phys_end_map *m, const double *w, double *q, double *v,
                         double *time, double *by)
{
    const size_t n = m->dof, row = 2 * n + 1;
    const double r = phys_end_norm(n, w);
    double e[DOF] = {0}, u[DOF], p[DOF] = {0}, s, along = 0;
    for (size_t k = 0; k < n; k++)
        e[k] = r > 0 ? w[k] / r : k == 0;
    times_unit(m, e, u);
    memcpy(q, m->from, n * sizeof *q);
    *time = m->time * r / m->speed;
    if (!find_speed(m, q, u, &s))
        return false;
    for (size_t i = 0; i < n; i++)
        v[i] = s * u[i];
    for (size_t k = 0; k < n * n; k++)
        p[k / n] += m->at.vv[k] * v[k % n]; /* of the energy by the velocity */
    for (size_t i = 0; i < n; i++)
        along += p[i] * u[i];
    for (size_t k = 0; k < n && by; k++) {
        double *at = by + k * row, turned[DOF] = {0}, grows = 0;
        memset(at, 0, row * sizeof *at);
        if (r == 0) {
            for (size_t i = 0; i < n; i++)
                at[i] = s * m->unit[i * n + k] * m->time / m->speed;
            continue;
        }
        at[2 * n] = m->time / m->speed * e[k];
        for (size_t i = 0; i < n; i++) {
            turned[i] = (m->unit[i * n + k] - u[i] * e[k]) / r;
            grows -= p[i] * turned[i] / along;
        }
        for (size_t i = 0; i < n; i++)
            at[n + i] = s * (turned[i] + u[i] * grows);
    }
    return true;
}

/* ---- coordinates free at the start, whose momenta are 0 ---- */

static bool by_place(struct phys_end_map *m, const double *w, double *q, double *v, double *by)
{
    const size_t n = m->dof, row = 2 * n + 1;
    const double places = m->reach / m->speed;
    double p[DOF];
    struct ad_error none = {0};
    for (size_t k = 0; k < n; k++) {
        const bool moves = phys_end_moves(m->ends, 0, k);
        q[k] = m->from[k] + (moves ? places * w[k] : 0);
        p[k] = moves ? 0 : w[k] / m->unit[k * n + k];
    }
    if (phys_legendre_velocity(m->legendre, q, p, 0, v, &none) != AD_OK ||
        (by && !phys_curvature_at(&m->at, q, v, 0)))
        return false;
    for (size_t k = 0; k < n && by; k++) {
        double dq[DOF] = {0}, dp[DOF] = {0}, *at = by + k * row;
        *(phys_end_moves(m->ends, 0, k) ? &dq[k] : &dp[k]) =
            phys_end_moves(m->ends, 0, k) ? places : 1 / m->unit[k * n + k];
        memcpy(at, dq, n * sizeof *at);
        phys_curvature_vary(&m->at, dq, dp, at + n, NULL);
        at[2 * n] = 0;
    }
    return true;
}

bool phys_end_map_start(struct phys_end_map *m, const double *w, double *q, double *v, double *time,
                        double *by)
{
    const size_t n = m->dof, row = 2 * n + 1;
    if (m->ends && m->ends->free_time)
        return by_direction(m, w, q, v, time, by);
    *time = m->time;
    if (m->ends && m->ends->free[0])
        return by_place(m, w, q, v, by);
    memcpy(q, m->from, n * sizeof *q);
    times_unit(m, w, v);
    for (size_t k = 0; k < n * row && by; k++) {
        const size_t i = k % row;
        by[k] = i >= n && i < 2 * n ? m->unit[(i - n) * n + k / row] : 0;
    }
    return true;
}
