/* Chooses a method and a step that meet an error (solving.h). The error of a run is its distance
   from a finer one; from two such errors the setting is predicted, so that the search costs about
   three times the final run (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I,
   section II.4). The search continues as long as finer runs reduce the error. */
#include "solving.h"
#include "physics/integrators/stepper.h"
#include "physics/system/internal.h"

#include <math.h>

enum {
    POINTS = 512,   /* times at which runs of fixed steps are compared: whole steps */
    SAMPLES = 2000, /* adaptive runs are interpolated */
    ROUNDS = 12,
    MOST_STEPS = 1000000,
    BUDGET = 20000, /* steps, rejected ones too, after which forces may be rounding */
    MOST_IDLE = 2,  /* rounds in a row that come no nearer */
    MOST_LOST = 4   /* that do not get through */
};

static const double caution = 2;        /* the finer run errs too, if less */
static const double aim = 0.3;          /* of the error: predictions are not exact */
static const double least_gain = 0.7;   /* of the estimate before, or rounding has taken over */
static const double least_tol = 1e-16;  /* of a step */
static const double finer_tol = 0.3162; /* of a run, for the one it is judged by */
static const double near = 1e-3;        /* sizes of the motion: a longer run is worth it */
/* Of the tolerance, to which steps of order 2 are in proportion: those of the methods are of high
   order, but where forces are rounding in proportion to the tolerance itself. */
static const double growth = 0.5;
static const double faster = 100; /* the steps beyond the budget than those within, at most */

/* First the series, of what has one and is small; then the method for high accuracy; where its
   rounding stops it, one whose steps are few. */
static const char *const candidates[PHYS_MOTION_TRIALS] = {"taylor", "dop853", "gauss5"};
enum { SERIES_DOF = 32 }; /* beyond, dop853 costs less: the series of every pair of bodies */

/* A method being refined. */
struct candidate {
    struct solving *solving;
    struct phys_motion_trial *trial;
    struct phys_ode ode;
    double size;    /* of the coordinates */
    double setting; /* of the finest run that got through, */
    size_t steps;   /* and its steps, rejected ones too */
    bool rounding;  /* the forces are, at a finer one */
    double reached; /* by the run that came furthest and was lost, ... */
    struct ad_error why;
};

/* One run of it. */
struct run {
    double *path; /* [dof x points + 1]; NULL: not run */
    size_t evaluations;
    bool complete;
};

static size_t points_of(const struct phys_integrator *integrator)
{
    return integrator->adaptive ? SAMPLES : POINTS;
}

/* A run judged by another: by a tenth of its tolerance, or by twice its steps. */
static double finer(const struct phys_integrator *integrator, double setting)
{
    return setting * (integrator->adaptive ? finer_tol : 0.5);
}

static bool possible(const struct solving *s, const struct phys_integrator *integrator,
                     double setting)
{
    return integrator->adaptive ? setting >= least_tol : s->settings->time / setting <= MOST_STEPS;
}

/* The setting to try after one that errs by `estimate`. Steps fill the time between two points. */
static double predict(const struct solving *s, const struct phys_integrator *integrator,
                      double setting, double estimate)
{
    double ratio = isnan(estimate) ? 1e-3 : aim * s->settings->error / estimate;
    if (integrator->adaptive)
        return fmax(setting * fmax(ratio, 1e-6), fmin(setting * finer_tol, 10 * least_tol));
    double stretch = s->settings->time / POINTS, steps = stretch / setting;
    double times = pow(ratio, -1 / (double)integrator->order);
    return stretch / ceil(steps * fmin(fmax(times, 1.1), 64));
}

