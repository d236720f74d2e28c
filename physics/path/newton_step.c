/* Steps of Newton's method (newton_step.h): H x = -g with the exact Hessian. A step is accepted if
   it reduces the gradient; otherwise it is damped by Levenberg's method for |g|^2 (Levenberg, Q.
   Appl. Math. 2, 1944; newton_system.c), which tends to a short step down |g|^2 whatever the signs
   of H. */
#include "newton_step.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Damping in units of the kinetic stiffness, where the spectrum of H ends at about 4. */
static const double LEAST_DAMPING = 1e-5, MOST_DAMPING = 1e4, DAMPING_FACTOR = 10;

static const double FAMILY_DAMPING = 1e-7; /* leaves out what is singular, where that is asked */

static const double POOR = 0.25;  /* a step that leaves more of the gradient may have been short */
static const double FAST = 1e-3;  /* one that leaves so little: Newton's method converges */
static const double SLOW = 0.999; /* ... and one that leaves so much is hardly a step */
static const double ROUGH = 1e-3; /* of the first step: short enough where that is asked */

static const double CONTRACTION = 0.25; /* of a step by the same matrix: the method converges */

static const double LEAST_SHARE = 1e-3; /* of Newton's step, where it is shortened */

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

void phys_newton_differentiate(struct phys_newton *s)
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

bool phys_newton_at_rounding(struct phys_newton *s) { return norm(s) <= s->rounding; }

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

double phys_newton_least_damping(const struct phys_newton *s)
{
    return s->settings.ends && s->settings.ends->families ? FAMILY_DAMPING : 0;
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
static bool improve_damped(struct phys_newton *s, struct phys_path_step *at, size_t *slow)
{
    size_t number = at->step + 1;
    phys_newton_differentiate(s);
    if (s->hessian.stopped)
        return false;
    double from = norm(s);
    bool first = true;
    while (!try_step(s, from, number, at)) {
        if (from <= s->rounding || s->damping >= MOST_DAMPING || s->band.no_memory ||
            phys_hessian_stopped(&s->hessian))
            return false;
        s->damping = fmax(LEAST_DAMPING, s->damping * DAMPING_FACTOR);
        first = false;
    }
    if (first && !s->lengthened) /* else the next step needs about as much */
        s->damping /= DAMPING_FACTOR * DAMPING_FACTOR;
    if (s->damping < LEAST_DAMPING)
        s->damping = phys_newton_least_damping(s);
    *slow = norm(s) > SLOW * from ? *slow + 1 : 0;
    return true;
}

/* One step of a length at which the next by the same matrix is shorter: the natural monotonicity
   test (Deuflhard 2011, section 3.3), blind to the conditioning that gives |g| minima of its own.
 */
static bool improve_naturally(struct phys_newton *s, struct phys_path_step *at)
{
    const size_t number = at->step + 1;
    phys_newton_differentiate(s);
    double from = norm(s), here;
    if (s->hessian.stopped || !factor(s, phys_newton_least_damping(s)))
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

bool phys_newton_improve(struct phys_newton *s, struct phys_path_step *at, size_t *slow)
{
    return s->natural ? improve_naturally(s, at) : improve_damped(s, at, slow);
}

bool phys_newton_contracts(struct phys_newton *s)
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
