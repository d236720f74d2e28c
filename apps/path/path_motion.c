/* The motion itself at the slices of a path, to all but the last digits (path.h). */
#include "path.h"
#include "apps/interrupt.h"

enum { STEPS = 50000 }; /* at most: what needs more has come to a collision */

static bool go_on(void *context)
{
    (void)context;
    return !interrupted();
}

struct phys_simulation path_tightly(double tolerance)
{
    return (struct phys_simulation){.rtol = tolerance, .max_steps = STEPS, .proceed = go_on};
}

enum ad_status path_motion(const struct path_run *run, size_t slices, double dt, double tolerance,
                           double *path, struct ad_error *error)
{
    struct phys_simulation how = path_tightly(tolerance);
    return phys_scene_path(&run->system, run->options->common.seed, &how, slices, dt, path, error);
}
