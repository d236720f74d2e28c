/* Newton's method for stationary paths, minima or saddles of the action: H x = -g with the exact
   Hessian. A step is accepted if it reduces the gradient; otherwise it is damped by Levenberg's
   method for |g|^2 (Levenberg, Q. Appl. Math. 2, 1944; newton_system.c), which tends to a short
   step down |g|^2 whatever the signs of H. */
#include "newton.h"
#include "spectrum.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Damping in units of the kinetic stiffness, where the spectrum of H ends at about 4. */
static const double LEAST_DAMPING = 1e-5, MOST_DAMPING = 1e4, DAMPING_FACTOR = 10;

static const double POOR = 0.25;  /* a step that leaves more of the gradient may have been short */
static const double FAST = 1e-3;  /* one that leaves so little: Newton's method converges */
static const double SLOW = 0.999; /* ... and one that leaves so much is hardly a step */
static const double ROUGH = 1e-3; /* of the first step: short enough where that is asked */

static const double CONTRACTION = 0.25; /* of a step by the same matrix: the method converges */

static const double LEAST_SHARE = 1e-3; /* of Newton's step, where it is shortened */

enum { PATIENCE = 10 }; /* slow steps in a row: |g| has a minimum here that is not zero */

enum { ROUNDING = 8 };   /* the gradient is zero below this multiple of its rounding */
enum { LAST_BITS = 16 }; /* rounding errors of a coordinate that a path is known to */

static double length_of(size_t n, const double *step)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += step[i] * step[i];
    return sqrt(sum);
}

/* Of a step, coordinates in units of their kinetic stiffness. */
static double stiff_length(const struct phys_newton *s, const double *step)
{
    double sum = 0;
    for (size_t k = 0; k < s->path.n; k++)
        sum += s->hessian.stiffness[k / s->settings.slices % s->hessian.dof] * step[k] * step[k];
    return sqrt(sum);
}

static double norm(struct phys_newton *s)
{
    for (size_t k = 0; k < s->path.n; k++)
        s->gradient[k] = s->unit * s->path.g[k];
    return s->path.surface ? s->band.scale[0] * length_of(s->path.n, s->gradient)
                           : phys_newton_system_norm(&s->band, s->gradient);
}

/* Below which the gradient is zero where the Hessian was taken. */
static void measure_rounding(struct phys_newton *s)
{
    s->rounding =
        ROUNDING * phys_newton_system_rounding(s->path.surface ? &s->whole : &s->band, s->path.x);
}

/* The Hessian at the path, on the tangent spaces of constraints if there are any. */
static void differentiate(struct phys_newton *s)
{
    if (s->known && memcmp(s->at, s->path.x, s->path.n * sizeof *s->at) == 0)
        return;
    s->known = s->factored = false;
    phys_hessian_at(&s->hessian, s->path.x, 0);
    if (s->hessian.stopped)
        return;
    s->known = true;
    memcpy(s->at, s->path.x, s->path.n * sizeof *s->at);
    if (s->path.surface)
        phys_surface_reduce(s->path.surface, s->path.x);
    phys_newton_system_scale(&s->band);
    for (size_t d = 0; s->path.surface && d < s->hessian.dof; d++)
        s->whole.scale[d] = s->band.scale[0];
    measure_rounding(s);
}

/* The factors of the Hessian with a damping. False: it has none. */
static bool factor(struct phys_newton *s, double damping)
{
    if (s->factored && s->band.damping == damping)
        return true;
    return s->factored = phys_newton_system_factor(&s->band, damping);
}

/* s->step from s->gradient and the factors. */
static void find_step(struct phys_newton *s)
{
    if (!s->path.surface) {
        phys_newton_system_step(&s->band, s->gradient, s->step);
        return;
    }
    phys_surface_to(s->path.surface, s->gradient, s->tangent);
    phys_newton_system_step(&s->band, s->tangent, s->gradient);
    memset(s->step, 0, s->path.n * sizeof *s->step); /* also where there are no nodes */
    phys_surface_from(s->path.surface, s->gradient, s->step);
}

