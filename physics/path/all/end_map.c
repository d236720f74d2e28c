/* Where motions end (end_map.h), by Taylor series of the motion and its variations where L has
   them. */
#include "end_map.h"
#include "physics/path/ends.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STEPS = 20000, SWEEPS = 30 };

static const double DIFFERENCE = 1e-6; /* of the speed */
static const double ESCAPED = 1e3;     /* of the reach: a motion lost so far away does not return */
static const double UNCONTROLLED = 1e300;

double phys_end_norm(size_t n, const double *a)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += a[k] * a[k];
    if (sum > DBL_MIN && sum < DBL_MAX)
        return sqrt(sum);
    sum = 0; /* squares are out of range */
    for (size_t k = 0; k < n; k++)
        sum = hypot(sum, a[k]);
    return sum;
}

double phys_end_distance(size_t n, const double *a, const double *b)
{
    double d[PHYS_END_MAP_DOF];
    for (size_t k = 0; k < n; k++)
        d[k] = a[k] - b[k];
    return phys_end_norm(n, d);
}

/* unit = C^-T where L_vv = C C^T at rest, or 1 where L_vv is not positive definite; and a natural
   speed, of the force and its growth with the place. */
static void find_units(struct phys_end_map *m, const struct phys_system *system,
                       struct ad_error *error)
{
    size_t n = m->dof;
    const struct phys_curvature *at = &m->at;
    double C[9] = {0}, zero[3] = {0}, rate = 0, force = 0, p[3];
    struct ad_error none = {0};
    bool known = phys_curvature_new(&m->at, system, &none) == AD_OK &&
                 phys_curvature_at(&m->at, m->from, zero, 0);
    for (size_t i = 0; i < n && known; i++)
        for (size_t j = 0; j <= i && known; j++) {
            double sum = at->vv[i * n + j];
            for (size_t k = 0; k < j; k++)
                sum -= C[i * n + k] * C[j * n + k];
            known = i != j || sum > 0;
            C[i * n + j] = i == j ? sqrt(sum) : sum / C[j * n + j];
        }
    for (size_t j = 0; j < n; j++) /* column j of C^-T: C^T x = e_j */
        for (size_t i = n; i-- > 0;) {
            double sum = i == j;
            for (size_t k = i + 1; k < n; k++)
                sum -= C[k * n + i] * m->unit[k * n + j];
            m->unit[i * n + j] = known ? sum / C[i * n + i] : (double)(i == j);
        }
    m->speed = 0;
    for (size_t j = 0; j < n && known; j++) { /* p = C^-1 L_q, growth C^-1 L_qq C^-T */
        p[j] = 0;
        for (size_t i = 0; i < n; i++)
            p[j] += m->unit[i * n + j] * at->q[i];
        force = hypot(force, p[j]);
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t a = 0; a < n; a++)
                for (size_t b = 0; b < n; b++)
                    sum += m->unit[a * n + j] * at->qq[a * n + b] * m->unit[b * n + k];
            rate = hypot(rate, sum);
        }
    }
    if (known && rate > 0)
        m->speed = force / sqrt(rate);
    phys_keep_memory(&none, error);
}

/* The speed of the energy asked for. */
static void find_speed(struct phys_end_map *m, struct ad_error *error)
{
    const double E = m->ends->energy;
    double y[2 * PHYS_END_MAP_DOF] = {0}, rest;
    memcpy(y, m->from, m->dof * sizeof *y);
    rest = m->motion.energy(m->motion.context, 0, y);
    m->speed = sqrt(2 * (E - rest));
    if (!(m->speed > 0 && isfinite(m->speed)))
        ad_fail(error, AD_E_ACCURACY,
                "no motion of energy %g leaves the start, where one at rest has %g; try a higher "
                "energy",
                E, rest);
}

