/* Steps to an equilibrium (search.h): the sum of squares of the forces L_q(q, 0) is made less by
   steps of Levenberg's and Marquardt's kind, along the eigenvectors of L_qq, so that directions
   without a force take no part. */
#include "physics/linear/vectors.h"
#include "search.h"
#include "physics/linear/linear.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 300, DESCENTS = 100 };

static const double longest_step = 0.5; /* all in units of the box's half width */
static const double escaped = 30;
static const double converged = 1e-9; /* Newton's next step */
static const double finest = 1e-15;   /* no reason to go on */
static const double cut = 1e-11;      /* curvatures below this share of the largest are none */
static const double furthest_doubt = 1e-2;
static const double probe = 1e-4; /* of kinks */

bool phys_equilibrium_evaluate(struct search *s, const double *y)
{
    const size_t n = s->n;
    for (size_t i = 0; i < n; i++)
        s->q[i] = s->middle[i] + y[i] * s->size[i];
    if (!phys_curvature_at(&s->curvature, s->q, s->zero, 0))
        return false;
    for (size_t i = 0; i < n; i++) {
        s->force[i] = s->size[i] * s->curvature.q[i];
        for (size_t j = 0; j < n; j++)
            s->turn[i * n + j] = s->size[i] * s->size[j] * s->curvature.qq[i * n + j];
    }
    return true;
}

bool phys_equilibrium_decompose(struct search *s)
{
    const size_t n = s->n;
    memcpy(s->vector, s->turn, n * n * sizeof *s->vector);
    memset(s->unit, 0, n * n * sizeof *s->unit);
    for (size_t i = 0; i < n; i++)
        s->unit[i * n + i] = 1;
    if (phys_lapack_eigenvectors(n, s->vector, s->unit, s->value) != 0)
        return false;
    for (size_t k = 0; k < n; k++) {
        s->along[k] = 0;
        for (size_t i = 0; i < n; i++)
            s->along[k] += s->vector[k * n + i] * s->force[i];
    }
    return true;
}

/* The damped step; returns its largest component. */
static double set_step(struct search *s, double damping)
{
    const size_t n = s->n;
    const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1]));
    memset(s->step, 0, n * sizeof *s->step);
    for (size_t k = 0; k < n; k++) {
        const double value = s->value[k], share = damping * most;
        if (fabs(value) <= cut * most)
            continue;
        const double by = -s->along[k] / value / (1 + share / value * (share / value));
        for (size_t i = 0; i < n; i++)
            s->step[i] += by * s->vector[k * n + i];
    }
    return phys_largest(n, s->step);
}

/* Of the force in directions in which it does not change. */
static bool force_remains(const struct search *s)
{
    const double most = fmax(fabs(s->value[0]), fabs(s->value[s->n - 1]));
    double sum = 0;
    for (size_t k = 0; k < s->n; k++)
        if (fabs(s->value[k]) <= cut * most)
            sum += s->along[k] * s->along[k];
    return sqrt(sum) > 64 * DBL_EPSILON * (s->typical + most);
}

bool phys_equilibrium_approach(struct search *s, double *off)
{
    const size_t n = s->n;
    double damping = 0, before = INFINITY;
    if (!phys_equilibrium_evaluate(s, s->y))
        return false;
    const bool flat = phys_largest(n * n, s->turn) == 0;
    for (size_t count = 0; count < STEPS; count++) {
        if (!phys_equilibrium_decompose(s))
            return false;
        const double newton = set_step(s, 0), size = phys_scaled_norm(n, s->force, 1);
        const bool near = newton <= converged && (flat || phys_largest(n * n, s->turn) > 0);
        if (near && (newton <= finest || newton > 0.9 * before)) {
            *off = newton;
            return !force_remains(s);
        }
        before = newton;
        for (size_t tries = 0;; tries++) {
            const double step = set_step(s, damping),
                         share = step > longest_step ? longest_step / step : 1;
            for (size_t i = 0; i < n; i++)
                s->next[i] = s->y[i] + share * s->step[i];
            if (phys_equilibrium_evaluate(s, s->next) &&
                (phys_scaled_norm(n, s->force, 1) < size || near))
                break;
            if (step == 0 || tries == 60)
                return false;
            damping = fmax(4 * damping, 1e-3);
        }
        damping = damping < 1e-6 ? 0 : 0.2 * damping;
        memcpy(s->y, s->next, n * sizeof *s->y);
        if (phys_largest(n, s->y) > escaped)
            return false;
    }
    return false;
}

