/* How good a path is (path.h): its distance to the reference, and what kind it is. */
#include "path.h"
#include "physics/stability/stability.h"

#include <math.h>

static double mean_square(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum / (double)n;
}

static double largest(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t k = 0; k < n; k++)
        most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

enum ad_status path_measure(const struct path_run *run, struct path_result *result,
                            struct ad_error *error)
{
    size_t n = run->system.dof * run->settings.slices;
    result->keeps_energy = phys_keeps_energy(&run->system);
    if (path_judge_kind(run, result, error) != AD_OK || path_distances(run, result, error) != AD_OK)
        return error->status;
    result->mse_initial = result->mse_final = result->max_error = result->reference_distance = NAN;
    if (run->reference) {
        result->mse_initial = mean_square(run->start, run->reference, n);
        result->mse_final = mean_square(run->path, run->reference, n);
        result->reference_distance = largest(run->path, run->reference, n);
        if (!result->another)
            result->max_error = result->reference_distance;
    }
    return AD_OK;
}
