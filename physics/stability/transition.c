/* Sensitivities of a motion to its start: the state-transition matrix, by the linearised equations,
   which follow the motion in one Taylor series. Where L depends on time, steps end where its forces
   change abruptly: a pulse that both runs step over would not show in their difference. */
#include "stability.h"
#include "physics/motion/time_scan.h"
#include "physics/ode/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two runs, whose steps and roundings differ; and the part of the matrix that they may differ by.
 */
static const double fine = 1e-15, coarse = 1e-13, lost = 1e-3;

/* y: x, then the columns of the matrix, which begin as `size` times those of the unit matrix, so
   that all are as large as the motion. */
static enum ad_status follow(const struct phys_ode *ode, const double *x, const double *size,
                             const struct phys_lyapunov_settings *settings,
                             const struct phys_time_scan *scan, double tolerance, double *y,
                             struct ad_error *error)
{
    struct phys_simulation_info info = {.stop = PHYS_SIMULATION_END};
    const bool back = settings->t1 < settings->t0;
    size_t d = 0;
    while (d * (d + 1) < ode->n)
        d++;
    struct phys_simulation how = {.integrator = phys_integrator_find("taylor", error),
                                  .t1 = settings->t0,
                                  .rtol = tolerance,
                                  .atol = tolerance,
                                  .scale = size,
                                  .proceed = settings->proceed,
                                  .context = settings->context};
    memset(y, 0, ode->n * sizeof *y);
    memcpy(y, x, d * sizeof *y);
    for (size_t j = 0; j < d; j++)
        y[d * (j + 1) + j] = size[j];
    for (size_t k = 0; k <= scan->n && info.stop == PHYS_SIMULATION_END; k++) {
        how.t0 = how.t1;
        how.t1 = k == scan->n ? settings->t1 : scan->times[back ? scan->n - 1 - k : k];
        if (how.t1 != how.t0 && phys_simulate(&how, ode, y, &info, error) != AD_OK)
            return error->status;
    }
    if (info.stop != PHYS_SIMULATION_END)
        return ad_fail(error, AD_E_ACCURACY, "interrupted");
    return error->status;
}

static enum ad_status scan_time(const struct phys_system *system, const double *x,
                                const struct phys_lyapunov_settings *settings,
                                struct phys_time_scan *scan, struct ad_error *error)
{
    const double low = fmin(settings->t0, settings->t1), high = fmax(settings->t0, settings->t1);
    if (phys_time_scan(system, x, x + system->dof, low, high, scan, error) == AD_OK &&
        isfinite(scan->unresolved))
        ad_fail(error, AD_E_ACCURACY,
                "sensitivities are lost: from t = %.6g on the forces change with time too often to "
                "be followed",
                scan->unresolved);
    return error->status;
}

/* From columns in units of the sizes, and how far they differ from the second run's. */
static enum ad_status settle(size_t d, const double *first, const double *second,
                             const double *size, double *matrix, double *uncertainty,
                             struct ad_error *error)
{
    double largest = 0, apart = 0;
    for (size_t i = 0; i < d; i++)
        for (size_t j = 0; j < d; j++) {
            const double x = first[j * d + i],
                         u = fabs(x - second[j * d + i]) + DBL_EPSILON * fabs(x);
            matrix[i * d + j] = x / size[j];
            uncertainty[i * d + j] = u / size[j];
            largest = fmax(largest, fabs(x) / size[i]);
            apart = fmax(apart, u / size[i]);
        }
    return apart <= lost * largest
               ? AD_OK
               : ad_fail(error, AD_E_ACCURACY,
                         "sensitivities are lost: two runs differ by %.2g of the largest, expected "
                         "at most %g; try a shorter time",
                         apart / largest, lost);
}

enum ad_status phys_transition(const struct phys_system *system, const double *x,
                               const struct phys_lyapunov_settings *settings, double *matrix,
                               double *uncertainty, struct ad_error *error)
{
    struct phys_ode ode = {0}, plain = {0};
    struct phys_time_scan scan = {0};
    if (AD_LACKS(error, system, system->scene, x, settings, matrix, uncertainty))
        return error->status;
    const size_t d = 2 * system->dof, n = d * (d + 1);
    for (size_t k = 0; k < d * d; k++)
        matrix[k] = uncertainty[k] = NAN;
    if (!isfinite(settings->t0) || !isfinite(settings->t1))
        return ad_fail(error, AD_E_ARGUMENT, "sensitivities from t = %g to %g: expected numbers",
                       settings->t0, settings->t1);
    double *size = calloc(3 * n, sizeof *size);
    if (!size)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *first = size + n, *second = first + n;
    if (phys_ode_variations(system, d, &ode, error) == AD_OK &&
        phys_ode_lagrangian(system, &plain, error) == AD_OK &&
        phys_typical_sizes(&plain, settings->t0, x, size, error) == AD_OK &&
        scan_time(system, x, settings, &scan, error) == AD_OK) {
        for (size_t i = d; i < n; i++)
            size[i] = size[i % d];
        if (follow(&ode, x, size, settings, &scan, fine, first, error) == AD_OK &&
            follow(&ode, x, size, settings, &scan, coarse, second, error) == AD_OK)
            settle(d, first + d, second + d, size, matrix, uncertainty, error);
    }
    phys_time_scan_free(&scan);
    phys_ode_free(&plain);
    phys_ode_free(&ode);
    free(size);
    return error->status;
}