static double energy(struct search *s, const double *y)
{
    for (size_t i = 0; i < s->n; i++)
        s->q[i] = s->middle[i] + y[i] * s->size[i];
    return phys_motion_energy(s->motion, s->q, s->zero, 0);
}

void phys_equilibrium_descend(struct search *s)
{
    const size_t n = s->n;
    double damping = 1e-3, now = energy(s, s->y);
    for (size_t count = 0;
         count < DESCENTS && phys_equilibrium_evaluate(s, s->y) && phys_equilibrium_decompose(s);
         count++) {
        const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1]));
        memset(s->step, 0, n * sizeof *s->step);
        for (size_t k = 0; k < n; k++)
            for (size_t i = 0; i < n; i++)
                s->step[i] += s->vector[k * n + i] * s->along[k] /
                              (fabs(s->value[k]) + damping * most + DBL_MIN);
        const double step = phys_largest(n, s->step),
                     share = step > longest_step / 5 ? longest_step / 5 / step : 1;
        for (size_t i = 0; i < n; i++)
            s->next[i] = s->y[i] + share * s->step[i];
        const double next = energy(s, s->next);
        if (next < now) {
            memcpy(s->y, s->next, n * sizeof *s->y);
            damping *= 0.3;
            now = next;
        } else {
            damping *= 8;
        }
        if (step < 1e-4 || damping > 1e6 || phys_largest(n, s->y) > escaped)
            return;
    }
}

bool phys_equilibrium_is_smooth(struct search *s)
{
    const size_t n = s->n, square = n * n;
    double *room = malloc((3 * n + 4 * square) * sizeof *room), most = 0, off = 0, curved = 0,
           jump = 0, closer = 0, forces = 0;
    bool smooth = room && phys_equilibrium_evaluate(s, s->y);
    double *force = room, *turn = room ? room + 3 * n : NULL;
    for (size_t k = 0; smooth && k < 4; k++) { /* before, after, close before, close after; there */
        if (k == 0)
            memcpy(turn, s->turn, square * sizeof *turn);
        const double h = (k % 2 ? 1 : -1) * (k < 2 ? probe : probe / 100);
        for (size_t i = 0; i < n; i++)
            s->next[i] = s->y[i] + (i % 3 == 1 ? -h : h) / (1 + 0.1 * (double)(i % 7));
        smooth = phys_equilibrium_evaluate(s, s->next);
        if (k < 2) {
            memcpy(force + k * n, s->force, n * sizeof *force);
            memcpy(turn + (1 + k) * square, s->turn, square * sizeof *turn);
        } else {
            for (size_t i = 0; i < square; i++)
                closer = fmax(closer, fabs(s->turn[i] - turn[i]));
        }
    }
    for (size_t i = 0; smooth && i < n; i++) {
        double change = 0;
        for (size_t j = 0; j < n; j++) {
            const double *t = turn + i * n + j;
            change += t[0] * (j % 3 == 1 ? -2 : 2) * probe / (1 + 0.1 * (double)(j % 7));
            most = fmax(most, fabs(t[0]));
            jump = fmax(jump, fmax(fabs(t[square] - t[0]), fabs(t[2 * square] - t[0])));
            curved = fmax(curved, fabs(t[square] - 2 * t[0] + t[2 * square]));
        }
        forces = fmax(forces, fabs(force[n + i]) + fabs(force[i]));
        off = fmax(off, fabs(force[n + i] - force[i] - change));
    }
    free(room);
    return smooth && off <= (double)n * probe * (curved + 1e-5 * most) + 1e-9 * forces &&
           closer <= 0.1 * jump + 1e-7 * most;
}

void phys_equilibrium_doubt(struct search *s, double off)
{
    const size_t n = s->n;
    const double most = fmax(fabs(s->value[0]), fabs(s->value[n - 1])),
                 noise = 8 * DBL_EPSILON * (s->typical + most);
    for (size_t i = 0; i < n; i++)
        s->step[i] = 4 * off + DBL_EPSILON;
    for (size_t k = 0; k < n; k++) {
        const double far = fmin(noise / fmax(fabs(s->value[k]), DBL_MIN), furthest_doubt);
        for (size_t i = 0; i < n && fabs(s->value[k]) > cut * most; i++)
            s->step[i] += far * fabs(s->vector[k * n + i]);
    }
}
