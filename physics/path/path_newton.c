/* Newton's method for stationary paths, minima or saddles of the action: its steps (newton_step.h)
   from where they may begin to where they end. */
#include "newton_step.h"

#include <string.h>

enum { PATIENCE = 10 }; /* slow steps in a row: |g| has a minimum here that is not zero */

static enum phys_stop follow(struct phys_newton *s, struct phys_path_step *at)
{
    enum phys_stop stop = phys_path_program_report(&s->path, at);
    size_t slow = 0;
    s->damping = phys_newton_least_damping(s);
    s->first = 0;
    s->arrived = false;
    while (!stop) {
        bool moved = phys_newton_improve(s, at, &slow);
        if (moved)
            stop = phys_path_program_report(&s->path, at);
        if (moved && !stop && (s->arrived || (s->settled && phys_newton_at_rounding(s))))
            stop = PHYS_STOP_ROUNDING;
        if (!stop && s->hessian.stopped)
            stop = PHYS_STOP_INTERRUPTED;
        else if (!stop && (!moved || slow >= PATIENCE))
            stop = phys_newton_at_rounding(s) ? PHYS_STOP_ROUNDING : PHYS_STOP_STALLED;
        else if (stop == PHYS_STOP_STEPS && phys_newton_at_rounding(s))
            stop = PHYS_STOP_ROUNDING;
    }
    return stop;
}

/* Whether the gradient is far above its rounding, without a Hessian: a path that differs in the
   eighth digit changes it by less than its size, and rounding is of the sixteenth. */
static bool clearly_not_stationary(struct phys_newton *s)
{
    const double share = 1e-8;
    double size = 0, change = 0;
    memcpy(s->before, s->path.x, s->path.n * sizeof *s->before);
    memcpy(s->step, s->path.g, s->path.n * sizeof *s->step);
    for (size_t k = 0; k < s->path.n; k++)
        s->path.x[k] *= k * 2654435761u >> 16 & 1 ? 1 + share : 1 - share;
    phys_path_program_run(&s->path, 0);
    for (size_t k = 0; k < s->path.n; k++) {
        size += s->step[k] * s->step[k];
        change += (s->path.g[k] - s->step[k]) * (s->path.g[k] - s->step[k]);
    }
    memcpy(s->path.x, s->before, s->path.n * sizeof *s->before);
    phys_path_program_run(&s->path, 0);
    return change < size;
}

/* Whether the path after `step` steps of Adam is one to begin with: the given one if it is
   stationary to rounding, as a saddle, from which they would lead away. */
static bool needs_no_descent(void *context, size_t step)
{
    struct phys_newton *s = context;
    if (step > 0 && !s->sparing)
        return false;
    phys_path_program_run(&s->path, step);
    if (!s->sparing && !s->path.surface && clearly_not_stationary(s))
        return false;
    phys_newton_differentiate(s);
    return s->hessian.stopped || phys_newton_at_rounding(s) || /* stopped: no steps are wanted */
           (s->sparing && phys_newton_contracts(s));
}

bool phys_newton_converges(struct phys_newton *s, const double *path)
{
    s->hessian.stopped = false;
    s->sparing = true;
    phys_path_program_place(&s->path, path);
    return needs_no_descent(s, 0);
}

/* Near a saddle, the Adam steps before Newton's may diverge: if they increased the gradient, the
   given start is tried first, else second. */
