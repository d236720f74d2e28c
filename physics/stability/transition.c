/* Sensitivities of a motion to its start, the state-transition matrix, and to parameters, by the
   linearised equations, which follow the motion in one Taylor series. Where L depends on time,
   steps end where its forces change abruptly: a pulse that both runs step over would not show in
   their difference. */
#include "internal.h"
#include "autodiff/sized.h"
#include "physics/motion/time_scan.h"
#include "physics/system/internal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two runs, whose steps and roundings differ; and the part of the matrix that they may differ by.
 */
static const double fine = 1e-15, coarse = 1e-13, lost = 1e-3;
/* Smaller ones, of the motion's size when a parameter changes by itself, are none: a G that
 * cancels. */
static const double least = 1e-6;

/* y, which is given, becomes that at the end; all of it is as large as `size`. */
static enum ad_status follow(const struct phys_ode *ode, const double *size,
                             const struct phys_lyapunov_settings *settings,
                             const struct phys_time_scan *scan, double tolerance, double *y,
                             struct ad_error *error)
{
    struct phys_simulation_info info = {.stop = PHYS_SIMULATION_END};
    const bool back = settings->t1 < settings->t0;
    struct phys_simulation how = {.size = sizeof how,
                                  .integrator = phys_integrator_find("taylor", error),
                                  .t1 = settings->t0,
                                  .rtol = tolerance,
                                  .atol = tolerance,
                                  .scale = size,
                                  .proceed = settings->proceed,
                                  .context = settings->context};
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

/* From n columns as they end, column j in units of unit[j], and how far they differ from the second
   run's. */
static enum ad_status settle(size_t d, size_t n, const double *first, const double *second,
                             const double *size, const double *unit, double *matrix,
                             double *uncertainty, struct ad_error *error)
{
    double largest = 0, apart = 0;
    for (size_t i = 0; i < d; i++)
        for (size_t j = 0; j < n; j++) {
            const double x = first[j * d + i],
                         u = fabs(x - second[j * d + i]) + DBL_EPSILON * fabs(x);
            matrix[i * n + j] = x;
            uncertainty[i * n + j] = u;
            largest = fmax(largest, fabs(x) * unit[j] / size[i]);
            apart = fmax(apart, u * unit[j] / size[i]);
        }
    return apart <= lost * fmax(largest, least)
               ? AD_OK
               : ad_fail(error, AD_E_ACCURACY,
                         "sensitivities are lost: two runs differ by %.2g of the largest, expected "
                         "at most %g; try a shorter time",
                         apart / largest, lost);
}

/* The derivatives of n columns at the end, which begin as begin[n][d]; those of the second run
   differ by doubt[n][d]. */
static enum ad_status measure(const struct phys_system *system, const double *x,
                              const struct phys_lyapunov_settings *settings,
                              const struct phys_ode *ode, const double *begin, const double *doubt,
                              const double *unit, double *matrix, double *uncertainty,
                              struct ad_error *error)
{
    const size_t d = 2 * system->dof, n = ode->n / d - 1;
    struct phys_ode plain = {0};
    struct phys_time_scan scan = {0};
    double *size = calloc(3 * ode->n, sizeof *size);
    if (!size)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    double *first = size + ode->n, *second = first + ode->n;
    if (phys_ode_lagrangian(system, &plain, error) == AD_OK &&
        phys_typical_sizes(&plain, settings->t0, x, size, error) == AD_OK &&
        scan_time(system, x, settings, &scan, error) == AD_OK) {
        for (size_t i = 0; i < n * d; i++) {
            size[d + i] = size[i % d] / unit[i / d];
            first[d + i] = begin[i];
            second[d + i] = begin[i] + doubt[i];
        }
        memcpy(first, x, d * sizeof *x);
        memcpy(second, x, d * sizeof *x);
        if (follow(ode, size, settings, &scan, fine, first, error) == AD_OK &&
            follow(ode, size, settings, &scan, coarse, second, error) == AD_OK)
            settle(d, n, first + d, second + d, size, unit, matrix, uncertainty, error);
    }
    phys_time_scan_free(&scan);
    phys_ode_free(&plain);
    free(size);
    return error->status;
}

static enum ad_status begin_checked(const struct phys_lyapunov_settings *settings, size_t n,
                                    double *matrix, double *uncertainty, struct ad_error *error)
{
    for (size_t k = 0; k < n; k++)
        matrix[k] = uncertainty[k] = NAN;
    return isfinite(settings->t0) && isfinite(settings->t1)
               ? AD_OK
               : ad_fail(error, AD_E_ARGUMENT, "sensitivities from t = %g to %g: expected numbers",
                         settings->t0, settings->t1);
}

enum ad_status phys_transition(const struct phys_system *system, const double *x,
                               const struct phys_lyapunov_settings *settings, double *matrix,
                               double *uncertainty, struct ad_error *error)
{
    struct phys_ode ode = {0}, plain = {0};
    if (AD_LACKS(error, system, system->scene, x, settings, matrix, uncertainty))
        return error->status;
    if (phys_refuse_constraints(system, "variations", error) != AD_OK)
        return error->status;
    AD_OWN(phys_lyapunov_settings, settings, context, error);
    const size_t d = 2 * system->dof;
    if (begin_checked(settings, d * d, matrix, uncertainty, error) != AD_OK)
        return error->status;
    double *unit = calloc(d + 2 * d * d, sizeof *unit);
    if (!unit)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    for (size_t k = 0; k < d; k++)
        unit[d + k * (d + 1)] = 1;
    if (phys_ode_variations(system, d, &ode, error) == AD_OK &&
        phys_ode_lagrangian(system, &plain, error) == AD_OK &&
        phys_typical_sizes(&plain, settings->t0, x, unit, error) == AD_OK)
        measure(system, x, settings, &ode, unit + d, unit + d + d * d, unit, matrix, uncertainty,
                error);
    phys_ode_free(&plain);
    phys_ode_free(&ode);
    free(unit);
    return error->status;
}

/* ---- by parameters ---- */

enum ad_status phys_sensitivity(const struct phys_system *system, const double *x, uint64_t seed,
                                const struct phys_lyapunov_settings *settings, size_t n,
                                const char *const names[], double *matrix, double *uncertainty,
                                struct ad_error *error)
{
    struct phys_ode ode = {0};
    if (AD_LACKS(error, system, system->scene, settings, names, matrix, uncertainty))
        return error->status;
    if (phys_refuse_constraints(system, "variations", error) != AD_OK)
        return error->status;
    AD_OWN(phys_lyapunov_settings, settings, context, error);
    const size_t d = 2 * system->dof;
    if (begin_checked(settings, d * n, matrix, uncertainty, error) != AD_OK)
        return error->status;
    double *begin = calloc(2 * d * n + d + n, sizeof *begin), *start, *unit;
    if (!begin)
        return ad_fail(error, AD_E_MEMORY, "out of memory");
    start = begin + 2 * d * n;
    unit = start + d;
    if (x)
        memcpy(start, x, d * sizeof *x);
    else if (phys_start_slopes(system, seed, n, names, begin, begin + d * n, error) == AD_OK)
        system->scene->start(system->params, seed, start, start + system->dof, error);
    for (size_t k = 0; k < n; k++) {
        const double p = phys_system_get(system, names[k]);
        unit[k] = p == 0 ? 1 : fabs(p);
    }
    if (error->status == AD_OK && phys_ode_parameters(system, 0, n, names, &ode, error) == AD_OK)
        measure(system, start, settings, &ode, begin, begin + d * n, unit, matrix, uncertainty,
                error);
    phys_ode_free(&ode);
    free(begin);
    return error->status;
}
