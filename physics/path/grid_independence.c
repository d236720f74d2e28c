/* Whether a stationary path is one of the action, and not of the grid alone: the motion through its
   ends, tightly integrated (shooting.h), is found from it and stays near. Grids too coarse for a
   motion have stationary paths of their own, which fly past a centre in one step; finer grids of
   the same kind may have them, too. */
#include "grid_independence.h"
#include "shooting.h"

static const double NEAR = 0.05;       /* of the path's extent: by how much they may disagree */
static const double TOLERANCE = 1e-11; /* of the motion */

enum ad_status phys_path_confirm(const struct phys_system *system,
                                 const struct phys_path_settings *settings, const double *path,
                                 bool *confirmed, struct ad_error *error)
{
    struct phys_shooting s;
    *confirmed = phys_shooting_new(&s, system, settings, path, error) &&
                 phys_shooting_solve(&s, TOLERANCE) && phys_shooting_moved(&s) <= NEAR;
    phys_shooting_free(&s);
    return error->status;
}
