/* What a wave packet is held against (quantum.h): closed forms, Crank-Nicolson on finer grids, and
   the particle of the same Lagrangian. */
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

/* ---- Crank-Nicolson ---- */

/* psi [n] from a grid `factor` times as fine (odd: its points are among them), in slices of about
   dt / factor. */
static enum ad_status fine_run(const struct quantum_run *run, double t, size_t factor,
                               qm_complex *psi, struct ad_error *error)
{
    struct qm_slice slice = run->slice;
    qm_propagator *propagator = NULL;
    size_t n = slice.grid.n, steps = (size_t)ceil(t / run->slice.dt - 1e-9) * factor;
    slice.grid.n = factor * n;
    slice.walls = QM_REFLECT;
    slice.dt = t / (double)steps;
    qm_complex *fine = malloc(slice.grid.n * sizeof *fine);
    if (!fine)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    qm_packet(&slice.grid, slice.hbar, &run->packet[0], 1, 0, fine);
    if (qm_propagator_new(&qm_method_crank_nicolson, &slice, &propagator, error) == AD_OK)
        for (size_t k = 0; k < steps; k++)
            qm_propagate(propagator, 1, fine, error);
    for (size_t a = 0; a < n; a++)
        psi[a] = fine[factor * a + factor / 2];
    qm_propagator_free(propagator);
    free(fine);
    return error->status;
}

enum { COARSE = 5, FINE = 15 };

/* Points times slices that are worth a reference. */
static const double worth = 2e8;

/* Both dx and dt fall by the same factor, and the error with their squares. */
static enum ad_status extrapolated(const struct quantum_run *run, double t, qm_complex *psi,
                                   struct ad_error *error)
{
    const double gain = (double)(FINE * FINE) / (COARSE * COARSE);
    size_t n = run->slice.grid.n;
    qm_complex *coarse = malloc(n * sizeof *coarse);
    if (!coarse)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    if (fine_run(run, t, COARSE, coarse, error) == AD_OK &&
        fine_run(run, t, FINE, psi, error) == AD_OK)
        for (size_t a = 0; a < n; a++)
            psi[a] = (gain * psi[a] - coarse[a]) / (gain - 1);
    free(coarse);
    return error->status;
}

enum ad_status quantum_truth(const struct quantum_run *run, double t, qm_complex *psi,
                             const char **truth, struct ad_error *error)
{
    const struct qm_slice *slice = &run->slice;
    struct qm_quadratic scene;
    struct ad_error no_potential = {0};
    double mass, V0, *V = malloc(slice->grid.n * sizeof *V);
    *truth = NULL;
    if (!V)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    bool separates = qm_potential(&run->system, &slice->grid, V, &mass, &no_potential) == AD_OK;
    if (separates && slice->walls == QM_OPEN && slice->absorb == 0 &&
        is_quadratic(&slice->grid, V, mass, &scene, &V0)) {
        *truth = "the closed form";
        qm_exact_packet(&scene, slice->hbar, &run->packet[0], t, &slice->grid, psi);
        for (size_t a = 0; a < slice->grid.n; a++)
            psi[a] *= cexp(-I * (V0 * t / slice->hbar));
    } else if (separates && slice->walls == QM_REFLECT && slice->absorb == 0 &&
               FINE * FINE * (double)slice->grid.n * t / slice->dt < worth &&
               extrapolated(run, t, psi, error) == AD_OK) {
        *truth = "Crank-Nicolson on two finer grids, extrapolated";
    }
    free(V);
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
    double y[2], now = 0;
    bool inside = true;
    if (start(run, y, error) == AD_OK && phys_ode_lagrangian(&run->system, &ode, error) == AD_OK)
        for (size_t k = 0; k < n; k++) {
            inside = inside && (k == 0 || advance(&ode, &walls, &now, t[k], y, error));
            x[k] = inside ? y[0] : (double)NAN;
        }
    phys_ode_free(&ode);
    return error->status;
}
