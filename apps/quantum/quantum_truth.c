/* What a wave packet is compared with (quantum.h): closed forms, Schroedinger's equation, finer
   slices, and the particle of the same Lagrangian. */
#include "quantum.h"
#include "physics/motion/motion.h"

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
    double second = (r - s) / (x[2] - x[0]), first = s - second * (x[0] + x[1]), most = 0;
    *V0 = v[0] - (first + second * x[0]) * x[0];
    *scene = (struct qm_quadratic){mass, 2 * second / mass, first / mass};
    for (size_t a = 0; a < n; a++)
        most = fmax(most, fabs(V[a]));
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

static const double known = 1e-5; /* what a reference is refined to */

/* sqrt of int |psi - truth|^2 over the box, without absorbing layers: there psi is not the wave. */
static double apart(const struct quantum_run *run, const qm_complex *psi, size_t stride,
                    const qm_complex *truth)
{
    const struct qm_slice *slice = &run->slice;
    const struct qm_grid *grid = &slice->grid;
    double sum = 0;
    for (size_t a = 0; a < grid->n; a++) {
        double x = qm_x(grid, a);
        if (fmin(x - grid->low, grid->high - x) >= slice->absorb)
            sum += pow(cabs(psi[a * stride] - truth[a]), 2);
    }
    return sqrt(sum * qm_dx(grid));
}

/* What of the true wave is beyond open walls; layers are meant to swallow it. */
static double outside_of(const struct quantum_run *run, double norm, const qm_complex *truth)
{
    const struct qm_slice *slice = &run->slice;
    bool counts = slice->walls == QM_OPEN && slice->absorb == 0;
    return counts ? sqrt(fmax(0, norm - qm_moments(&slice->grid, 1, truth).norm)) : 0;
}

static bool closed_form(const struct quantum_run *run, const double *V, double mass, size_t packet,
                        double t, qm_complex *truth)
{
    const struct qm_slice *slice = &run->slice;
    struct qm_quadratic scene;
    double V0;
    if (slice->walls != QM_OPEN || !is_quadratic(&slice->grid, V, mass, &scene, &V0))
        return false;
    qm_exact_packet(&scene, slice->hbar, &run->packet[packet], t, &slice->grid, truth);
    for (size_t a = 0; a < slice->grid.n; a++)
        truth[a] *= cexp(-I * (V0 * t / slice->hbar));
    return true;
}

enum { FINER = 3 }; /* odd: the points are among those of the finer grid */

/* The same slices, three times as fine, of an L that has no potential to itself; the difference is
   most of the coarser one's error, whose order is at least that of the rule. */
static enum ad_status finer(const struct quantum_run *run, size_t packet, double t,
                            qm_complex *truth, struct qm_reference *reference,
                            struct ad_error *error)
{
    struct qm_slice slice = run->slice;
    qm_propagator *propagator = NULL;
    size_t n = slice.grid.n, steps = FINER * (size_t)ceil(t / slice.dt - 1e-9);
    slice.grid.n = FINER * n;
    slice.dt /= FINER;
    struct qm_cost cost;
    run->method->cost(&slice, &cost);
    if (cost.bytes > 4e9 || cost.setup + cost.step * (double)steps > 1e12)
        return ad_fail(error, AD_E_ACCURACY,
                       "the error is not known: a run three times as fine would take too long; "
                       "expected fewer --points or --steps, or --no-reference");
    qm_complex *psi = malloc(slice.grid.n * sizeof *psi);
    if (!psi)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    qm_packet(&slice.grid, slice.hbar, &run->packet[packet], 1, 0, psi);
    if (qm_propagator_new(run->method, &slice, &propagator, error) == AD_OK)
        for (size_t k = 0; k < steps && error->status == AD_OK; k++)
            qm_propagate(propagator, 1, psi, error);
    for (size_t a = 0; a < n; a++)
        truth[a] = psi[FINER * a + FINER / 2];
    *reference = (struct qm_reference){.norm = 1};
    qm_propagator_free(propagator);
    free(psi);
    return error->status;
}

