/* The classical particle that starts at a packet's mean, between the same walls (quantum.h). */
#include "internal.h"
#include "autodiff/sized.h"
#include "physics/motion/motion.h"

#include <math.h>

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
    struct phys_simulation settings = {.size = sizeof settings,
                                       .integrator = phys_integrator_find("dop853", error),
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

static enum ad_status start(const struct phys_system *system, const struct qm_gaussian *packet,
                            double y[2], struct ad_error *error)
{
    phys_legendre *legendre = NULL;
    y[0] = packet->x;
    y[1] = 0;
    if (phys_legendre_new(system, &legendre, error) == AD_OK)
        phys_legendre_velocity(legendre, y, &packet->p, 0, y + 1, error);
    phys_legendre_free(legendre);
    return error->status;
}

/* A ring ends where it begins. */
static double on_grid(const struct qm_slice *slice, double x)
{
    const double low = slice->grid.low, length = slice->grid.high - low;
    return slice->walls == QM_RING ? x - length * floor((x - low) / length) : x;
}

enum ad_status qm_classical(const struct qm_slice *slice, const struct qm_gaussian *packet,
                            size_t n, const double *t, double *x, struct ad_error *error)
{
    if (AD_LACKS(error, packet, t, x) || qm_slice_check(slice, error) != AD_OK)
        return error->status;
    AD_OWN(qm_slice, slice, threads, error);
    const struct qm_grid *grid = &slice->grid;
    const struct walls walls = {slice->walls == QM_RING ? -INFINITY : grid->low,
                                slice->walls == QM_RING ? INFINITY : grid->high,
                                slice->walls == QM_REFLECT};
    struct phys_ode ode = {0};
    struct ad_error lost = {0}; /* the particle is only for comparison */
    double y[2], now = 0;
    bool inside = true;
    if (start(slice->system, packet, y, error) == AD_OK &&
        phys_ode_lagrangian(slice->system, &ode, error) == AD_OK)
        for (size_t k = 0; k < n; k++) {
            inside = inside && (t[k] <= 0 || advance(&ode, &walls, &now, t[k], y, &lost));
            x[k] = inside ? on_grid(slice, y[0]) : (double)NAN;
        }
    phys_ode_free(&ode);
    return error->status;
}