/* One run of at most `most` steps, incomplete if the motion was lost. Other failures are errors. */
static enum ad_status attempt_within(struct candidate *c, double setting, size_t most,
                                     struct run *run, struct phys_simulation_info *info,
                                     struct ad_error *error)
{
    struct solving *s = c->solving;
    const struct phys_integrator *integrator = c->trial->integrator;
    size_t dof = s->solution->system->dof, points = points_of(integrator);
    const double *start = s->solution->start;
    struct phys_simulation how = phys_simulation_of(integrator, setting, s->settings->time);
    struct ad_error lost = {0};
    double *y = malloc(2 * dof * sizeof *y);
    *info = (struct phys_simulation_info){0};
    free(run->path);
    run->path = malloc(dof * (points + 1) * sizeof *run->path);
    how.n_samples = points;
    how.max_steps = most;
    how.proceed = solving_proceed;
    how.context = s;
    if (!y || !run->path)
        ad_fail(error, AD_E_MEMORY, "out of memory");
    else if (phys_ode_enter(&c->ode, 0, start, start + dof, y, error) == AD_OK)
        phys_trajectory(&how, &c->ode, y, dof, points + 1, run->path, info, &lost);
    free(y);
    run->evaluations = info->evaluations;
    c->trial->searched += info->evaluations;
    run->complete = lost.status == AD_OK && info->samples == points + 1;
    if (lost.status != AD_OK && info->steps < most && info->t >= c->reached) {
        c->reached = info->t;
        c->why = lost;
    }
    if (s->interrupted)
        ad_fail(error, AD_E_ACCURACY, "interrupted while a method was looked for");
    else if (lost.status != AD_OK && lost.status != AD_E_NONFINITE && lost.status != AD_E_ACCURACY)
        ad_fail(error, lost.status, "%s", lost.message);
    return error->status;
}

/* Steps of a run, rejected ones too. */
static size_t tried(const struct phys_simulation_info *info)
{
    return info->steps + info->rejected;
}

/* Whether steps grow with the tolerance as rounding of the forces makes them, over two decades: a
   force that only the finer tolerance sees shortens them once. */
static bool is_rounding(struct candidate *c, double setting,
                        const struct phys_simulation_info *info, struct ad_error *error)
{
    double step = info->t / (double)tried(info);
    bool grows = true;
    for (int k = 0; grows && k < 2; k++) {
        struct phys_simulation_info looser;
        struct run run = {0};
        setting *= 10;
        attempt_within(c, setting, BUDGET, &run, &looser, error);
        free(run.path);
        grows = looser.t > pow(10, growth) * step * (double)tried(&looser);
        step = looser.t / (double)tried(&looser);
    }
    return grows;
}

/* One run, which ends early where the forces are rounding. */
static enum ad_status attempt(struct candidate *c, double setting, struct run *run,
                              struct ad_error *error)
{
    const bool adaptive = c->trial->integrator->adaptive;
    const double grown = c->steps ? (double)c->steps * pow(c->setting / setting, growth) : 0;
    const size_t most = adaptive ? (size_t)fmin(BUDGET + grown, MOST_STEPS) : MOST_STEPS;
    struct phys_simulation_info info;
    if (attempt_within(c, setting, most, run, &info, error) != AD_OK)
        return error->status;
    c->rounding = adaptive && tried(&info) >= most && is_rounding(c, setting, &info, error);
    const bool hopeful = faster * info.t * MOST_STEPS > c->solving->settings->time * (double)most;
    if (error->status == AD_OK && !c->rounding && info.steps == most && most < MOST_STEPS &&
        hopeful)
        attempt_within(c, setting, MOST_STEPS, run, &info, error);
    if (run->complete) {
        c->steps = tried(&info);
        c->setting = setting;
    }
    return error->status;
}

static double distance(size_t dof, size_t n, const double *a, const double *b)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t k = 0; k < dof; k++)
            sum = hypot(sum, a[k * n + i] - b[k * n + i]);
        most = fmax(most, sum);
    }
    return most;
}

/* Whether a round brought the trial further; it keeps the best setting. */
static bool judge(struct phys_motion_trial *trial, double setting, const struct run *coarse,
                  double estimate)
{
    bool gain = !(estimate > least_gain * trial->estimate);
    if (isnan(estimate) || estimate >= trial->estimate)
        return gain;
    trial->estimate = estimate;
    trial->setting = setting;
    trial->evaluations = coarse->evaluations;
    return gain;
}

static void forget(struct run *run)
{
    free(run->path);
    *run = (struct run){0};
}