/* Of one packet. */
static enum ad_status error_of(const struct quantum_run *run, size_t packet, double t,
                               const qm_complex *psi, qm_complex *truth, double *off,
                               const char **against, struct ad_error *error)
{
    const struct qm_slice *slice = &run->slice;
    struct ad_error no_potential = {0};
    struct qm_reference reference = {.norm = 1};
    double mass, share = 1, *V = malloc(slice->grid.n * sizeof *V);
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool separates = qm_potential(&run->system, &slice->grid, V, &mass, &no_potential) == AD_OK;
    if (separates && closed_form(run, V, mass, packet, t, truth)) {
        *against = "the closed form";
    } else if (separates) {
        *against = "Schroedinger's equation, split in Fourier space";
        qm_reference(slice, &run->packet[packet], t, known, truth, &reference, error);
    } else {
        double order = (double)slice->rule->order;
        *against = "the same method, three times as fine";
        share = 1 - pow(FINER, -order);
        finer(run, packet, t, truth, &reference, error);
    }
    double inside = apart(run, psi, run->n_packets, truth) / share;
    *off = fmax(hypot(inside, outside_of(run, reference.norm, truth)), reference.uncertainty);
    free(V);
    return error->status;
}

enum ad_status quantum_error(const struct quantum_run *run, double t, const qm_complex *psi,
                             double *off, const char **against, struct ad_error *error)
{
    qm_complex *truth = calloc(run->slice.grid.n, sizeof *truth);
    if (!truth)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    *off = 0;
    for (size_t p = 0; p < run->n_packets && error->status == AD_OK; p++) {
        double one;
        if (error_of(run, p, t, psi + p, truth, &one, against, error) == AD_OK)
            *off = fmax(*off, one);
    }
    free(truth);
    return error->status;
}

/* ---- the particle ---- */

struct walls {
    double low, high;
    bool reflect;
};

static void outside(void *context, double t, const double *y, double *g)
{
    const struct walls *w = context;
    (void)t;
    g[0] = w->low - y[0];
    g[1] = y[0] - w->high;
}

static bool hit(void *context, size_t k, double t, const double *y)
{
    (void)context, (void)k, (void)t, (void)y;
    return false;
}

/* From y at time *now to `then`, off the walls; false where an open one was crossed. */
static bool advance(const struct phys_ode *ode, const struct walls *walls, double *now, double then,
                    double y[2], struct ad_error *error)
{
    struct walls context = *walls;
    struct phys_events events = {
        .n = 2, .values = outside, .direction = 1, .found = hit, .context = &context};
    struct phys_simulation settings = {.integrator = phys_integrator_find("dop853", error),
                                       .rtol = 1e-12,
                                       .atol = 1e-12,
                                       .events = &events,
                                       .n_events = 1};
    while (*now < then && error->status == AD_OK) {
        struct phys_simulation_info info;
        settings.t0 = *now;
        settings.t1 = then;
        phys_simulate(&settings, ode, y, &info, error);
        *now = info.t;
        if (info.stop != PHYS_SIMULATION_EVENT)
            continue;
        if (!walls->reflect)
            return false;
        y[1] = -y[1];
    }
    return error->status == AD_OK;
}

static enum ad_status start(const struct quantum_run *run, double y[2], struct ad_error *error)
{
    phys_legendre *legendre = NULL;
    double p = run->packet[0].p;
    y[0] = run->packet[0].x;
    y[1] = 0;
    if (phys_legendre_new(&run->system, &legendre, error) == AD_OK)
        phys_legendre_velocity(legendre, y, &p, 0, y + 1, error);
    phys_legendre_free(legendre);
    return error->status;
}

enum ad_status quantum_classical(const struct quantum_run *run, size_t n, const double *t,
                                 double *x, struct ad_error *error)
{
    const struct qm_grid *grid = &run->slice.grid;
    const struct walls walls = {run->slice.walls == QM_RING ? -INFINITY : grid->low,
                                run->slice.walls == QM_RING ? INFINITY : grid->high,
                                run->slice.walls == QM_REFLECT};
    struct phys_ode ode = {0};
    struct ad_error lost = {0}; /* the particle is only for comparison */
    double y[2], now = 0;
    bool inside = true;
    if (start(run, y, error) == AD_OK && phys_ode_lagrangian(&run->system, &ode, error) == AD_OK)
        for (size_t k = 0; k < n; k++) {
            inside = inside && (k == 0 || advance(&ode, &walls, &now, t[k], y, &lost));
            x[k] = inside ? y[0] : (double)NAN;
        }
    phys_ode_free(&ode);
    return error->status;
}
