/* The error of packets (quantum.h): against closed forms, Schroedinger's equation, or, for an L
   without a separate potential, finer slices. */
#include "physics/linear/vectors.h"
#include "internal.h"
#include "autodiff/sized.h"

#include <complex.h>
#include <math.h>
#include <stdlib.h>

/* ---- quadratic potentials ---- */

/* V = V0 + m (curvature x^2/2 + gravity x) through three points, if it goes through all. */
static bool is_quadratic(const struct qm_grid *grid, const double *V, double mass,
                         struct qm_quadratic *scene, double *V0)
{
    size_t n = grid->n;
    double x[3], v[3];
    for (size_t k = 0; k < 3; k++) {
        x[k] = qm_x(grid, k * (n - 1) / 2);
        v[k] = V[k * (n - 1) / 2];
    }
    double s = (v[1] - v[0]) / (x[1] - x[0]), r = (v[2] - v[1]) / (x[2] - x[1]);
    double second = (r - s) / (x[2] - x[0]), first = s - second * (x[0] + x[1]),
           most = phys_largest(n, V);
    *V0 = v[0] - (first + second * x[0]) * x[0];
    *scene = (struct qm_quadratic){mass, 2 * second / mass, first / mass};
    for (size_t a = 0; a < n; a++) {
        double at = qm_x(grid, a);
        if (fabs(V[a] - *V0 - (first + second * at) * at) > 1e-11 * most)
            return false;
    }
    if (fabs(scene->curvature) * fmax(x[2] * x[2], x[0] * x[0]) * mass <= 1e-11 * most)
        scene->curvature = 0;
    return scene->curvature >= 0;
}

/* ---- errors ---- */

/* A reference is refined until its uncertainty is a hundredth of the error, or `known`. */
static const double known = 1e-5, at_first = 1e-3, share_known = 0.01;

/* A packet to compare, and the time it is compared at. */
struct question {
    const struct qm_method *method;
    const struct qm_slice *slice;
    const struct qm_gaussian *packet;
    double t;
};

/* sqrt of int |psi - truth|^2 over the box, without absorbing layers: there psi is not the wave. */
static double apart(const struct qm_slice *slice, const qm_complex *psi, size_t stride,
                    const qm_complex *truth)
{
    const struct qm_grid *grid = &slice->grid;
    double sum = 0;
    for (size_t a = 0; a < grid->n; a++) {
        double x = qm_x(grid, a);
        if (fmin(x - grid->low, grid->high - x) >= slice->absorb)
            sum += pow(cabs(psi[a * stride] - truth[a]), 2);
    }
    return sqrt(sum * qm_dx(grid));
}

/* The part of the true wave beyond open walls; absorbing layers are meant to swallow it. */
static double outside_of(const struct qm_slice *slice, double norm, const qm_complex *truth)
{
    bool counts = slice->walls == QM_OPEN && slice->absorb == 0;
    return counts ? sqrt(fmax(0, norm - qm_moments(&slice->grid, 1, truth).norm)) : 0;
}

static bool closed_form(const struct question *ask, const double *V, double mass, qm_complex *truth)
{
    const struct qm_slice *slice = ask->slice;
    struct qm_quadratic scene;
    double V0;
    if (slice->walls != QM_OPEN || !is_quadratic(&slice->grid, V, mass, &scene, &V0))
        return false;
    qm_exact_packet(&scene, slice->hbar, ask->packet, ask->t, &slice->grid, truth);
    for (size_t a = 0; a < slice->grid.n; a++)
        truth[a] *= cexp(-I * (V0 * ask->t / slice->hbar));
    return true;
}

enum { FINER = 3 }; /* odd: the points are among those of the finer grid */

/* The packet by the same method with dt and dx a third as long, at the points of the slice's grid.
   Its difference is most of the coarser run's error, whose order is at least that of the rule. */
