/* Alternating drifts q += d_i h v and kicks p += k_i h F(q, t). For H = T(p) + V(q, t) each is the
   exact motion of one term, so that any composition is symplectic (Hairer, Lubich, Wanner,
   Geometric Numerical Integration, section II.5). */
#include "stepper.h"

#include <string.h>

/* Work: velocities; the last forces, the positions they were taken at, and 1 where there are any.
 */
static size_t work(const struct phys_integrator *integrator, size_t n)
{
    (void)integrator;
    return 3 * (n / 2) + 1;
}

/* Half 0 or 1 of the rate of systems that do not separate, where the state is, as the published
   semi-implicit Euler takes its force. */
static enum ad_status rate_of_half(struct phys_stepper *s, double t, size_t half, double *rate,
                                   struct ad_error *error)
{
    size_t n = s->n / 2;
    if (phys_stepper_rate(s, t, s->next, s->next_rate, error) == AD_OK)
        memcpy(rate, s->next_rate + half * n, n * sizeof *rate);
    return error->status;
}

static enum ad_status force(struct phys_stepper *s, double t, double *F, struct ad_error *error)
{
    if (!s->ode->kick)
        return rate_of_half(s, t, 1, F, error);
    s->evaluations++;
    return s->ode->kick(s->ode->context, t, s->next, F, error);
}

static enum ad_status velocity(struct phys_stepper *s, double t, double *v, struct ad_error *error)
{
    const double *p = s->next + s->n / 2;
    if (!s->ode->kick)
        return rate_of_half(s, t, 0, v, error);
    if (s->ode->drift)
        return s->ode->drift(s->ode->context, t, p, v, error);
    memcpy(v, p, s->n / 2 * sizeof *v);
    return AD_OK;
}

/* A half of the state, from component `first` on, += h * rate, with what was cut off it before. */
static void move(struct phys_stepper *s, size_t first, double h, const double *rate)
{
    for (size_t k = 0; k < s->n / 2; k++)
        phys_add_with_cut(s->next[first + k], h * rate[k], s->next_cut[first + k],
                          &s->next[first + k], &s->next_cut[first + k]);
}

/* Friction for a time h, half before and half after the kick: the step stays symmetric. */
static void decay(const struct phys_stepper *s, double *p, double h)
{
    if (s->ode->friction == 0)
        return;
    double share = exp(-s->ode->friction * h);
    for (size_t k = 0; k < s->n / 2; k++)
        p[k] *= share;
}

static enum ad_status step(struct phys_stepper *s, double h, struct ad_error *error)
{
    const struct phys_kicks *c = s->integrator->coefficients;
    size_t half = s->n / 2;
    double *p = s->next + half, t = s->t, *F = s->work + half, *at = F + half, *known = at + half;
    /* the force at the end of the step before */
    const bool kept = s->ode->kick && c->drift[0] == 0 && c->kick[c->n - 1] != 0 && *known != 0 &&
                      memcmp(at, s->y, half * sizeof *at) == 0;
    memcpy(s->next, s->y, s->n * sizeof *s->y);
    memcpy(s->next_cut, s->cut, s->n * sizeof *s->cut);
    for (size_t i = 0; i < c->n; i++) {
        if (c->drift[i] != 0) {
            if (velocity(s, t, s->work, error) != AD_OK)
                return error->status;
            move(s, 0, c->drift[i] * h, s->work);
            t += c->drift[i] * h;
        }
        if (c->kick[i] != 0) {
            if (!(i == 0 && kept) && force(s, t, F, error) != AD_OK)
                return error->status;
            decay(s, p, 0.5 * c->kick[i] * h);
            move(s, half, c->kick[i] * h, F);
            decay(s, p, 0.5 * c->kick[i] * h);
        }
    }
    memcpy(at, s->next, half * sizeof *at);
    *known = 1;
    return AD_OK;
}

const struct phys_scheme phys_splitting = {.work = work, .step = step};
