/* Morse index, conjugate points and smallest eigenvalue of the action's Hessian, by the inertia of
   its shifts (inertia.h). */
#include "internal.h"
#include "spectrum.h"
#include "inertia.h"
#include "path_units.h"
#include "autodiff/blas.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static const double ROUNDING = 16; /* of an eigenvalue, in units of the largest */
/* Relative errors of eigenvalues next to zero: as reported, and where their kind alone is asked. */
static const double KNOWN = 0.01, ROUGH = 0.25;
static const double LITTLE = 1.05; /* times: a guess is as near, often */
enum { MOST_TRIALS = 6 };          /* from a guess, for an eigenvalue that seems to be zero */
enum { CHEAP = 40 };               /* dof * degree up to which sixty eliminations are cheap */

/* ---- eigenvalues ---- */

/* A shift, the number of eigenvalues below it, and log |det(H - shift)|. */
struct shift {
    double at, log;
    size_t below;
};

/* Whether the shift is above eigenvalue k. */
static bool is_above(struct phys_inertia *c, size_t k, struct shift *shift)
{
    shift->below = phys_inertia_below(c, shift->at, NULL);
    shift->log = c->log_determinant;
    return shift->below > k;
}

/* The determinant at a shift, over exp(scale). */
static double determinant(const struct shift *s, double scale)
{
    return (s->below % 2 ? -1 : 1) * exp(s->log - scale);
}

/* Where the determinant is 0 between the shifts x and y, as a share of the way: by inverse
   quadratic interpolation with a third one beyond x or y where that is safe, else in the middle
   (Chandrupatla, Adv. Eng. Software 28, 145, 1997). */
static double zero_between(const struct shift *x, const struct shift *y, const struct shift *third)
{
    double scale = fmax(x->log, fmax(y->log, third->log)), f = determinant(x, scale),
           g = determinant(y, scale), h = determinant(third, scale);
    double at = (x->at - y->at) / (third->at - y->at), value = (f - g) / (h - g);
    if (!(value * value < at && (1 - value) * (1 - value) < 1 - at))
        return 0.5;
    return f / (g - f) * h / (g - h) +
           (third->at - x->at) / (y->at - x->at) * f / (h - f) * g / (h - g);
}

/* Where to look for an eigenvalue, which a shift is above or not (`above`), after a number of
   trials from a guess: a little further, then at 4 times or a quarter of it, and without one, or
   where it seems to be zero, anywhere. */
static double look_further(const struct phys_inertia *c, double at, bool above, double guess,
                           size_t trials)
{
    const bool nearer_zero = above == (guess > 0);
    const double factor = trials ? 4 : LITTLE;
    if (at * guess > 0 && !nearer_zero)
        return factor * at;
    if (at * guess > 0)
        return trials < MOST_TRIALS ? at / factor : 0;
    return at != 0 ? 2 * at : above ? -c->scale : c->scale;
}

/* Eigenvalue k, ascending from 0, to rounding or a relative error: shifts on either side of it are
   brought together by order of size, then by halves, and by the determinant where it is alone. A
   guess of its sign, or 0. INFINITY: there are fewer. */
static double eigenvalue(struct phys_inertia *c, size_t k, double relative, double guess)
{
    struct shift end[2] = {{0}}, next = {.at = guess}, replaced;
    bool side = is_above(c, k, &next), above = side;
    for (size_t trials = 0; above == side && !c->hessian->stopped;
         above = is_above(c, k, &next), trials++) {
        end[side] = next;
        next.at = look_further(c, next.at, side, guess, trials);
        if (next.at > PHYS_BEYOND_SPECTRUM * c->scale)
            return (double)INFINITY;
    }
    replaced = end[!side] = next;
    while (!c->hessian->stopped) {
        const struct shift *low = &end[0], *high = &end[1], *here = &end[above];
        double near = fmin(fabs(low->at), fabs(high->at)), width = high->at - low->at;
        double far = fmax(fabs(low->at), fabs(high->at)), share = 0.5;
        double least = fmax(4 * DBL_EPSILON * c->scale, relative * near);
        if (width <= least)
            break;
        if (high->below == low->below + 1)
            share = zero_between(here, &end[!above], &replaced);
        share = fmax(0.5 * least / width, fmin(1 - 0.5 * least / width, share));
        next.at = far > 4 * fmax(near, least) && low->at * high->at >= 0
                      ? (high->at > 0 ? 1 : -1) * sqrt(fmax(near, least) * far)
                      : here->at + share * (end[!above].at - here->at);
        above = is_above(c, k, &next);
        replaced = end[above];
        end[above] = next;
    }
    return 0.5 * (end[0].at + end[1].at);
}

/* An upper bound of the smallest eigenvalue of the second variation: the quotient of one
   coordinate's half sine wave. */
