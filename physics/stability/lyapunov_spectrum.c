/* Lyapunov exponents, the largest ones: variations follow the motion and are made orthogonal at
   intervals; the logarithms of their lengths add up (Benettin, Galgani, Giorgilli, Strelcyn,
   Meccanica 15, 1980). */
#include "stability.h"
#include "physics/system/internal.h"
#include "autodiff/sized.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { INTERVALS = 200 };

static const double usual = 1e-13;        /* tolerance */
static const double most = 6, little = 2; /* log growth within an interval */
static const double shortest = 1e-7;      /* of the time */

struct spectrum {
    const struct phys_lyapunov_settings *settings;
    struct phys_ode ode;
    size_t d, k;   /* components of the motion, exponents */
    double *y;     /* [d][1 + k], one after the other */
    double *begun; /* the same where the interval begins */
    double *scale; /* [d][1 + k] */
    double *log;   /* [k] growth so far */
};

static double dot(const struct spectrum *s, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < s->d; i++)
        sum += a[i] / s->scale[i] * (b[i] / s->scale[i]);
    return sum;
}

/* Gram and Schmidt, twice; the logarithms of the lengths. */
static double make_orthonormal(const struct spectrum *s, double *log_length)
{
    double largest = 0;
    for (size_t j = 0; j < s->k; j++) {
        double *a = s->y + (j + 1) * s->d, length;
        for (int pass = 0; pass < 2; pass++)
            for (size_t i = 0; i < j; i++) {
                const double *b = s->y + (i + 1) * s->d;
                double share = dot(s, b, a);
                for (size_t m = 0; m < s->d; m++)
                    a[m] -= share * b[m];
            }
        length = sqrt(dot(s, a, a));
        for (size_t m = 0; m < s->d; m++)
            a[m] /= length;
        log_length[j] = log(length);
        largest = fmax(largest, fabs(log_length[j]));
    }
    return largest;
}

/* One interval; an interval in which variations grow too much is halved. */
static enum ad_status follow(struct spectrum *s, double *t, double *length, struct ad_error *error)
{
    const struct phys_lyapunov_settings *how = s->settings;
    struct phys_simulation step = {.size = sizeof step,
                                   .integrator = phys_integrator_find("taylor", error),
                                   .rtol = how->tolerance > 0 ? how->tolerance : usual,
                                   .scale = s->scale,
                                   .proceed = how->proceed,
                                   .context = how->context};
    const size_t bytes = s->ode.n * sizeof *s->y;
    double *log_length = s->log + s->k;
    memcpy(s->begun, s->y, bytes);
    for (;;) {
        struct phys_simulation_info info;
        double left = how->t1 - *t;
        bool last = *length * 1.01 >= left;
        step.t0 = *t;
        step.t1 = last ? how->t1 : *t + *length;
        if (phys_simulate(&step, &s->ode, s->y, &info, error) != AD_OK)
            return error->status;
        if (info.stop != PHYS_SIMULATION_END)
            return ad_fail(error, AD_E_ACCURACY, "interrupted");
        double largest = make_orthonormal(s, log_length);
        if (largest <= most) {
            for (size_t j = 0; j < s->k; j++)
                s->log[j] += log_length[j];
            *t = step.t1;
            if (largest < little)
                *length = fmin(2 * *length, (how->t1 - how->t0) / INTERVALS);
            return AD_OK;
        }
        *length = (step.t1 - step.t0) / 2;
        if (!(*length > shortest * (how->t1 - how->t0)))
            return ad_fail(error, AD_E_ACCURACY,
                           "variations grow too fast at t = %.9g: no exponents", *t);
        memcpy(s->y, s->begun, bytes);
    }
}

/* Over a short time directions have not settled yet, and growths come in any order. */
static void sort_falling(size_t k, double *exponents, double *spread)
{
    for (size_t i = 1; i < k; i++)
        for (size_t j = i; j > 0 && exponents[j] > exponents[j - 1]; j--) {
            const double rate = exponents[j], change = spread[j];
            exponents[j] = exponents[j - 1];
            spread[j] = spread[j - 1];
            exponents[j - 1] = rate;
            spread[j - 1] = change;
        }
}

static enum ad_status follow_all(struct spectrum *s, double *exponents, double *spread,
                                 struct ad_error *error)
{
    const double t0 = s->settings->t0, t1 = s->settings->t1, half = t0 + (t1 - t0) / 2;
    double t = t0, length = (t1 - t0) / INTERVALS;
    bool halved = false;
    while (t < t1 && follow(s, &t, &length, error) == AD_OK)
        if (!halved && t >= half) {
            halved = true;
            for (size_t j = 0; j < s->k; j++)
                s->log[2 * s->k + j] = s->log[j] / (t - t0);
        }
    for (size_t j = 0; j < s->k && error->status == AD_OK; j++) {
        exponents[j] = s->log[j] / (t1 - t0);
        spread[j] = fabs(exponents[j] - s->log[2 * s->k + j]);
    }
    if (error->status == AD_OK)
        sort_falling(s->k, exponents, spread);
    return error->status;
}

enum ad_status phys_lyapunov_spectrum(const struct phys_system *system, const double *x,
                                      const struct phys_lyapunov_settings *settings, size_t k,
                                      double *exponents, double *spread, struct ad_error *error)
{
    struct spectrum s = {.k = k};
    struct phys_ode ode = {0};
    if (AD_LACKS(error, system, system->scene, x, settings, exponents, spread))
        return error->status;
    if (phys_refuse_constraints(system, "variations", error) != AD_OK)
        return error->status;
    AD_OWN(phys_lyapunov_settings, settings, context, error);
    s.settings = settings;
    s.d = 2 * system->dof;
    if (k == 0 || k > s.d)
        return ad_fail(error, AD_E_ARGUMENT, "%zu exponents: expected 1 to %zu", k, s.d);
    for (size_t j = 0; j < k; j++)
        exponents[j] = spread[j] = NAN;
    if (!(settings->t1 > settings->t0))
        return ad_fail(error, AD_E_ARGUMENT, "growth from t = %g to %g: expected a later end",
                       settings->t0, settings->t1);
    const size_t n = s.d * (1 + k);
    double *memory = calloc(3 * n + 3 * k, sizeof *memory);
    if (!memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    s.y = memory;
    s.begun = s.y + n;
    s.scale = s.begun + n;
    s.log = s.scale + n;
    memcpy(s.y, x, s.d * sizeof *x);
    if (phys_ode_variations(system, k, &s.ode, error) == AD_OK &&
        (settings->scale || (phys_ode_lagrangian(system, &ode, error) == AD_OK &&
                             phys_typical_sizes(&ode, settings->t0, x, s.scale, error) == AD_OK))) {
        for (size_t i = 0; i < n; i++)
            s.scale[i] = settings->scale ? settings->scale[i % s.d] : s.scale[i % s.d];
        /* irregular directions: none is that of a symmetry */
        for (size_t i = s.d; i < n; i++)
            s.y[i] = s.scale[i] * (fmod((double)(i + 1) * 0.754877666246693, 1) - 0.5 +
                                   (i % s.d == i / s.d - 1));
        make_orthonormal(&s, s.log + k);
        follow_all(&s, exponents, spread, error);
    }
    phys_ode_free(&s.ode);
    phys_ode_free(&ode);
    free(memory);
    return error->status;
}
