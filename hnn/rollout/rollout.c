/* Follows a model's motion (rollout.h). Fixed steps divide the intervals between outputs evenly, so
   that outputs are steps and the way back takes the same ones; adaptive steps ignore outputs, which
   are interpolated. */
#include "physics/linear/vectors.h"
#include "rollout.h"
#include "autodiff/sized.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double default_tolerance = 1e-9;

struct motion {
    const struct phys_ode *ode;
    const struct hnn_rollout_settings *settings;
    struct phys_simulation simulation; /* integrator and size of its steps */
    double *y;                         /* [states], now */
    struct hnn_path *path;
    size_t next; /* output */
    struct hnn_rollout_info *info;
    struct ad_error *error;
};

static void store(struct motion *m, const double *y)
{
    size_t states = m->path->states;
    memcpy(m->path->x + states * m->next++, y, states * sizeof *y);
}

/* ---- motion in time ---- */

/* The first sample of every simulation is its start, which is known. */
static bool sample(void *context, double t, const double *y)
{
    struct motion *m = context;
    if (t != m->simulation.t0)
        store(m, y);
    return true;
}

/* One simulation; outputs first ... end-1 come from the polynomials of its steps. */
static enum ad_status advance(struct motion *m, double t0, double t1, size_t first, size_t end)
{
    struct phys_simulation s = m->simulation;
    struct phys_simulation_info info = {0};
    if (t0 == t1)
        return AD_OK;
    m->simulation.t0 = s.t0 = t0;
    s.t1 = t1;
    s.n_samples = end - first;
    s.times = m->settings->t + first;
    s.sample = end > first ? sample : NULL;
    s.context = m;
    phys_simulate(&s, m->ode, m->y, &info, m->error);
    m->info->evaluations += info.evaluations + info.interpolations;
    m->info->seconds += info.seconds;
    return m->error->status;
}

/* Integrates from t0 to t1, which outputs first ... end-1 lie between. */
static enum ad_status onwards(struct motion *m, double t0, double t1, size_t first, size_t end)
{
    if (m->simulation.integrator->adaptive)
        return advance(m, t0, t1, first, end);
    for (size_t k = first; k < end; t0 = m->settings->t[k++]) {
        if (advance(m, t0, m->settings->t[k], 0, 0) != AD_OK)
            return m->error->status;
        store(m, m->y);
    }
    return advance(m, t0, t1, 0, 0);
}

static enum ad_status backwards(struct motion *m, double t1, double t0, size_t first, size_t end)
{
    if (!m->simulation.integrator->adaptive)
        for (size_t k = end; k > first; t1 = m->settings->t[--k])
            if (advance(m, t1, m->settings->t[k - 1], 0, 0) != AD_OK)
                return m->error->status;
    return advance(m, t1, t0, 0, 0);
}

/* ---- motion in energy ---- */

/* x' = g/|g|^2, g = grad H, so that H' = 1: the energy itself is the time of this motion. With
   y' = (H_p, -H_q), g is y' with its halves changed and one sign. */
static enum ad_status ascent(void *context, double s, const double *y, double *rate,
                             struct ad_error *error)
{
    const struct motion *m = context;
    size_t n = m->ode->n / 2;
    double squares = 0;
    (void)s;
    if (m->ode->field(m->ode->context, m->settings->add_at, y, rate, error) != AD_OK)
        return error->status;
    for (size_t k = 0; k < n; k++) {
        double H_p = rate[k], H_q = -rate[n + k];
        squares += H_p * H_p + H_q * H_q;
        rate[k] = H_q;
        rate[n + k] = H_p;
    }
    if (squares == 0)
        return ad_fail(error, AD_E_NONFINITE,
                       "no energy can be added at rest: its gradient vanishes there");
    for (size_t k = 0; k < 2 * n; k++)
        rate[k] /= squares;
    return AD_OK;
}

static enum ad_status climb(struct motion *m, double energy)
{
    struct phys_ode up = {
        .name = "the motion along the gradient", .n = m->ode->n, .field = ascent, .context = m};
    struct phys_simulation s = {.size = sizeof s,
                                .integrator = phys_integrator_find("dop853", m->error),
                                .t1 = energy,
                                .rtol = 1e-12,
                                .atol = 1e-12,
                                .scale = m->simulation.scale};
    struct phys_simulation_info info = {0};
    phys_simulate(&s, &up, m->y, &info, m->error);
    m->info->evaluations += info.evaluations;
    m->info->seconds += info.seconds;
    return m->error->status;
}

/* ---- the rollout ---- */

