/* Solvers over ranks (path_ranks.h): Newton's method; limited-memory BFGS; and descents, whose
   steps are those of each number alone. A step of Newton's is halved until the gradient becomes
   smaller: along it |g|^2 falls at first, whatever the signs of H, as its derivative is -2 |g|^2.
 */
#include "autodiff/clock.h"
#include "autodiff/free.h"
#include "autodiff/lbfgs.h"
#include "autodiff/optim.h"
#include "elimination.h"
#include "kinetic.h"
#include "physics/path/path_program.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    HALVINGS = 30,
    ROUNDING = 8, /* the gradient is zero below this multiple of its rounding */
    PATIENCE = 10 /* slow steps in a row: |g| has a minimum here that is not zero */
};
static const double SLOW = 0.999;  /* a step that leaves so much of the gradient */
static const double SHORTER = 0.1; /* a step after the last one */
static const double FALLING = 0.5; /* |g| of lbfgs after a step, while it still falls */

struct solve {
    struct phys_ranked_path path;
    struct phys_ranked_sums sums; /* of the path evaluated last */
    struct phys_path_figures at;
    double *x, *before, *step;
    double start_norm, last; /* last: length of the last step of newton */
    struct phys_elimination system;
    struct phys_kinetic kinetic; /* of lbfgs */
    struct ad_error *error;      /* of its evaluations */
};

static double share_of(const struct phys_ranked_path *p)
{
    const struct phys_scene *scene = p->system->scene;
    double bodies = scene->per_body ? (double)p->system->bodies : 1;
    return 1 / (p->settings->dt * (double)p->settings->slices * bodies);
}

static struct phys_path_figures figures_of(const struct phys_ranked_path *p,
                                           const struct phys_ranked_sums *sums)
{
    double share = share_of(p);
    return (struct phys_path_figures){.action = sums->action,
                                      .action_mean = share * sums->action,
                                      .kinetic_mean = share * sums->kinetic,
                                      .potential_mean = share * (sums->kinetic - sums->action),
                                      .objective = share * sums->action,
                                      .grad_norm = share * sqrt(sums->plain)};
}

/* ---- evaluation ---- */

static enum ad_status evaluate(struct solve *s, struct ad_error *error)
{
    s->path.path = s->x;
    if (phys_ranked_gradient(&s->path, &s->sums, error) == AD_OK)
        s->at = figures_of(&s->path, &s->sums);
    return error->status;
}

static enum ad_status finite(const struct solve *s, size_t step, struct ad_error *error)
{
    if (isfinite(s->at.action) && isfinite(s->at.grad_norm))
        return phys_path_stays(step, s->at.grad_norm, s->start_norm, error);
    return ad_fail(error, AD_E_NONFINITE,
                   "step %zu: action %g, |gradient| %g: expected finite numbers", step,
                   s->at.action, s->at.grad_norm);
}

/* Why to stop. An error is found at the next evaluation. */
static enum phys_stop report(const struct solve *s, size_t step)
{
    const struct phys_path_settings *settings = s->path.settings;
    const struct phys_path_step at = {.step = step,
                                      .action = s->at.action,
                                      .action_mean = s->at.action_mean,
                                      .kinetic_mean = s->at.kinetic_mean,
                                      .potential_mean = s->at.potential_mean,
                                      .objective = s->at.objective,
                                      .grad_norm = s->at.grad_norm};
    struct ad_error lost = {0};
    bool on = !settings->progress || settings->progress(settings->context, &at);
    if (settings->progress)
        ad_ranks_broadcast(s->path.ranks, 0, &on, sizeof on, &lost);
    if (!on)
        return PHYS_STOP_INTERRUPTED;
    if (settings->tolerance > 0 && s->at.grad_norm <= settings->tolerance * s->start_norm)
        return PHYS_STOP_TOLERANCE;
    return step == settings->steps ? PHYS_STOP_STEPS : 0;
}

/* That of action_mean, of the path evaluated last. */
static void take_gradient(const struct solve *s, double *g)
{
    const double share = share_of(&s->path);
    for (size_t k = 0; k < s->path.rows * s->path.columns; k++)
        g[k] = share * s->path.g[k];
}

/* ---- descents ---- */

