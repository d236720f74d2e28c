/* How far a simulation is to be believed (simulate_diagnostics.h). */
#include "simulate.h"
#include "apps/interrupt.h"
#include "apps/output/unit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double too_much = 0.1;  /* of the energy */
static const double most_work = 3e7; /* places times dof^3 */
static const double most_places = 1000;

/* A place for one more warning. */
static char *more(struct simulate_outlook *outlook)
{
    return outlook->warning[outlook->n_warnings++];
}

/* Steps of one length against the fastest oscillation at (some of) the samples. A motion whose
   second derivatives are not to be had gets no advice. */
static void judge_steps(const struct simulate_run *run, struct simulate_result *result)
{
    const struct simulate_samples *s = &result->samples;
    struct ad_error none = {0};
    struct phys_step_advice advice, worst = {.verdict = PHYS_STEP_GOOD};
    double dof = (double)s->dof, places = fmin(most_places, most_work / (dof * dof * dof));
    size_t stride = (size_t)ceil((double)s->n / fmax(places, 1));
    double *x = malloc(2 * s->dof * (s->n / stride + 1) * sizeof *x);
    double *t = malloc((s->n / stride + 1) * sizeof *t);
    double dt = result->info.steps > 0 ? result->info.max_step : run->dt;
    size_t n = 0;
    for (size_t i = 0; x && t && i < s->n; i += stride, n++) {
        memcpy(x + 2 * n * s->dof, s->x + 2 * i * s->dof, 2 * s->dof * sizeof *x);
        t[n] = s->t[i];
    }
    if (n > 0 &&
        phys_step_advise(run->integrator, &run->system, n, x, t, dt, &advice, &none) == AD_OK)
        worst = advice;
    if (worst.verdict != PHYS_STEP_GOOD)
        snprintf(more(&result->outlook), sizeof *result->outlook.warning, "%s", worst.text);
    free(x);
    free(t);
}

/* The largest condition number of the mass matrix at (some of) the samples. */
static void judge_mass(const struct simulate_run *run, struct simulate_result *result)
{
    enum { PLACES = 64 };
    const struct simulate_samples *s = &result->samples;
    const double suspicious = 1e8;
    struct ad_error none = {0};
    phys_legendre *legendre;
    size_t dof = s->dof, stride = (s->n + PLACES - 1) / PLACES;
    double at = 0, most = 1;
    if (phys_legendre_new(&run->system, &legendre, &none) != AD_OK)
        return;
    for (size_t i = 0; i < s->n; i += stride) {
        const double *x = s->x + 2 * i * dof;
        double condition = phys_legendre_condition(legendre, x, x + dof, s->t[i]);
        at = condition > most ? s->t[i] : at;
        most = fmax(most, condition);
    }
    phys_legendre_free(legendre);
    result->outlook.mass_condition = most;
    if (most > suspicious)
        snprintf(more(&result->outlook), sizeof *result->outlook.warning,
                 "the mass matrix is nearly singular at t = %.6g: its condition number is %.2g or "
                 "more, so that of 16 digits of the accelerations %.0f are lost",
                 at, most, log10(most));
}

static void judge_energy(const struct simulate_run *run, struct simulate_result *result,
                         bool complete)
{
    double drift = result->info.energy_drift;
    char change[64] = "grows beyond all numbers";
    if (drift <= too_much || result->info.energy_start == 0 || run->system.scene->free_time ||
        (!isfinite(drift) && !complete) || run->ode.friction != 0 || !result->keeps_energy)
        return;
    if (isfinite(drift))
        snprintf(change, sizeof change, "changes by %.3g times its value", drift);
    snprintf(more(&result->outlook), sizeof *result->outlook.warning,
             "the energy %s: this is not the motion of %s; try %s or dop853, and look at the "
             "closest approach",
             change, run->system.scene->name,
             run->integrator->adaptive ? "a smaller --tol" : "shorter steps");
}

/* As many digits of x as a spread leaves: the last is where the spread begins. */
static double known_digits(double x, double spread)
{
    char text[32];
    if (!isfinite(x) || x == 0 || !(spread > 0) || isinf(spread))
        return x;
    int digits = (int)(floor(log10(fabs(x))) - floor(log10(spread)));
    snprintf(text, sizeof text, "%.*e", digits < 0 ? 0 : digits, x);
    return strtod(text, NULL);
}

static bool proceed(void *unused)
{
    (void)unused;
    return !interrupted();
}

static void find_horizon(const struct simulate_run *run, struct simulate_outlook *outlook,
                         struct ad_error *error)
{
    struct phys_ode ode = {0};
    size_t n = 2 * run->system.dof;
    double *y = malloc(n * sizeof *y), *scale = malloc(n * sizeof *scale);
    struct phys_lyapunov_settings settings = {.t1 = run->time,
                                              .scale = scale,
                                              .known = run->options->horizon,
                                              .lost = simulate_lost,
                                              .proceed = proceed};
    if (!y || !scale)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_ode_lagrangian(&run->system, &ode, error) == AD_OK &&
             phys_ode_enter(&ode, 0, run->q, run->v, y, error) == AD_OK &&
             phys_typical_sizes(&ode, 0, y, scale, error) == AD_OK)
        phys_lyapunov(&ode, y, &settings, &outlook->chaos, error);
    outlook->has_horizon = error->status == AD_OK;
    phys_ode_free(&ode);
    free(y);
    free(scale);
}

static double horizon_known(const struct phys_lyapunov *chaos)
{
    return known_digits(chaos->horizon, chaos->latest - chaos->horizon);
}