static enum ad_status check(const struct phys_ode *ode, const struct hnn_rollout_settings *s,
                            struct ad_error *error)
{
    if (s->n == 0)
        return ad_fail(error, AD_E_ARGUMENT, "a rollout needs at least one output, its start");
    if (AD_LACKS(error, s->t))
        return error->status;
    for (size_t k = 0; k < s->n; k++)
        if (!isfinite(s->t[k]) || (k && !(s->t[k] > s->t[k - 1])))
            return ad_fail(error, AD_E_ARGUMENT,
                           "outputs at %g and then %g: times must be finite and increase",
                           s->t[k ? k - 1 : 0], s->t[k]);
    const double number[] = {s->dt, s->rtol};
    for (size_t k = 0; k < 2; k++)
        if (!(number[k] >= 0 && isfinite(number[k])))
            return ad_fail(error, AD_E_ARGUMENT, "%s: expected more than 0, or 0 for none, got %g",
                           k ? "rtol" : "dt", number[k]);
    if (!isfinite(s->add))
        return ad_fail(error, AD_E_ARGUMENT, "add: expected a finite energy, got %g", s->add);
    if (s->add != 0 && !(ode->canonical && ode->energy))
        return ad_fail(error, AD_E_ARGUMENT,
                       "adding energy needs a purely symplectic field, which %s lacks", ode->name);
    if (s->add != 0 && !(s->add_at >= s->t[0] && s->add_at <= s->t[s->n - 1]))
        return ad_fail(error, AD_E_ARGUMENT,
                       "energy is to be added at t = %g, expected a time from %g to %g", s->add_at,
                       s->t[0], s->t[s->n - 1]);
    return AD_OK;
}

static enum ad_status prepare(struct motion *m, const double *x0)
{
    const struct hnn_rollout_settings *s = m->settings;
    size_t states = m->ode->n;
    *m->path = (struct hnn_path){.states = states, .n = s->n};
    m->path->t = malloc(s->n * sizeof *m->path->t);
    m->path->x = malloc(states * s->n * sizeof *m->path->x);
    m->y = malloc(2 * states * sizeof *m->y);
    if (!m->path->t || !m->path->x || !m->y)
        return ad_fail(m->error, AD_E_MEMORY, "out of memory for %zu outputs", s->n);
    memcpy(m->path->t, s->t, s->n * sizeof *s->t);
    memcpy(m->y, x0, states * sizeof *x0);
    double rtol = s->rtol > 0 ? s->rtol : default_tolerance;
    m->simulation = (struct phys_simulation){.size = sizeof(struct phys_simulation),
                                             .integrator = s->integrator,
                                             .rtol = rtol,
                                             .atol = rtol,
                                             .scale = m->y + states};
    if (!s->integrator)
        m->simulation.integrator = phys_integrator_find("dop853", m->error);
    if (!m->simulation.integrator->adaptive)
        m->simulation.dt = s->dt;
    return phys_typical_sizes(m->ode, s->t[0], x0, m->y + states, m->error);
}

static enum ad_status follow(struct motion *m, const double *x0)
{
    const struct hnn_rollout_settings *s = m->settings;
    double t0 = s->t[0], t1 = s->t[s->n - 1], at = s->add != 0 ? s->add_at : t0;
    size_t before = 1; /* outputs up to `at` */
    while (before < s->n && s->t[before] <= at)
        before++;
    store(m, x0);
    if (onwards(m, t0, at, 1, before) != AD_OK || (s->add != 0 && climb(m, s->add) != AD_OK) ||
        onwards(m, at, t1, before, s->n) != AD_OK || !s->reverse)
        return m->error->status;
    if (backwards(m, t1, at, before, s->n) == AD_OK &&
        (s->add == 0 || climb(m, -s->add) == AD_OK) && backwards(m, at, t0, 1, before) == AD_OK)
        m->info->reversal_error = phys_distance(m->ode->n, m->y, x0);
    return m->error->status;
}

enum ad_status hnn_rollout(const struct phys_ode *ode, const struct hnn_rollout_settings *settings,
                           const double *x0, struct hnn_path *path, struct hnn_rollout_info *info,
                           struct ad_error *error)
{
    struct hnn_rollout_info unused = {0};
    info = info ? info : &unused;
    struct motion m = {.ode = ode, .path = path, .info = info, .error = error};
    if (path)
        *path = (struct hnn_path){0};
    if (AD_LACKS(error, ode, settings, x0, path))
        return error->status;
    AD_OWN(hnn_rollout_settings, settings, reverse, error);
    m.settings = settings;
    *info = (struct hnn_rollout_info){.reversal_error = NAN};
    if (check(ode, settings, error) == AD_OK && prepare(&m, x0) == AD_OK)
        follow(&m, x0);
    if (error->status != AD_OK)
        hnn_path_free(path);
    free(m.y);
    return error->status;
}
