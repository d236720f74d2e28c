/* Diagnostics of a motion (diagnostics.h). */
#include "internal.h"
#include "autodiff/sized.h"
#include "autodiff/free.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double too_much = 0.1;    /* of the energy */
static const double well_known = 1e-4; /* error of a motion, in units of its size */
static const double most_work = 3e7;   /* places times dof^3 */
static const double most_places = 1000;

/* A place for one more warning. */
static char *more(struct phys_diagnosis *d) { return d->warning[d->n_warnings++]; }

/* Steps of one length against the fastest oscillation at (some of) the samples. A motion whose
   second derivatives are not to be had gets no advice. */
static void judge_steps(const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    struct ad_error none = {0};
    struct phys_step_advice advice, worst = {.verdict = PHYS_STEP_GOOD};
    size_t dof = m->system->dof;
    double places = fmin(most_places, most_work / pow((double)dof, 3));
    size_t stride = (size_t)ceil((double)m->n / fmax(places, 1));
    double *x = malloc(2 * dof * (m->n / stride + 1) * sizeof *x);
    double *t = malloc((m->n / stride + 1) * sizeof *t);
    double dt = m->info.steps > 0 ? m->info.max_step : m->setting;
    size_t n = 0;
    for (size_t i = 0; x && t && i < m->n; i += stride, n++) {
        memcpy(x + 2 * n * dof, m->x + 2 * i * dof, 2 * dof * sizeof *x);
        t[n] = m->t[i];
    }
    if (n > 0 && phys_step_advise(m->integrator, m->system, n, x, t, dt, &advice, &none) == AD_OK)
        worst = advice;
    if (worst.verdict != PHYS_STEP_GOOD)
        snprintf(more(d), sizeof *d->warning, "%s", worst.text);
    AD_FREE(x, t);
}

/* The largest condition number of the mass matrix at (some of) the samples. */
static void judge_mass(const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    enum { PLACES = 64 };
    const double suspicious = 1e8;
    struct ad_error none = {0};
    phys_legendre *legendre;
    size_t dof = m->system->dof, stride = (m->n + PLACES - 1) / PLACES;
    double at = 0, most = 1;
    if (phys_legendre_new(m->system, &legendre, &none) != AD_OK)
        return;
    for (size_t i = 0; i < m->n; i += stride) {
        const double *x = m->x + 2 * i * dof;
        double condition = phys_legendre_condition(legendre, x, x + dof, m->t[i]);
        at = condition > most ? m->t[i] : at;
        most = fmax(most, condition);
    }
    phys_legendre_free(legendre);
    d->mass_condition = most;
    if (most > suspicious)
        snprintf(more(d), sizeof *d->warning,
                 "the mass matrix is nearly singular at t = %.6g: its condition number is %.2g or "
                 "more, so that of 16 digits of the accelerations %.0f are lost",
                 at, most, log10(most));
}

static void judge_energy(const struct phys_motion_solution *m, struct phys_diagnosis *d,
                         bool complete)
{
    double drift = m->info.energy_drift;
    char change[64] = "grows beyond all numbers";
    if (drift <= too_much || m->info.energy_start == 0 || m->system->scene->free_time ||
        (!isfinite(drift) && !complete) || m->ode.friction != 0 || !m->keeps_energy ||
        m->error <= well_known * m->size) /* the start's energy is small beside its parts */
        return;
    if (isfinite(drift))
        snprintf(change, sizeof change, "changes by %.3g times its value", drift);
    snprintf(more(d), sizeof *d->warning,
             "the energy %s: this is not the motion of %s; try %s or dop853, and look at the "
             "closest approach",
             change, m->system->scene->name,
             m->integrator->adaptive ? "a smaller tolerance" : "shorter steps");
}

/* As many digits of x as a spread leaves: the last is where the spread begins. */
double phys_known_digits(double x, double spread)
{
    char text[32];
    if (!isfinite(x) || x == 0 || !(spread > 0) || isinf(spread))
        return x;
    int digits = (int)(floor(log10(fabs(x))) - floor(log10(spread)));
    snprintf(text, sizeof text, "%.*e", digits < 0 ? 0 : digits, x);
    return strtod(text, NULL);
}

static double horizon_known(const struct phys_lyapunov *chaos)
{
    return phys_known_digits(chaos->horizon, chaos->latest - chaos->horizon);
}

/* After the horizon there is nothing to compare. */
static void compare_before(const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    const struct phys_lyapunov *c = &d->chaos;
    for (size_t i = 0; m->distance && i < m->n; i++)
        if (m->t[i] <= c->horizon)
            d->error_before = fmax(d->error_before, fmax(m->distance[i], 0));
    char lyapunov[64] = "";
    if (!isfinite(c->horizon))
        return;
    if (c->chaotic)
        snprintf(lyapunov, sizeof lyapunov, "chaotic, Lyapunov time %.3g to %.3g: ", 1 / c->most,
                 1 / c->least);
    snprintf(more(d), sizeof *d->warning,
             "%sa difference of the start reaches %g of the motion's size at t = %.6g at the "
             "earliest; later the motion is unpredictable, and a comparison there says nothing "
             "about the method",
             lyapunov, PHYS_MOTION_LOST, horizon_known(c));
}