static enum ad_status finer(const struct question *ask, qm_complex *truth, struct ad_error *error)
{
    struct qm_slice slice = *ask->slice;
    struct qm_cost cost;
    qm_propagator *propagator = NULL;
    size_t n = slice.grid.n, steps = FINER * (size_t)ceil(ask->t / slice.dt - 1e-9);
    slice.grid.n = FINER * n;
    slice.dt /= FINER;
    ask->method->cost(&slice, &cost);
    if (cost.bytes > 4e9 || cost.setup + cost.step * (double)steps > 1e12)
        return ad_fail(error, AD_E_ACCURACY,
                       "the error is not known: a run three times as fine would take too long; "
                       "expected fewer points or steps");
    qm_complex *psi = malloc(slice.grid.n * sizeof *psi);
    if (!psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", slice.grid.n);
    if (qm_packet_wound(&slice, &slice.grid, ask->packet, 1, 0, psi, error) == AD_OK &&
        qm_propagator_new(ask->method, &slice, &propagator, error) == AD_OK)
        for (size_t k = 0; k < steps && error->status == AD_OK; k++)
            qm_propagate(propagator, 1, psi, error);
    for (size_t a = 0; a < n; a++)
        truth[a] = psi[FINER * a + FINER / 2];
    qm_propagator_free(propagator);
    free(psi);
    return error->status;
}

/* The distance from a true wave of this norm, the part beyond the box included. */
static double distance(const struct question *ask, size_t stride, const qm_complex *psi,
                       double norm, const qm_complex *truth)
{
    return hypot(apart(ask->slice, psi, stride, truth), outside_of(ask->slice, norm, truth));
}

/* The distance from Schroedinger's equation, or the uncertainty of that where it is larger. */
static double by_schroedinger(const struct question *ask, size_t stride, const qm_complex *psi,
                              qm_complex *truth, struct ad_error *error)
{
    struct qm_reference reference;
    double away = INFINITY, wanted = at_first, next = wanted;
    do {
        wanted = next;
        if (qm_reference(ask->slice, ask->packet, ask->t, wanted, truth, &reference, error) !=
            AD_OK)
            return INFINITY;
        away = distance(ask, stride, psi, reference.norm, truth);
        next = fmax(known, share_known * away);
    } while (reference.uncertainty > next && next < 0.5 * wanted);
    return fmax(away, reference.uncertainty);
}

static enum ad_status error_of(const struct question *ask, size_t stride, const qm_complex *psi,
                               qm_complex *truth, double *off, const char **against,
                               struct ad_error *error)
{
    const struct qm_slice *slice = ask->slice;
    const struct phys_rule *rule = qm_rule(slice, error);
    struct ad_error no_potential = {0};
    double mass, *V = malloc(slice->grid.n * sizeof *V);
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", slice->grid.n);
    bool separates = qm_potential(slice->system, &slice->grid, V, &mass, &no_potential) == AD_OK;
    if (separates && closed_form(ask, V, mass, truth)) {
        *against = "the closed form";
        *off = distance(ask, stride, psi, 1, truth);
    } else if (separates) {
        *against = "Schroedinger's equation, split in Fourier space";
        *off = by_schroedinger(ask, stride, psi, truth, error);
    } else {
        *against = "the same method, three times as fine";
        finer(ask, truth, error);
        *off = hypot(apart(slice, psi, stride, truth) / (1 - pow(FINER, -(double)rule->order)),
                     outside_of(slice, 1, truth));
    }
    free(V);
    return error->status;
}

enum ad_status qm_error(const struct qm_method *method, const struct qm_slice *slice,
                        size_t packets, const struct qm_gaussian *packet, double t,
                        const qm_complex *psi, double *off, const char **against,
                        struct ad_error *error)
{
    if (!method || !packets || !packet || !psi || !off || !against || !(t >= 0) || !isfinite(t))
        return ad_fail(error, AD_E_ARGUMENT,
                       "error of packets: expected a method, one packet or more, and a time from 0 "
                       "on, got NULL, none, or t = %g",
                       t);
    if (qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    qm_complex *truth = calloc(slice->grid.n, sizeof *truth);
    if (!truth)
        return ad_fail(error, AD_E_MEMORY, "out of memory for %zu points", slice->grid.n);
    *off = 0;
    for (size_t p = 0; p < packets && error->status == AD_OK; p++) {
        const struct question ask = {method, slice, &packet[p], t};
        double one = 0;
        if (error_of(&ask, packets, psi + p, truth, &one, against, error) == AD_OK)
            *off = fmax(*off, one);
    }
    free(truth);
    return error->status;
}
