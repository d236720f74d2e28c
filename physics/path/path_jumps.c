/* Whether the forces jump along a path (path.h): its slices as points of phys_check_jumps. */
#include "path_nodes.h"
#include "physics/lagrangian/check.h"

#include <stdlib.h>

bool phys_path_jumps(const struct phys_system *system, const struct phys_path_settings *settings,
                     const double *path)
{
    struct ad_error error = {0};
    if (AD_LACKS(&error, system, system->scene, settings, path))
        return false;
    struct phys_path_nodes nodes = {0};
    const struct phys_grid grid = phys_grid_of(settings);
    size_t n = settings->slices, dof = system->dof;
    double *q = malloc(((2 * dof + 1) * n + 2 * dof) * sizeof *q), *v = q ? q + dof * n : NULL;
    bool jumps = false;
    if (q && phys_path_nodes_new(&nodes, dof, &grid, 3, path, &error) == AD_OK) {
        double *t = v + dof * n, *x = t + n;
        for (size_t i = 0; i < n; i++) {
            t[i] = phys_grid_time(&grid, i);
            phys_path_nodes_at(&nodes, t[i], x, x + dof);
            for (size_t k = 0; k < dof; k++) {
                q[k * n + i] = x[k];
                v[k * n + i] = x[dof + k];
            }
        }
        jumps = phys_check_jumps(
            system, &(struct phys_points){.size = sizeof(struct phys_points), n, q, v, t});
    }
    phys_path_nodes_free(&nodes);
    free(q);
    return jumps;
}