/* Refines one candidate from `setting` on. */
static enum ad_status refine(struct candidate *c, double setting, struct ad_error *error)
{
    const struct solving *s = c->solving;
    const struct phys_integrator *method = c->trial->integrator;
    size_t dof = s->solution->system->dof, points = points_of(method) + 1, lost = 0, idle = 0;
    struct run coarse = {0}, fine = {0};
    bool again = true;
    c->trial->estimate = (double)NAN;
    for (size_t round = 0; again && round < ROUNDS && possible(s, method, setting); round++) {
        double estimate = (double)NAN;
        if ((!coarse.path && (attempt(c, setting, &coarse, error) != AD_OK || c->rounding)) ||
            attempt(c, finer(method, setting), &fine, error) != AD_OK)
            break;
        if (coarse.complete && fine.complete)
            estimate = caution * distance(dof, points, coarse.path, fine.path);
        lost = fine.complete ? 0 : lost + 1;
        idle = judge(c->trial, setting, &coarse, estimate) ? 0 : idle + 1;
        again = idle < MOST_IDLE && lost < MOST_LOST && !c->rounding &&
                !(estimate <= s->settings->error);
        double next = predict(s, method, setting, estimate);
        forget(&coarse);
        if (next >= finer(method, setting)) { /* it has been run */
            next = finer(method, setting);
            coarse = fine;
            fine = (struct run){0};
        }
        forget(&fine);
        setting = next;
    }
    forget(&coarse);
    forget(&fine);
    return error->status;
}

/* From a share of the error in units of the motion on, or from the coarsest steps. */
static enum ad_status try_candidate(struct candidate *c, struct ad_error *error)
{
    const struct phys_motion_solution *m = c->solving->solution;
    const struct phys_motion_settings *settings = c->solving->settings;
    const struct phys_integrator *method = c->trial->integrator;
    /* more digits of a series cost little, another round of the search as much as an answer */
    const double share = method->scheme == &phys_power_series ? 1e-3 : 0.1;
    size_t n = 2 * m->system->dof;
    double *y = malloc(2 * n * sizeof *y);
    if (!y)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    c->steps = 0;
    c->rounding = false;
    if (phys_ode_for(m->system, method, &c->ode, error) == AD_OK &&
        phys_ode_enter(&c->ode, 0, m->start, m->start + n / 2, y, error) == AD_OK &&
        phys_typical_sizes(&c->ode, 0, y, y + n, error) == AD_OK) {
        c->size = y[n];
        refine(c,
               method->adaptive
                   ? fmin(fmax(share * settings->error / c->size, 100 * least_tol), 1e-2)
                   : settings->time / POINTS,
               error);
    }
    phys_ode_free(&c->ode);
    free(y);
    return error->status;
}

/* Whether the motion has a Taylor series, and a small one; L may have kinks. */
static bool has_series(const struct solving *s, struct ad_error *error)
{
    const struct phys_motion_solution *m = s->solution;
    const size_t dof = m->system->dof;
    struct phys_ode ode;
    struct ad_error none = {0};
    double c[PHYS_SERIES_MOST + 1][2 * SERIES_DOF];
    if (dof > SERIES_DOF || m->system->scene->hamiltonian) /* in (q, p) there are cheaper steps */
        return false;
    bool has = phys_ode_lagrangian(m->system, &ode, &none) == AD_OK && ode.series &&
               phys_ode_enter(&ode, 0, m->start, m->start + dof, c[0], &none) == AD_OK &&
               ode.series(ode.context, PHYS_SERIES_MOST, 0, c[0], NULL, &none) == AD_OK;
    phys_ode_free(&ode);
    phys_keep_memory(&none, error);
    return has;
}

/* No explicit method gets through: names an implicit one, if two of its runs agree. */
static enum ad_status not_reached(struct solving *s, struct ad_error *error)
{
    struct phys_motion_trial trial = {.integrator = phys_integrator_find("gauss3", error)};
    struct candidate implicit = {.solving = s, .trial = &trial};
    if (try_candidate(&implicit, error) != AD_OK)
        return error->status;
    if (trial.estimate <= s->settings->error)
        return ad_fail(error, AD_E_ACCURACY,
                       "an error of %g: stiff, explicit methods need more than %d steps to t = %g; "
                       "--integrator %s --dt %.6g (implicit) gets there, and half its steps change "
                       "the motion by %.1e",
                       s->settings->error, MOST_STEPS, s->settings->time, trial.integrator->name,
                       trial.setting, trial.estimate / caution);
    return ad_fail(error, AD_E_ACCURACY,
                   "an error of %g: no method reaches t = %g in %d steps: a collision, a "
                   "motion that ends before, or too long a time; try a shorter one",
                   s->settings->error, s->settings->time, MOST_STEPS);
}