/* The largest distance that is known; NaN: none. */
static double known_distance(const struct phys_motion_solution *m)
{
    double most = (double)NAN;
    for (size_t i = 0; m->distance && i < m->n; i++)
        most = fmax(most, m->distance[i]);
    return most;
}

static void judge_crossings(const struct phys_motion_settings *settings,
                            const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    size_t n = m->crossed.undecided;
    if (n > 0)
        snprintf(more(d), sizeof *d->warning,
                 "event %s: %zu time%s the motion comes nearer to that than its error and turns: "
                 "it may cross there; try %s",
                 settings->crossings[m->crossed.which_undecided].text, n, n == 1 ? "" : "s",
                 m->integrator->adaptive ? "a smaller tolerance" : "shorter steps");
}

/* Where the reference is unknown or known to be wrong. */
static void judge_error(const struct phys_motion_solution *m, struct phys_diagnosis *d)
{
    const double tightest = 1e-15;
    if (m->reference_tolerance > tightest)
        snprintf(more(d), sizeof *d->warning,
                 "terms of the forces cancel: their rounding leaves the reference a tolerance of "
                 "%.0e where it is otherwise %.0e, and known to %.2g; write L without large terms "
                 "that cancel",
                 m->reference_tolerance, tightest, m->reference_uncertainty);
    if (isfinite(m->time_unresolved))
        snprintf(more(d), sizeof *d->warning,
                 "from t = %.6g on the forces change with time too often to be followed: the error "
                 "is not verified; try a shorter time",
                 m->time_unresolved);
    if (isfinite(m->known_until))
        snprintf(more(d), sizeof *d->warning,
                 "no error from t = %.6g on: two runs at a tolerance of %.0e diverge there; the "
                 "motion is chaotic (see its horizon), or a force acts on it for less than %.2g",
                 m->known_until, m->reference_tolerance, m->seen);
    else if (known_distance(m) > too_much * m->size && !m->n_trials)
        snprintf(more(d), sizeof *d->warning, "the error %.3g is as large as the motion: try %s",
                 known_distance(m),
                 m->integrator->adaptive ? "a smaller tolerance, or fixed steps" : "shorter steps");
    else if (m->worst_error > too_much) {
        char name[64];
        phys_coordinate_name(m->system, m->worst, name, sizeof name);
        snprintf(more(d), sizeof *d->warning,
                 "%s errs by %.2g of its largest value, the others by less: try %s", name,
                 m->worst_error, m->integrator->adaptive ? "a smaller tolerance" : "shorter steps");
    }
}

static enum ad_status find_horizon(const struct phys_motion_settings *settings,
                                   const struct phys_motion_solution *m, double known,
                                   struct phys_diagnosis *d, struct ad_error *error)
{
    struct phys_ode ode = {0};
    size_t dof = m->system->dof, n = 2 * dof;
    double *y = malloc(2 * n * sizeof *y), *scale = y ? y + n : NULL;
    const struct phys_lyapunov_settings how = {.size = sizeof how,
                                               .t1 = settings->time,
                                               .scale = scale,
                                               .known = known,
                                               .lost = PHYS_MOTION_LOST,
                                               .proceed = settings->proceed,
                                               .context = settings->context};
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (phys_ode_lagrangian(m->system, &ode, error) == AD_OK &&
        phys_ode_enter(&ode, 0, m->start, m->start + dof, y, error) == AD_OK &&
        phys_typical_sizes(&ode, 0, y, scale, error) == AD_OK)
        phys_lyapunov(&ode, y, &how, &d->chaos, error);
    d->has_horizon = error->status == AD_OK;
    phys_ode_free(&ode);
    free(y);
    return error->status;
}

enum ad_status phys_motion_diagnose(const struct phys_motion_settings *settings,
                                    const struct phys_motion_solution *solution, double known,
                                    struct phys_diagnosis *diagnosis, struct ad_error *error)
{
    const struct phys_motion_solution *m = solution;
    struct phys_diagnosis *d = diagnosis;
    struct phys_motion_settings own;
    struct ad_error wrong = {0}; /* that of the motion does not matter here */
    bool complete = error->status == AD_OK;
    if (AD_LACKS(&wrong, diagnosis))
        return ad_fail(error, wrong.status, "%s", wrong.message);
    *d = (struct phys_diagnosis){.error_before = NAN};
    if (AD_LACKS(&wrong, settings, solution) || !AD_TAKE(&own, settings, context, &wrong))
        return ad_fail(error, wrong.status, "%s", wrong.message);
    settings = &own;
    if (m->n == 0)
        return error->status; /* it did not begin */
    if (m->system->bodies <= PHYS_MOTION_FEW) {
        if (!m->integrator->adaptive)
            judge_steps(m, d);
        else if (complete && !(m->worst_error > too_much))
            phys_judge_stiffness(settings, m, d);
        judge_mass(m, d);
    }
    judge_energy(m, d, complete);
    if (complete && !isnan(m->known_until)) {
        judge_error(m, d);
        judge_crossings(settings, m, d);
    }
    if (complete && known > 0 && find_horizon(settings, m, known, d, error) == AD_OK)
        compare_before(m, d);
    return error->status;
}
