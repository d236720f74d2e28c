/* Step size control: fixed steps, or as long as the tolerance allows (Hairer, Norsett, Wanner,
   Solving Ordinary Differential Equations I, section II.4; Gustafsson's controller for order 5 and
   the plain one for order 8, as in their codes DOPRI5 and DOP853). */
#include "run.h"

#include <float.h>
#include <math.h>

/* What the controller does for a method of some order; one that chooses it chooses its steps, too,
   and is corrected here alone. */
struct control {
    double beta;        /* weight of the error before */
    double exponent;    /* of the error now */
    double least, most; /* change of the step's length */
};

static struct control control_of(size_t order)
{
    double p = order ? (double)order : PHYS_SERIES_MOST;
    if (order && order < 8)
        return (struct control){0.04, 1 / p - 0.03, 0.2, 10};
    return (struct control){0, 1 / p, 1.0 / 3, 6};
}

static const double safety = 0.9;

enum { STALL = 20000 };           /* steps after which a run is looked at */
static const double moved = 1e-3; /* of the time, or of as many steps of the longest, in so many */

static double clamp(double x, double low, double high) { return fmin(fmax(x, low), high); }

static double floor_of(const struct run *run)
{
    const struct phys_simulation *s = run->settings;
    double clock = 10 * DBL_EPSILON * phys_larger(fabs(run->stepper.t), 1e-3 * fabs(s->t1 - s->t0));
    return phys_larger(s->min_step, clock);
}

static enum ad_status underflow(const struct run *run, const struct ad_error *cause,
                                struct ad_error *error)
{
    const struct phys_stepper *m = &run->stepper;
    char name[64];
    phys_ode_component(m->ode, m->worst, name, sizeof name);
    if (cause->status != AD_OK)
        return ad_fail(error, AD_E_NONFINITE, "step %zu: %s", run->info->steps + 1, cause->message);
    return ad_fail(error, AD_E_ACCURACY,
                   "step %zu: the step fell under %.2g at t = %.12g, where %s = %.6g changes too "
                   "fast to be followed: a collision or another singularity; stop before it, "
                   "soften the law, or allow a larger error",
                   run->info->steps + 1, floor_of(run), m->t, name, m->y[m->worst]);
}

/* Where a force jumps and holds the motion there, as dry friction a body at rest, every other step
   is rejected and the run would not end. */
static enum ad_status check_stall(struct run *run, struct ad_error *error)
{
    const struct phys_simulation_info *info = run->info;
    const struct phys_stepper *m = &run->stepper;
    const size_t steps = info->steps - run->looked.steps;
    char name[64];
    if (steps < STALL)
        return AD_OK;
    const double way =
        fmin(fabs(run->settings->t1 - run->settings->t0), (double)steps * info->max_step);
    const bool stalls = info->rejected - run->looked.rejected > steps / 4 &&
                        fabs(m->t - run->looked.t) < moved * way;
    if (stalls) {
        phys_ode_component(m->ode, m->worst, name, sizeof name);
        return ad_fail(error, AD_E_ACCURACY,
                       "%zu steps, and %zu tried in vain, from t = %.9g to t = %.9g: a force jumps "
                       "where %s = %.3g and holds the motion there, as dry friction does; take a "
                       "smooth law, tanh(v/small) for sign(v), or fixed steps",
                       steps, info->rejected - run->looked.rejected, run->looked.t, m->t, name,
                       m->y[m->worst]);
    }
    run->looked.steps = info->steps;
    run->looked.rejected = info->rejected;
    run->looked.t = m->t;
    return AD_OK;
}

/* Tries one step; its error in *norm, infinite where the field or the result is not finite. */
static enum ad_status attempt(struct run *run, double *norm, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    const struct phys_scheme *scheme = m->integrator->scheme;
    struct ad_error *cause = &run->cause;
    *norm = INFINITY;
    if (scheme->step(m, m->h, cause) == AD_OK)
        scheme->error_norm(m, &run->tolerance, norm, cause);
    if (cause->status != AD_OK && cause->status != AD_E_NONFINITE)
        return ad_fail(error, cause->status, "%s", cause->message);
    if (cause->status != AD_OK)
        *norm = INFINITY;
    return AD_OK;
}

/* The landing that is next, or t1. */
static double landing(struct run *run)
{
    while (run->next_landing < run->n_landings &&
           !(run->landings[run->next_landing] > run->stepper.t))
        run->next_landing++;
    return run->next_landing < run->n_landings
               ? fmin(run->landings[run->next_landing], run->settings->t1)
               : run->settings->t1;
}

/* Where steps have to end. */
static double target(struct run *run)
{
    const struct phys_simulation *s = run->settings;
    const double until = run->n_landings > 0 ? landing(run) : s->t1;
    for (size_t i = run->next_sample; s->land && i <= s->n_samples; i++) {
        double t = phys_run_sample_time(run, i);
        if ((t - run->stepper.t) * run->direction > 0)
            return run->n_landings > 0 ? fmin(t, until) : t;
    }
    return until;
}

void phys_run_propose(struct run *run, double longest)
{
    const bool given = run->info->steps == 0 && run->settings->dt > 0;
    run->target = target(run);
    run->cause.status = AD_OK;
    if (run->stepper.integrator->scheme->longest)
        run->h = run->direction * (given ? run->settings->dt : longest);
}