/* Steps up to `steps`; with a report where they are the solver's own. */
static enum ad_status descend(struct solve *s, enum ad_optimiser_method method, size_t steps,
                              bool reported, size_t *taken, enum phys_stop *stop,
                              struct ad_error *error)
{
    const struct phys_path_settings *settings = s->path.settings;
    const size_t n = s->path.rows * s->path.columns;
    struct ad_optimiser_settings how = ad_optimiser_defaults(method);
    how.learning_rate = settings->learning_rate;
    if (method == AD_SGD)
        how.momentum = settings->momentum;
    ad_optimiser *o = ad_optimiser_new(&how, AD_F64, n, error);
    ad_ranks_agree(s->path.ranks, error);
    for (*taken = 0; error->status == AD_OK; ++*taken) {
        if (finite(s, *taken, error) != AD_OK)
            break;
        *stop = reported ? report(s, *taken) : *taken == steps ? PHYS_STOP_STEPS : 0;
        if (*stop)
            break;
        take_gradient(s, s->path.g);
        ad_optimiser_step(o, s->x, s->path.g);
        evaluate(s, error);
    }
    ad_optimiser_free(o);
    return error->status;
}

/* Before newton and lbfgs. */
static enum ad_status approach(struct solve *s, enum phys_stop *stop, struct ad_error *error)
{
    size_t taken, steps = s->path.settings->adam_steps;
    return steps ? descend(s, AD_ADAM, steps, false, &taken, stop, error) : AD_OK;
}

/* ---- limited-memory BFGS ---- */

static double product(void *context, const double *a, const double *b)
{
    struct solve *s = context;
    double sums[2];
    phys_ranked_products(&s->path, a, b, sums, s->error);
    return s->error->status == AD_OK ? sums[0] : (double)NAN;
}

static double objective(void *context, double *x, double *g)
{
    struct solve *s = context;
    (void)x; /* s->x */
    evaluate(s, s->error);
    take_gradient(s, g);
    return s->at.objective;
}

static void precondition(void *context, double *d)
{
    struct solve *s = context;
    phys_kinetic_solve(&s->kinetic, d, s->error);
}

/* Whether the gradient is zero within its rounding, as much as velocities bring, and falls no more.
 */
static bool at_kinetic_rounding(struct solve *s, double before, struct ad_error *error)
{
    double squares[2] = {0};
    phys_ranked_products(&s->path, s->x, s->x, squares, error);
    return s->at.grad_norm >= FALLING * before &&
           s->at.grad_norm <= ROUNDING * 4 * DBL_EPSILON * sqrt(squares[1]);
}

static void prepare_lbfgs(struct solve *s, ad_lbfgs *method, struct ad_error *error)
{
    double *g = s->step;
    take_gradient(s, g);
    s->error = error;
    ad_lbfgs_share(method, product, s);
    ad_lbfgs_precondition(method, precondition, s);
    if (phys_kinetic_new(&s->kinetic, &s->path, share_of(&s->path), s->x, g, s->before, error) ==
        AD_OK)
        evaluate(s, error); /* again: the other path was the last one */
}

static enum ad_status lbfgs(struct solve *s, size_t *taken, enum phys_stop *stop,
                            struct ad_error *error)
{
    ad_lbfgs *method = ad_lbfgs_new(s->path.rows * s->path.columns);
    double before = (double)INFINITY;
    if (!method)
        ad_fail(error, AD_E_MEMORY, "out of memory for a share of %zu slices", s->path.columns);
    if (ad_ranks_agree(s->path.ranks, error) == AD_OK && approach(s, stop, error) == AD_OK)
        prepare_lbfgs(s, method, error);
    for (; error->status == AD_OK && finite(s, *taken, error) == AD_OK; ++*taken) {
        double value = s->at.objective;
        *stop = report(s, *taken);
        if (!*stop && at_kinetic_rounding(s, before, error))
            *stop = PHYS_STOP_ROUNDING;
        if (*stop)
            break;
        before = s->at.grad_norm;
        if (!ad_lbfgs_step(method, objective, s, 0, s->x, s->step, &value)) {
            *stop = PHYS_STOP_STALLED;
            evaluate(s, error);
            break;
        }
    }
    ad_lbfgs_free(method);
    phys_kinetic_free(&s->kinetic);
    return error->status;
}