static enum ad_status out_of_reach(const struct candidate *c, bool rounding, struct ad_error *error)
{
    struct solving *s = c->solving;
    const char *const cause = rounding ? "by rounding of forces whose terms cancel: write L without"
                                         " large terms that cancel, or allow a larger one"
                                       : "by rounding, chaos or work; allow a larger one or take"
                                         " a shorter time";
    const struct phys_motion_trial *nearest = NULL;
    for (size_t k = 0; k < s->solution->n_trials; k++) {
        const struct phys_motion_trial *trial = &s->solution->trial[k];
        if (!isnan(trial->estimate) && (!nearest || trial->estimate < nearest->estimate))
            nearest = trial;
    }
    if (!nearest && !rounding && c->why.status == AD_OK)
        return not_reached(s, error);
    if (!nearest)
        return ad_fail(error, AD_E_ACCURACY, "an error of %g is out of reach%s%s",
                       s->settings->error, rounding ? ", limited " : ": ",
                       rounding ? cause : c->why.message);
    return ad_fail(error, AD_E_ACCURACY,
                   "an error of %g is out of reach: %s reaches %.2g, limited %s",
                   s->settings->error, nearest->integrator->name, nearest->estimate, cause);
}

enum ad_status phys_motion_choose(struct solving *s, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    struct candidate c = {.solving = s};
    const struct phys_integrator *given = m->integrator;
    struct phys_motion_trial *chosen = NULL;
    bool rounding = false;
    const size_t first = given || (!s->blind && has_series(s, error)) ? 0 : 1;
    if (error->status != AD_OK)
        return error->status;
    for (size_t k = first; k < PHYS_MOTION_TRIALS && !chosen; k++) {
        const struct phys_motion_trial *last = k == first ? NULL : &m->trial[m->n_trials - 1];
        /* rounding, or a series that did not get through where another method may */
        bool another = !last || m->trial[0].estimate <= near * c.size ||
                       (isnan(last->estimate) && last->integrator->scheme == &phys_power_series);
        if (!another || (given && k > 0))
            break;
        c.trial = &m->trial[m->n_trials++];
        c.trial->integrator = given ? given : phys_integrator_find(candidates[k], error);
        if (try_candidate(&c, error) != AD_OK)
            return error->status;
        rounding |= c.rounding;
        if (c.trial->estimate <= s->settings->error)
            chosen = c.trial;
    }
    if (!chosen)
        return out_of_reach(&c, rounding, error);
    chosen->chosen = true;
    chosen->searched -= chosen->evaluations; /* the answer itself */
    m->integrator = chosen->integrator;
    m->setting = chosen->setting;
    return AD_OK;
}

/* A series knows the motion from one point: it may step over a barrier, at every tolerance. */
static bool is_blind(const struct phys_motion_trial *trial, double missed)
{
    const double grossly = 100;
    return trial->chosen && trial->integrator->scheme == &phys_power_series &&
           missed > grossly * trial->estimate;
}

static bool choose_another(struct solving *s, struct phys_motion_trial *trial,
                           struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    trial->chosen = false;
    trial->searched += trial->evaluations;
    s->blind = true;
    m->integrator = NULL;
    phys_ode_free(&m->ode);
    return phys_motion_choose(s, error) == AD_OK &&
           phys_ode_for(m->system, m->integrator, &m->ode, error) == AD_OK;
}

bool phys_motion_tighten(struct solving *s, double missed, struct ad_error *error)
{
    struct phys_motion_solution *m = s->solution;
    const bool given = s->settings->integrator != NULL;
    if (!given && m->n_trials > 0 && is_blind(&m->trial[0], missed))
        return choose_another(s, &m->trial[0], error);
    for (size_t k = 0; k < m->n_trials; k++) {
        struct phys_motion_trial *trial = &m->trial[k];
        double next = predict(s, trial->integrator, trial->setting, missed);
        if (!trial->chosen || !possible(s, trial->integrator, next))
            continue;
        trial->searched += trial->evaluations;
        trial->estimate = (double)NAN; /* of another run */
        m->setting = trial->setting = next;
        return true;
    }
    return false;
}