static double half_wave(const struct phys_inertia *c)
{
    const struct phys_hessian *h = c->hessian;
    const size_t degree = h->table.degree, nodes = degree * h->elements;
    double least = (double)INFINITY;
    for (size_t d = 0; d < c->dof; d++) {
        double form = 0, mass = 0;
        for (size_t e = 0; e < h->elements; e++)
            for (size_t a = 0; a <= degree; a++) {
                const double x = sin(M_PI * (double)(e * degree + a) / (double)nodes);
                mass += a < degree ? x * x * c->mass[a] * phys_hessian_length(h, e) : 0;
                for (size_t b = 0; b <= degree; b++)
                    form += x * phys_hessian_entry(h, e, a, d, b, d) *
                            sin(M_PI * (double)(e * degree + b) / (double)nodes);
            }
        least = fmin(least, form / mass);
    }
    return least;
}

/* Whether eigenvalues are found at all. */
static bool is_cheap(const struct phys_inertia *c)
{
    return c->dof * c->hessian->table.degree <= CHEAP && c->largest > 0;
}

/* ---- public functions ---- */

static const struct phys_spectrum unknown = {
    .smallest = (double)NAN, .second_variation = (double)NAN, .around = {(double)NAN, (double)NAN}};

void phys_hessian_settings(struct phys_hessian *h, const struct phys_path_settings *settings)
{
    h->mesh = settings->mesh;
    h->ends = phys_free_ends(settings) ? settings->ends : NULL;
    for (size_t end = 0; h->ends && end < 2; end++)
        h->free[end] = h->ends->free[end];
}

/* The Hessian of -S. */
static void negate(struct phys_hessian *h)
{
    for (size_t k = 0; k < phys_hessian_size(h); k++)
        h->element[k] = -h->element[k];
}

/* Fills h, if it is not yet, for coordinates in the common unit: beside eigenvalues of another unit
   those of one may be zero within rounding. Tangent coordinates of a surface have the unit of the
   path. Makes `ends` where they move. */
static enum ad_status fill(struct phys_hessian *h, struct phys_surface *surface, const double *path,
                           bool filled, struct phys_end_space *ends, struct ad_error *error)
{
    if (!filled)
        phys_hessian_at(h, path, 0);
    if (surface && !filled && !h->stopped)
        phys_surface_reduce(surface, path);
    if (surface)
        return surface->tangent.ends
                   ? phys_end_space_new(ends, surface->tangent.ends, surface->left, error)
                   : AD_OK;
    double *unit = phys_hessian_units(h, path, error); /* with room */
    size_t nodes = h->table.degree + 1;
    if (unit && h->ends && phys_end_space_new(ends, h->ends, h->dof, error) == AD_OK) {
        for (size_t k = 0; k < h->dof; k++)
            unit[h->dof + k] = unit[h->order[k]];
        phys_end_space_scale(ends, h->order, unit + h->dof);
    }
    for (size_t e = 0; unit && e < h->elements; e++)
        for (size_t at = 0; at < nodes * h->side; at++) {
            size_t a = at / h->side, b = at % h->side / h->dof, j = at % h->dof;
            for (size_t i = j > h->around ? j - h->around : 0; i < h->dof && i <= j + h->around;
                 i++)
                h->element[phys_hessian_place(h, e, a, i, b, j)] *=
                    unit[h->order[i]] * unit[h->order[j]];
        }
    free(unit);
    return error->status;
}

/* To be called between ad_blas_single_thread and ad_blas_threads. */
static void count_directions(struct phys_inertia *c, double relative,
                             struct phys_spectrum *spectrum)
{
    phys_inertia_masses(c, false);
    const size_t k = spectrum->index = phys_inertia_below(c, 0, spectrum);
    if (c->hessian->ends)
        spectrum->n_conjugate = 0; /* they are of other fields: the end's own curvature counts */
    if (!is_cheap(c))
        return;
    double *around = spectrum->around;
    phys_inertia_masses(c, true);
    const double guess = k > 1 ? 0 : half_wave(c);
    around[0] = k ? eigenvalue(c, k - 1, relative, guess < 0 ? guess : 0) : (double)NAN;
    around[1] = eigenvalue(c, k, relative, guess > 0 && k == 0 ? guess : 0);
    spectrum->undetermined =
        fmin(fabs(around[0]), fabs(around[1])) <= ROUNDING * DBL_EPSILON * c->scale;
}

/* The smallest ones to rounding, of a spectrum that is known else. */
static void find_smallest(struct phys_inertia *c, struct phys_spectrum *spectrum)
{
    const size_t k = spectrum->index, degree = c->hessian->table.degree;
    double mass = 0, guess = 0;
    if (!is_cheap(c))
        return;
    phys_inertia_masses(c, true);
    if (k < 2)
        guess = spectrum->around[k == 0];
    else
        guess = fmin(half_wave(c), 0);
    spectrum->second_variation = eigenvalue(c, 0, 0, isfinite(guess) ? guess : 0);
    for (size_t j = 0; j < degree; j++)
        mass += c->mass[j] / (double)degree;
    phys_inertia_masses(c, false);
    spectrum->smallest = eigenvalue(c, 0, 0, spectrum->second_variation * mass);
}