enum ad_status phys_end_map_new(struct phys_end_map *m, const struct phys_system *system,
                                const struct phys_ends *ends, const double *from, const double *to,
                                double time, double reach, struct ad_error *error)
{
    size_t n = system->dof, most = 2 * n * (1 + n);
    struct ad_error none = {0};
    *m = (struct phys_end_map){.dof = n, .time = time, .reach = reach, .ends = ends};
    memcpy(m->from, from, n * sizeof *from);
    memcpy(m->to, to, n * sizeof *to);
    m->unit = calloc(n * n + 2 * most, sizeof *m->unit);
    if (!m->unit)
        return ad_fail(error, AD_E_MEMORY, "out of memory for motions");
    m->y = m->unit + n * n;
    m->scale = m->y + most;
    find_units(m, system, error);
    double slowest = 0; /* as far as `to` in the time */
    for (size_t k = 0; k < n; k++)
        slowest = hypot(slowest, (to[k] - from[k]) / m->unit[k * n + k] / time);
    m->speed = fmax(m->speed, fmax(slowest, reach / m->unit[0] / time));
    for (size_t k = 0; k < most; k++)
        m->scale[k] = k < n ? reach : k < 2 * n ? m->speed * m->unit[0] : UNCONTROLLED;
    m->has_variations = phys_ode_variations(system, n, &m->varied, &none) == AD_OK;
    phys_keep_memory(&none, error);
    const bool places = ends && (ends->free[0] || ends->free[1]), timed = ends && ends->free_time;
    if ((places || timed) && !m->at.program && error->status == AD_OK)
        ad_fail(error, AD_E_ARGUMENT, "all paths of free ends: L has no second derivatives");
    if (places && error->status == AD_OK)
        phys_legendre_new(system, &m->legendre, error);
    if (error->status == AD_OK && phys_ode_lagrangian(system, &m->motion, error) == AD_OK && timed)
        find_speed(m, error);
    return error->status;
}

void phys_end_map_free(struct phys_end_map *m)
{
    phys_ode_free(&m->varied);
    phys_ode_free(&m->motion);
    phys_curvature_free(&m->at);
    phys_legendre_free(m->legendre);
    free(m->unit);
}

enum end { REACHED, GONE, LOST };

/* The momentum of a coordinate that is free at the end as a length: by the mass and the time. */
static double length_of_momentum(const struct phys_end_map *m, size_t k)
{
    return m->unit[k * m->dof + k] * m->unit[k * m->dof + k] * m->time;
}

static void find_miss(struct phys_end_map *m, double time, double *miss)
{
    double p[PHYS_END_MAP_DOF] = {0};
    if (m->legendre)
        phys_legendre_momentum(m->legendre, m->y, m->y + m->dof, time, p, NULL);
    for (size_t i = 0; i < m->dof; i++)
        miss[i] =
            phys_end_moves(m->ends, 1, i) ? p[i] * length_of_momentum(m, i) : m->y[i] - m->to[i];
}

/* The motion, with variations if asked for, and by how much it misses; by: of its duration. */
static enum end follow(struct phys_end_map *m, const double *w, bool vary, double tolerance,
                       double *miss, double *time, double *by_time)
{
    size_t n = m->dof;
    const struct phys_ode *ode = vary ? &m->varied : &m->motion;
    double by[PHYS_END_MAP_DOF * (2 * PHYS_END_MAP_DOF + 1)] = {0};
    struct ad_error lost = {0};
    struct phys_simulation_info info = {0};
    if (!phys_end_map_start(m, w, m->y, m->y + n, time, vary ? by : NULL))
        return LOST;
    const struct phys_simulation how = {
        .size = sizeof how,
        .integrator = phys_integrator_find(ode->series ? "taylor" : "dop853", &lost),
        .t1 = *time,
        .rtol = tolerance,
        .atol = tolerance,
        .scale = m->scale,
        .max_steps = MOST_STEPS,
        .proceed = m->proceed,
        .context = m->context};
    for (size_t k = 0; k < n && vary; k++) {
        memcpy(m->y + 2 * n * (1 + k), by + k * (2 * n + 1), 2 * n * sizeof *m->y);
        by_time[k] = by[k * (2 * n + 1) + 2 * n];
    }
    bool arrived = *time == 0 || (phys_simulate(&how, ode, m->y, &info, &lost) == AD_OK &&
                                  info.stop == PHYS_SIMULATION_END);
    m->steps += info.steps + 1;
    find_miss(m, *time, miss);
    double length = phys_end_norm(n, miss);
    if (arrived && isfinite(length))
        return REACHED;
    bool gone = isfinite(length) && length > ESCAPED * m->reach;
    for (size_t i = 0; i < n; i++)
        miss[i] /= length;
    return gone ? GONE : LOST;
}