/* ---- Newton's method ---- */

/* A pivot that is zero to the last bit is passed by a shift below rounding. */
static enum ad_status find_step(struct solve *s, struct ad_error *error)
{
    for (double shift = 0;; shift -= DBL_EPSILON) {
        s->path.path = s->x;
        if (phys_eliminate(&s->system, shift, error) != AD_OK || !s->system.singular ||
            shift < -4 * DBL_EPSILON)
            return error->status == AD_OK && !s->system.singular
                       ? phys_elimination_step(&s->system, s->step, error)
                       : error->status;
    }
}

/* Moves by `length` steps. Whether the path may stay there. */
static bool try_step(struct solve *s, double length, double most, struct ad_error *error)
{
    for (size_t k = 0; k < s->path.rows * s->path.columns; k++)
        s->x[k] = s->before[k] + length * s->step[k];
    return evaluate(s, error) == AD_OK && sqrt(s->sums.scaled) <= most;
}

/* One step, halved as often as the gradient needs to become smaller. Where it is zero to rounding,
   it does not show how much better a path is: a step is taken as long as they become shorter by
   much. False, and the path where it was, if there is no such step. */
static bool improve(struct solve *s, struct ad_error *error)
{
    const double from = sqrt(s->sums.scaled);
    double squares[2], length = 1;
    if (find_step(s, error) != AD_OK || s->system.singular ||
        phys_ranked_products(&s->path, s->step, s->step, squares, error) != AD_OK)
        return false;
    const double zero = ROUNDING * s->system.rounding, last = s->last;
    s->last = sqrt(squares[0]);
    if (from <= zero && !(s->last <= SHORTER * last))
        return false;
    memcpy(s->before, s->x, s->path.rows * s->path.columns * sizeof *s->x);
    for (size_t trial = 0; trial < (from <= zero ? 1 : HALVINGS); trial++, length /= 2)
        if (try_step(s, length, from <= zero ? zero : from * (1 - DBL_EPSILON), error))
            return true;
    if (error->status == AD_OK)
        try_step(s, 0, 0, error);
    return false;
}

static enum ad_status follow(struct solve *s, size_t *step, enum phys_stop *stop,
                             struct ad_error *error)
{
    size_t slow = 0;
    s->last = (double)INFINITY;
    *stop = report(s, *step);
    while (!*stop && error->status == AD_OK) {
        double from = sqrt(s->sums.scaled);
        bool moved = improve(s, error);
        *step += moved;
        double left = sqrt(s->sums.scaled) / from;
        slow = left > SLOW ? slow + 1 : 0;
        if (moved)
            *stop = report(s, *step);
        if (*stop == PHYS_STOP_INTERRUPTED || *stop == PHYS_STOP_TOLERANCE)
            break;
        if (sqrt(s->sums.scaled) <= ROUNDING * s->system.rounding && (!moved || *stop))
            *stop = PHYS_STOP_ROUNDING;
        else if (!*stop && (!moved || slow >= PATIENCE))
            *stop = PHYS_STOP_STALLED;
    }
    return error->status;
}

static enum ad_status newton(struct solve *s, size_t *steps, enum phys_stop *stop,
                             struct ad_error *error)
{
    if (phys_elimination_new(&s->system, &s->path, error) == AD_OK &&
        approach(s, stop, error) == AD_OK)
        follow(s, steps, stop, error);
    phys_elimination_free(&s->system);
    return error->status;
}

/* ---- public functions ---- */

static enum ad_status measure(struct solve *s, struct phys_path_info *info, struct ad_error *error)
{
    struct phys_ranked_path *p = &s->path;
    double weights = (double)(p->settings->slices - 1) * p->settings->dt, energy = p->energy;
    double range[2] = {p->range[0], p->range[1]};
    ad_ranks_broadcast(p->ranks, 0, &energy, sizeof energy, error);
    if (phys_ranked_range(p, range, error) != AD_OK)
        return error->status;
    double drift = fmax(range[1] - energy, energy - range[0]);
    info->energy_mean = (2 * s->sums.kinetic - s->sums.action) / weights;
    info->energy_drift = energy != 0 ? drift / fabs(energy) : drift;
    return AD_OK;
}