static enum ad_status examine(struct phys_hessian *h, struct phys_surface *surface,
                              enum phys_spectrum_parts parts, struct phys_inertia *c,
                              const double *path, struct phys_end_space *ends,
                              struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_hessian *of = surface ? &surface->tangent : h;
    if (fill(h, surface, path, false, ends, error) != AD_OK)
        return error->status;
    if (h->stopped)
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    if (parts & PHYS_KIND)
        spectrum->legendre = phys_hessian_definite(h, &spectrum->not_definite);
    if (spectrum->legendre == PHYS_NEGATIVE)
        negate(of);
    if (!phys_inertia_new(c, of, ends))
        return ad_fail(error, AD_E_MEMORY, "out of memory for the inertia");
    if (!isfinite(c->largest))
        return ad_fail(error, AD_E_NONFINITE, "second derivatives of the action are not finite");
    ad_blas_single_thread();
    if (parts & PHYS_KIND && spectrum->legendre != PHYS_INDEFINITE)
        count_directions(c, parts & PHYS_EIGENVALUES ? KNOWN : ROUGH, spectrum);
    if (parts & PHYS_EIGENVALUES && spectrum->legendre != PHYS_INDEFINITE)
        find_smallest(c, spectrum);
    ad_blas_threads();
    if (c->lost)
        return ad_fail(error, AD_E_MEMORY, "out of memory for the inertia of the path");
    return of->stopped ? ad_fail(error, AD_E_ACCURACY, "interrupted") : AD_OK;
}

enum ad_status phys_hessian_spectrum(struct phys_hessian *h, struct phys_surface *surface,
                                     enum phys_spectrum_parts parts, const double *path,
                                     struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_inertia c = {0};
    struct phys_end_space ends = {0};
    if (parts & PHYS_KIND)
        *spectrum = unknown;
    if (!(parts & PHYS_KIND) || phys_hessian_keep_mass(h))
        examine(h, surface, parts, &c, path, &ends, spectrum, error);
    else
        ad_fail(error, AD_E_MEMORY, "out of memory for the mass matrices");
    phys_inertia_free(&c);
    phys_end_space_free(&ends);
    free(h->mass);
    h->mass = NULL;
    return error->status;
}

bool phys_hessian_confirms(struct phys_hessian *h, struct phys_surface *surface, const double *path,
                           bool filled, const struct phys_spectrum *spectrum,
                           struct ad_error *error)
{
    struct phys_hessian *of = surface ? &surface->tangent : h;
    struct phys_inertia c = {0};
    struct phys_end_space ends = {0};
    bool same = true;
    fill(h, surface, path, filled, &ends, error);
    if (spectrum->legendre == PHYS_NEGATIVE)
        negate(of);
    if (error->status != AD_OK || !phys_inertia_new(&c, of, &ends)) {
        ad_fail(error, AD_E_MEMORY, "out of memory for the inertia");
    } else if (!isfinite(c.largest)) {
        same = false;
    } else {
        ad_blas_single_thread();
        phys_inertia_masses(&c, true);
        /* without eigenvalues below zero none is below half of the next: one count tells */
        for (size_t k = spectrum->index == 0; same && k < 2 && !of->stopped; k++) {
            double sigma = isfinite(spectrum->around[k]) ? 0.5 * spectrum->around[k] : 0;
            same = phys_inertia_below(&c, sigma, NULL) == spectrum->index;
        }
        ad_blas_threads();
    }
    if (c.lost)
        ad_fail(error, AD_E_MEMORY, "out of memory for the inertia of the path");
    phys_inertia_free(&c);
    phys_end_space_free(&ends);
    if (of->stopped)
        ad_fail(error, AD_E_ACCURACY, "interrupted");
    return same;
}

enum ad_status phys_path_spectrum(const struct phys_system *system,
                                  const struct phys_path_settings *settings, const double *path,
                                  struct phys_spectrum *spectrum, struct ad_error *error)
{
    struct phys_hessian h = {0};
    struct phys_surface *surface = NULL;
    if (AD_LACKS(error, spectrum))
        return error->status;
    *spectrum = unknown;
    if (AD_LACKS(error, system, system->scene, settings, settings->rule, path))
        return error->status;
    if (phys_refuse_forces(system, "paths", error) != AD_OK)
        return error->status;
    PHYS_OWN_PATH(settings, error);
    if (phys_hessian_new(&h, system, settings->rule, settings->slices, settings->dt, NULL, error) ==
        AD_OK) {
        h.proceed = settings->proceed;
        h.context = settings->context;
        phys_hessian_settings(&h, settings);
        struct phys_ends tangent;
        if (phys_surface_new(system, &h, &surface, error) == AD_OK) {
            phys_ends_of_surface(surface, &tangent);
            phys_hessian_spectrum(&h, surface, PHYS_KIND | PHYS_EIGENVALUES, path, spectrum, error);
        }
    }
    phys_surface_free(surface);
    phys_hessian_free(&h);
    return error->status;
}

void phys_spectrum_free(struct phys_spectrum *spectrum)
{
    if (!spectrum)
        return;
    free(spectrum->conjugate);
    *spectrum = (struct phys_spectrum){0};
}