/* Derivatives of the miss by w, from the variations at the end. */
static bool derivatives(struct phys_end_map *m, double time, const double *by_time, double *J)
{
    const size_t n = m->dof;
    if (m->legendre && !phys_curvature_at(&m->at, m->y, m->y + n, time))
        return false;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            const double *q = m->y + 2 * n * (1 + k), *v = q + n;
            double p = 0;
            for (size_t j = 0; j < n && phys_end_moves(m->ends, 1, i); j++)
                p += m->at.qv[j * n + i] * q[j] + m->at.vv[i * n + j] * v[j];
            J[i * n + k] = phys_end_moves(m->ends, 1, i) ? p * length_of_momentum(m, i)
                                                         : q[i] + m->y[n + i] * by_time[k];
        }
    return true;
}

/* The same by differences. */
static bool differences(struct phys_end_map *m, const double *w, double tolerance,
                        const double *miss, double *J)
{
    const size_t n = m->dof;
    const double speed = hypot(m->speed, phys_end_norm(n, w));
    for (size_t k = 0; k < n; k++) {
        double other[PHYS_END_MAP_DOF], by[PHYS_END_MAP_DOF], time;
        memcpy(by, w, n * sizeof *w);
        by[k] += DIFFERENCE * speed;
        if (follow(m, by, false, 1e-3 * tolerance, other, &time, NULL) != REACHED)
            return false;
        for (size_t i = 0; i < n; i++)
            J[i * n + k] = (other[i] - miss[i]) / (DIFFERENCE * speed);
    }
    return true;
}

bool phys_end_map_at(struct phys_end_map *m, const double *w, double tolerance, double *miss,
                     double *J)
{
    size_t n = m->dof;
    double time, by_time[PHYS_END_MAP_DOF];
    enum end end = follow(m, w, m->has_variations, tolerance, miss, &time, by_time);
    memset(J, 0, n * n * sizeof *J);
    if (end != REACHED)
        return end == GONE;
    double length = phys_end_norm(n, miss), size;
    if (!(m->has_variations ? derivatives(m, time, by_time, J)
                            : differences(m, w, tolerance, miss, J)))
        return false;
    size = m->reach + length;
    for (size_t k = 0; k < n; k++) {
        double grows = 0;
        for (size_t i = 0; i < n; i++)
            grows += length > 0 ? miss[i] / length * J[i * n + k] : 0;
        for (size_t i = 0; i < n; i++)
            J[i * n + k] = (J[i * n + k] - miss[i] / size * grows) / size;
    }
    for (size_t i = 0; i < n; i++)
        miss[i] /= size;
    for (size_t i = 0; i < n * n; i++)
        if (!isfinite(J[i]))
            return false;
    return true;
}

/* One-sided Jacobi rotations: columns of J V become orthogonal (Golub and Van Loan, Matrix
   Computations, section 8.6.3). */
void phys_singular_values(size_t n, const double *J, struct phys_singular *s)
{
    memset(s, 0, sizeof *s);
    for (size_t k = 0; k < n; k++) {
        s->right[k][k] = 1;
        for (size_t i = 0; i < n; i++)
            s->left[k][i] = J[i * n + k];
    }
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (size_t p = 0; p < n; p++)
            for (size_t q = p + 1; q < n; q++) {
                double a = 0, b = 0, c = 0;
                for (size_t i = 0; i < n; i++) {
                    a += s->left[p][i] * s->left[p][i];
                    b += s->left[q][i] * s->left[q][i];
                    c += s->left[p][i] * s->left[q][i];
                }
                double angle = 0.5 * atan2(2 * c, a - b), x = cos(angle), y = sin(angle);
                if (c == 0 && a >= b)
                    continue;
                for (size_t i = 0; i < n; i++) {
                    double l = s->left[p][i], r = s->right[p][i];
                    s->left[p][i] = x * l + y * s->left[q][i];
                    s->left[q][i] = x * s->left[q][i] - y * l;
                    s->right[p][i] = x * r + y * s->right[q][i];
                    s->right[q][i] = x * s->right[q][i] - y * r;
                }
            }
    for (size_t k = 0; k < n; k++) {
        s->size[k] = phys_end_norm(n, s->left[k]);
        for (size_t i = 0; i < n && s->size[k] > 0; i++)
            s->left[k][i] /= s->size[k];
    }
}