/* After the horizon there is nothing to compare. */
static void compare_before(struct simulate_result *result)
{
    struct simulate_outlook *outlook = &result->outlook;
    double error_before = 0;
    outlook->error_before = (double)NAN;
    for (size_t i = 0; result->distance && i < result->samples.n; i++)
        if (result->samples.t[i] <= outlook->chaos.horizon)
            outlook->error_before = error_before = fmax(error_before, result->distance[i]);
    const struct phys_lyapunov *c = &outlook->chaos;
    char lyapunov[64] = "";
    if (!isfinite(c->horizon))
        return;
    if (c->chaotic)
        snprintf(lyapunov, sizeof lyapunov, "chaotic, Lyapunov time %.3g to %.3g: ", 1 / c->most,
                 1 / c->least);
    snprintf(more(outlook), sizeof *outlook->warning,
             "%sa difference of the start reaches %g of the motion's size at t = %.6g at the "
             "earliest; later nothing is predicted, and a comparison there says nothing of the "
             "method",
             lyapunov, simulate_lost, horizon_known(c));
}

/* The largest distance that is known; NaN: none. */
static double known_distance(const struct simulate_result *result)
{
    double most = (double)NAN;
    for (size_t i = 0; result->distance && i < result->samples.n; i++)
        most = fmax(most, result->distance[i]);
    return most;
}

/* What the reference does not know, or knows to be wrong. */
static void judge_error(const struct simulate_run *run, struct simulate_result *result)
{
    struct simulate_outlook *outlook = &result->outlook;
    if (isfinite(result->known_until))
        snprintf(more(outlook), sizeof *outlook->warning,
                 "no error from t = %.6g on: two runs at a tolerance of 1e-15 part there; the "
                 "motion is chaotic (--horizon tells), or something acts on it for less than %.2g",
                 result->known_until, result->seen);
    else if (known_distance(result) > too_much * result->size && !run->tables.n && !run->n_trials)
        snprintf(more(outlook), sizeof *outlook->warning,
                 "the error %.3g is as large as the motion: try %s", known_distance(result),
                 run->integrator->adaptive ? "a smaller --tol, or fixed steps" : "shorter steps");
}

enum ad_status simulate_miss(const struct simulate_run *run, const struct simulate_result *result,
                             struct ad_error *error)
{
    double E = run->options->tolerance;
    if (run->n_trials == 0 || isnan(result->known_until) || result->error <= E)
        return AD_OK;
    if (isfinite(result->known_until))
        return ad_fail(error, AD_E_ACCURACY,
                       "--tol %g: not known to be met, the reference is lost at t = %.6g; try a "
                       "shorter --time",
                       E, result->known_until);
    return ad_fail(
        error, AD_E_ACCURACY,
        "--tol %g: missed, got an error of %.3g: rounding, or a force that acts for less "
        "than a step of %.3g; try --integrator gauss4 with --dt",
        E, result->error, result->info.max_step);
}

void simulate_outlook(const struct simulate_run *run, struct simulate_result *result,
                      struct ad_error *error)
{
    struct simulate_outlook *outlook = &result->outlook;
    if (result->samples.n == 0)
        return; /* it did not begin */
    if (!run->integrator->adaptive && simulate_few(run))
        judge_steps(run, result);
    if (simulate_few(run))
        judge_mass(run, result);
    judge_energy(run, result, error->status == AD_OK);
    if (error->status == AD_OK && !isnan(result->known_until))
        judge_error(run, result);
    if (error->status == AD_OK && !isnan(run->options->horizon)) {
        find_horizon(run, outlook, error);
        if (outlook->has_horizon)
            compare_before(result);
    }
    for (size_t k = 0; k < outlook->n_warnings && !run->options->common.quiet; k++)
        fprintf(stderr, "leastaction simulate: warning: %s\n", outlook->warning[k]);
}

void simulate_outlook_report(const struct simulate_run *run, const struct simulate_outlook *outlook,
                             struct report *report)
{
    const struct phys_scene *scene = run->system.scene;
    const struct phys_lyapunov *chaos = &outlook->chaos;
    const char *warnings[SIMULATE_WARNINGS];
    char rate[48];
    snprintf(rate, sizeof rate, "1/%s", unit_shown(scene->time_unit));
    if (outlook->has_horizon) {
        report_number(report, "lyapunov_exponent", "Lyapunov exponent", rate,
                      known_digits(chaos->exponent, chaos->most - chaos->least));
        report_number(report, "lyapunov_least", NULL, rate, chaos->least);
        report_number(report, "lyapunov_most", NULL, rate, chaos->most);
        report_number(report, "lyapunov_time", "Lyapunov time", scene->time_unit,
                      chaos->least > 0
                          ? known_digits(chaos->time, 1 / chaos->least - 1 / chaos->most)
                          : (double)NAN);
        report_number(report, "megno", "MEGNO", NULL, chaos->megno);
        report_flag(report, "chaotic", "chaotic in this time", chaos->chaotic);
        report_number(report, "horizon", "horizon", scene->time_unit, horizon_known(chaos));
        report_number(report, "error_before_horizon", "error before the horizon", scene->unit,
                      outlook->error_before);
    }
    report_number(report, "mass_condition", NULL, NULL,
                  outlook->mass_condition > 0 ? outlook->mass_condition : (double)NAN);
    for (size_t k = 0; k < outlook->n_warnings; k++)
        warnings[k] = outlook->warning[k];
    report_texts(report, "warnings", outlook->n_warnings, warnings);
}