/* |g| at `length` steps from where the path was. */
static double norm_at(struct phys_newton *s, double length, size_t number,
                      struct phys_path_step *at)
{
    for (size_t k = 0; k < s->path.n; k++)
        s->path.x[k] = s->before[k] + length * s->step[k];
    if (s->path.surface &&
        phys_surface_meet(s->path.surface, s->path.x, &(struct ad_error){0}) != AD_OK)
        return NAN;
    *at = phys_path_program_run(&s->path, number);
    return norm(s);
}

static bool at_rounding(struct phys_newton *s) { return norm(s) <= s->rounding; }

/* Extends a step that reduced |g| only slightly, as long as that helps: near a pole r^-p Newton's
   step is 1/p of the way. Returns whether it did. */
static bool lengthen(struct phys_newton *s, double from, double here, size_t number,
                     struct phys_path_step *at)
{
    double length = 1, further;
    if (here <= POOR * from)
        return false;
    while ((further = norm_at(s, 2 * length, number, at)) < here) {
        here = further;
        length *= 2;
    }
    norm_at(s, length, number, at);
    return length > 1;
}

/* Whether the step changes the last bits of every coordinate alone. */
static bool within_last_bits(const struct phys_newton *s)
{
    const size_t slices = s->settings.slices, dof = s->hessian.dof, rows = s->path.n / slices;
    for (size_t d = 0; d < dof; d++) {
        double moved = 0, size = 0;
        for (size_t row = d; row < rows; row += dof)
            for (size_t k = row * slices; k < (row + 1) * slices; k++) {
                moved = fmax(moved, fabs(s->step[k]));
                size = fmax(size, fabs(s->path.x[k]));
            }
        if (!(moved <= LAST_BITS * DBL_EPSILON * size))
            return false;
    }
    return true;
}

/* Repeats Newton's step with the matrix that is factored, which is cheaper than another one, as
   long as that makes |g| smaller: by much, or at all where it is zero to rounding. A step that is
   not much shorter than the last is not taken: along an eigenvector of nearly zero eigenvalue an
   old matrix leads astray, and |g| does not show it; the path is settled where that step is one of
   the last bits. */
static void repeat(struct phys_newton *s, size_t number, struct phys_path_step *at)
{
    double from, here = norm(s), last = length_of(s->path.n, s->step);
    do {
        from = here;
        find_step(s);
        double length = length_of(s->path.n, s->step);
        s->arrived = s->rough && length <= ROUGH * s->first;
        if (s->arrived || !(length <= FAST * last)) {
            s->settled = here <= s->rounding && within_last_bits(s);
            return;
        }
        last = length;
        memcpy(s->before, s->path.x, s->path.n * sizeof *s->before);
        here = norm_at(s, 1, number, at);
    } while (here < (here <= s->rounding ? 1 : FAST) * from);
    s->settled = !(here < from);
    if (s->settled) {
        memcpy(s->path.x, s->before, s->path.n * sizeof *s->before);
        *at = phys_path_program_run(&s->path, number);
    }
}

/* Moves the path by a step with the present damping. False, and the path back, if the gradient does
   not fall below `from`. */
static bool try_step(struct phys_newton *s, double from, size_t number, struct phys_path_step *at)
{
    norm(s);
    if (!factor(s, s->damping))
        return false;
    find_step(s);
    if (s->first == 0)
        s->first = length_of(s->path.n, s->step);
    memcpy(s->before, s->path.x, s->path.n * sizeof *s->before);
    double here = norm_at(s, 1, number, at);
    if (!(here < from)) { /* NaN, too */
        memcpy(s->path.x, s->before, s->path.n * sizeof *s->before);
        *at = phys_path_program_run(&s->path, number - 1);
        return false;
    }
    s->lengthened = lengthen(s, from, here, number, at);
    s->settled = false;
    if (s->damping == 0 && (here < FAST * from || here <= s->rounding))
        repeat(s, number, at);
    return true;
}

