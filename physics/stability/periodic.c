/* Newton's method for periodic motions (periodic.h), damped as by Levenberg and Marquardt with the
   square of what is left to close: it converges quadratically where solutions are not isolated, too
   (Yamashita, Fukushima, Computing Suppl. 15, 2001). */
#include "periodic.h"
#include "autodiff/free.h"
#include "autodiff/sized.h"
#include "internal.h"
#include "physics/lagrangian/internal.h"
#include "physics/linear/linear.h"
#include "physics/linear/vectors.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 60, HALVINGS = 12 };

/* In units of sizes: what closes, or in units of the largest growth of a difference; and steps. */
static const double nearly = 1e-9, rounding = 1e-12, tolerance = 1e-15, still = 1e-6;

struct orbit {
    const struct phys_system *system;
    const struct phys_periodic_settings *settings;
    struct phys_ode plain, varied;
    size_t shares; /* of the period, after which the motion is turned by `turn` bodies */
    size_t turn;
    size_t d, rows, columns; /* of J: d, and 1 for the energy; d, and 1 for the period */
    double energy, power;    /* held, and its size */
    double close;            /* less is closed */
    double *size;            /* [d] */
    double *y;               /* [d + d^2] the end of a period, and the matrix */
    double *rate;            /* [d] there */
    double *left, *next;     /* [rows] what is left */
    double *J, *U, *s, *V;   /* [columns][rows]; its singular vectors and values */
    double *step, *x;        /* [columns] in units of sizes; [d] a trial */
};

static enum ad_status go(struct orbit *o, const struct phys_ode *ode, const char *method,
                         const double *x, double from, double to, double *y, struct ad_error *error)
{
    const struct phys_orbit orbit = {o->d, o->size, tolerance, o->settings->proceed,
                                     o->settings->context};
    return phys_orbit_follow(&orbit, ode, method, x, from, to, y, error);
}

static double energy_of(struct orbit *o, const double *x)
{
    return o->plain.energy(o->plain.context, 0, x);
}

/* The component of the start that component k has become. */
static size_t from(const struct orbit *o, size_t k)
{
    const size_t dof = o->d / 2;
    return k / dof * dof + (k % dof + o->turn * o->system->dims) % dof;
}

/* What is left to close of the motion from x that ends at o->y, in units of sizes. */
static double measure(struct orbit *o, const double *x, double *left)
{
    for (size_t k = 0; k < o->d; k++)
        left[k] = (o->y[k] - x[from(o, k)]) / o->size[k];
    if (o->rows > o->d)
        left[o->d] = (energy_of(o, x) - o->energy) / o->power;
    return phys_norm(o->rows, left);
}

/* J by columns: of the start, in units of sizes, and of the period, in units of itself. */
static enum ad_status fill(struct orbit *o, const double *x, double period, struct ad_error *error)
{
    const size_t d = o->d, rows = o->rows;
    const double share = period / (double)o->shares;
    if (o->plain.field(o->plain.context, share, o->y, o->rate, error) != AD_OK)
        return error->status;
    for (size_t j = 0; j < d; j++)
        for (size_t i = 0; i < d; i++)
            o->J[j * rows + i] =
                (o->y[d + j * d + i] - (from(o, i) == j)) * o->size[j] / o->size[i];
    for (size_t i = 0; i < d && o->columns > d; i++)
        o->J[d * rows + i] = o->rate[i] * share / o->size[i];
    for (size_t j = 0; j < o->columns && rows > d; j++) {
        const double h = 1e-5;
        double both[2] = {0, 0};
        for (int sign = 0; sign < 2 && j < d; sign++) {
            memcpy(o->x, x, d * sizeof *x);
            o->x[j] += (sign ? -h : h) * o->size[j];
            both[sign] = energy_of(o, o->x);
        }
        o->J[j * rows + d] = (both[0] - both[1]) / (2 * h * o->power);
    }
    return AD_OK;
}

/* The damped step for what is left, of J as fill leaves it, which is destroyed. */
static enum ad_status solve(struct orbit *o, const double *left, struct ad_error *error)
{
    const size_t n = o->columns, m = o->rows, k = m < n ? m : n;
    const double damping = fmin(pow(phys_norm(m, left), 2), 1e-2);
    memset(o->step, 0, n * sizeof *o->step);
    if (phys_lapack_singular_values(m, n, o->J, o->s, o->U, o->V) != 0)
        return ad_fail(error, AD_E_ACCURACY, "the steps of a period have no singular values");
    for (size_t j = 0; j < k && o->s[j] > 1e-11 * o->s[0]; j++) {
        double along = 0;
        for (size_t i = 0; i < m; i++)
            along += o->U[j * m + i] * left[i];
        for (size_t i = 0; i < n; i++)
            o->step[i] -= o->V[i * k + j] * o->s[j] * along / (o->s[j] * o->s[j] + damping);
    }
    return AD_OK;
}