static enum ad_status run(struct solve *s, const struct phys_solver *solver, double *path,
                          struct phys_path_info *info, struct ad_error *error)
{
    const size_t n = s->path.rows * s->path.columns;
    const double started = ad_now();
    size_t steps = 0;
    enum phys_stop stop = 0;
    bool is_newton = strcmp(solver->name, "newton") == 0;
    s->x = n <= SIZE_MAX / 3 / sizeof *s->x ? malloc(3 * n * sizeof *s->x) : NULL;
    if (!s->x)
        ad_fail(error, AD_E_MEMORY, "out of memory for a share of %zu slices", s->path.columns);
    if (ad_ranks_agree(s->path.ranks, error) != AD_OK)
        return error->status;
    s->before = s->x + n;
    s->step = s->before + n;
    memcpy(s->x, path, n * sizeof *path);
    s->path.path = s->x;
    if ((is_newton && phys_ranked_scale(&s->path, error) != AD_OK) || evaluate(s, error) != AD_OK ||
        finite(s, 0, error) != AD_OK)
        return error->status;
    const struct phys_path_figures start = s->at;
    s->start_norm = start.grad_norm;
    if ((is_newton ? newton(s, &steps, &stop, error)
         : strcmp(solver->name, "lbfgs") == 0
             ? lbfgs(s, &steps, &stop, error)
             : descend(s, strcmp(solver->name, "sgd") == 0 ? AD_SGD : AD_ADAM, 0, true, &steps,
                       &stop, error)) != AD_OK ||
        measure(s, info, error) != AD_OK)
        return error->status;
    memcpy(path, s->x, n * sizeof *path);
    *info = (struct phys_path_info){.stop = stop,
                                    .steps = steps,
                                    .seconds = ad_now() - started,
                                    .action = s->at.action,
                                    .action_mean = s->at.action_mean,
                                    .kinetic_mean = s->at.kinetic_mean,
                                    .potential_mean = s->at.potential_mean,
                                    .grad_norm = s->at.grad_norm,
                                    .start = start,
                                    .compared = {NAN, NAN, NAN, NAN, NAN, NAN},
                                    .energy_mean = info->energy_mean,
                                    .energy_drift = info->energy_drift};
    return AD_OK;
}

enum ad_status phys_path_ranks_solve(struct ad_ranks *ranks, const struct phys_solver *solver,
                                     const struct phys_system *system,
                                     const struct phys_path_settings *settings, double *path,
                                     struct phys_path_info *info, struct ad_error *error)
{
    struct solve s = {0};
    if ((ranks && ad_ranks_check(ranks, error) != AD_OK) ||
        phys_path_check(solver, system, settings, path, info, error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    bool newton = strcmp(solver->name, "newton") == 0;
    if (phys_ranked_check(system, settings, solver, error) == AD_OK &&
        phys_ranked_new(&s.path, ranks, system, settings, newton, error) == AD_OK)
        run(&s, solver, path, info, error);
    phys_ranked_free(&s.path);
    free(s.x);
    return error->status;
}

enum ad_status phys_path_ranks_gradient(struct ad_ranks *ranks, const struct phys_system *system,
                                        const struct phys_path_settings *settings,
                                        const double *path, double *gradient,
                                        struct phys_path_figures *figures, struct ad_error *error)
{
    struct solve s = {0};
    if (AD_LACKS_RESULT(error, figures) || AD_LACKS(error, gradient) ||
        (ranks && ad_ranks_check(ranks, error) != AD_OK) ||
        phys_path_check(&phys_solver_newton, system, settings, path, &(struct phys_path_info){0},
                        error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (phys_ranked_check(system, settings, &phys_solver_newton, error) == AD_OK &&
        phys_ranked_new(&s.path, ranks, system, settings, false, error) == AD_OK) {
        s.path.path = path;
        if (phys_ranked_gradient(&s.path, &s.sums, error) == AD_OK) {
            take_gradient(&s, gradient);
            *figures = figures_of(&s.path, &s.sums);
        }
    }
    phys_ranked_free(&s.path);
    free(s.x);
    return error->status;
}