/* One step, damped as much as it needs. False if none makes the gradient smaller. `slow` counts. */
static bool improve(struct phys_newton *s, struct phys_path_step *at, size_t *slow)
{
    size_t number = at->step + 1;
    differentiate(s);
    if (s->hessian.stopped)
        return false;
    double from = norm(s);
    bool first = true;
    while (!try_step(s, from, number, at)) {
        if (from <= s->rounding || s->damping >= MOST_DAMPING || s->band.no_memory ||
            phys_hessian_stopped(&s->hessian))
            return false;
        s->damping = s->damping > 0 ? s->damping * DAMPING_FACTOR : LEAST_DAMPING;
        first = false;
    }
    if (first && !s->lengthened) /* else the next step needs about as much */
        s->damping /= DAMPING_FACTOR * DAMPING_FACTOR;
    if (s->damping < LEAST_DAMPING)
        s->damping = 0;
    *slow = norm(s) > SLOW * from ? *slow + 1 : 0;
    return true;
}

/* One step of a length at which the next by the same matrix is shorter: the natural monotonicity
   test (Deuflhard 2011, section 3.3), blind to the conditioning that gives |g| minima of its own.
 */
static bool improve_naturally(struct phys_newton *s, struct phys_path_step *at)
{
    const size_t number = at->step + 1;
    differentiate(s);
    double from = norm(s), here;
    if (s->hessian.stopped || !factor(s, 0))
        return false;
    find_step(s);
    memcpy(s->before, s->path.x, s->path.n * sizeof *s->before);
    const double length = stiff_length(s, s->step);
    for (s->share = fmin(1, 4 * s->share); s->share >= LEAST_SHARE; s->share /= 2) {
        here = norm_at(s, s->share, number, at);
        phys_newton_system_step(&s->band, s->gradient, s->tangent);
        if (stiff_length(s, s->tangent) <= (1 - s->share / 4) * length) {
            s->settled = false;
            if (s->share == 1 && (here < FAST * from || here <= s->rounding))
                repeat(s, number, at);
            return true;
        }
    }
    memcpy(s->path.x, s->before, s->path.n * sizeof *s->before);
    *at = phys_path_program_run(&s->path, number - 1);
    return false;
}

static enum phys_stop follow(struct phys_newton *s, struct phys_path_step *at)
{
    enum phys_stop stop = phys_path_program_report(&s->path, at);
    size_t slow = 0;
    s->damping = s->first = 0;
    s->arrived = false;
    while (!stop) {
        bool moved = s->natural ? improve_naturally(s, at) : improve(s, at, &slow);
        if (moved)
            stop = phys_path_program_report(&s->path, at);
        if (moved && !stop && (s->arrived || (s->settled && at_rounding(s))))
            stop = PHYS_STOP_ROUNDING;
        if (!stop && s->hessian.stopped)
            stop = PHYS_STOP_INTERRUPTED;
        else if (!stop && (!moved || slow >= PATIENCE))
            stop = at_rounding(s) ? PHYS_STOP_ROUNDING : PHYS_STOP_STALLED;
        else if (stop == PHYS_STOP_STEPS && at_rounding(s))
            stop = PHYS_STOP_ROUNDING;
    }
    return stop;
}

/* Whether a step by the matrix of the last is a quarter as long at the most, where by Kantorovich's
   theorem Newton's method converges to the one path nearby (Deuflhard, Newton Methods for Nonlinear
   Problems, 2011, section 2.1). The path of the program stays. */
static bool contracts(struct phys_newton *s)
{
    struct phys_path_step at;
    norm(s);
    if (s->path.surface || !factor(s, 0))
        return false;
    find_step(s);
    double length = stiff_length(s, s->step);
    memcpy(s->before, s->path.x, s->path.n * sizeof *s->before);
    norm_at(s, 1, 0, &at);
    find_step(s);
    memcpy(s->path.x, s->before, s->path.n * sizeof *s->before);
    return stiff_length(s, s->step) <= CONTRACTION * length;
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
    differentiate(s);
    return s->hessian.stopped || at_rounding(s) || /* stopped: no steps are wanted */
           (s->sparing && contracts(s));
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