/* One step, as much of it as makes what is left less; false: none does. */
static bool advance(struct orbit *o, double *x, double *period, double *left,
                    struct ad_error *error)
{
    const size_t d = o->d;
    if (fill(o, x, *period, error) != AD_OK || solve(o, o->left, error) != AD_OK)
        return false;
    for (double share = 1; share > ldexp(1, -HALVINGS); share /= 2) {
        const double by = o->columns > d ? share * o->step[d] : 0, T = *period * (1 + by);
        struct ad_error lost = {0};
        if (fabs(by) > 0.2 || T < o->settings->period / 2 || T > 2 * o->settings->period)
            continue; /* at T = 0 all close */
        for (size_t k = 0; k < d; k++)
            o->x[k] = x[k] + share * o->step[k] * o->size[k];
        if (go(o, &o->varied, "taylor", o->x, 0, T / (double)o->shares, o->y, &lost) != AD_OK) {
            const bool stopped =
                o->settings->proceed && !o->settings->proceed(o->settings->context);
            if (stopped || (lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY))
                return ad_fail(error, lost.status, "%s", lost.message), false;
            continue;
        }
        const double now = measure(o, o->x, o->next);
        if (!(now < *left))
            continue;
        memcpy(x, o->x, d * sizeof *x);
        memcpy(o->left, o->next, o->rows * sizeof *o->left);
        *period = T;
        *left = now;
        return true;
    }
    return false;
}

/* Forces that change with time have a period of their own. */
static enum ad_status check_time(const struct orbit *o, struct ad_error *error)
{
    if (!o->settings->hold_period && !phys_orbit_is_timeless(o->system, error) &&
        error->status == AD_OK)
        ad_fail(error, AD_E_ARGUMENT,
                "the forces of %s depend on time, and the period is a multiple of theirs; hold the "
                "period",
                o->system->scene->name);
    return error->status;
}

static enum ad_status begin(struct orbit *o, struct phys_periodic *found, struct ad_error *error)
{
    const size_t dof = o->system->dof, d = o->d = 2 * dof;
    if (dof > PHYS_PERIODIC_DOF)
        return ad_fail(error, AD_E_ARGUMENT,
                       "%s: periodic motions of %zu coordinates; expected at most %d",
                       o->system->scene->name, dof, PHYS_PERIODIC_DOF);
    if (!(o->settings->period > 0) || !isfinite(o->settings->period))
        return ad_fail(error, AD_E_ARGUMENT, "period: expected more than 0, got %g",
                       o->settings->period);
    for (size_t i = 0; i < d; i++)
        if (!isfinite(o->settings->x[i]))
            return ad_fail(error, AD_E_ARGUMENT, "x[%zu] = %g; expected a finite start", i,
                           o->settings->x[i]);
    if (o->settings->energy && !isfinite(*o->settings->energy))
        return ad_fail(error, AD_E_ARGUMENT, "energy: expected a finite number, got %g",
                       *o->settings->energy);
    if (o->settings->choreography && o->system->bodies < 2)
        return ad_fail(error, AD_E_ARGUMENT, "choreography: expected two bodies or more, got %zu",
                       o->system->bodies);
    o->shares = o->settings->choreography ? o->system->bodies : 1;
    o->rows = d + o->settings->hold_energy;
    o->columns = d + !o->settings->hold_period;
    found->n = d;
    found->x = calloc(d, sizeof *found->x);
    found->multiplier = calloc(d, sizeof *found->multiplier);
    o->size = calloc(5 * (d + 1) * (d + 2) + 9 * (d + 1), sizeof *o->size);
    if (!found->x || !found->multiplier || !o->size)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    o->y = o->size + d;
    o->rate = o->y + d + d * d;
    o->left = o->rate + d;
    o->next = o->left + d + 1;
    o->step = o->next + d + 1;
    o->x = o->step + d + 1;
    o->J = o->x + d;
    o->U = o->J + (d + 1) * (d + 1);
    o->V = o->U + (d + 1) * (d + 1);
    o->s = o->V + (d + 1) * (d + 1);
    memcpy(found->x, o->settings->x, d * sizeof *found->x);
    found->period = o->settings->period;
    if (check_time(o, error) != AD_OK ||
        phys_ode_variations(o->system, d, &o->varied, error) != AD_OK ||
        phys_ode_lagrangian(o->system, &o->plain, error) != AD_OK ||
        phys_typical_sizes(&o->plain, 0, found->x, o->size, error) != AD_OK)
        return error->status;
    o->energy = o->settings->energy ? *o->settings->energy : energy_of(o, found->x);
    o->power = o->energy != 0 ? fabs(o->energy) : 1;
    return AD_OK;
}