/* The end of a step as the clock says: its rounding must not add up. A method that takes the
   longest step that it can takes few of them, and rounded lengths would show in its energy after
   1e5 periods: there the clock has a remainder instead. */
static void set_end(struct run *run, double h)
{
    struct phys_stepper *m = &run->stepper;
    volatile double end = m->t + h;
    m->h = end - m->t;
    if (!m->integrator->scheme->longest)
        return;
    m->h = h;
    phys_add_with_cut(m->t, h, run->late, &m->end, &run->next_late);
    if (run->last) {
        m->end = run->target;
        run->next_late = 0;
    }
}

enum ad_status phys_run_length(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    const double left = (run->target - m->t) - run->late;
    run->last = fabs(run->h) * 1.01 >= fabs(left);
    double h = run->last ? left : run->h;
    if (!run->last && fabs(h) < floor_of(run))
        return underflow(run, &run->cause, error);
    run->tried = h;
    set_end(run, h);
    m->has_next_rate = false;
    run->cause.status = AD_OK;
    return check_stall(run, error);
}

bool phys_run_judge(struct run *run, double norm)
{
    const struct control c = control_of(run->stepper.integrator->order);
    norm = isfinite(norm) ? norm : (double)INFINITY;
    bool chosen =
        norm <= 1 && run->stepper.integrator->scheme->longest; /* the next step is, anew */
    double growth = chosen ? 1 : safety * pow(norm, -c.exponent);
    if (norm <= 1) {
        growth = chosen ? 1
                        : clamp(growth * pow(run->last_norm, c.beta), c.least,
                                run->rejected ? 1 : c.most);
        if (!run->last || growth < 1)
            run->h = run->tried * growth;
        run->last_norm = phys_larger(norm, 1e-4);
        run->rejected = false;
        return true;
    }
    run->info->rejected++;
    run->rejected = true;
    run->h = run->tried * clamp(growth, c.least, 1);
    return false;
}

static enum ad_status adaptive(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    double h = 0, norm;
    if (m->integrator->scheme->longest &&
        m->integrator->scheme->longest(m, &run->tolerance, &h, error) != AD_OK)
        return error->status;
    phys_run_propose(run, h);
    do
        if (phys_run_length(run, error) != AD_OK || attempt(run, &norm, error) != AD_OK)
            return error->status;
    while (!phys_run_judge(run, norm));
    return AD_OK;
}

static enum ad_status fixed(struct run *run, struct ad_error *error)
{
    const struct phys_simulation *s = run->settings;
    struct phys_stepper *m = &run->stepper;
    struct ad_error local; /* its message is longer than a short step takes to clear */
    local.status = AD_OK;
    m->h = (s->t1 - s->t0) / (double)run->n_steps;
    m->has_next_rate = false;
    if (m->integrator->scheme->step(m, m->h, &local) != AD_OK)
        return ad_fail(error, local.status, "step %zu: %s", run->info->steps + 1, local.message);
    if (!m->integrator->scheme->observe)
        return AD_OK;
    run->unseen = !phys_run_looks(run);
    return run->unseen ? AD_OK : m->integrator->scheme->observe(m, m->t + m->h, m->next, error);
}

enum ad_status phys_run_step(struct run *run, struct ad_error *error)
{
    return run->settings->integrator->adaptive ? adaptive(run, error) : fixed(run, error);
}

static double norm(const struct run *run, const double *x, const double *y)
{
    double sum = 0;
    for (size_t k = 0; k < run->stepper.n; k++) {
        double allowed = phys_allowed(&run->tolerance, k, y[k]);
        double a = x[k] == 0 || allowed == 0 ? 0 : x[k] / allowed;
        sum += a * a;
    }
    return sqrt(sum / (double)run->stepper.n);
}

/* A Euler step on trial shows the second derivative (ibid., section II.4, starting step size). */
enum ad_status phys_run_first_step(struct run *run, struct ad_error *error)
{
    struct phys_stepper *m = &run->stepper;
    if (m->integrator->scheme->longest)
        return AD_OK;
    double span = fabs(run->settings->t1 - run->settings->t0);
    if (phys_stepper_need_rate(m, error) != AD_OK)
        return error->status;
    double d0 = norm(run, m->y, m->y), d1 = norm(run, m->rate, m->y);
    double h0 = fmin(d0 < 1e-5 || d1 < 1e-5 ? 1e-6 * fmax(span, DBL_MIN) : 0.01 * d0 / d1, span);
    for (size_t k = 0; k < m->n; k++)
        m->next[k] = m->y[k] + run->direction * h0 * m->rate[k];
    double h = h0 * 1e-3;
    struct ad_error local = {
        0}; /* a trial step outside the field's domain: continue with small steps */
    if (phys_stepper_rate(m, m->t + run->direction * h0, m->next, m->next_rate, &local) == AD_OK) {
        for (size_t k = 0; k < m->n; k++)
            m->next[k] = m->next_rate[k] - m->rate[k];
        double d2 = norm(run, m->next, m->y) / h0, most = fmax(d1, d2);
        h = most <= 1e-15 ? fmax(1e-6 * span, h0 * 1e-3)
                          : pow(0.01 / most, 1 / (double)m->integrator->order);
        h = fmin(100 * h0, h);
    } else if (local.status != AD_E_NONFINITE) {
        return ad_fail(error, local.status, "%s", local.message);
    }
    /* what starts next to 0 has no size yet */
    run->h = run->direction * fmin(fmax(h, 4 * floor_of(run)), span);
    return AD_OK;
}