static enum ad_status iterate(struct phys_newton *s, double *path, struct phys_path_info *info,
                              struct ad_error *error)
{
    struct phys_path_step at = phys_path_program_run(&s->path, 0);
    if (phys_path_program_finite(&s->path, &at, error) != AD_OK)
        return error->status;
    bool away = at.grad_norm > s->path.start_norm;
    if (away) {
        phys_path_program_place(&s->path, path);
        at = phys_path_program_run(&s->path, 0);
    }
    enum phys_stop stop = follow(s, &at);
    if (stop == PHYS_STOP_STALLED && s->path.settings->adam_steps > 0) {
        phys_path_program_place(&s->path, path);
        if (away && phys_path_program_adam(&s->path, NULL, NULL, error) != AD_OK)
            return error->status;
        at = phys_path_program_run(&s->path, at.step + 1);
        stop = follow(s, &at);
    }
    if (stop == PHYS_STOP_STALLED && !s->path.surface) {
        phys_path_program_place(&s->path, path);
        at = phys_path_program_run(&s->path, at.step + 1);
        s->natural = true;
        s->share = 1;
        stop = follow(s, &at);
        s->natural = false;
    }
    if (s->band.no_memory)
        return ad_fail(error, AD_E_MEMORY, "out of memory for a step of newton");
    phys_path_program_end(&s->path, stop, &at, path, info);
    return AD_OK;
}

enum ad_status phys_newton_solve(struct phys_newton *s, double *path, struct phys_path_info *info,
                                 struct ad_error *error)
{
    s->hessian.stopped = false;
    if (s->path.surface) {
        memcpy(s->before, path, s->path.n * sizeof *path);
        if (phys_surface_meet(s->path.surface, s->before, error) != AD_OK)
            return error->status;
    }
    phys_path_program_start(&s->path, s->path.surface ? s->before : path);
    if (phys_path_program_adam(&s->path, needs_no_descent, s, error) == AD_OK)
        iterate(s, path, info, error);
    return error->status;
}

bool phys_newton_settle(struct phys_newton *s, double *path, struct phys_path_info *info,
                        struct ad_error *error)
{
    const struct phys_path_settings asked = s->settings;
    struct ad_error lost = {0};
    s->settings.adam_steps = 0;
    s->settings.tolerance = 0;
    s->settings.progress = NULL;
    s->settings.compare = NULL;
    s->settings.start_momentum = NULL;
    phys_newton_solve(s, path, info, &lost);
    s->settings = asked;
    phys_keep_memory(&lost, error);
    return lost.status == AD_OK && info->stop == PHYS_STOP_ROUNDING;
}

enum ad_status phys_newton_spectrum(struct phys_newton *s, enum phys_spectrum_parts parts,
                                    const double *path, struct phys_spectrum *spectrum,
                                    struct ad_error *error)
{
    s->hessian.stopped = s->known = false;
    return phys_hessian_spectrum(&s->hessian, s->path.surface, parts, path, spectrum, error);
}

bool phys_newton_confirms(struct phys_newton *s, const double *path, bool filled,
                          const struct phys_spectrum *spectrum, struct ad_error *error)
{
    s->hessian.stopped = s->known = false;
    return phys_hessian_confirms(&s->hessian, s->path.surface, path, filled, spectrum, error);
}

static enum ad_status solve_over(const struct phys_system *system,
                                 const struct phys_path_settings *settings,
                                 struct phys_derivatives *of, bool sparing, double *path,
                                 struct phys_path_info *info, struct ad_error *error)
{
    struct phys_newton s;
    bool made = phys_newton_new(&s, system, settings, of, error) == AD_OK;
    s.sparing = sparing;
    if (made)
        phys_newton_solve(&s, path, info, error);
    phys_newton_free(&s);
    return error->status;
}

static enum ad_status solve(const struct phys_system *system,
                            const struct phys_path_settings *settings, double *path,
                            struct phys_path_info *info, struct ad_error *error)
{
    return solve_over(system, settings, NULL, false, path, info, error);
}

enum ad_status phys_newton_over(const struct phys_system *system,
                                const struct phys_path_settings *settings,
                                struct phys_derivatives *of, bool sparing, double *path,
                                struct phys_path_info *info, struct ad_error *error)
{
    if (phys_path_check(&phys_solver_newton, system, settings, path, info, error) != AD_OK)
        return error->status;
    return solve_over(system, settings, of, sparing, path, info, error);
}

const struct phys_solver phys_solver_newton = {
    "newton", "stationary path, minimum or saddle, to rounding", solve, false};