/* The turn of a choreography that leaves less to close; AD_E_ARGUMENT where bodies differ. */
static enum ad_status choose_turn(struct orbit *o, const double *x, struct ad_error *error)
{
    const size_t bodies = o->system->bodies;
    double left[2] = {0};
    if (o->shares == 1)
        return AD_OK;
    for (size_t k = 0; k < 2; k++) {
        o->turn = k ? bodies - 1 : 1;
        left[k] = measure(o, x, o->left);
        for (size_t i = 0; i < o->d; i++)
            o->x[i] = x[from(o, i)];
        const double E = energy_of(o, x), turned = energy_of(o, o->x);
        if (!(fabs(turned - E) <= 1e-10 * o->power))
            return ad_fail(error, AD_E_ARGUMENT,
                           "choreography: expected bodies that are alike; the energy is %.9g, and "
                           "%.9g with each in the place of the next",
                           E, turned);
    }
    o->turn = left[0] <= left[1] ? 1 : bodies - 1;
    return AD_OK;
}

static enum ad_status approach(struct orbit *o, struct phys_periodic *found, struct ad_error *error)
{
    if (go(o, &o->varied, "taylor", found->x, 0, found->period / (double)o->shares, o->y, error) !=
            AD_OK ||
        choose_turn(o, found->x, error) != AD_OK)
        return error->status;
    double left = measure(o, found->x, o->left), first = left, before = INFINITY;
    while (found->iterations < STEPS && (left >= nearly || left <= before / 2)) {
        before = left;
        if (!advance(o, found->x, &found->period, &left, error))
            break;
        found->iterations++;
    }
    o->close = fmax(nearly, rounding * phys_norm(o->d * o->d, o->y + o->d));
    if (error->status == AD_OK && !(left < o->close))
        ad_fail(error, AD_E_ACCURACY,
                "no periodic motion found near the start: after %.6g it is %.2g of its size from "
                "there, and %.2g at best; try a start or a period nearer to one",
                o->settings->period / (double)o->shares, first, left);
    o->shares = 1;
    o->turn = 0;
    return error->status;
}

/* How far the motion from x is from x after a time, in units of sizes. */
static double apart(struct orbit *o, const double *x, double from, double to, const char *method,
                    struct ad_error *error)
{
    if (go(o, &o->plain, method, x, from, to, o->y, error) != AD_OK)
        return NAN;
    return measure(o, x, o->left);
}

/* By another method: how well it closes, and what that leaves of the period; again after it; and
   how often it goes round in it. */
static enum ad_status verify(struct orbit *o, struct phys_periodic *found, struct ad_error *error)
{
    static const size_t primes[] = {2, 3, 5, 7};
    const double T = found->period, *x = found->x;
    if (go(o, &o->varied, "taylor", x, 0, T, o->y, error) != AD_OK || fill(o, x, T, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < o->d; k++)
        o->next[k] = o->rate[k] * T / o->size[k];
    const bool rests = !(phys_norm(o->d, o->next) > still);
    found->closure = apart(o, x, 0, T, "dop853", error);
    if (error->status != AD_OK || solve(o, o->left, error) != AD_OK)
        return error->status;
    found->uncertainty = (o->columns > o->d ? fabs(o->step[o->d]) * T : 0) + 4 * DBL_EPSILON * T;
    const double again = apart(o, x, T, 2 * T, "taylor", error);
    if (error->status == AD_OK && rests)
        return ad_fail(error, AD_E_ACCURACY, "the nearest periodic motion is a point at rest");
    if (error->status == AD_OK && !(found->closure < o->close && again < o->close))
        return ad_fail(error, AD_E_ACCURACY,
                       "closes at t = %.9g to %.2g of its size, but after another %.9g it is %.2g "
                       "off: %s",
                       T, found->closure, T, again,
                       o->columns > o->d ? "rounding grows too fast"
                                         : "the forces have another period");
    found->turns = 1;
    for (size_t k = 0; k < LENGTH(primes) && error->status == AD_OK; k++)
        while (error->status == AD_OK &&
               apart(o, x, 0, T / (double)(found->turns * primes[k]), "taylor", error) < nearly &&
               found->turns < 1000)
            found->turns *= primes[k];
    return error->status;
}

enum ad_status phys_periodic_find(const struct phys_system *system,
                                  const struct phys_periodic_settings *settings,
                                  struct phys_periodic *found, struct ad_error *error)
{
    if (AD_LACKS(error, found))
        return error->status;
    *found = (struct phys_periodic){.period = NAN, .uncertainty = NAN, .closure = NAN};
    if (AD_LACKS(error, system, system->scene, settings))
        return error->status;
    if (phys_refuse_constraints(system, "periodic motions", error) != AD_OK)
        return error->status;
    AD_OWN(phys_periodic_settings, settings, context, error);
    if (AD_LACKS(error, settings->x))
        return error->status;
    struct orbit o = {.system = system, .settings = settings};
    if (begin(&o, found, error) == AD_OK && approach(&o, found, error) == AD_OK &&
        verify(&o, found, error) == AD_OK)
        phys_multipliers(system, o.size, found, settings, error);
    phys_ode_free(&o.plain);
    phys_ode_free(&o.varied);
    free(o.size);
    return error->status;
}

void phys_periodic_free(struct phys_periodic *found)
{
    if (!found)
        return;
    AD_FREE(found->x, found->multiplier);
    *found = (struct phys_periodic){0};
}
