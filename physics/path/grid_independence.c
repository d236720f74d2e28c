/* Whether a stationary path is one of the action, and not of the grid alone: two and four times as
   fine, Newton's method finds it again, with the same index, and closer the second time. Grids too
   coarse for a motion have stationary paths of their own, which fly past a centre in one step. */
#include "grid_independence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NEAR = 0.1;   /* of the path's extent: by how much grids may disagree */
static const double FALL = 0.6;   /* of that, where it is twice as fine: half for order 1 */
static const double SAME = 1e-10; /* of the extent: where rounding may stop the fall */

/* Largest range of a coordinate. */
static double extent(size_t dof, size_t slices, const double *path)
{
    double most = 0;
    for (size_t k = 0; k < dof; k++) {
        double low = path[k * slices], high = low;
        for (size_t i = 1; i < slices; i++) {
            low = fmin(low, path[k * slices + i]);
            high = fmax(high, path[k * slices + i]);
        }
        most = fmax(most, high - low);
    }
    return most;
}

/* The path [dof x n] on a grid twice as fine, [dof x 2n-1]; `work` is room for [2 dof x n]. */
static void refine(size_t dof, size_t n, const double *path, double *work, double *fine)
{
    struct ad_error error = {0};
    size_t m = 2 * n - 1;
    memcpy(work, path, dof * n * sizeof *work);
    phys_rule_interpolate(phys_rule_find("gauss2", &error), dof, n, work); /* nodes half way */
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < m; i++)
            fine[k * m + i] = work[(i % 2 * dof + k) * n + i / 2];
}

/* Largest distance at the slices of the coarser path [dof x n]. */
static double distance(size_t dof, size_t n, const double *path, const double *fine)
{
    double most = 0;
    for (size_t k = 0; k < dof; k++)
        for (size_t i = 0; i < n; i++)
            most = fmax(most, fabs(path[k * n + i] - fine[k * (2 * n - 1) + 2 * i]));
    return most;
}

/* Makes `finer` settings of half the step, and the path stationary there; the index is SIZE_MAX
   where there is none. */
static double *follow(const struct phys_system *system, struct phys_path_settings *finer,
                      const double *path, size_t *index, struct ad_error *error)
{
    struct phys_path_info info = {0};
    struct phys_spectrum spectrum = {0};
    struct ad_error lost = {0};
    size_t dof = system->dof, n = finer->slices, degree = finer->rule->degree;
    finer->slices = 2 * n - 1;
    finer->dt *= 0.5;
    *index = SIZE_MAX;
    double *fine = malloc((degree * finer->slices + 2 * n) * dof * sizeof *fine);
    if (!fine) {
        ad_fail(error, AD_E_MEMORY, "out of memory");
        return NULL;
    }
    refine(dof, n, path, fine + degree * finer->slices * dof, fine);
    phys_rule_interpolate(finer->rule, dof, finer->slices, fine);
    phys_solver_newton.solve(system, finer, fine, &info, &lost);
    if (lost.status == AD_OK && info.stop == PHYS_STOP_ROUNDING &&
        phys_path_spectrum(system, finer, fine, &spectrum, error) == AD_OK)
        *index = spectrum.index;
    phys_spectrum_free(&spectrum);
    return fine;
}

enum ad_status phys_path_confirm(const struct phys_system *system,
                                 const struct phys_path_settings *settings, const double *path,
                                 size_t index, bool *confirmed, struct ad_error *error)
{
    struct phys_path_settings finer = *settings;
    size_t dof = system->dof, n = settings->slices, found;
    double size = extent(dof, n, path), *finest = NULL;
    double *fine = follow(system, &finer, path, &found, error);
    *confirmed = false;
    if (fine && found == index && distance(dof, n, path, fine) <= NEAR * size) {
        finest = follow(system, &finer, fine, &found, error);
        double fall = FALL * distance(dof, n, path, fine);
        *confirmed = finest && found == index &&
                     distance(dof, 2 * n - 1, fine, finest) <= fmax(fall, SAME * size);
    }
    free(fine);
    free(finest);
    return error->status;
}
